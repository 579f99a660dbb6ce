//! Level of detail: hair that is small on the screen is simulated more cheaply.
//!
//! A [`HairLod`] on a [`Hair`](crate::Hair) lists levels by the share of the view's height that the
//! hair takes up ([`HairScreenShare`]). Each has fewer iterations, longer substeps and fewer simulated
//! strands. A change of level moves no node: hair swings smoothly to the equilibrium of that level, which
//! is near the previous one ([`LodLevel`] says how near). Bonds stay as they are.
//!
//! # Fewer strands
//!
//! Strands have a spread order: any prefix of it samples the roots evenly ([`spread`]). A level
//! simulates the first strands of that order, so that strands simulated at a coarse level are at all
//! finer ones, too. The others are **followers** of up to three near and similar guides ([`follow`]), of
//! one where less than an eighth is simulated: once a tick a follower's edges rotate as those of its
//! guides have rotated, at the same distance from the root, since the level began. So position and
//! velocity are continuous when a level begins and ends, and lengths and root are kept. Its initial
//! motion relative to the guides decays within a second.
//!
//! | what | for a follower |
//! |---|---|
//! | gravity, drag, wind, droplets' pull | act on its guides only |
//! | bonds: treatments, drying, water | act on it; bonds that form remember its present shape |
//! | colliders | do not act on it: it stays out of the head as its guides do |
//! | contact with other strands | none; on wet hair its film acts on its simulated neighbours. Where fewer than an eighth of the strands are simulated, dry ones do not collide: they are centimetres apart |
//! | a root on a mesh | goes with it once a tick; where most strands are followers, once one of sixteen roots has moved by more than 0.05 mm |
//! | sleep | while all its guides sleep |
//! | [`HeldNodes`](crate::HeldNodes), wound on a rod | it is simulated, and is no guide |
//! | game code that writes to its [`Strand`](crate::Strand) | it follows from there; velocities are lost |
//!
//! At a level without simulated strands hair is **frozen**: it moves with its head in its present shape,
//! a strand whose root moves is translated with it, and at a finer level it continues from there, at
//! rest. It costs almost nothing.
//!
//! A follower keeps its offset from its guides until the level changes. A strand that is added at a
//! level keeps its shape, as far as its guides keep theirs; the spread order is then computed again.
//!
//! # A budget
//!
//! A [`HairBudget`] limits the time of all hair: beyond it the least important hair takes coarser levels.
//! Hair on the GPU does not count; hair that goes there has the level of its size on the screen first.
//!
//! Drawing needs no level: strands thinner than a pixel are drawn fewer and wider, smoothly.

mod assign;
mod budget;
mod choose;
#[cfg(feature = "gpu")]
mod elsewhere;
#[doc(hidden)]
pub mod follow;
mod followers;
mod guides;
#[doc(hidden)]
pub mod model;
mod release;
#[doc(hidden)]
pub mod spread;
mod systems;

pub use budget::{HairBudget, HairEstimate};
pub use guides::{Follower, Guides};
pub use systems::LodPlugin;

use crate::base::setting::{InvalidValue, Ranged, setting};
use bevy::prelude::*;

setting! {
    /// How cheaply a hair is simulated when it is small on the screen. Component of a
    /// [`Hair`](crate::Hair) or its wearer, may change at any time; where absent,
    /// [`HairDefault<HairLod>`](crate::HairDefault) holds, which has no levels unless the game gives it some. Hair
    /// without levels is always simulated in full.
    ///
    /// The feature `render` writes [`HairScreenShare`] from the cameras; without it a game writes that itself.
    ///
    /// ```
    /// # use bevy_keratin::prelude::*; use bevy::prelude::*;
    /// # let mut world = World::new();
    /// world.spawn((Hair, HairLod::default()));
    /// // for all hair:
    /// world.insert_resource(HairDefault(HairLod::default()));
    /// ```
    #[derive(Component, Reflect, Clone, Debug, PartialEq)]
    #[reflect(Component, Default, Clone, PartialEq)]
    pub struct HairLod {
        /// The levels, from near to far, each for smaller hair than the one before.
        pub levels: Vec<LodLevel> =
            vec![LodLevel::NEAR, LodLevel::BACKGROUND, LodLevel::FROZEN] => Ranged::clamp_values;
        /// How far beyond a level's limit hair has to grow on the screen before it leaves the level
        /// again, as a share of the limit.
        pub hysteresis: f32 = 0.2, in HYSTERESIS: 0.0..=100.0, safe 0.05..=1.0, "0.2 is a fifth";
        /// Weight of its share of the view when a [`HairBudget`] is exceeded: higher for a hero than for
        /// a passer-by.
        pub importance: f32 = 1.0, in IMPORTANCE: 0.0..=1e6, safe 0.1..=10.0, "1 is a passer-by's";
    }
}

setting! {
    /// One level of a [`HairLod`].
    #[derive(Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Default, Clone, PartialEq)]
    pub struct LodLevel {
        /// The level applies to hair that takes up less than this share of the view's height.
        pub below: f32 = 0.1, in BELOW: 0.0..=100.0, safe 0.0..=1.0, "a tenth of the view is 0.1";
        /// Iterations a substep, at most as many as [`HairSolver`](crate::HairSolver) and
        /// [`Springs`](crate::Springs) have. On 24 cm of hair that stands out 2 in place of 5 move the
        /// tip by 0.5 mm.
        pub iterations: u32 = 2, in ITERATIONS: 1.0..=1000.0, safe 2.0..=5.0,
            "2 are enough from afar";
        /// How many substeps are taken as one at most, if that is more than
        /// [`HairSolver::substep`](crate::HairSolver::substep) takes anyway: a tick is divided into as few
        /// as that allows, as alike as can be. Rods that are solved directly settle to the same shape in longer ones; by
        /// [`Sweeps`](crate::Sweeps) hair sags more, the same tip by 8 mm at 2, 2 cm at 3.
        pub substeps: u32 = 2, in SUBSTEPS: 1.0..=1000.0, safe 1.0..=3.0, "2 makes three of six";
        /// Share of the hair's strands that are simulated, rounded up; the others follow those, see the
        /// [module](self). With 0 the hair is frozen: it moves with the head in its present shape. Hair
        /// of springs is simulated whole at every level.
        pub strands: f32 = 1.0, in STRANDS: 0.0..=1.0, "0.25 is one of four";
    }
}

/// The share of the view's height that the sphere around a hair takes up, in the view in which it is
/// largest: 1 fills it, 0 is out of sight. Written once a frame by the feature `render`, which needs a
/// `Camera`; otherwise by the game. Default 1.
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq, Deref, DerefMut)]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct HairScreenShare(pub f32);

impl Default for HairScreenShare {
    fn default() -> Self {
        Self(1.0)
    }
}

/// The level at which a hair is simulated in this tick. Kept by the tick.
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[component(clone_behavior = Ignore)]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct PresentLod {
    /// 0 in full, n the n-th of [`HairLod::levels`].
    pub level: usize,
    /// How many strands are followers: not simulated, but moved with their guides.
    pub followers: usize,
    /// How many levels coarser it is because of the [`HairBudget`].
    pub budget_levels: usize,
    strands: Option<f32>,
    /// The same at the level that it would have without a budget.
    wanted_strands: Option<f32>,
    /// Whether it is about to be simulated elsewhere: the budget does not count it.
    is_leaving: bool,
    /// Segments of all its strands; 0 until they are counted.
    segments: usize,
}

impl PresentLod {
    /// In full from now on. Followers are counted until they are let go.
    fn in_full(&self) -> Self {
        Self { followers: self.followers, ..Self::default() }
    }

    /// The share of the strands that is to be simulated.
    pub(crate) fn simulated_share(&self) -> f32 {
        self.strands.unwrap_or(1.0)
    }

    /// Whether any strand would be simulated without the [`HairBudget`](super::HairBudget).
    pub(crate) fn wants_simulation(&self) -> bool {
        self.wanted_strands.is_none_or(|share| share > 0.0)
    }
}

impl LodLevel {
    /// For hair under a third of the view's height: half of the strands.
    pub const NEAR: Self = Self { below: 0.3, iterations: 3, substeps: 1, strands: 0.5 };
    /// For hair under a seventh: one strand of sixteen, two substeps a tick at 60 Hz.
    pub const BACKGROUND: Self = Self { below: 0.15, iterations: 2, substeps: 3, strands: 0.0625 };
    /// For hair under a thirtieth: none.
    pub const FROZEN: Self = Self { below: 0.03, iterations: 1, substeps: 3, strands: 0.0 };

    /// A level for hair below a share of the view's height, with its iterations, and how many substeps
    /// are taken as one.
    ///
    /// # Errors
    /// When a value is outside [`BELOW`](Self::BELOW), [`ITERATIONS`](Self::ITERATIONS) or
    /// [`SUBSTEPS`](Self::SUBSTEPS).
    pub fn new(below: f32, iterations: u32, substeps: u32) -> Result<Self, InvalidValue> {
        Self { below, iterations, substeps, ..default() }.checked()
    }

    /// The same level with another share of the strands simulated.
    ///
    /// # Errors
    /// When the share is outside [`STRANDS`](Self::STRANDS).
    pub fn with_strands(self, share: f32) -> Result<Self, InvalidValue> {
        Self { strands: share, ..self }.checked()
    }
}

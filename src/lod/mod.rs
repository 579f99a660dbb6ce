//! Level of detail: hair that is small on the screen is simulated more cheaply.
//!
//! A [`HairLod`] on a [`Hair`](crate::Hair) lists levels by the share of the view's height that the
//! hair takes up ([`ScreenShare`]). Each has fewer iterations, longer substeps and fewer simulated
//! strands. A change of level moves no node: hair goes over, as hair does, into what it settles to at
//! that level, which is near to what it was ([`LodLevel`] says how near). Bonds stay as they are.
//!
//! # Fewer strands
//!
//! Strands stand in an order of which every beginning is spread evenly over the roots ([`spread`]). At a
//! level its first ones are simulated, so that who is at a coarse level is at all finer ones. Each of
//! the others is **carried** by up to three guides that are near and run alike ([`follow`]), by one where
//! less than an eighth is simulated: once a tick
//! its edges turn as theirs have turned at the same distance from the root since the level began. So
//! it begins and ends where it is, keeps its lengths and its root, and goes on with the velocity it
//! has. The motion of its own with which it begins ebbs away within a second.
//!
//! | what | for a strand that is carried |
//! |---|---|
//! | gravity, drag, wind, droplets' pull | felt by its guides only |
//! | bonds: treatments, drying, water | act on it; bonds that form remember the shape it has |
//! | colliders | do not push it: it stays out of the head as its guides do |
//! | contact with other strands | none, in either way; where water joins strands, they feel it |
//! | sleep | while all its guides sleep |
//! | [`HeldNodes`](crate::HeldNodes), wound on a rod | it is simulated, and nobody follows it |
//! | game code that writes to its [`Strand`](crate::Strand) | it goes on from there; velocities are lost |
//!
//! At a level without simulated strands hair is **frozen**: it goes along with its head in the shape it
//! has, a strand whose root moves goes with that, and near again it goes on from there, at rest. It costs
//! next to nothing.
//!
//! What a strand lags behind its guides when a level begins stays until it ends. A strand that comes at
//! a level keeps the shape it came with, as far as its guides keep theirs; all strands take new places
//! in the order then.
//!
//! # A budget
//!
//! A [`HairBudget`] bounds what all hair takes: beyond it the least important goes on to coarser levels.
//!
//! Drawing needs no level: strands thinner than a pixel are drawn fewer and wider, smoothly.

mod budget;
mod carry;
mod choose;
#[doc(hidden)]
pub mod follow;
#[doc(hidden)]
pub mod model;
#[doc(hidden)]
pub mod spread;
mod systems;

pub use budget::{HairBudget, HairEstimate};
pub use choose::{Follower, Guides};
pub use systems::LodPlugin;

use crate::{
    schedule::SubstepLimits,
    setting::{InvalidValue, Ranged, setting},
};
use bevy::prelude::*;

setting! {
    /// How cheaply a hair is simulated when it is small on the screen. Component of a
    /// [`Hair`](crate::Hair), may change at any time; hair without it is always simulated in full.
    ///
    /// The feature `render` writes [`ScreenShare`] from the cameras; without it a game writes that itself.
    ///
    /// ```
    /// # use bevy_keratin::prelude::*; use bevy::prelude::*;
    /// # let mut world = World::new();
    /// world.spawn((Hair, HairLod::default()));
    /// ```
    #[derive(Component, Reflect, Clone, Debug, PartialEq)]
    #[reflect(Component, Default, Clone, PartialEq)]
    #[require(ScreenShare, PresentLod, SubstepLimits)]
    pub struct HairLod {
        /// The levels, from near to far, each for smaller hair than the one before.
        pub levels: Vec<LodLevel> =
            vec![LodLevel::NEAR, LodLevel::BACKGROUND, LodLevel::FROZEN] => Ranged::clamp_values;
        /// By which share more than a level's limit hair has to grow before it leaves the level again.
        pub hysteresis: f32 = 0.2, in HYSTERESIS: 0.0..=100.0, safe 0.05..=1.0, "0.2 is a fifth";
        /// How much its share of the view counts where a [`HairBudget`] is short: a hero's more than a
        /// passer-by's.
        pub importance: f32 = 1.0, in IMPORTANCE: 0.0..=1e6, safe 0.1..=10.0, "1 is a passer-by's";
    }
}

setting! {
    /// One level of a [`HairLod`].
    #[derive(Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Default, Clone, PartialEq)]
    pub struct LodLevel {
        /// Hair that takes up less than this share of the view's height is simulated so.
        pub below: f32 = 0.1, in BELOW: 0.0..=100.0, safe 0.0..=1.0, "a tenth of the view is 0.1";
        /// Iterations a substep, at most as many as [`HairSolver`](crate::HairSolver) and
        /// [`Springs`](crate::Springs) have. On 24 cm of hair that stands out 2 in place of 5 move the
        /// tip by 0.5 mm.
        pub iterations: u32 = 2, in ITERATIONS: 1.0..=1000.0, safe 2.0..=5.0,
            "2 are enough from afar";
        /// How many substeps are taken as one, if that is more than
        /// [`HairSolver::substep`](crate::HairSolver::substep) takes anyway. The last of a tick may be
        /// shorter. Rods that are solved directly settle to the same shape in longer ones; by
        /// [`Sweeps`](crate::Sweeps) hair sags more, the same tip by 8 mm at 2, 2 cm at 3.
        pub substeps: u32 = 2, in SUBSTEPS: 1.0..=1000.0, safe 1.0..=3.0, "2 makes three of six";
        /// Share of the hair's strands that are simulated, rounded up; the others go along with those, as
        /// the [module](self) says. With 0 the hair is frozen: it goes along with the head in the shape
        /// it has. Hair of springs is simulated whole at every level.
        pub strands: f32 = 1.0, in STRANDS: 0.0..=1.0, safe 0.0..=1.0, "0.25 is one of four";
    }
}

/// The share of the view's height that the sphere around a hair takes up, in the view in which it is
/// largest: 1 fills it, 0 is out of sight. Written once a frame by the feature `render`, which needs a
/// `Camera`; else by the game. Default 1.
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq, Deref, DerefMut)]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct ScreenShare(pub f32);

impl Default for ScreenShare {
    fn default() -> Self {
        Self(1.0)
    }
}

/// The level at which a hair is simulated in this tick. Kept by the tick.
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct PresentLod {
    /// 0 in full, n the n-th of [`HairLod::levels`].
    pub level: usize,
    /// How many strands are not simulated but carried by others.
    pub carried: usize,
    /// How many levels coarser it is than it would be without a [`HairBudget`].
    pub saved: usize,
    strands: Option<f32>,
    /// Segments of all its strands, and how many strands there were when they were counted.
    segments: (usize, usize),
}

impl PresentLod {
    /// The share of the strands that is to be simulated.
    pub(crate) fn share(&self) -> f32 {
        self.strands.unwrap_or(1.0)
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
    /// When the share is negative or not a number, or a count is 0 or more than 1000.
    pub fn new(below: f32, iterations: u32, substeps: u32) -> Result<Self, InvalidValue> {
        Self { below, iterations, substeps, ..default() }.checked()
    }

    /// The same level with another share of the strands simulated.
    ///
    /// # Errors
    /// When the share is not a number or outside 0…1.
    pub fn with_strands(self, share: f32) -> Result<Self, InvalidValue> {
        Self { strands: share, ..self }.checked()
    }
}

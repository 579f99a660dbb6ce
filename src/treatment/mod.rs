//! Tools on bonds: treatments that cut or re-form them, and perm rods that hair is wound on.

mod systems;
pub mod winding;

pub use systems::TreatmentPlugin;

use crate::{
    bond::BondKind,
    setting::{Bound, InvalidValue, Notes},
    strand::{HeldNodes, TickPose},
};
use bevy::prelude::*;
use core::ops::Range;

/// A request to move bond rates, for a hair or one strand, all joints or some, at once or over
/// time. A message: write it from anywhere, the next tick takes it up and lets it act through
/// equation 16, so that bonds which re-form remember the shape of that moment.
///
/// ```
/// # use bevy_keratin::prelude::*; use bevy::prelude::*;
/// fn shower(hair: Single<Entity, With<Hair>>, mut treat: MessageWriter<Treat>) {
///     treat.write(Treat::wet(*hair));
///     // dry the outer half in two seconds
///     treat.write(Treat::dry(*hair).over(2.0).joints(4..8));
/// }
/// ```
#[derive(Message, Reflect, Clone, Debug, PartialEq)]
#[reflect(Clone, PartialEq)]
pub struct Treat {
    /// The [`Hair`](crate::Hair) or strand to treat.
    pub target: Entity,
    /// The joints to treat, from the root; `None` all.
    pub joints: Option<Range<usize>>,
    /// The rate that each [`BondKind`] is to reach, `None` where it stays. Peptide bonds are never
    /// cut.
    pub rates: [Option<f32>; BondKind::COUNT],
    /// Time to get there (s). Default 0: in one substep.
    pub seconds: f32,
}

/// The share of disulfide bonds that perm lotion leaves (\[B\] §4).
pub const LOTION_DISULFIDE: f32 = 0.8;

const RATE: Bound = Bound::new("a bond's rate", 0.0, 1.0, "0 all broken, 1 all closed");

impl Treat {
    fn rates(target: Entity, rates: [Option<f32>; BondKind::COUNT]) -> Self {
        Self { target, joints: None, rates, seconds: 0.0 }
    }

    /// Soaks: cuts the hydrogen bonds.
    pub fn wet(target: Entity) -> Self {
        Self::rates(target, [Some(0.0), None, None, None])
    }

    /// Dries: the hydrogen bonds re-form around the present shape.
    pub fn dry(target: Entity) -> Self {
        Self::rates(target, [Some(1.0), None, None, None])
    }

    /// Perm lotion: cuts hydrogen and ionic bonds, and a fifth of the disulfide bonds.
    pub fn lotion(target: Entity) -> Self {
        Self::rates(target, [Some(0.0), Some(0.0), Some(LOTION_DISULFIDE), None])
    }

    /// Neutraliser and rinse: ionic and disulfide bonds re-form. Hydrogen bonds wait for drying.
    pub fn neutraliser(target: Entity) -> Self {
        Self::rates(target, [None, Some(1.0), Some(1.0), None])
    }

    /// Shampoo: cuts hydrogen and ionic bonds.
    pub fn shampoo(target: Entity) -> Self {
        Self::rates(target, [Some(0.0), Some(0.0), None, None])
    }

    /// Everything re-forms around the present shape, which becomes the hair's own.
    pub fn set_everything(target: Entity) -> Self {
        Self::rates(target, [Some(1.0); BondKind::COUNT])
    }

    /// Brings one kind to a rate.
    ///
    /// # Errors
    /// When the rate is outside 0 to 1.
    pub fn set(target: Entity, kind: BondKind, rate: f32) -> Result<Self, InvalidValue> {
        let mut rates = [None; BondKind::COUNT];
        rates[kind as usize] = Some(RATE.check(rate)?);
        Ok(Self::rates(target, rates))
    }

    /// The same treatment of these joints only, counted from the root.
    pub fn joints(mut self, joints: Range<usize>) -> Self {
        self.joints = Some(joints);
        self
    }

    /// The same treatment, taking `seconds`, of which [`ProcessTime`](crate::ProcessTime) makes fewer.
    pub fn over(mut self, seconds: f32) -> Self {
        self.seconds = seconds;
        self
    }

    /// Values from anywhere: brought into their ranges.
    fn mended(mut self, notes: &Notes) -> Self {
        const SECONDS: Bound = Bound::new("Treat::seconds (s)", 0.0, 1e6, "0 acts at once");
        self.seconds = SECONDS.mend(self.seconds, 0.0, notes);
        for rate in self.rates.iter_mut().flatten() {
            *rate = RATE.mend(*rate, 1.0, notes);
        }
        self
    }
}

/// The treatments that are acting on a strand. Kept by the tick.
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Clone)]
pub struct Treatments {
    acting: Vec<Treat>,
}

impl Treatments {
    /// The treatments, oldest first, with the time they still take.
    pub fn acting(&self) -> &[Treat] {
        &self.acting
    }
}

/// A cylinder along Y that strands are wound round: see [`Winding`]. Despawn it to release them.
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq)]
#[require(Transform, TickPose)]
pub struct PermRod {
    /// Radius (m). Default 0.03, safe 0.003…0.1. A joint turns by 2 asin(l/2R): keep segments below
    /// 1.7 times the radius.
    pub radius: f32,
    /// Length (m). Default 0.2.
    pub length: f32,
}

impl Default for PermRod {
    fn default() -> Self {
        Self { radius: 0.03, length: 0.2 }
    }
}

const ROD_RADIUS: Bound = Bound::new("PermRod::radius (m)", 1e-3, 10.0, "3 cm is the paper's size");
const ROD_LENGTH: Bound = Bound::new("PermRod::length (m)", 1e-3, 100.0, "0.2 takes a row of hair");

impl PermRod {
    /// A rod of `radius` and `length` (m).
    ///
    /// # Errors
    /// When one is not between 1 mm and 10 m (radius) or 100 m (length).
    pub fn new(radius: f32, length: f32) -> Result<Self, InvalidValue> {
        Ok(Self { radius: ROD_RADIUS.check(radius)?, length: ROD_LENGTH.check(length)? })
    }

    fn mended(&self, notes: &Notes) -> Self {
        Self {
            radius: ROD_RADIUS.mend(self.radius, 0.03, notes),
            length: ROD_LENGTH.mend(self.length, 0.2, notes),
        }
    }
}

/// The rod that a strand is wound on. Removing it, or despawning the rod, releases the strand.
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq, Eq)]
#[reflect(Component, Clone, PartialEq)]
#[relationship(relationship_target = WoundStrands)]
#[require(Winding, WindingProgress, HeldNodes)]
pub struct WoundOn(pub Entity);

/// The strands on a [`PermRod`]. Kept by Bevy.
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq, Eq)]
#[reflect(Component, Default, Clone)]
#[relationship_target(relationship = WoundOn)]
pub struct WoundStrands(Vec<Entity>);

/// How a strand is wound on its rod.
///
/// The nodes are guided, as by a hairdresser's hand: from where the strand is when winding begins,
/// through ever tighter helices whose radius shrinks to the rod's, each of the strand's own length,
/// so nothing is stretched on the way. Their shape is the bonds' to remember.
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct Winding {
    /// The first node on the rod, from the root. Default 2.
    pub from_node: usize,
    /// Advance along the rod's axis per turn (m). Default 0.004: turns lie side by side.
    pub pitch: f32,
    /// Time that winding takes (s). Default 2.
    pub seconds: f32,
}

impl Default for Winding {
    fn default() -> Self {
        Self { from_node: 2, pitch: 0.004, seconds: 2.0 }
    }
}

/// How far winding has come. Kept by the tick.
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Clone)]
pub struct WindingProgress {
    progress: f32,
    /// Where the strand was when winding began, in the hair's frame.
    start: Vec<Vec3>,
    /// Where its nodes are on the rod once they are wound, in the rod's frame.
    on_rod: Vec<Vec3>,
}

impl WindingProgress {
    /// 0 has just begun, 1 is wound.
    pub fn progress(&self) -> f32 {
        self.progress
    }
}

//! Side-chain bonds: why this hair remembers.
//!
//! Every joint carries four kinds of bonds. Each has a shape it remembers and a rate, the share of
//! its bonds that are closed. Water, lotions, heat and wind move the rates; bonds that re-form
//! remember the shape of that moment ([`JointBonds::change`], equation 16); the rest shape the rod
//! springs back to is their weighted mean ([`JointBonds::rest_shape`], equation 15).
//!
//! Mathematics in [`model`], components here, systems beside. Nothing but `BondUpdate` moves rates:
//! whoever wants a change asks for it in [`BondChanges`], which game code does through
//! [`Treat`](crate::treatment::Treat).

mod command;
mod lanes;
pub mod model;
mod systems;

pub use model::JointBonds;
pub use systems::BondPlugin;

use crate::{
    parallel::prefetch,
    setting::{InvalidValue, Ranged, ValueRange, Violations, setting},
    strand::Strand,
};
use bevy::prelude::*;

/// A kind of side-chain bond of keratin.
#[derive(Reflect, Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u8)]
pub enum BondKind {
    /// Cut by water, re-forms on drying.
    Hydrogen = 0,
    /// Salt bonds, cut by pH: shampoo, styling products, lotions.
    Ionic = 1,
    /// Cut by perm lotion, re-formed by the neutraliser; about a fifth of them at most.
    Disulfide = 2,
    /// The backbone: never cut.
    Peptide = 3,
}

impl BondKind {
    /// How many kinds there are.
    pub const COUNT: usize = 4;
    /// All kinds, in the order of their indices.
    pub const ALL: [Self; Self::COUNT] =
        [Self::Hydrogen, Self::Ionic, Self::Disulfide, Self::Peptide];
}

/// The bonds of a strand: one [`JointBonds`] a joint, joint i at node i, joint 0 at the scalp.
///
/// Spawned empty it is filled in the next tick with closed bonds around the strand's present shape.
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct Bonds {
    /// The joints, root first; as many as the strand has edges.
    pub joints: Vec<JointBonds>,
}

impl Bonds {
    /// Closed bonds around the strand's present shape.
    pub fn of(strand: &Strand) -> Self {
        let joints =
            (0..strand.edges()).map(|i| JointBonds::closed(strand.darboux(i).xyz())).collect();
        Self { joints }
    }

    /// The rates of one kind, root first.
    pub fn rates(&self, kind: BondKind) -> impl Iterator<Item = f32> + '_ {
        self.joints.iter().map(move |j| j.rates[kind as usize])
    }
}

/// What the tick will do to a strand's rates: requested Δb per joint and kind, summed over all who
/// ask in `ExternalForces`, taken by `BondUpdate` through equation 16.
#[derive(Component, Reflect, Clone, Debug, Default)]
#[reflect(Component, Default, Clone)]
pub struct BondChanges {
    /// Δb per joint; may be empty when nobody asks.
    joints: Vec<[f32; BondKind::COUNT]>,
    any: bool,
}

impl BondChanges {
    /// Asks for a change of `kind` at `joint`. Requests beyond the strand's joints and non-finite
    /// ones do nothing; peptide bonds are never cut.
    #[inline]
    pub fn ask(&mut self, joint: usize, kind: BondKind, change: f32) {
        if change == 0.0 || !change.is_finite() || (kind == BondKind::Peptide && change < 0.0) {
            return;
        }
        if joint >= self.joints.len() {
            self.joints.resize(joint + 1, [0.0; BondKind::COUNT]);
        }
        self.joints[joint][kind as usize] += change;
        self.any = true;
    }

    /// Whether anything was asked.
    pub fn is_empty(&self) -> bool {
        !self.any
    }

    /// Asks for the memory of what was asked for.
    pub(crate) fn prefetch(&self) {
        prefetch(&self.joints);
    }

    /// What was asked of each joint, root first.
    fn asked(&self) -> &[[f32; BondKind::COUNT]] {
        &self.joints
    }

    /// All of it is done.
    fn clear(&mut self) {
        self.any = false;
        self.joints.fill([0.0; BondKind::COUNT]);
    }
}

setting! {
    /// How much each kind of bond contributes to the shape: the influences f_j of equation 15, as
    /// shares of their sum. Component of a [`Hair`](crate::Hair); where absent,
    /// [`HairDefault<BondInfluence>`](crate::HairDefault) holds.
    ///
    /// The default is \[B\] table 1's scenes 1 and 2, hydrogen 33 %, the other 67 % spread as the perm
    /// scene's ionic, disulfide and peptide bonds stand to each other.
    #[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Component, Default, Clone, PartialEq)]
    pub struct BondInfluence {
        /// f of the hydrogen bonds.
        pub hydrogen: f32 = 0.33, in HYDROGEN: 0.0..=1e6, safe 0.0..=1.0, "a share such as 0.33";
        /// f of the ionic bonds.
        pub ionic: f32 = 0.30, in IONIC: 0.0..=1e6, safe 0.0..=1.0, "a share such as 0.3";
        /// f of the disulfide bonds.
        pub disulfide: f32 = 0.20, in DISULFIDE: 0.0..=1e6, safe 0.0..=1.0, "a share such as 0.2";
        /// f of the peptide bonds.
        pub peptide: f32 = 0.17, in PEPTIDE: 0.0..=1e6, safe 0.0..=1.0, "a share such as 0.17";
    }
    then Self::one_must_count
}

impl BondInfluence {
    /// Influences of hydrogen, ionic, disulfide and peptide bonds; only their proportions count.
    ///
    /// # Errors
    /// When one is negative or not finite, or all are zero.
    pub fn new(
        hydrogen: f32,
        ionic: f32,
        disulfide: f32,
        peptide: f32,
    ) -> Result<Self, InvalidValue> {
        Self { hydrogen, ionic, disulfide, peptide }.checked()
    }

    /// The influences by [`BondKind`] as index.
    pub fn as_array(&self) -> [f32; BondKind::COUNT] {
        [self.hydrogen, self.ionic, self.disulfide, self.peptide]
    }

    fn one_must_count(&mut self, violations: &mut Violations) {
        const SUM: ValueRange =
            ValueRange::new("the sum of BondInfluence", 1e-6..=1e7, "at least one kind must count");
        if let Err(wrong) = SUM.check(self.as_array().iter().sum::<f32>()) {
            violations.push(wrong);
            *self = default();
        }
    }
}

setting! {
    /// Wear of the cuticle, which softens hair toward the tip: equations 13 and 14. Component of a
    /// [`Hair`](crate::Hair); where absent, [`HairDefault<Cuticle>`](crate::HairDefault) holds.
    #[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Component, Default, Clone, PartialEq)]
    pub struct Cuticle {
        /// s, share of the cuticle lost per length from the root.
        pub damage: f32 = 0.33, "1/m" in DAMAGE: 0.0..=1e4, safe 0.0..=10.0, "the paper uses 0.33";
        /// k_cut / k_o, the share of stiffness that is gone where the cuticle is.
        pub softening: f32 = 0.5764, in SOFTENING: 0.0..=0.99, safe 0.0..=0.9,
            "the paper uses 0.5764";
    }
}

/// What the rods spring back to in this substep, written by `RestShape`, read by `Projection`.
#[derive(Component, Reflect, Clone, Debug, Default)]
#[reflect(Component, Default, Clone)]
pub struct RestShape {
    /// Ω0 of each joint (equation 15), a full quaternion with real part ≥ 0.
    pub darboux: Vec<Quat>,
    /// k′ of each joint: equation 13's factor on the true stiffness, spread over the iterations
    /// (equation 12).
    pub stiffness: Vec<f32>,
    key: Option<systems::Key>,
    /// Whether all bonds are closed: then the shape is theirs alone, and stays until they change.
    closed: bool,
    /// What the stiffness was last softened by.
    softened: Vec<f32>,
}

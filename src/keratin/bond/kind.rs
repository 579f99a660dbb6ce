//! The kinds of bonds.

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

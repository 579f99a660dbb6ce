//! The bones of a character that roots follow.

use bevy::prelude::*;

/// The bones that move the root of one strand.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Default, Clone, PartialEq)]
pub struct StrandBones {
    /// Indices into [`RootBones::names`]. What a slot without weight says has no meaning.
    pub bones: [u16; 4],
    /// How much each moves the root; of sum 1 as read from a file. All 0: none does, and the root stays
    /// with the hair.
    pub weights: [f32; 4],
}

impl StrandBones {
    /// The bones that move the root, each with its weight.
    pub fn used(&self) -> impl Iterator<Item = (u16, f32)> + '_ {
        self.bones.iter().copied().zip(self.weights).filter(|(_, weight)| *weight > 0.0)
    }
}

/// Which bones move the roots of a groom's strands, and how much: skinning by the strand. Read from a `.tfxbone`
/// by [`tressfx::read_bones`](super::tressfx::read_bones), or made by game code, and kept by
/// [`Groom::with_bones`](super::Groom::with_bones). Default empty: no bones.
#[derive(Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Default, Clone, PartialEq)]
pub struct RootBones {
    /// The bones' names, as the character's skeleton has them.
    pub names: Vec<String>,
    /// One for each strand, in order.
    pub strands: Vec<StrandBones>,
}

impl RootBones {
    /// Gives strands that have no bones yet, up to `count`, those of the last. Returns how many.
    pub(super) fn extend(&mut self, count: usize) -> usize {
        let missing = count.saturating_sub(self.strands.len());
        let last = self.strands.last().copied().unwrap_or_default();
        self.strands.resize(self.strands.len() + missing, last);
        missing
    }
}

/// Which file names the bones of a groom's roots: see [`GroomSettings::bones`](super::GroomSettings::bones).
#[derive(Reflect, Clone, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[reflect(Default, Clone, PartialEq)]
pub enum BonesFile {
    /// The one beside a `.tfx`, of the same name, such as `bob.tfxbone` of `bob.tfx`, if it is there.
    #[default]
    Beside,
    /// None.
    Unused,
    /// The `.tfxbone` at this path, from the groom's folder on; a groom of any format may have one.
    Named(String),
}

//! Morph targets of the few vertices that have roots.

use bevy::{
    ecs::system::SystemParam,
    mesh::morph::{MeshMorphWeights, MorphWeights},
    prelude::*,
};

/// The displacement of one corner by one morph target.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shift {
    /// Of which mesh.
    part: u16,
    target: u32,
    /// At weight 1, in the mesh's own space.
    by: Vec3,
}

impl Shift {
    /// `None` where the target does not move the corner.
    pub fn new(part: u16, target: usize, by: Vec3) -> Option<Self> {
        (by != Vec3::ZERO && by.is_finite()).then_some(Self { part, target: target as u32, by })
    }

    /// The displacement with these weights of all targets of each mesh. A missing or non-finite weight counts
    /// as 0.
    pub fn at(&self, weights: &[&[f32]]) -> Vec3 {
        let own = weights.get(usize::from(self.part)).copied().unwrap_or_default();
        let weight = own.get(self.target as usize).copied().unwrap_or(0.0);
        if weight.is_finite() { self.by * weight } else { Vec3::ZERO }
    }
}

/// The weights of morph targets as Bevy draws them: a mesh's own, or those it refers to.
#[derive(SystemParam)]
pub(super) struct Morphs<'w, 's> {
    meshes: Query<'w, 's, &'static MeshMorphWeights>,
    shared: Query<'w, 's, &'static MorphWeights>,
}

impl Morphs<'_, '_> {
    /// Those of a mesh, one for each target; empty where nothing morphs it.
    pub fn of(&self, mesh: Entity) -> &[f32] {
        match self.meshes.get(mesh) {
            Ok(MeshMorphWeights::Value { weights }) => weights,
            Ok(MeshMorphWeights::Reference(other)) => {
                self.shared.get(*other).map_or(&[], MorphWeights::weights)
            }
            Err(_) => &[],
        }
    }
}

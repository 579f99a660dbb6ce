//! The mesh as posed by joints and morph targets.

use super::{
    corner::Corner,
    error::RootsError,
    morph::{Morphs, Shift},
};
use bevy::{
    math::{Affine3A, Vec3A},
    mesh::skinning::{SkinnedMesh, SkinnedMeshInverseBindposes},
    prelude::*,
};

/// A joint that moves some of the triangles; the mesh itself where it is not skinned.
#[derive(Clone, Copy, Debug)]
struct Joint {
    entity: Entity,
    inverse_bind: Affine3A,
}

/// The joints and morph targets of the corners that roots are tied to.
#[derive(Clone, Debug, Default)]
pub(super) struct Movers {
    mesh: Option<Entity>,
    joints: Vec<Joint>,
    /// Of every corner that morph targets move; empty on most meshes.
    pub shifts: Vec<Shift>,
}

impl Movers {
    /// The movers of a mesh's entity.
    pub fn of(
        mesh: Entity,
        skin: Option<(&SkinnedMesh, &SkinnedMeshInverseBindposes)>,
    ) -> Result<Self, RootsError> {
        let joints: Vec<Joint> = match skin {
            None => vec![Joint { entity: mesh, inverse_bind: Affine3A::IDENTITY }],
            Some((skin, poses)) => (skin.joints.iter().zip(poses.iter()))
                .map(|(&entity, pose)| Joint { entity, inverse_bind: Affine3A::from_mat4(*pose) })
                .collect(),
        };
        match (joints.is_empty(), skin) {
            (true, Some((skin, poses))) => {
                Err(RootsError::NoJoints { joints: skin.joints.len(), poses: poses.len() })
            }
            _ => Ok(Self { mesh: Some(mesh), joints, shifts: Vec::new() }),
        }
    }

    /// The mesh that they move; `None` before there is one.
    pub fn mesh(&self) -> Option<Entity> {
        self.mesh
    }

    /// How many joints there are, one at least.
    pub fn joints(&self) -> usize {
        self.joints.len()
    }

    /// The present pose; `None` while a joint has no transform.
    pub fn pose<'a>(
        &'a self,
        mut place: impl FnMut(Entity) -> Option<GlobalTransform>,
        morphs: &'a Morphs,
    ) -> Option<MeshPose<'a>> {
        let joints = self.joints.iter().map(|j| Some(place(j.entity)?.affine() * j.inverse_bind));
        Some(MeshPose {
            joints: joints.collect::<Option<_>>()?,
            shifts: &self.shifts,
            weights: morphs.of(self.mesh),
        })
    }
}

/// The mesh at one moment.
pub(super) struct MeshPose<'a> {
    joints: Vec<Affine3A>,
    shifts: &'a [Shift],
    weights: &'a [f32],
}

impl MeshPose<'_> {
    /// Where a corner is in the world.
    pub fn corner(&self, corner: &Corner) -> Vec3 {
        let own = self.shifts.get(corner.shifts()).unwrap_or_default();
        let by: Vec3 = own.iter().map(|shift| shift.at(self.weights)).sum();
        self.skinned(corner, corner.at + by)
    }

    /// Where it would be if no target morphed it.
    pub fn unmorphed(&self, corner: &Corner) -> Vec3 {
        self.skinned(corner, corner.at)
    }

    fn skinned(&self, corner: &Corner, at: Vec3) -> Vec3 {
        let all: f32 = corner.weights.iter().sum();
        let sum: Vec3A = (corner.joints.iter().zip(corner.weights))
            .map(|(&j, w)| self.joints[j as usize].transform_point3a(at.into()) * (w / all))
            .sum();
        sum.into()
    }
}

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
use core::ops::Range;

/// A joint that moves some of the triangles; the mesh itself where it is not skinned.
#[derive(Clone, Copy, Debug)]
struct Joint {
    entity: Entity,
    inverse_bind: Affine3A,
}

/// The joints and morph targets of the corners that roots are tied to.
#[derive(Clone, Debug, Default)]
pub(super) struct Movers {
    meshes: Vec<Entity>,
    /// Of one mesh after the other.
    joints: Vec<Joint>,
    /// Of every corner that morph targets move; empty on most meshes.
    pub shifts: Vec<Shift>,
}

impl Movers {
    /// Adds a mesh with its skin. Returns its joints, one at least, among those of all.
    pub fn add(
        &mut self,
        mesh: Entity,
        skin: Option<(&SkinnedMesh, &SkinnedMeshInverseBindposes)>,
    ) -> Result<Range<usize>, RootsError> {
        let first = self.joints.len();
        match skin {
            None => self.joints.push(Joint { entity: mesh, inverse_bind: Affine3A::IDENTITY }),
            Some((skin, poses)) => {
                let both = skin.joints.iter().zip(poses.iter());
                self.joints.extend(both.map(|(&entity, pose)| Joint {
                    entity,
                    inverse_bind: Affine3A::from_mat4(*pose),
                }));
                if self.joints.len() == first {
                    let (joints, poses) = (skin.joints.len(), poses.len());
                    return Err(RootsError::NoJoints { joints, poses });
                }
            }
        }
        self.meshes.push(mesh);
        Ok(first..self.joints.len())
    }

    /// Adds a bone, with the transform to its own space from that of the roots at rest. Returns its index.
    pub fn add_bone(&mut self, entity: Entity, inverse_bind: Affine3A) -> u16 {
        self.joints.push(Joint { entity, inverse_bind });
        (self.joints.len() - 1) as u16
    }

    /// The joints' entities.
    pub fn bones(&self) -> impl Iterator<Item = Entity> + '_ {
        self.joints.iter().map(|joint| joint.entity)
    }

    /// The meshes that they move; none before there is one.
    pub fn meshes(&self) -> &[Entity] {
        &self.meshes
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
            weights: self.meshes.iter().map(|mesh| morphs.of(*mesh)).collect(),
        })
    }
}

/// The mesh at one moment.
pub(super) struct MeshPose<'a> {
    joints: Vec<Affine3A>,
    shifts: &'a [Shift],
    /// Of the morph targets of each mesh.
    weights: Vec<&'a [f32]>,
}

impl MeshPose<'_> {
    /// Where a corner is in the world.
    pub fn corner(&self, corner: &Corner) -> Vec3 {
        let own = self.shifts.get(corner.shifts()).unwrap_or_default();
        let by: Vec3 = own.iter().map(|shift| shift.at(&self.weights)).sum();
        self.skinned(corner, corner.at + by)
    }

    /// Where it would be if no target morphed it.
    pub fn unmorphed(&self, corner: &Corner) -> Vec3 {
        self.skinned(corner, corner.at)
    }

    /// As Bevy draws it: weights are not divided by their sum.
    fn skinned(&self, corner: &Corner, at: Vec3) -> Vec3 {
        let sum: Vec3A = (corner.joints.iter().zip(corner.weights))
            .map(|(&j, w)| self.joints[j as usize].transform_point3a(at.into()) * w)
            .sum();
        sum.into()
    }
}

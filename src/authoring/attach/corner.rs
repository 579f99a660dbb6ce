//! The few vertices of a mesh that have roots, with their joints and morph targets.

use super::{error::RootsError, morph::Shift};
use crate::authoring::plant::RootOnMesh;
use bevy::{
    mesh::{Indices, Mesh, MeshAccessError, VertexAttributeValues, morph::MorphAttributes},
    prelude::*,
};
use core::ops::Range;

/// A vertex at rest, with its joints and morph targets.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    pub at: Vec3,
    /// Always valid indices, see [`Corners::joints_of`].
    pub joints: [u16; 4],
    pub weights: [f32; 4],
    /// Its range in the shifts of its hair: first and one past the last; empty for most.
    shifts: [u32; 2],
}

impl Corner {
    /// The range of its shifts among those of its hair.
    pub fn shifts(&self) -> Range<usize> {
        self.shifts[0] as usize..self.shifts[1] as usize
    }
}

/// Which triangles a mesh has: vertices may move, but roots are on these.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Triangles {
    pub(super) vertices: usize,
    hash: u64,
}

impl Triangles {
    fn of(mesh: &Mesh, vertices: usize) -> Self {
        // FNV-1a, a word at a time.
        let mix = |hash: u64, word: u64| (hash ^ word).wrapping_mul(0x0000_0100_0000_01b3);
        let hash = match mesh.try_indices_option() {
            Ok(Some(Indices::U16(all))) => all.iter().fold(0, |hash, v| mix(hash, u64::from(*v))),
            Ok(Some(Indices::U32(all))) => all.iter().fold(0, |hash, v| mix(hash, u64::from(*v))),
            _ => 0,
        };
        Self { vertices, hash }
    }
}

/// Reads corners from a mesh.
pub(super) struct Corners<'a> {
    mesh: &'a Mesh,
    positions: &'a [[f32; 3]],
    skin: Option<(&'a [[u16; 4]], &'a [[f32; 4]])>,
    joints: usize,
    /// Target after target, each with all vertices.
    morphs: &'a [MorphAttributes],
}

impl<'a> Corners<'a> {
    /// Reads a mesh with `joints` joints, at least one.
    pub fn of(mesh: &'a Mesh, skinned: bool, joints: usize) -> Result<Self, RootsError> {
        let attribute = |id| mesh.try_attribute_option(id);
        let positions = match attribute(Mesh::ATTRIBUTE_POSITION) {
            Ok(Some(VertexAttributeValues::Float32x3(positions))) => positions,
            Err(MeshAccessError::ExtractedToRenderWorld) => return Err(RootsError::Extracted),
            _ => return Err(RootsError::NoPositions),
        };
        let skin = match [Mesh::ATTRIBUTE_JOINT_INDEX, Mesh::ATTRIBUTE_JOINT_WEIGHT].map(attribute)
        {
            [
                Ok(Some(VertexAttributeValues::Uint16x4(indices))),
                Ok(Some(VertexAttributeValues::Float32x4(weights))),
            ] if skinned => Some((&indices[..], &weights[..])),
            _ => None,
        };
        let morphs = mesh.try_morph_targets().map_or(&[][..], |targets| targets);
        Ok(Self { mesh, positions, skin, joints, morphs })
    }

    /// Which triangles the mesh has.
    pub fn triangles(&self) -> Triangles {
        Triangles::of(self.mesh, self.positions.len())
    }

    /// The corners of a root's triangle; what morph targets do to them goes into `shifts`.
    pub fn around(
        &self,
        root: &RootOnMesh,
        shifts: &mut Vec<Shift>,
    ) -> Result<[Corner; 3], RootsError> {
        let [a, b, c] = root.vertices;
        Ok([self.corner(a, shifts)?, self.corner(b, shifts)?, self.corner(c, shifts)?])
    }

    fn corner(&self, vertex: u32, shifts: &mut Vec<Shift>) -> Result<Corner, RootsError> {
        let (v, vertices) = (vertex as usize, self.positions.len());
        let at = self.positions.get(v).ok_or(RootsError::Vertex { found: vertex, vertices })?;
        let first = shifts.len();
        let targets = self.morphs.chunks_exact(vertices).enumerate();
        shifts.extend(targets.filter_map(|(target, all)| Shift::new(target, all[v].position)));
        let (joints, weights) = self.joints_of(v).unwrap_or(([0; 4], [1.0, 0.0, 0.0, 0.0]));
        let shifts = [first as u32, shifts.len() as u32];
        Ok(Corner { at: (*at).into(), joints, weights, shifts })
    }

    /// The joints of a vertex with their weights; `None` where they are invalid.
    fn joints_of(&self, v: usize) -> Option<([u16; 4], [f32; 4])> {
        let (indices, weights) = self.skin?;
        let (indices, weights) = (*indices.get(v)?, *weights.get(v)?);
        let valid = indices.iter().all(|&j| usize::from(j) < self.joints);
        (valid && weights.iter().sum::<f32>() > 1e-6).then_some((indices, weights))
    }
}

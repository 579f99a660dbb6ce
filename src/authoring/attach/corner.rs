//! The few vertices of meshes that have roots, with their joints and morph targets.

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
    /// Of which mesh it is.
    pub part: u16,
    /// Among the joints of all meshes; always valid, see [`Part::joints_of`].
    pub joints: [u16; 4],
    pub weights: [f32; 4],
    /// Its range in the shifts of its hair: first and one past the last; empty for most.
    shifts: [u32; 2],
}

impl Corner {
    /// A point that is on no mesh and moves with joints.
    pub fn on_joints(at: Vec3, joints: [u16; 4], weights: [f32; 4]) -> Self {
        Self { at, part: 0, joints, weights, shifts: [0; 2] }
    }

    /// The range of its shifts among those of its hair.
    pub fn shifts(&self) -> Range<usize> {
        self.shifts[0] as usize..self.shifts[1] as usize
    }
}

/// Which triangles meshes have: vertices may move, but roots are on these.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Triangles {
    pub(super) vertices: usize,
    hash: u64,
}

impl Triangles {
    /// Those of no mesh yet.
    pub(super) const NONE: Self = Self { vertices: 0, hash: 0 };

    /// Adds those of a mesh.
    fn add(&mut self, mesh: &Mesh, vertices: usize) {
        // FNV-1a, a word at a time.
        let mix = |hash: u64, word: u64| (hash ^ word).wrapping_mul(0x0000_0100_0000_01b3);
        self.vertices += vertices;
        let fold = |hash: u64, v: u32| mix(hash, u64::from(v));
        match mesh.try_indices_option() {
            Ok(Some(Indices::U16(all))) => {
                self.hash = all.iter().fold(self.hash, |hash, v| fold(hash, u32::from(*v)));
            }
            Ok(Some(Indices::U32(all))) => {
                self.hash = all.iter().fold(self.hash, |hash, v| fold(hash, *v));
            }
            _ => {}
        }
    }
}

/// Reads corners from meshes, whose vertices are counted one mesh after the other.
pub(super) struct Corners<'a> {
    parts: Vec<Part<'a>>,
    triangles: Triangles,
}

/// One mesh.
struct Part<'a> {
    positions: &'a [[f32; 3]],
    skin: Option<(&'a [[u16; 4]], &'a [[f32; 4]])>,
    /// Its joints among those of all meshes.
    joints: Range<usize>,
    /// Target after target, each with all vertices.
    morphs: &'a [MorphAttributes],
}

impl<'a> Corners<'a> {
    pub const fn new() -> Self {
        Self { parts: Vec::new(), triangles: Triangles::NONE }
    }

    /// Adds a mesh, with its joints among those of all: at least one.
    pub fn add(
        &mut self,
        mesh: &'a Mesh,
        skinned: bool,
        joints: Range<usize>,
    ) -> Result<(), RootsError> {
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
        self.triangles.add(mesh, positions.len());
        self.parts.push(Part { positions, skin, joints, morphs });
        Ok(())
    }

    /// Which triangles the meshes have.
    pub fn triangles(&self) -> Triangles {
        self.triangles
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
        let mut v = vertex as usize;
        for (i, part) in (0..).zip(&self.parts) {
            if v < part.positions.len() {
                return Ok(part.corner(i, v, shifts));
            }
            v -= part.positions.len();
        }
        Err(RootsError::Vertex { found: vertex, vertices: self.triangles.vertices })
    }
}

impl Part<'_> {
    fn corner(&self, part: u16, v: usize, shifts: &mut Vec<Shift>) -> Corner {
        let first = shifts.len();
        let targets = self.morphs.chunks_exact(self.positions.len()).enumerate();
        shifts
            .extend(targets.filter_map(|(target, all)| Shift::new(part, target, all[v].position)));
        let (joints, weights) =
            self.joints_of(v).unwrap_or(([self.joints.start as u16; 4], [1.0, 0.0, 0.0, 0.0]));
        let shifts = [first as u32, shifts.len() as u32];
        Corner { at: self.positions[v].into(), part, joints, weights, shifts }
    }

    /// The joints of a vertex with their weights; `None` where they are invalid. A slot without weight is not
    /// used, whatever joint it names.
    fn joints_of(&self, v: usize) -> Option<([u16; 4], [f32; 4])> {
        let (indices, weights) = self.skin?;
        let (indices, weights) = (*indices.get(v)?, *weights.get(v)?);
        let mut joints = [self.joints.start as u16; 4];
        for k in (0..4).filter(|k| weights[*k] != 0.0) {
            let joint = self.joints.start + usize::from(indices[k]);
            joints[k] = u16::try_from(joint).ok().filter(|_| joint < self.joints.end)?;
        }
        (weights.iter().sum::<f32>() > 1e-6).then_some((joints, weights))
    }
}

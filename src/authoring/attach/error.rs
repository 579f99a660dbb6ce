//! Why roots cannot follow a mesh.

use bevy::prelude::*;

/// Why the strands of a [`RootsOnMesh`](super::RootsOnMesh) do not follow its mesh: which value, what
/// was expected and how to fix it. Reported as [`FaultKind::Roots`](crate::FaultKind::Roots).
#[derive(thiserror::Error, Reflect, Clone, Debug, PartialEq)]
#[reflect(Clone, PartialEq)]
#[non_exhaustive]
pub enum RootsError {
    /// Not one root for each strand.
    #[error(
        "RootsOnMesh or RootsOnBones has {found} roots, expected {expected}, one for each strand of its hair: \
         take both from the same planting or groom"
    )]
    Count {
        /// How many roots there are.
        found: usize,
        /// How many strands the hair has.
        expected: usize,
    },
    /// A mesh whose data is on the graphics device only.
    #[error(
        "the data of RootsOnMesh's mesh has gone to the render world: give it \
         RenderAssetUsages::MAIN_WORLD as well"
    )]
    Extracted,
    /// A mesh without usable positions.
    #[error(
        "the mesh of RootsOnMesh has no positions of type Float32x3: insert \
         Mesh::ATTRIBUTE_POSITION"
    )]
    NoPositions,
    /// A root on a vertex beyond the mesh's.
    #[error(
        "RootsOnMesh names vertex {found}, expected less than the mesh's {vertices} vertices: \
         plant on this very mesh"
    )]
    Vertex {
        /// The vertex' index.
        found: u32,
        /// How many vertices there are.
        vertices: usize,
    },
    /// A mesh of other triangles than those that roots were planted on.
    #[error(
        "RootsOnMesh's mesh has {found} vertices and other triangles than the one with {expected} that its \
         roots were planted on: insert RootsOnMesh with RootOnMesh::nearest on this mesh, or plant again"
    )]
    Triangles {
        /// How many vertices it has.
        found: usize,
        /// How many the other had.
        expected: usize,
    },
    /// A skin without joints.
    #[error(
        "the SkinnedMesh of RootsOnMesh's mesh has {joints} joints and {poses} inverse bind poses, \
         expected one or more of each: give it the joints of its skeleton, or remove it"
    )]
    NoJoints {
        /// How many joints there are.
        joints: usize,
        /// How many inverse bind poses.
        poses: usize,
    },
    /// Bones that are not there.
    #[error(
        "no entity among {named} with names at, below or above the hair of RootsOnBones is named {missing}: put the \
         hair on its character, or set RootsOnBones::skeleton, or name the bones as the .tfxbone does"
    )]
    NoBones {
        /// Their names, quoted.
        missing: String,
        /// How many entities with names there are.
        named: usize,
    },
    /// Roots on triangles that have no area, and so no normal, or that are not finite.
    #[error(
        "{found} roots of RootsOnMesh or RootsOnBones are on triangles without area, expected none: they stay on \
         the hair; plant them elsewhere or repair the mesh, or the bones' scale"
    )]
    Flat {
        /// How many there are.
        found: usize,
    },
}

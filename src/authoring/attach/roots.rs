//! The roots that are tied to a mesh.

use super::{
    corner::{Corner, Triangles},
    pose::Movers,
};
use crate::authoring::plant::RootOnMesh;
use bevy::{
    ecs::entity::{EntityHashMap, MapEntities},
    math::{Affine3A, Isometry3d, Mat3A},
    prelude::*,
};

/// Ties the strands of a [`Hair`](crate::Hair) to triangles of a mesh, or several: static, skinned or morphed.
/// Component of the hair, which best sits on the bone that moves most of it.
///
/// Strands are in the mesh's own space, before any skinning, as planting gives them, or in the space
/// set by [`strands_from_mesh`](Self::strands_from_mesh). In the first tick in which mesh and joints
/// exist every strand is moved to its place on the posed mesh; lengths are scaled as the mesh is. From
/// then on roots move and rotate with their triangles: by the joints of a `SkinnedMesh`, and by the
/// mesh's morph targets with the weights of `MeshMorphWeights`. Invalid data are reported once as
/// [`FaultKind::Roots`](crate::FaultKind::Roots).
///
/// Each strand is planted once and remembers its root: writing to this component again moves nothing, and
/// after strands were despawned the others keep their roots. Another [`mesh`](Self::mesh), or another root,
/// moves the strand there in its present shape. When the vertices of the mesh are edited roots follow from
/// that frame on and lengths stay; a mesh of other triangles is refused by
/// [`RootsError::Triangles`](super::RootsError::Triangles).
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct RootsOnMesh {
    /// The entity that carries the `Mesh3d`, and if there are any `SkinnedMesh` and
    /// `MeshMorphWeights`.
    #[entities]
    pub mesh: Option<Entity>,
    /// One for each strand, in the order of the hair's [`Strands`](crate::Strands).
    pub roots: Vec<RootOnMesh>,
    /// Transform from the mesh's own space to that of the strands; the identity by default. With the
    /// hair's frame at rest as that space, strands are in place before they are tied.
    pub strands_from_mesh: Affine3A,
    /// Further meshes that strands grow on, such as the other parts of a head. Roots count vertices on: first those
    /// of [`mesh`](Self::mesh), then those of each of these, in order. Default none.
    #[entities]
    pub others: Vec<OtherMesh>,
}

/// A further mesh of a [`RootsOnMesh`].
#[derive(Reflect, MapEntities, Clone, Copy, Debug, PartialEq)]
#[reflect(Clone, PartialEq)]
pub struct OtherMesh {
    /// The entity that carries the `Mesh3d`.
    #[entities]
    pub mesh: Entity,
    /// Transform from this mesh's own space to that of the strands.
    pub strands_from_mesh: Affine3A,
}

impl RootsOnMesh {
    /// All meshes, each with the transform from its space to that of the strands.
    pub(crate) fn meshes(&self) -> impl Iterator<Item = (Entity, Affine3A)> + '_ {
        let others = self.others.iter().map(|other| (other.mesh, other.strands_from_mesh));
        self.mesh.map(|mesh| (mesh, self.strands_from_mesh)).into_iter().chain(others)
    }
}

/// How a strand was planted on its mesh, from which its root's place on the posed mesh follows. State of the
/// strand: it goes into clones and scenes.
#[doc(hidden)]
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[component(storage = "SparseSet")]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct PlantedRoot {
    pub(super) root: RootOnMesh,
    /// Place and frame relative to the posed triangle.
    pub(super) place: Vec3,
    pub(super) frame: Quat,
    /// The frame of that triangle in the strands' space.
    pub(super) bind: Quat,
    /// The factor by which its lengths were multiplied on the mesh.
    pub(super) scale: f32,
}

impl PlantedRoot {
    pub(super) fn offset(&self) -> Isometry3d {
        Isometry3d::new(self.place, self.frame)
    }
}

/// Data read from the mesh when the strands were tied to it, so that its asset may be unloaded. Derived from
/// [`RootsOnMesh`] and [`PlantedRoot`].
#[doc(hidden)]
#[derive(Component, Reflect, Clone, Debug, Default)]
#[component(clone_behavior = Ignore)]
#[reflect(Default, Clone)]
pub struct TiedRoots {
    #[reflect(ignore)]
    pub(super) roots: Vec<Tied>,
    #[reflect(ignore)]
    pub(super) movers: Movers,
    /// The triangles that the roots are on.
    #[reflect(ignore)]
    pub(super) triangles: Option<Triangles>,
    /// Whether the roots are those of [`RootsOnMesh`] or [`RootsOnBones`](super::RootsOnBones), or never will be.
    pub(super) done: bool,
    /// For how long bones have been searched (s).
    #[reflect(ignore)]
    pub(super) searched: f32,
    /// Whether the mesh has changed and is to be read again.
    #[reflect(ignore)]
    pub(super) stale: bool,
    /// Whether it could not be read again: it has other triangles.
    #[reflect(ignore)]
    pub(super) lost: bool,
    /// Whether the roots stay where they are in this tick.
    #[reflect(ignore)]
    pub(super) rest: bool,
}

/// Marks hair that is made again when its mesh has other triangles.
#[derive(Component, Clone, Copy, Debug, Default)]
pub(crate) struct MadeAgain;

impl TiedRoots {
    /// Where roots are on their way to, if they are on the same meshes or bones as before.
    pub(super) fn aims(&self, is_known: bool) -> EntityHashMap<Isometry3d> {
        self.roots.iter().filter(|_| is_known).map(|root| (root.strand, root.to)).collect()
    }

    /// Whether the mesh no longer fits, since the last call of this.
    pub(crate) fn take_lost(&mut self) -> bool {
        core::mem::take(&mut self.lost)
    }
}

#[cfg(feature = "gpu")]
impl TiedRoots {
    /// Whether roots follow a mesh.
    pub(crate) fn are_tied(&self) -> bool {
        !self.roots.is_empty()
    }

    /// Whether they are yet to be tied.
    pub(crate) fn wait(&self) -> bool {
        !self.done
    }

    /// Each tied strand with place and frame of its root at the share `t` of this tick; none while they
    /// stay.
    pub(crate) fn at(&self, t: f32) -> impl Iterator<Item = (Entity, Isometry3d)> + '_ {
        let moved = if self.rest { &[][..] } else { &self.roots };
        moved.iter().map(move |root| (root.strand, root.at(t)))
    }
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Tied {
    pub(super) strand: Entity,
    pub(super) root: RootOnMesh,
    pub(super) corners: [Corner; 3],
    /// The root's frame relative to its triangle's.
    pub(super) offset: Isometry3d,
    pub(super) from: Isometry3d,
    pub(super) to: Isometry3d,
}

impl Tied {
    /// Place and frame of the root at the share `t` of the tick.
    pub(super) fn at(&self, t: f32) -> Isometry3d {
        let (from, to) = (&self.from, &self.to);
        let turn = from.rotation.slerp(to.rotation, t).normalize();
        Isometry3d::new(from.translation.lerp(to.translation, t), turn)
    }
}

/// The frame of a triangle at a point of it; `None` where it has no area.
pub(super) fn triangle(corners: [Vec3; 3], weights: Vec3) -> Option<Isometry3d> {
    let [a, b, c] = corners;
    let along = (b - a).try_normalize()?;
    let normal = (b - a).cross(c - a).try_normalize()?;
    let turn = Mat3A::from_cols(along.into(), normal.cross(along).into(), normal.into());
    let at = a * weights.x + b * weights.y + c * weights.z;
    at.is_finite().then(|| Isometry3d::new(at, Quat::from_mat3a(&turn)))
}

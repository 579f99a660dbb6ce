//! Roots that go with the triangles of a mesh that is skinned or morphs.
//!
//! Hair on a head that only turns needs no more than a [`Hair`](crate::Hair) on the head's bone. Where
//! the scalp itself stretches (a neck, a beard, fur) every root has to follow its own triangle.
//! [`RootsOnMesh`] morphs and skins those few triangles on the CPU: once a tick for the simulation,
//! which takes roots there in equal parts over its substeps, and once a frame from the pose that is
//! drawn, so that no root is ever seen beside its scalp.

mod corner;
mod error;
mod follow;
mod morph;
mod pose;
mod tie;

pub use error::RootsError;

use crate::plant::RootOnMesh;
use crate::schedule::{HairSystems, HairTick};
use bevy::{
    math::{Isometry3d, Mat3A},
    prelude::*,
};

/// Ties the strands of a [`Hair`](crate::Hair) to triangles of a mesh, at rest, skinned or morphed.
/// Component of the hair, which best sits on the bone that moves most of it.
///
/// Give strands as they grow on the mesh in its own space, before any skinning, as planting gives
/// them. In the first tick in which mesh and joints are there every strand is taken to its place on
/// the mesh as it is posed; lengths are scaled as the mesh is. From then on roots go with their
/// triangles, turning with them: with the joints of a `SkinnedMesh`, and with the mesh's morph targets
/// as `MeshMorphWeights` weighs them. What does not fit is told once as
/// [`FaultKind::Roots`](crate::FaultKind::Roots).
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct RootsOnMesh {
    /// The entity that carries the `Mesh3d`, and if there are any `SkinnedMesh` and
    /// `MeshMorphWeights`.
    pub mesh: Option<Entity>,
    /// One for each strand, in the order of the hair's [`Strands`](crate::Strands).
    pub roots: Vec<RootOnMesh>,
}

/// What was read from the mesh when the strands were tied to it, so that its asset may go.
#[derive(Component, Reflect, Clone, Debug, Default)]
#[reflect(Component, Default, Clone)]
pub struct TiedRoots {
    #[reflect(ignore)]
    roots: Vec<Tied>,
    #[reflect(ignore)]
    movers: pose::Movers,
    failed: bool,
}

#[derive(Clone, Copy, Debug)]
struct Tied {
    strand: Entity,
    weights: Vec3,
    corners: [corner::Corner; 3],
    /// Where the root's frame is in its triangle's.
    offset: Isometry3d,
    from: Isometry3d,
    to: Isometry3d,
}

/// The frame of a triangle at a point of it; `None` where it has no area.
fn triangle(corners: [Vec3; 3], weights: Vec3) -> Option<Isometry3d> {
    let [a, b, c] = corners;
    let along = (b - a).try_normalize()?;
    let normal = (b - a).cross(c - a).try_normalize()?;
    let turn = Mat3A::from_cols(along.into(), normal.cross(along).into(), normal.into());
    let at = a * weights.x + b * weights.y + c * weights.z;
    at.is_finite().then(|| Isometry3d::new(at, Quat::from_mat3a(&turn)))
}

/// Roots on meshes.
#[derive(Clone, Copy, Debug, Default)]
pub struct AttachPlugin;

impl Plugin for AttachPlugin {
    fn build(&self, app: &mut App) {
        app.register_type::<RootsOnMesh>()
            .register_type::<TiedRoots>()
            .register_required_components::<RootsOnMesh, TiedRoots>()
            .add_systems(
                HairTick,
                (tie::tie, follow::aim_roots, follow::move_roots)
                    .chain()
                    .in_set(HairSystems::MeshRoots),
            )
            .add_systems(PostUpdate, follow::draw_roots.after(TransformSystems::Propagate));
    }
}

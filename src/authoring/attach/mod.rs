//! Roots that follow the triangles of a skinned or morphed mesh, or bones.
//!
//! Hair on a head that only turns needs no more than a [`Hair`](crate::Hair) on the head's bone. Where
//! the scalp itself stretches (a neck, a beard, fur) every root has to follow its own triangle.
//! [`RootsOnMesh`] morphs and skins those few triangles on the CPU: once a tick for the simulation,
//! which moves roots there in equal parts over its substeps, and once a frame from the pose that is
//! drawn, so that roots are always drawn on their scalp. [`RootsOnBones`] does the same without a mesh: each root
//! carries a triangle of its own, which its bones skin.

mod bones;
mod corner;
mod error;
mod follow;
mod morph;
mod pose;
mod roots;
mod tie;

pub use bones::RootsOnBones;
pub use error::RootsError;
pub(crate) use roots::MadeAgain;
pub use roots::{OtherMesh, PlantedRoot, RootsOnMesh, TiedRoots};

use crate::{
    base::schedule::{HairSystems, HairTick},
    hair::strand::{DrawnFrames, lacks_strands},
};
use bevy::{asset::AssetEventSystems, prelude::*};

/// Roots on meshes.
#[derive(Clone, Copy, Debug, Default)]
pub struct AttachPlugin;

impl Plugin for AttachPlugin {
    fn build(&self, app: &mut App) {
        if lacks_strands::<Self>(app) {
            return;
        }
        app.register_type::<RootsOnMesh>()
            .register_type::<RootsOnBones>()
            .register_type::<OtherMesh>()
            .register_type::<PlantedRoot>()
            .register_type::<TiedRoots>()
            .register_type::<RootsError>()
            .register_required_components::<RootsOnMesh, TiedRoots>()
            .register_required_components::<RootsOnBones, TiedRoots>()
            .add_systems(
                HairTick,
                (tie::tie, tie::tie_to_bones, follow::aim_roots, follow::move_roots)
                    .chain()
                    .in_set(HairSystems::MeshRoots),
            )
            .add_systems(
                PostUpdate,
                tie::follow_edits
                    .after(AssetEventSystems)
                    .after(follow::draw_roots)
                    .run_if(any_with_component::<TiedRoots>),
            );
        let draw = follow::draw_roots.after(DrawnFrames).run_if(any_with_component::<TiedRoots>);
        #[cfg(feature = "render")]
        let draw = draw.before(crate::render::HairRenderSystems);
        app.add_systems(PostUpdate, draw);
    }
}

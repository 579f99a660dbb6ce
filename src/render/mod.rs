//! Draws the hair: simulated strands and many followers between them, from one buffer of nodes.
//!
//! Each [`Hair`] is two draw calls in a camera's picture (one more for each prepass and shadow map), of a mesh that
//! all hair with as many strands shares: the first finds out which strands are in front, the second lights those
//! alone. Once a frame its nodes are packed, interpolated by the fixed clock's overstep, and
//! written to the GPU; all else happens there. A compute shader expands them once a frame in which the hair
//! is seen: curves through the nodes, followers between guides, rings along each strand. All passes read
//! these, and make ribbons of them that face the camera or the light (where they were in the frame before,
//! for motion vectors, vertices compute); where the device has no compute
//! shaders, or the rings exceed its largest buffer, each vertex computes its own. Followers are pushed out
//! of the balls, capsules and ellipsoids among the [`HairCollider`](crate::HairCollider)s near them, at
//! most 192; the sixteen largest also shade the hair behind them, for lights without shadow maps as well.
//!
//! Where the device has compute shaders, strands are also counted in a grid around the hair, 32 cells a side (16
//! where it is far): how many fibres the four brightest lights meet on their way to each cell, how thick the hair
//! is there and how open to its surroundings. Shadow maps add what is nearer than one and a half cells. For more
//! lights, and without compute shaders, hair without a shadow map is taken for a plane layer.
//! Positions stay in the hair's frame up to there, so roots never lag behind the head.
//!
//! Water is drawn as beads: see [`HairBeads`].
//!
//! How it looks is edited at run time through components of the hair: [`HairLook`], [`HairDye`],
//! [`HairFollowers`], [`HairDetail`], [`HairView`]. Far hair is drawn with fewer and wider strands,
//! smoothly; [`HairDetail::strands`] is the switch for slow graphics devices. For a look of your own write a material around [`HairBuffers`].
//!
//! Vertex shaders read storage buffers, so this needs WebGPU or native, not WebGL2. Strands thinner
//! than a pixel are drawn one pixel wide and cover a share of its samples equal to their coverage; without
//! MSAA they cover some pixels and others not. Pictures are averaged along the strands afterwards, so that
//! this is not seen as grain: see [`HairSmoothing`].
//!
//! # Against path tracing
//!
//! Scenes of `tests/drawing/reference.rs`, rebuilt from path-traced ones of the same strands, melanin and light
//! (Cycles' Chiang model, up to 512 bounces). Ratios of this renderer to the reference, for hair with no, a
//! blond's, a brown's and a black's melanin; mean of the channels.
//!
//! | scene | none | blond | brown | black | aim |
//! |---|---|---|---|---|---|
//! | flat tress, sun from the side | 1.12 | 1.02 | 0.99 | 1.09 | 15 % + 0.01 |
//! | flat tress, sun above in front | 1.16 | 0.91 | 0.97 | 0.78 | 15 % + 0.01 |
//! | flat tress, sun behind | 1.06 | 1.07 | 0.59 | | 25 % + 0.005 |
//! | ball, sun behind, mean of the ring | 1.12 | 1.01 | 0.93 | 1.04 | 25 % |
//! | ball, sun behind, ring to centre | 0.77 | 0.74 | 0.73 | 0.79 | 25 % |
//! | ball, sun 60° aside, mean of the disc | 0.46 | 0.45 | 0.45 | 0.68 | |
//! | the same, profile from lit to dark, rms of its maximum | 0.35 | 0.34 | 0.28 | 0.09 | 0.15 |
//! | ball under a white sky | 0.95 | 0.93 | 0.88 | 0.97 | 10 % + 0.02 |
//!
//! All are within their aims (ring to centre of blond and brown hair lack one and two hundredths) but the ball with the
//! sun aside: its strands point outward from a black core, so that all light from one to the eye has turned more than once, and
//! ours turns too little: half of it lacks. On a cylinder both
//! highlights lie within 2° of the reference (`tests/drawing/fibre.rs`).
//! Under a sky of one colour white hair has 0.93 of its light (`tests/drawing/look.rs`).

#[doc(hidden)]
pub mod curve;

mod beads;
mod buffers;
mod cuts;
mod depth;
mod detail;
mod draw;
#[cfg(feature = "groom")]
mod drawn_curves;
mod drawn_strand;
mod elsewhere;
mod expand;
mod flags;
mod follower_roots;
mod followers;
mod frame;
mod kernel;
mod locks;
mod material;
mod packed_frame;
mod pass;
mod present;
mod ribbon_mesh;
mod rings;
mod scatter;
mod screen_share;
mod sets;
mod smoothing;
mod solids;
mod streaks;
mod thickness;
mod upload;
mod view;
mod volume;
mod wet_look;

pub use beads::{Bead, HairBeadSystems, HairBeads};
pub use buffers::HairBuffers;
pub use detail::HairDetail;
#[cfg(feature = "groom")]
pub(crate) use drawn_curves::DrawnCurves;
pub use drawn_strand::{DrawnStrand, LockOffset};
#[cfg(feature = "gpu")]
pub(crate) use elsewhere::DrawnElsewhere;
pub use follower_roots::{FollowerRoot, FollowerRoots};
pub use followers::HairFollowers;
#[doc(hidden)]
pub use pass::HairPhase;
pub use sets::HairRenderSystems;
pub use smoothing::HairSmoothing;
pub use view::{HairView, STRAIN_FULL, heat};
pub use wet_look::WetLook;
#[cfg(feature = "gpu")]
pub(crate) use {
    buffers::{FAR, MOTION_UNITS},
    kernel::why_broken,
    sets::WritesNodes,
};

/// What is drawn by it; see [`look`](crate::hair::look).
#[doc(no_inline)]
pub use crate::hair::look::{HairDye, HairLook, HairShading, Melanin};

use crate::{
    base::schedule::HairTicks,
    hair::{
        strand::{DrawnFrames, Hair, lacks_strands},
        worn,
    },
    simulation::settle::{SettlePlugin, Settling},
};
use bevy::{
    asset::{AssetEventSystems, embedded_asset, io::embedded::EmbeddedAssetRegistry},
    camera::visibility::VisibilitySystems,
    prelude::*,
    render::{RenderApp, erased_render_asset::ErasedRenderAssetPlugin, storage::ShaderBuffer},
    shader::load_shader_library,
};
use material::{Depth, Lit, RibbonMaterial};
use sets::{Interpolate, supported};

/// Draws the hair. Part of [`HairPlugins`](crate::HairPlugins), which may be added before or after
/// `DefaultPlugins`. Without a renderer it does nothing.
#[derive(Clone, Copy, Debug)]
pub struct HairRenderPlugin {
    /// Whether to draw between the last two ticks by the overstep of the fixed clock. Right for hair
    /// that ticks in a fixed schedule, wrong for any other. Default true.
    pub interpolate: bool,
}

impl Default for HairRenderPlugin {
    fn default() -> Self {
        Self { interpolate: true }
    }
}

impl Plugin for HairRenderPlugin {
    fn build(&self, app: &mut App) {
        if lacks_strands::<Self>(app) {
            return;
        }
        worn::setting::<HairFollowers>(app);
        worn::setting::<HairView>(app);
        worn::setting::<HairDetail>(app);
        app.insert_resource(Interpolate(self.interpolate))
            .init_resource::<HairBeads>()
            .register_type::<HairBeads>()
            .register_type::<draw::DrawnHair>()
            .register_type::<HairBuffers>()
            .register_type::<HairSmoothing>()
            .register_type::<FollowerRoots>()
            .register_type::<WetLook>()
            .add_systems(
                PostUpdate,
                beads::show_droplets
                    .in_set(HairBeadSystems)
                    .after(HairTicks)
                    .before(HairRenderSystems)
                    .run_if(beads::are_any),
            );
        app.add_systems(
            PostUpdate,
            screen_share::measure
                .after(TransformSystems::Propagate)
                .after(HairRenderSystems)
                .run_if(any_with_component::<HairBuffers>),
        );
        // The drawn child inherits it. An error says that the user has required it already.
        let _ = app.try_register_required_components::<Hair, Visibility>();
        let _ = app.try_register_required_components::<Camera3d, HairSmoothing>();
    }

    /// In `finish`, because all render plugins have been added by then, in any order.
    fn finish(&self, app: &mut App) {
        let world = app.world();
        if !world.contains_resource::<Interpolate>() {
            return;
        }
        if !app.is_plugin_added::<SettlePlugin>() {
            app.add_systems(
                PostUpdate,
                draw::end_settling.before(HairRenderSystems).run_if(any_with_component::<Settling>),
            );
        }
        let world = app.world();
        let can_draw = world.contains_resource::<EmbeddedAssetRegistry>()
            && world.contains_resource::<Assets<Shader>>()
            && world.contains_resource::<Assets<Mesh>>()
            && world.contains_resource::<Assets<ShaderBuffer>>()
            && world.contains_resource::<Assets<StandardMaterial>>();
        if !can_draw {
            return;
        }
        if app.get_sub_app(RenderApp).is_none() {
            tracing::warn!("hair is simulated but not drawn: the app has no graphics device");
        }
        load_shader_library!(app, "strands.wgsl");
        load_shader_library!(app, "rings.wgsl");
        load_shader_library!(app, "ribbon.wgsl");
        load_shader_library!(app, "coverage.wgsl");
        load_shader_library!(app, "fibre.wgsl");
        load_shader_library!(app, "passage.wgsl");
        load_shader_library!(app, "volume/counts.wgsl");
        load_shader_library!(app, "volume/volume.wgsl");
        load_shader_library!(app, "shading.wgsl");
        embedded_asset!(app, "ribbon_forward.wgsl");
        embedded_asset!(app, "ribbon_prepass.wgsl");
        embedded_asset!(app, "expand.wgsl");
        embedded_asset!(app, "volume/fill.wgsl");
        embedded_asset!(app, "volume/settle.wgsl");
        embedded_asset!(app, "volume/march.wgsl");
        app.add_plugins((
            MaterialPlugin::<RibbonMaterial<Lit>>::default(),
            MaterialPlugin::<RibbonMaterial<Depth>>::default(),
        ));
        // Bevy does not call `finish` of plugins added in `finish`.
        ErasedRenderAssetPlugin::<MeshMaterial3d<RibbonMaterial<Lit>>>::default().finish(app);
        ErasedRenderAssetPlugin::<MeshMaterial3d<RibbonMaterial<Depth>>>::default().finish(app);
        let draw =
            (draw::appear, draw::pack, frame::prepare, depth::follow).chain().run_if(supported);
        app.init_resource::<ribbon_mesh::RibbonMeshes>();
        app.add_observer(cuts::cut_followers);
        app.add_systems(PostUpdate, draw.in_set(HairRenderSystems)).configure_sets(
            PostUpdate,
            HairRenderSystems
                .after(DrawnFrames)
                .after(TransformSystems::Propagate)
                .before(VisibilitySystems::VisibilityPropagate)
                .before(AssetEventSystems),
        );
        flags::plugin(app);
        pass::plugin(app);
        smoothing::plugin(app);
        upload::plugin(app);
        expand::plugin(app);
        volume::plugin(app);
        beads::finish(app);
    }
}

/// The room's share of [the prelude](crate::prelude).
pub mod prelude {
    pub use crate::render::{HairDetail, HairFollowers, HairSmoothing, HairView};
}

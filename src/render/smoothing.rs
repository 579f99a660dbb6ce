//! Hair on the screen averaged along its strands, since few samples a pixel cannot hold strands much thinner
//! than a pixel.

use super::HairRenderSystems;
use bevy::{
    core_pipeline::{
        Core3dSystems, FullscreenShader,
        fullscreen_material::{FullscreenMaterial, FullscreenMaterialPlugin},
    },
    ecs::{schedule::ScheduleConfigs, system::BoxedSystem},
    prelude::*,
    render::{RenderApp, extract_component::ExtractComponent, render_resource::ShaderType},
    shader::ShaderRef,
};

/// How far hair is averaged along its strands in a camera's picture: against grain, stipple and flicker of strands
/// thinner than a pixel, whose coverage of four samples a pixel is stochastic. All [`Camera3d`]s have it.
///
/// Each pixel of hair gets the mean of those before and behind it in a line along the strands there, which count less
/// the more strands cross or curl within three pixels. What shows through is kept where no strand is. Edges of
/// other things across the strands soften by a pixel.
///
/// While it works, hair marks its pixels in the alpha channel, which is 1 again afterwards. Where any active
/// `Camera3d` lacks this component, has a reach below 1, or clears to a colour that is not opaque, hair is drawn
/// without marks and is not averaged in any picture. Heat maps never are.
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct HairSmoothing {
    /// How many pixels to either side, 0 to 8; 0 is off. The cost is in proportion. Default 3.
    pub reach: f32,
    /// How much pixels beside these count, across the strands, 0 to 1: 0 keeps every line of them crisp, 1 is as soft
    /// as it is smooth. Default 0.4.
    pub across: f32,
}

impl Default for HairSmoothing {
    fn default() -> Self {
        Self { reach: 3.0, across: 0.4 }
    }
}

/// Farther strands bend away from the line, and pictures are smeared.
const FARTHEST: f32 = 8.0;

/// Whether hair marks its pixels.
#[derive(Resource, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Marks(pub(super) bool);

/// The uniform of a camera's pass.
#[derive(Component, ExtractComponent, ShaderType, Clone, Copy, Debug, Default, PartialEq)]
struct Smooth {
    reach: f32,
    across: f32,
    samples: f32,
}

impl FullscreenMaterial for Smooth {
    fn fragment_shader() -> ShaderRef {
        "embedded://bevy_keratin/render/smoothing.wgsl".into()
    }

    fn schedule_configs(system: ScheduleConfigs<BoxedSystem>) -> ScheduleConfigs<BoxedSystem> {
        // Before all that looks at the picture or at its alpha.
        system.after(Core3dSystems::MainPass).before(Core3dSystems::EarlyPostProcess)
    }
}

type Smoothed = (
    Entity,
    &'static Camera,
    Option<&'static HairSmoothing>,
    Option<&'static Msaa>,
    Option<&'static Smooth>,
);

/// Tells passes what their cameras ask for, and hair whether to mark its pixels.
fn request_passes(
    mut commands: Commands,
    cameras: Query<Smoothed, With<Camera3d>>,
    clear: Option<Res<ClearColor>>,
    mut marks: ResMut<Marks>,
) {
    let clear = clear.map_or(Color::BLACK, |clear| clear.0);
    let reach = |smoothing: Option<&HairSmoothing>| {
        let reach = smoothing.map_or(0.0, |smoothing| smoothing.reach);
        if reach >= 1.0 { reach.min(FARTHEST).floor() } else { 0.0 }
    };
    let across = |smoothing: Option<&HairSmoothing>| {
        let across = smoothing.map_or(0.0, |smoothing| smoothing.across);
        if across >= 0.0 { across.min(1.0) } else { 0.0 }
    };
    let opaque = |camera: &Camera| match camera.clear_color {
        ClearColorConfig::Default => clear.alpha() >= 1.0,
        ClearColorConfig::Custom(color) => color.alpha() >= 1.0,
        ClearColorConfig::None => true,
    };
    let mut active = cameras.iter().filter(|(_, camera, ..)| camera.is_active);
    marks.set_if_neq(Marks(
        active.all(|(_, camera, asked, ..)| reach(asked) > 0.0 && opaque(camera)),
    ));
    for (camera, _, asked, msaa, known) in &cameras {
        let samples = msaa.copied().unwrap_or_default().samples() as f32;
        let now = Smooth { reach: reach(asked), across: across(asked), samples };
        match (marks.0, known) {
            (true, known) if known != Some(&now) => {
                commands.entity(camera).try_insert(now);
            }
            (false, Some(_)) => {
                commands.entity(camera).try_remove::<Smooth>();
            }
            _ => {}
        }
    }
}

/// After Bevy's render plugins.
pub(super) fn plugin(app: &mut App) {
    app.init_resource::<Marks>();
    let draws = app.get_sub_app(RenderApp);
    if !draws.is_some_and(|draws| draws.world().contains_resource::<FullscreenShader>()) {
        return;
    }
    bevy::asset::embedded_asset!(app, "smoothing.wgsl");
    app.add_plugins(FullscreenMaterialPlugin::<Smooth>::default());
    app.add_systems(PostUpdate, request_passes.before(HairRenderSystems));
}

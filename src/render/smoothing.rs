//! Hair on the screen averaged along its strands, since few samples a pixel cannot hold strands much thinner
//! than a pixel.

use super::{
    HairRenderSystems,
    pass::{HairPass, ViewMarks},
};
use bevy::{
    asset::load_embedded_asset,
    core_pipeline::{
        FullscreenShader,
        core_3d::main_transparent_pass_3d,
        schedule::{Core3d, Core3dSystems},
    },
    pbr::main_transmissive_pass_3d,
    prelude::*,
    render::{
        Render, RenderApp, RenderStartup, RenderSystems,
        diagnostic::RecordDiagnostics,
        extract_component::{
            ComponentUniforms, DynamicUniformIndex, ExtractComponent, ExtractComponentPlugin,
            UniformComponentPlugin,
        },
        render_resource::{
            BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries,
            CachedRenderPipelineId, ColorTargetState, ColorWrites, FragmentState, MultisampleState,
            PipelineCache, RenderPassDescriptor, RenderPipelineDescriptor, ShaderStages,
            ShaderType, SpecializedRenderPipeline, SpecializedRenderPipelines, TextureFormat,
            TextureSampleType,
            binding_types::{texture_2d, uniform_buffer},
        },
        renderer::{RenderContext, RenderDevice, ViewQuery},
        view::{ExtractedView, ViewTarget},
    },
};

/// How far hair is averaged along its strands in a camera's picture: against grain, stipple and flicker of strands
/// thinner than a pixel, whose coverage of four samples a pixel is stochastic. All [`Camera3d`]s have it.
///
/// Each pixel of hair gets the mean of those before and behind it in a line along the strands there, which count less
/// the more strands cross or curl within three pixels. What shows through is kept where no strand is. Edges of
/// other opaque things across the strands soften by a pixel; what is seen through is drawn after it, and crisp.
///
/// Which pixels are hair is noted in a texture of its own: a picture without hair in view is as without the plugin, to
/// the bit. Heat maps are not averaged.
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

/// The uniform of a camera's pass.
#[derive(Component, ExtractComponent, ShaderType, Clone, Copy, Debug, Default, PartialEq)]
struct Smooth {
    reach: f32,
    across: f32,
}

/// Tells passes what their cameras ask for.
fn request_passes(
    mut commands: Commands,
    cameras: Query<(Entity, Option<&HairSmoothing>, Option<&Smooth>), With<Camera3d>>,
) {
    for (camera, asked, known) in &cameras {
        let wanted = asked.filter(|asked| asked.reach >= 1.0).map(|asked| Smooth {
            reach: asked.reach.min(FARTHEST).floor(),
            across: if asked.across >= 0.0 { asked.across.min(1.0) } else { 0.0 },
        });
        match wanted {
            Some(wanted) if known != Some(&wanted) => {
                commands.entity(camera).try_insert(wanted);
            }
            None if known.is_some() => {
                commands.entity(camera).try_remove::<Smooth>();
            }
            _ => {}
        }
    }
}

/// After Bevy's render plugins.
pub(super) fn plugin(app: &mut App) {
    let draws = app.get_sub_app(RenderApp);
    if !draws.is_some_and(|draws| draws.world().contains_resource::<FullscreenShader>()) {
        return;
    }
    bevy::asset::embedded_asset!(app, "smoothing.wgsl");
    app.add_plugins((
        ExtractComponentPlugin::<Smooth>::default(),
        UniformComponentPlugin::<Smooth>::default(),
    ))
    .add_systems(PostUpdate, request_passes.before(HairRenderSystems));
    let Some(render) = app.get_sub_app_mut(RenderApp) else { return };
    render
        .init_resource::<SpecializedRenderPipelines<Smoother>>()
        .add_systems(RenderStartup, compile)
        .add_systems(Render, prepare.in_set(RenderSystems::PrepareBindGroups))
        .add_systems(
            Core3d,
            smooth
                .after(HairPass)
                .before(main_transmissive_pass_3d)
                .before(main_transparent_pass_3d)
                .in_set(Core3dSystems::MainPass),
        );
}

#[derive(Resource)]
struct Smoother {
    layout: BindGroupLayoutDescriptor,
    base: RenderPipelineDescriptor,
}

fn compile(mut commands: Commands, assets: Res<AssetServer>, fullscreen: Res<FullscreenShader>) {
    let texture = || texture_2d(TextureSampleType::Float { filterable: false });
    let layout = BindGroupLayoutDescriptor::new(
        "smoothing of hair",
        &BindGroupLayoutEntries::sequential(
            ShaderStages::FRAGMENT,
            (texture(), texture(), uniform_buffer::<Smooth>(true)),
        ),
    );
    let base = RenderPipelineDescriptor {
        label: Some("smoothing of hair".into()),
        layout: vec![layout.clone()],
        vertex: fullscreen.to_vertex_state(),
        fragment: Some(FragmentState {
            shader: load_embedded_asset!(&*assets, "smoothing.wgsl"),
            ..default()
        }),
        ..default()
    };
    commands.insert_resource(Smoother { layout, base });
}

impl SpecializedRenderPipeline for Smoother {
    type Key = (TextureFormat, u32);

    fn specialize(&self, (format, samples): Self::Key) -> RenderPipelineDescriptor {
        let mut descriptor = self.base.clone();
        descriptor.multisample = MultisampleState { count: samples, ..default() };
        if let Some(fragment) = &mut descriptor.fragment {
            fragment.shader_defs.extend((samples > 1).then(|| "MULTISAMPLED".into()));
            let target = ColorTargetState { format, blend: None, write_mask: ColorWrites::ALL };
            fragment.targets = vec![Some(target)];
        }
        descriptor
    }
}

/// The pipeline of a view that is smoothed.
#[derive(Component)]
struct Smoothing(CachedRenderPipelineId);

type Smoothed = (With<Smooth>, With<ViewMarks>);

fn prepare(
    mut commands: Commands,
    smoother: Option<Res<Smoother>>,
    mut pipelines: ResMut<SpecializedRenderPipelines<Smoother>>,
    cache: Res<PipelineCache>,
    views: Query<(Entity, &ExtractedView, &Msaa), Smoothed>,
) {
    let Some(smoother) = smoother else { return };
    for (entity, view, msaa) in &views {
        let key = (view.target_format, msaa.samples());
        let id = pipelines.specialize(&cache, &smoother, key);
        commands.entity(entity).insert(Smoothing(id));
    }
}

type Picture = (
    &'static ViewTarget,
    &'static ViewMarks,
    &'static Smoothing,
    &'static DynamicUniformIndex<Smooth>,
);

/// From a camera's picture into its other texture; where it has several samples a pixel, into all of these.
fn smooth(
    view: ViewQuery<Picture, With<Smooth>>,
    smoother: Option<Res<Smoother>>,
    cache: Res<PipelineCache>,
    (uniforms, device): (Res<ComponentUniforms<Smooth>>, Res<RenderDevice>),
    mut context: RenderContext,
) {
    let (target, marks, smoothing, uniform) = view.into_inner();
    let (Some(smoother), Some(pipeline)) = (smoother, cache.get_render_pipeline(smoothing.0))
    else {
        return;
    };
    let Some(asked) = uniforms.uniforms().binding() else { return };
    let write = target.post_process_write();
    let group = device.create_bind_group(
        "smoothing of hair",
        &cache.get_bind_group_layout(&smoother.layout),
        &BindGroupEntries::sequential((write.source, marks.view(), asked)),
    );
    let diagnostics = context.diagnostic_recorder();
    let diagnostics = diagnostics.as_deref();
    let mut pass = context.begin_tracked_render_pass(RenderPassDescriptor {
        label: Some("smoothing of hair"),
        // The one that was written to until now has been exchanged for the other.
        color_attachments: &[Some(target.get_color_attachment())],
        depth_stencil_attachment: None,
        timestamp_writes: None,
        occlusion_query_set: None,
        multiview_mask: None,
    });
    let span = diagnostics.pass_span(&mut pass, "hair, smoothing");
    pass.set_render_pipeline(pipeline);
    pass.set_bind_group(0, &group, &[uniform.index()]);
    pass.draw(0..3, 0..1);
    span.end(&mut pass);
}

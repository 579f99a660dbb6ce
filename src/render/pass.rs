//! Hair in a camera's picture: drawn in a pass of its own, after all that is opaque and before what is seen through, so
//! that what it notes for itself is in a texture of its own.
//!
//! In it each hair is drawn twice: its depth, by which it is found out which strands are seen, with marks that tell
//! [`smoothing`](super::smoothing) which samples are hair and which way it lies; then its light.

use super::material::{Depth, Lit, MARKS, RibbonMaterial};
use bevy::{
    camera::{MainPassResolutionOverride, Viewport},
    core_pipeline::{
        core_3d::{AlphaMask3d, Opaque3d, main_opaque_pass_3d, main_transparent_pass_3d},
        prepass::{OpaqueNoLightmap3dBatchSetKey, OpaqueNoLightmap3dBinKey},
        schedule::{Core3d, Core3dSystems},
    },
    image::ToExtents,
    pbr::{
        DrawMaterial, MeshPipeline, PreparedMaterial, RenderMaterialInstances, RenderMeshInstances,
        SpecializedMaterialPipelineCache, main_transmissive_pass_3d, queue_material_meshes,
    },
    prelude::*,
    render::{
        Extract, ExtractSchedule, Render, RenderApp, RenderDebugFlags, RenderSystems,
        batching::gpu_preprocessing::{GpuPreprocessingMode, GpuPreprocessingSupport},
        camera::ExtractedCamera,
        diagnostic::RecordDiagnostics,
        erased_render_asset::ErasedRenderAssets,
        mesh::allocator::MeshAllocator,
        render_phase::{
            AddRenderCommand, BinnedPhaseItem, BinnedRenderPhasePlugin, BinnedRenderPhaseType,
            CachedRenderPipelinePhaseItem, DrawFunctionId, DrawFunctions, PhaseItem,
            PhaseItemExtraIndex, ViewBinnedRenderPhases,
        },
        render_resource::{
            CachedRenderPipelineId, LoadOp, Operations, RenderPassColorAttachment,
            RenderPassDescriptor, StoreOp, TextureDescriptor, TextureDimension, TextureUsages,
            TextureView,
        },
        renderer::{RenderContext, RenderDevice, ViewQuery},
        sync_world::MainEntity,
        texture::{CachedTexture, TextureCache},
        view::{
            ExtractedView, NoIndirectDrawing, RenderVisibleEntities, RetainedViewEntity,
            ViewDepthTexture, ViewTarget,
        },
    },
};
use core::{any::TypeId, ops::Range};

pub(super) fn plugin(app: &mut App) {
    app.add_plugins((
        BinnedRenderPhasePlugin::<HairPhase<false>, MeshPipeline>::new(RenderDebugFlags::empty()),
        BinnedRenderPhasePlugin::<HairPhase<true>, MeshPipeline>::new(RenderDebugFlags::empty()),
    ));
    let Some(render) = app.get_sub_app_mut(RenderApp) else { return };
    render
        .init_resource::<DrawnRibbons>()
        .init_resource::<DrawFunctions<HairPhase<false>>>()
        .init_resource::<DrawFunctions<HairPhase<true>>>()
        .add_render_command::<HairPhase<false>, DrawMaterial>()
        .add_render_command::<HairPhase<true>, DrawMaterial>()
        .add_systems(ExtractSchedule, extract)
        .add_systems(
            Render,
            (
                queue.in_set(RenderSystems::QueueMeshes).after(queue_material_meshes),
                prepare_marks.in_set(RenderSystems::PrepareResources),
            ),
        )
        .add_systems(
            Core3d,
            draw.in_set(HairPass)
                .after(main_opaque_pass_3d)
                .before(main_transmissive_pass_3d)
                .before(main_transparent_pass_3d)
                .in_set(Core3dSystems::MainPass),
        );
}

/// What draws hair into a camera's picture.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct HairPass;

/// One of a camera's two draws of hair: of depth and marks, or of light.
pub struct HairPhase<const LIT: bool> {
    batch_set_key: OpaqueNoLightmap3dBatchSetKey,
    representative: (Entity, MainEntity),
    batch_range: Range<u32>,
    extra_index: PhaseItemExtraIndex,
}

impl<const LIT: bool> PhaseItem for HairPhase<LIT> {
    fn entity(&self) -> Entity {
        self.representative.0
    }

    fn main_entity(&self) -> MainEntity {
        self.representative.1
    }

    fn draw_function(&self) -> DrawFunctionId {
        self.batch_set_key.draw_function
    }

    fn batch_range(&self) -> &Range<u32> {
        &self.batch_range
    }

    fn batch_range_mut(&mut self) -> &mut Range<u32> {
        &mut self.batch_range
    }

    fn extra_index(&self) -> PhaseItemExtraIndex {
        self.extra_index.clone()
    }

    fn batch_range_and_extra_index_mut(&mut self) -> (&mut Range<u32>, &mut PhaseItemExtraIndex) {
        (&mut self.batch_range, &mut self.extra_index)
    }
}

impl<const LIT: bool> BinnedPhaseItem for HairPhase<LIT> {
    type BinKey = OpaqueNoLightmap3dBinKey;
    type BatchSetKey = OpaqueNoLightmap3dBatchSetKey;

    fn new(
        batch_set_key: Self::BatchSetKey,
        _: Self::BinKey,
        representative: (Entity, MainEntity),
        batch_range: Range<u32>,
        extra_index: PhaseItemExtraIndex,
    ) -> Self {
        Self { batch_set_key, representative, batch_range, extra_index }
    }
}

impl<const LIT: bool> CachedRenderPipelinePhaseItem for HairPhase<LIT> {
    fn cached_pipeline(&self) -> CachedRenderPipelineId {
        self.batch_set_key.pipeline
    }
}

/// What is drawn of all hair, lit or not.
#[derive(Resource, Default)]
struct DrawnRibbons(Vec<MainEntity>);

type Ribbons =
    Or<(With<MeshMaterial3d<RibbonMaterial<Lit>>>, With<MeshMaterial3d<RibbonMaterial<Depth>>>)>;

/// Begins a frame without hair.
fn extract(
    ribbons: Extract<Query<Entity, Ribbons>>,
    cameras: Extract<Query<(Entity, &Camera, Has<NoIndirectDrawing>), With<Camera3d>>>,
    support: Res<GpuPreprocessingSupport>,
    mut drawn: ResMut<DrawnRibbons>,
    mut depth: ResMut<ViewBinnedRenderPhases<HairPhase<false>>>,
    mut lit: ResMut<ViewBinnedRenderPhases<HairPhase<true>>>,
) {
    drawn.0.clear();
    drawn.0.extend(ribbons.iter().map(MainEntity::from));
    depth.clear();
    lit.clear();
    if drawn.0.is_empty() {
        return;
    }
    for (camera, _, direct) in cameras.iter().filter(|(_, camera, _)| camera.is_active) {
        let mode = support.min(match direct {
            true => GpuPreprocessingMode::PreprocessingOnly,
            false => GpuPreprocessingMode::Culling,
        });
        let view = RetainedViewEntity::new(camera.into(), None, 0);
        depth.prepare_for_new_frame(view, mode);
        lit.prepare_for_new_frame(view, mode);
    }
}

/// Takes hair out of Bevy's phases into its own. Pipelines and bind groups are those of its material.
fn queue(
    ribbons: Res<DrawnRibbons>,
    views: Query<(&ExtractedView, &RenderVisibleEntities), With<ExtractedCamera>>,
    (instances, materials): (
        Res<RenderMaterialInstances>,
        Res<ErasedRenderAssets<PreparedMaterial>>,
    ),
    (meshes, allocator): (Res<RenderMeshInstances>, Res<MeshAllocator>),
    (pipelines, support): (Res<SpecializedMaterialPipelineCache>, Res<GpuPreprocessingSupport>),
    (mut opaque, mut masked): (
        ResMut<ViewBinnedRenderPhases<Opaque3d>>,
        ResMut<ViewBinnedRenderPhases<AlphaMask3d>>,
    ),
    (mut depths, mut lights): (
        ResMut<ViewBinnedRenderPhases<HairPhase<false>>>,
        ResMut<ViewBinnedRenderPhases<HairPhase<true>>>,
    ),
    (draw_depth, draw_light): (
        Res<DrawFunctions<HairPhase<false>>>,
        Res<DrawFunctions<HairPhase<true>>>,
    ),
) {
    if ribbons.0.is_empty() {
        return;
    }
    let draw_depth = draw_depth.read().id::<DrawMaterial>();
    let draw_light = draw_light.read().id::<DrawMaterial>();
    for (view, visible) in &views {
        let at = &view.retained_view_entity;
        let (Some(opaque), Some(masked)) = (opaque.get_mut(at), masked.get_mut(at)) else {
            continue;
        };
        let (Some(depths), Some(lights)) = (depths.get_mut(at), lights.get_mut(at)) else {
            continue;
        };
        let (Some(pipelines), Some(visible)) = (pipelines.get(at), visible.get::<Mesh3d>()) else {
            continue;
        };
        for &ribbon in &ribbons.0 {
            let Some(instance) = instances.instances.get(&ribbon) else { continue };
            // A game may have put a material of its own there.
            let kind = instance.asset_id.type_id();
            let is_lit = kind == TypeId::of::<RibbonMaterial<Lit>>();
            match is_lit {
                true => masked.remove(ribbon),
                false if kind == TypeId::of::<RibbonMaterial<Depth>>() => opaque.remove(ribbon),
                false => continue,
            }
            let seen = &visible.entities_cpu_culling;
            let is_seen = seen.binary_search_by_key(&ribbon, |(_, entity)| *entity).is_ok()
                || visible.entities_gpu_culling.contains_key(&ribbon);
            let Some(&pipeline) = pipelines.get(&ribbon).filter(|_| is_seen) else { continue };
            let Some(material) = materials.get(instance.asset_id) else { continue };
            let Some(mesh) = meshes.render_mesh_queue_data(ribbon) else { continue };
            let Some(slabs) = allocator.mesh_slabs(&mesh.mesh_asset_id()) else { continue };
            let key = OpaqueNoLightmap3dBatchSetKey {
                pipeline,
                draw_function: if is_lit { draw_light } else { draw_depth },
                material_bind_group_index: Some(material.binding.group.0),
                slabs,
            };
            let bin = OpaqueNoLightmap3dBinKey { asset_id: mesh.mesh_asset_id().into() };
            let entity = (Entity::PLACEHOLDER, ribbon);
            let kind = BinnedRenderPhaseType::mesh(mesh.should_batch(), &support);
            match is_lit {
                true => lights.add(key, bin, entity, mesh.current_uniform_index, kind),
                false => depths.add(key, bin, entity, mesh.current_uniform_index, kind),
            }
        }
    }
}

/// A view's marks, where it sees hair.
#[derive(Component)]
pub(super) struct ViewMarks {
    texture: CachedTexture,
    /// With several samples a pixel: before they are averaged.
    sampled: Option<CachedTexture>,
}

impl ViewMarks {
    /// Of pixels: the mean of their samples.
    pub(super) fn view(&self) -> &TextureView {
        &self.texture.default_view
    }
}

fn prepare_marks(
    mut commands: Commands,
    views: Query<(Entity, &ExtractedCamera, &ExtractedView, &Msaa, Has<ViewMarks>)>,
    lit: Res<ViewBinnedRenderPhases<HairPhase<true>>>,
    mut textures: ResMut<TextureCache>,
    device: Res<RenderDevice>,
) {
    for (entity, camera, view, msaa, has_marks) in &views {
        let sees = lit.get(&view.retained_view_entity).is_some_and(|lit| !lit.is_empty());
        let Some(size) = camera.physical_target_size.filter(|_| sees) else {
            if has_marks {
                commands.entity(entity).remove::<ViewMarks>();
            }
            continue;
        };
        let mut texture = |samples: u32| {
            let read =
                if samples > 1 { TextureUsages::empty() } else { TextureUsages::TEXTURE_BINDING };
            let descriptor = TextureDescriptor {
                label: Some("marks of hair"),
                size: size.to_extents(),
                mip_level_count: 1,
                sample_count: samples,
                dimension: TextureDimension::D2,
                format: MARKS,
                usage: TextureUsages::RENDER_ATTACHMENT | read,
                view_formats: &[],
            };
            textures.get(&device, descriptor)
        };
        let sampled = (msaa.samples() > 1).then(|| texture(msaa.samples()));
        commands.entity(entity).insert(ViewMarks { texture: texture(1), sampled });
    }
}

type Picture = (
    &'static ExtractedCamera,
    &'static ExtractedView,
    &'static ViewTarget,
    &'static ViewDepthTexture,
    &'static ViewMarks,
    Option<&'static MainPassResolutionOverride>,
);

fn draw(
    world: &World,
    view: ViewQuery<Picture>,
    depth: Res<ViewBinnedRenderPhases<HairPhase<false>>>,
    lit: Res<ViewBinnedRenderPhases<HairPhase<true>>>,
    mut context: RenderContext,
) {
    let entity = view.entity();
    let (camera, view, target, depth_texture, marks, resolution) = view.into_inner();
    let at = &view.retained_view_entity;
    let (Some(depth), Some(lit)) = (depth.get(at), lit.get(at)) else { return };
    let none = LinearRgba::new(0.5, 0.5, 0.0, 0.0).into();
    let marks = RenderPassColorAttachment {
        view: &marks.sampled.as_ref().unwrap_or(&marks.texture).default_view,
        depth_slice: None,
        resolve_target: marks.sampled.is_some().then_some(&*marks.texture.default_view),
        ops: Operations { load: LoadOp::Clear(none), store: StoreOp::Store },
    };
    let diagnostics = context.diagnostic_recorder();
    let diagnostics = diagnostics.as_deref();
    let mut pass = context.begin_tracked_render_pass(RenderPassDescriptor {
        label: Some("hair"),
        color_attachments: &[Some(target.get_color_attachment()), Some(marks)],
        depth_stencil_attachment: Some(depth_texture.get_attachment(StoreOp::Store)),
        timestamp_writes: None,
        occlusion_query_set: None,
        multiview_mask: None,
    });
    let span = diagnostics.pass_span(&mut pass, "hair");
    let viewport = Viewport::from_viewport_and_override(camera.viewport.as_ref(), resolution);
    if let Some(viewport) = viewport {
        pass.set_camera_viewport(&viewport);
    }
    for drawn in [depth.render(&mut pass, world, entity), lit.render(&mut pass, world, entity)] {
        if let Err(error) = drawn {
            tracing::error!("hair is not drawn: {error:?}");
        }
    }
    span.end(&mut pass);
}

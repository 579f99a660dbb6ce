//! Counts fibres on the GPU, after strands have been expanded.

use crate::render::{
    expand::{Expansion, Expansions, expand},
    material::Ribbon,
    rings::{has_compute, why_broken},
    sets::WritesNodes,
};
use bevy::{
    asset::load_embedded_asset,
    core_pipeline::schedule::camera_driver,
    platform::collections::HashMap,
    prelude::*,
    render::{
        RenderApp, RenderStartup,
        render_asset::RenderAssets,
        render_resource::{
            BindGroup, BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries, Buffer,
            BufferDescriptor, BufferId, BufferUsages, CachedComputePipelineId,
            ComputePassDescriptor, ComputePipelineDescriptor, Extent3d, PipelineCache,
            SamplerBindingType, ShaderStages, StorageTextureAccess, TextureDescriptor,
            TextureDimension, TextureFormat, TextureSampleType, TextureUsages, TextureView,
            TextureViewId,
            binding_types::{
                sampler, storage_buffer_read_only_sized, storage_buffer_sized, texture_3d,
                texture_storage_3d, uniform_buffer,
            },
        },
        renderer::{RenderAdapter, RenderContext, RenderDevice, RenderGraph, RenderGraphSystems},
        storage::GpuShaderBuffer,
        texture::GpuImage,
    },
    shader::ShaderDefVal,
};

/// `@workgroup_size` of `fill.wgsl`, and along a side of the others.
const LANES: u32 = 64;
const BLOCK: u32 = 4;
/// `ENOUGH` of `fill.wgsl`: so many strands are counted.
const STRANDS: u32 = 8192;

pub(in crate::render) fn plugin(app: &mut App) {
    let Some(render) = app.get_sub_app_mut(RenderApp) else { return };
    render.init_resource::<Scratch>().add_systems(RenderStartup, compile).add_systems(
        RenderGraph,
        count
            .in_set(RenderGraphSystems::Render)
            .after(WritesNodes)
            .after(expand)
            .before(camera_driver),
    );
}

/// The kernels.
#[derive(Resource)]
struct Counter {
    layouts: [BindGroupLayoutDescriptor; 3],
    /// Fill, settle, march.
    pipelines: [CachedComputePipelineId; 3],
}

fn compile(
    mut commands: Commands,
    assets: Res<AssetServer>,
    pipelines: Res<PipelineCache>,
    adapter: Res<RenderAdapter>,
) {
    if !has_compute(&adapter) {
        return;
    }
    let read = || storage_buffer_read_only_sized(false, None);
    let store = || texture_storage_3d(TextureFormat::Rgba16Float, StorageTextureAccess::WriteOnly);
    let stage = ShaderStages::COMPUTE;
    let layouts = [
        BindGroupLayoutDescriptor::new(
            "hair volume, fill",
            &BindGroupLayoutEntries::with_indices(
                stage,
                (
                    (0, uniform_buffer::<Ribbon>(true)),
                    (3, read()),
                    (5, read()),
                    (6, read()),
                    (7, storage_buffer_sized(false, None)),
                ),
            ),
        ),
        BindGroupLayoutDescriptor::new(
            "hair volume, settle",
            &BindGroupLayoutEntries::with_indices(
                stage,
                ((5, read()), (7, storage_buffer_sized(false, None)), (8, store())),
            ),
        ),
        BindGroupLayoutDescriptor::new(
            "hair volume, march",
            &BindGroupLayoutEntries::with_indices(
                stage,
                (
                    (5, read()),
                    (8, texture_3d(TextureSampleType::Float { filterable: true })),
                    (9, sampler(SamplerBindingType::Filtering)),
                    (10, store()),
                ),
            ),
        ),
    ];
    let shaders = [
        load_embedded_asset!(&*assets, "fill.wgsl"),
        load_embedded_asset!(&*assets, "settle.wgsl"),
        load_embedded_asset!(&*assets, "march.wgsl"),
    ];
    let [fill, settle, march] = shaders;
    let queue = |of: usize, shader: Handle<Shader>| {
        pipelines.queue_compute_pipeline(ComputePipelineDescriptor {
            label: Some(layouts[of].label.clone()),
            layout: vec![layouts[of].clone()],
            shader,
            shader_defs: vec![ShaderDefVal::UInt("MATERIAL_BIND_GROUP".into(), 0)],
            ..default()
        })
    };
    let all = [queue(0, fill), queue(1, settle), queue(2, march)];
    commands.insert_resource(Counter { layouts, pipelines: all });
}

/// What hair after hair is counted in, for each number of cells along a side, and the bind groups.
#[derive(Resource, Default)]
struct Scratch {
    grids: HashMap<u32, Grid>,
    groups: HashMap<Bound, Groups>,
    is_broken: bool,
}

struct Grid {
    cells: Buffer,
    density: TextureView,
}

/// The ribbons, strands, frame and rings of a hair, and its image.
type Bound = ([BufferId; 4], TextureViewId);

struct Groups {
    groups: [BindGroup; 3],
    is_used: bool,
}

impl Grid {
    fn new(device: &RenderDevice, side: u32) -> Self {
        let cells = device.create_buffer(&BufferDescriptor {
            label: Some("hair volume, cells"),
            size: 6 * 4 * u64::from(side).pow(3),
            usage: BufferUsages::STORAGE,
            mapped_at_creation: false,
        });
        let density = device.create_texture(&TextureDescriptor {
            label: Some("hair volume, density"),
            size: Extent3d { width: side, height: side, depth_or_array_layers: 2 * side },
            mip_level_count: 1,
            sample_count: 1,
            dimension: TextureDimension::D3,
            format: TextureFormat::Rgba16Float,
            usage: TextureUsages::STORAGE_BINDING | TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        Self { cells, density: density.create_view(&default()) }
    }
}

fn count(
    expansions: Res<Expansions>,
    counter: Option<Res<Counter>>,
    pipelines: Res<PipelineCache>,
    (buffers, images): (Option<Res<RenderAssets<GpuShaderBuffer>>>, Res<RenderAssets<GpuImage>>),
    device: Res<RenderDevice>,
    mut scratch: ResMut<Scratch>,
    mut context: RenderContext,
) {
    let Scratch { grids, groups, is_broken } = &mut *scratch;
    if device.is_changed() {
        // What a lost device held is gone.
        (*grids, *groups) = default();
    }
    let (Some(counter), Some(buffers)) = (counter, buffers) else { return };
    let ready = counter.pipelines.map(|id| pipelines.get_compute_pipeline(id));
    let [Some(fill), Some(settle), Some(march)] = ready else {
        let error = counter.pipelines.into_iter().find_map(|id| why_broken(&pipelines, id));
        if let Some(error) = error
            && !core::mem::replace(is_broken, true)
        {
            tracing::error!("light in hair is estimated without counting fibres: {error}");
        }
        return;
    };
    groups.retain(|_, groups| core::mem::take(&mut groups.is_used));
    let Some((uniform, ribbon)) = expansions.ribbons() else { return };
    let most = device.limits().max_compute_workgroups_per_dimension;
    let mut pass = context
        .command_encoder()
        .begin_compute_pass(&ComputePassDescriptor { label: Some("hair volume"), ..default() });
    for hair in expansions.hairs() {
        let Expansion { buffers: [_, _, strands, frame, rings], offset, rings: rings_of, .. } =
            hair;
        let Some((volume, side)) = hair.volume else { continue };
        let gpu = [strands, frame, rings].map(|id| buffers.get(*id).map(|gpu| &gpu.buffer));
        let ([Some(strands), Some(frame), Some(rings)], Some(image)) = (gpu, images.get(volume))
        else {
            continue;
        };
        if image.texture_descriptor.size.width != side {
            continue;
        }
        let grid = grids.entry(side).or_insert_with(|| Grid::new(&device, side));
        let bound = [uniform, strands, frame, rings].map(Buffer::id);
        let groups = groups.entry((bound, image.texture_view.id())).or_insert_with(|| {
            let [fill, settle, march] =
                counter.layouts.each_ref().map(|of| pipelines.get_bind_group_layout(of));
            let fill = device.create_bind_group(
                "hair volume, fill",
                &fill,
                &BindGroupEntries::with_indices((
                    (0, ribbon.clone()),
                    (3, strands.as_entire_binding()),
                    (5, frame.as_entire_binding()),
                    (6, rings.as_entire_binding()),
                    (7, grid.cells.as_entire_binding()),
                )),
            );
            let settle = device.create_bind_group(
                "hair volume, settle",
                &settle,
                &BindGroupEntries::with_indices((
                    (5, frame.as_entire_binding()),
                    (7, grid.cells.as_entire_binding()),
                    (8, &grid.density),
                )),
            );
            let march = device.create_bind_group(
                "hair volume, march",
                &march,
                &BindGroupEntries::with_indices((
                    (5, frame.as_entire_binding()),
                    (8, &grid.density),
                    (9, &image.sampler),
                    (10, &image.texture_view),
                )),
            );
            Groups { groups: [fill, settle, march], is_used: true }
        });
        groups.is_used = true;
        let [to_fill, to_settle, to_march] = &groups.groups;
        pass.set_pipeline(fill);
        pass.set_bind_group(0, to_fill, &[*offset]);
        let lanes = u64::from(rings_of.ranks.min(STRANDS)) * u64::from(rings_of.segments());
        let count = lanes.div_ceil(u64::from(LANES)) as u32;
        pass.dispatch_workgroups(count.min(most), count.div_ceil(most), 1);
        let blocks = side.div_ceil(BLOCK);
        for (pipeline, group) in [(settle, to_settle), (march, to_march)] {
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, group, &[]);
            pass.dispatch_workgroups(blocks, blocks, blocks);
        }
    }
}

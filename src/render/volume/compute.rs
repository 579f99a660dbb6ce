//! Counts fibres on the GPU, after strands have been expanded.

use super::{AROUND, image_size};
use crate::render::{
    expand::{Expansion, Expansions, expand},
    kernel::{Groups, Kernel, has_compute},
    material::Ribbon,
    sets::WritesNodes,
};
use bevy::{
    asset::load_embedded_asset,
    core_pipeline::schedule::camera_driver,
    platform::collections::HashMap,
    prelude::*,
    render::{
        RenderApp, RenderStartup,
        diagnostic::RecordDiagnostics,
        render_asset::RenderAssets,
        render_resource::{
            BindGroup, BindGroupEntries, BindGroupLayoutDescriptor, BindGroupLayoutEntries, Buffer,
            BufferDescriptor, BufferId, BufferUsages, ComputePassDescriptor, Extent3d,
            PipelineCache, SamplerBindingType, ShaderStages, StorageTextureAccess,
            TextureDescriptor, TextureDimension, TextureFormat, TextureSampleType, TextureUsages,
            TextureView, TextureViewId,
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
const WORKGROUP_SIZE: u32 = 64;
const BLOCK: u32 = 4;
/// So many strands are counted and stand for all.
const ENOUGH: u32 = 8192;

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

/// Fill, settle, march towards lights, march all around.
#[derive(Resource)]
struct Counter([Kernel; 4]);

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
    let fill = BindGroupLayoutDescriptor::new(
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
    );
    let settle = BindGroupLayoutDescriptor::new(
        "hair volume, settle",
        &BindGroupLayoutEntries::with_indices(
            stage,
            ((5, read()), (7, storage_buffer_sized(false, None)), (8, store())),
        ),
    );
    let march = BindGroupLayoutDescriptor::new(
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
    );
    let marching = load_embedded_asset!(&*assets, "march.wgsl");
    let enough = ShaderDefVal::UInt("ENOUGH".into(), ENOUGH);
    let queue = |shader, entry, layout: &BindGroupLayoutDescriptor, constants| {
        Kernel::queue(&pipelines, shader, entry, layout.clone(), constants)
    };
    commands.insert_resource(Counter([
        queue(load_embedded_asset!(&*assets, "fill.wgsl"), "fill", &fill, vec![enough]),
        queue(load_embedded_asset!(&*assets, "settle.wgsl"), "settle", &settle, vec![]),
        queue(marching.clone(), "march", &march, vec![]),
        queue(marching, "march_around", &march, vec![]),
    ]));
}

/// What hair after hair is counted in, for each number of cells along a side, and the bind groups.
#[derive(Resource, Default)]
struct Scratch {
    grids: HashMap<u32, Grid>,
    groups: Groups<Bound, [BindGroup; 3]>,
    is_broken: bool,
}

struct Grid {
    cells: Buffer,
    density: TextureView,
}

/// The ribbons, strands, frame and rings of a hair, and its image.
type Bound = ([BufferId; 4], TextureViewId);

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
    let kernels = &counter.0;
    let ready = kernels.each_ref().map(|kernel| kernel.ready(&pipelines));
    let [Some(fill), Some(settle), Some(march), Some(march_around)] = ready else {
        let error = kernels.iter().find_map(|kernel| kernel.why_broken(&pipelines));
        if let Some(error) = error
            && !core::mem::replace(is_broken, true)
        {
            tracing::error!("light in hair is estimated without counting fibres: {error}");
        }
        return;
    };
    groups.begin_frame();
    let Some((uniform, ribbon)) = expansions.ribbons() else { return };
    let most = device.limits().max_compute_workgroups_per_dimension;
    let diagnostics = context.diagnostic_recorder();
    let diagnostics = diagnostics.as_deref();
    let mut pass = context
        .command_encoder()
        .begin_compute_pass(&ComputePassDescriptor { label: Some("hair volume"), ..default() });
    let span = diagnostics.pass_span(&mut pass, "hair, volume");
    for hair in expansions.hairs() {
        let Expansion { buffers: [_, _, strands, frame, rings], offset, rings: rings_of, .. } =
            hair;
        let Some((volume, side)) = hair.volume else { continue };
        let gpu = [strands, frame, rings].map(|id| buffers.get(*id).map(|gpu| &gpu.buffer));
        let ([Some(strands), Some(frame), Some(rings)], Some(image)) = (gpu, images.get(volume))
        else {
            continue;
        };
        if image.texture_descriptor.size != image_size(side) {
            continue;
        }
        let grid = grids.entry(side).or_insert_with(|| Grid::new(&device, side));
        let bound = [uniform, strands, frame, rings].map(Buffer::id);
        let groups = groups.get((bound, image.texture_view.id()), || {
            let fill = BindGroupEntries::with_indices((
                (0, ribbon.clone()),
                (3, strands.as_entire_binding()),
                (5, frame.as_entire_binding()),
                (6, rings.as_entire_binding()),
                (7, grid.cells.as_entire_binding()),
            ));
            let settle = BindGroupEntries::with_indices((
                (5, frame.as_entire_binding()),
                (7, grid.cells.as_entire_binding()),
                (8, &grid.density),
            ));
            let march = BindGroupEntries::with_indices((
                (5, frame.as_entire_binding()),
                (8, &grid.density),
                (9, &image.sampler),
                (10, &image.texture_view),
            ));
            [
                kernels[0].group(&device, &pipelines, &fill),
                kernels[1].group(&device, &pipelines, &settle),
                kernels[2].group(&device, &pipelines, &march),
            ]
        });
        let [to_fill, to_settle, to_march] = groups;
        pass.set_pipeline(fill);
        pass.set_bind_group(0, to_fill, &[*offset]);
        let lanes = u64::from(rings_of.ranks.min(ENOUGH)) * u64::from(rings_of.segments());
        let count = lanes.div_ceil(u64::from(WORKGROUP_SIZE)) as u32;
        pass.dispatch_workgroups(count.min(most), count.div_ceil(most), 1);
        for (pipeline, group, side) in [
            (settle, to_settle, side),
            (march, to_march, side),
            (march_around, to_march, side / AROUND),
        ] {
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, group, &[]);
            let blocks = side.div_ceil(BLOCK);
            pass.dispatch_workgroups(blocks, blocks, blocks);
        }
    }
    span.end(&mut pass);
}

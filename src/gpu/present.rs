//! Packs a hair's nodes into the buffer that drawing reads, on the GPU.

use super::{pipelines::HairKernels, strands::GpuStrands};
use bevy::render::{
    render_resource::{
        BindGroup, BindGroupEntries, Buffer, BufferDescriptor, BufferInitDescriptor, BufferUsages,
        CommandEncoder,
    },
    renderer::{RenderDevice, RenderQueue},
};

/// Writes a hair's nodes to [`HairBuffers::nodes`](crate::render::HairBuffers::nodes), or to a
/// buffer of the same layout.
#[derive(Debug)]
pub struct DrawnNodes {
    frame: Buffer,
    groups: [BindGroup; 2],
}

impl DrawnNodes {
    /// Writes into `nodes`; `firsts` holds the index of the first node for each strand.
    pub fn new(
        device: &RenderDevice,
        kernels: &HairKernels,
        strands: &GpuStrands,
        nodes: &Buffer,
        firsts: &[u32],
    ) -> Self {
        let layout = strands.layout();
        let by_number: Vec<u32> = (0..layout.strands() as u32)
            .filter_map(|number| firsts.get(layout.strand_of(number)?).copied())
            .collect();
        let firsts = device.create_buffer_with_data(&BufferInitDescriptor {
            label: Some("drawn hair's first nodes"),
            contents: bytemuck::cast_slice(&by_number),
            usage: BufferUsages::STORAGE,
        });
        let frame = device.create_buffer(&BufferDescriptor {
            label: Some("drawn hair's frame"),
            size: 8,
            usage: BufferUsages::UNIFORM | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let group = |pose: &Buffer| {
            device.create_bind_group(
                "drawn hair",
                &kernels.drawn,
                &BindGroupEntries::sequential((
                    strands.blocks.as_entire_binding(),
                    pose.as_entire_binding(),
                    strands.motion.as_entire_binding(),
                    strands.rest.as_entire_binding(),
                    strands.bonds.as_entire_binding(),
                    firsts.as_entire_binding(),
                    nodes.as_entire_binding(),
                    frame.as_entire_binding(),
                )),
            )
        };
        let groups = [group(&strands.poses[0]), group(&strands.poses[1])];
        Self { frame, groups }
    }

    /// Adds the packing of this frame to a command encoder, which has to be submitted before the next
    /// call: between the last two ticks by the `overstep` of the fixed clock; `known` says that the buffer
    /// holds the frame before.
    pub fn encode(
        &self,
        queue: &RenderQueue,
        kernels: &HairKernels,
        strands: &GpuStrands,
        encoder: &mut CommandEncoder,
        overstep: f32,
        known: bool,
    ) {
        let frame = [overstep.to_bits(), known.into()];
        queue.write_buffer(&self.frame, 0, bytemuck::cast_slice(&frame));
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&kernels.present);
        pass.set_bind_group(0, &self.groups[strands.present], &[]);
        pass.dispatch_workgroups(strands.layout().blocks().len() as u32, 1, 1);
    }
}

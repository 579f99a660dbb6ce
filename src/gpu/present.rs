//! Packs a hair's nodes into the buffer that drawing reads, on the GPU.

use super::{pipelines::HairKernels, strands::GpuStrands};
use bevy::{
    math::Vec3,
    render::{
        render_resource::{
            BindGroup, BindGroupEntries, Buffer, BufferDescriptor, BufferInitDescriptor,
            BufferUsages, CommandEncoder,
        },
        renderer::{RenderDevice, RenderQueue},
    },
};

/// Writes a hair's nodes to [`HairBuffers::nodes`](crate::render::HairBuffers::nodes), or to a
/// buffer of the same layout.
#[derive(Debug)]
pub struct DrawnNodes {
    frame: Buffer,
    /// Of each strand, by its number on the GPU, the first drawn node and where its root is drawn.
    firsts: Buffer,
    /// The first drawn node of each strand, by its number.
    by_number: Vec<u32>,
    groups: [BindGroup; 2],
}

/// The moment at which nodes are drawn.
#[derive(Clone, Copy, Debug)]
pub struct DrawnMoment<'a> {
    /// How far it is from the last tick but one to the last, by the fixed clock.
    pub overstep: f32,
    /// Whether the buffer holds the frame before.
    pub known: bool,
    /// Where the strands' roots are drawn, where that is not where they are simulated; none if empty.
    pub roots: &'a [Option<Vec3>],
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
        let contents: Vec<[u32; 4]> = by_number.iter().map(|first| [*first, 0, 0, 0]).collect();
        let firsts = device.create_buffer_with_data(&BufferInitDescriptor {
            label: Some("drawn hair's first nodes"),
            contents: bytemuck::cast_slice(&contents),
            usage: BufferUsages::STORAGE | BufferUsages::COPY_DST,
        });
        let frame = device.create_buffer(&BufferDescriptor {
            label: Some("drawn hair's frame"),
            size: 16,
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
        Self { frame, firsts, by_number, groups }
    }

    /// Adds the packing of this frame to a command encoder, which has to be submitted before the next
    /// call.
    pub fn encode(
        &self,
        queue: &RenderQueue,
        kernels: &HairKernels,
        strands: &GpuStrands,
        encoder: &mut CommandEncoder,
        moment: &DrawnMoment<'_>,
    ) {
        strands.settle(queue);
        let layout = strands.layout();
        let rooted = !moment.roots.is_empty();
        if rooted {
            let root = |number: u32| *moment.roots.get(layout.strand_of(number)?)?;
            let firsts = self.by_number.iter().zip(0..).map(|(first, number)| {
                let [x, y, z] = root(number).unwrap_or(UNKNOWN).to_array().map(f32::to_bits);
                [*first, x, y, z]
            });
            let firsts: Vec<[u32; 4]> = firsts.collect();
            queue.write_buffer(&self.firsts, 0, bytemuck::cast_slice(&firsts));
        }
        let frame = [moment.overstep.to_bits(), moment.known.into(), rooted.into(), 0];
        queue.write_buffer(&self.frame, 0, bytemuck::cast_slice(&frame));
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&kernels.present);
        pass.set_bind_group(0, &self.groups[strands.present], &[]);
        pass.dispatch_workgroups(layout.blocks().len() as u32, 1, 1);
    }
}

/// A root that is drawn where it is simulated: too far away to be one.
const UNKNOWN: Vec3 = Vec3::splat(1e30);

//! A hair's strands on a device, and their substeps on a command encoder.

use super::{
    layout::{BONDS, Contents, Layout, MOTION, POSE, SCRATCH, StrandState, StrandView},
    pipelines::HairKernels,
    record::{LedNode, SubstepRecord, WORDS},
};
use bevy::render::{
    render_resource::{
        BindGroup, BindGroupEntries, Buffer, BufferBinding, BufferDescriptor, BufferInitDescriptor,
        BufferUsages, CommandEncoder, ComputePass, MapMode, PollType,
    },
    renderer::{RenderDevice, RenderQueue},
};
use core::num::NonZeroU64;

/// Bytes of a report.
pub(super) const REPORT_BYTES: usize = 64;

/// Counts of faulty strands in the substeps since the last report was read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GpuReport {
    /// Strands that became non-finite in a substep and were put back to its start.
    pub put_back: u32,
    /// Strands that were non-finite at the start of a substep and were rebuilt from their bonds.
    pub rebuilt: u32,
    /// One of them.
    pub first: Option<usize>,
}

/// A hair's strands on a device.
#[derive(Debug)]
pub struct GpuStrands {
    layout: Layout,
    /// The index of the buffer that holds the present pose.
    pub(super) present: usize,
    pub(super) blocks: Buffer,
    pub(super) poses: [Buffer; 2],
    pub(super) motion: Buffer,
    pub(super) rest: Buffer,
    pub(super) bonds: Buffer,
    pub(super) report: Buffer,
    measured: [BindGroup; 2],
    /// From the first pose to the second, and back.
    groups: [BindGroup; 2],
    records: Option<(Buffer, BindGroup)>,
    words: Vec<u32>,
    leads: Leads,
    /// What leading binds beside `leads`.
    scratch: Buffer,
}

/// The led nodes of the uploaded substeps.
#[derive(Debug, Default)]
struct Leads {
    uploaded: Option<(Buffer, BindGroup)>,
    words: Vec<[u32; 8]>,
    /// How many each substep has.
    counts: Vec<u32>,
}

// Bits beside a led node's slot, as lead.wgsl has them.
const ROOT: u32 = 1 << 30;
const FREE: u32 = 1 << 31;

/// Threads of a workgroup that leads nodes.
const LEAD_GROUP: u32 = 64;

impl GpuStrands {
    /// Uploads strands. Each must have two nodes or more, and a bond for each joint.
    pub fn new(device: &RenderDevice, kernels: &HairKernels, strands: &[StrandView<'_>]) -> Self {
        let nodes: Vec<usize> = strands.iter().map(|view| view.positions.len()).collect();
        let layout = Layout::of(&nodes);
        let mut contents = Contents::new(&layout);
        for (strand, view) in strands.iter().enumerate() {
            contents.put(&layout, strand, view);
        }
        let usage = BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST;
        let with = |label, contents: &[u8]| {
            let label = Some(label);
            device.create_buffer_with_data(&BufferInitDescriptor { label, contents, usage })
        };
        let blocks = with("hair blocks", bytemuck::cast_slice(layout.blocks()));
        let pose = bytemuck::cast_slice(&contents.pose);
        let poses = [with("hair pose", pose), with("hair pose", pose)];
        let motion = with("hair motion", bytemuck::cast_slice(&contents.motion));
        let rest = with("hair rest shapes", bytemuck::cast_slice(&contents.rest));
        let bonds = with("hair bonds", bytemuck::cast_slice(&contents.bonds));
        let report = with("hair report", &[0; REPORT_BYTES]);
        let scratch = device.create_buffer(&BufferDescriptor {
            label: Some("hair scratch"),
            size: 16 * layout.vectors(SCRATCH) as u64,
            usage,
            mapped_at_creation: false,
        });
        let group = |from: &Buffer, to: &Buffer| {
            device.create_bind_group(
                "hair",
                &kernels.hair,
                &BindGroupEntries::sequential((
                    blocks.as_entire_binding(),
                    from.as_entire_binding(),
                    to.as_entire_binding(),
                    motion.as_entire_binding(),
                    rest.as_entire_binding(),
                    bonds.as_entire_binding(),
                    scratch.as_entire_binding(),
                    report.as_entire_binding(),
                )),
            )
        };
        let groups = [group(&poses[0], &poses[1]), group(&poses[1], &poses[0])];
        let measured = [&poses[0], &poses[1]].map(|pose| {
            device.create_bind_group(
                "measured hair",
                &kernels.measured,
                &BindGroupEntries::sequential((
                    blocks.as_entire_binding(),
                    pose.as_entire_binding(),
                    motion.as_entire_binding(),
                    report.as_entire_binding(),
                )),
            )
        });
        Self {
            layout,
            present: 0,
            blocks,
            poses,
            motion,
            rest,
            bonds,
            report,
            measured,
            groups,
            records: None,
            words: Vec::new(),
            leads: Leads::default(),
            scratch,
        }
    }

    /// The memory layout of the strands.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Adds these substeps to a command encoder, which has to be submitted before the next call.
    pub fn encode(
        &mut self,
        device: &RenderDevice,
        queue: &RenderQueue,
        kernels: &HairKernels,
        encoder: &mut CommandEncoder,
        substeps: &[SubstepRecord],
    ) {
        self.upload(device, queue, kernels, substeps);
        let mut pass = encoder.begin_compute_pass(&Default::default());
        for index in 0..substeps.len() {
            self.dispatch(kernels, &mut pass, index);
        }
    }

    /// Has the device take these substeps before the next submission.
    pub(super) fn upload(
        &mut self,
        device: &RenderDevice,
        queue: &RenderQueue,
        kernels: &HairKernels,
        substeps: &[SubstepRecord],
    ) {
        if substeps.is_empty() {
            return;
        }
        self.words.clear();
        self.leads.words.clear();
        self.leads.counts.clear();
        for record in substeps {
            let first = self.leads.words.len() as u32;
            let led = record.led.iter().filter_map(|led| led_words(&self.layout, led));
            self.leads.words.extend(led);
            let end = self.leads.words.len() as u32;
            record.write_led(&mut self.words, first..end);
            self.leads.counts.push(end - first);
        }
        self.upload_leads(device, queue, kernels);
        let bytes: &[u8] = bytemuck::cast_slice(&self.words);
        let size = bytes.len() as u64;
        if self.records.as_ref().is_none_or(|(buffer, _)| buffer.size() < size) {
            let buffer = device.create_buffer(&BufferDescriptor {
                label: Some("hair substeps"),
                size,
                usage: BufferUsages::UNIFORM | BufferUsages::COPY_DST,
                mapped_at_creation: false,
            });
            let binding = BufferBinding {
                buffer: &buffer,
                offset: 0,
                size: NonZeroU64::new(4 * WORDS as u64),
            };
            let entries = BindGroupEntries::single(binding);
            let group = device.create_bind_group("hair substeps", &kernels.record, &entries);
            self.records = Some((buffer, group));
        }
        if let Some((buffer, _)) = &self.records {
            queue.write_buffer(buffer, 0, bytes);
        }
    }

    fn upload_leads(&mut self, device: &RenderDevice, queue: &RenderQueue, kernels: &HairKernels) {
        let bytes: &[u8] = bytemuck::cast_slice(&self.leads.words);
        let size = bytes.len() as u64;
        if size == 0 {
            return;
        }
        let uploaded = self.leads.uploaded.take().filter(|(buffer, _)| buffer.size() >= size);
        let (buffer, group) = uploaded.unwrap_or_else(|| {
            let buffer = device.create_buffer(&BufferDescriptor {
                label: Some("led hair"),
                size: size.next_power_of_two(),
                usage: BufferUsages::STORAGE | BufferUsages::COPY_DST,
                mapped_at_creation: false,
            });
            let group = device.create_bind_group(
                "led hair",
                &kernels.led,
                &BindGroupEntries::sequential((
                    buffer.as_entire_binding(),
                    self.rest.as_entire_binding(),
                    self.scratch.as_entire_binding(),
                )),
            );
            (buffer, group)
        });
        queue.write_buffer(&buffer, 0, bytes);
        self.leads.uploaded = Some((buffer, group));
    }

    /// One of the uploaded substeps.
    pub(super) fn dispatch(
        &mut self,
        kernels: &HairKernels,
        pass: &mut ComputePass<'_>,
        index: usize,
    ) {
        let Some((_, records)) = self.records.as_ref().filter(|_| self.layout.strands() > 0) else {
            return;
        };
        let record = (4 * WORDS * index) as u32;
        let led = self.leads.counts.get(index).copied().unwrap_or(0);
        if let Some((_, leads)) = self.leads.uploaded.as_ref().filter(|_| led > 0) {
            pass.set_pipeline(&kernels.lead);
            pass.set_bind_group(0, leads, &[]);
            pass.set_bind_group(1, records, &[record]);
            pass.dispatch_workgroups(led.div_ceil(LEAD_GROUP), 1, 1);
        }
        pass.set_pipeline(&kernels.substep);
        pass.set_bind_group(0, &self.groups[self.present], &[]);
        pass.set_bind_group(1, records, &[record]);
        pass.dispatch_workgroups(self.layout.blocks().len() as u32, 1, 1);
        self.present = 1 - self.present;
    }

    /// Measures the present state; what the report held of
    /// another has to be cleared before.
    pub(super) fn measure(&self, kernels: &HairKernels, pass: &mut ComputePass<'_>) {
        if self.layout.strands() > 0 {
            pass.set_pipeline(&kernels.measure);
            pass.set_bind_group(0, &self.measured[self.present], &[]);
            pass.dispatch_workgroups(self.layout.blocks().len() as u32, 1, 1);
        }
    }

    /// Copies the present state: pose, motion and bonds, one after the other.
    pub(super) fn copy_state(&self, encoder: &mut CommandEncoder, to: &Buffer) {
        let mut at = 0;
        let parts =
            [(&self.poses[self.present], POSE), (&self.motion, MOTION), (&self.bonds, BONDS)];
        for (buffer, parts) in parts {
            let size = 16 * self.layout.vectors(parts) as u64;
            encoder.copy_buffer_to_buffer(buffer, 0, to, at, size);
            at += size;
        }
    }

    /// Submits these substeps alone.
    pub fn run(
        &mut self,
        device: &RenderDevice,
        queue: &RenderQueue,
        kernels: &HairKernels,
        substeps: &[SubstepRecord],
    ) {
        let mut encoder = device.create_command_encoder(&Default::default());
        self.encode(device, queue, kernels, &mut encoder, substeps);
        queue.submit([encoder.finish()]);
    }

    /// Waits for the device and reads all strands back; `None` if it does not answer, as after a
    /// device loss.
    pub fn read(&self, device: &RenderDevice, queue: &RenderQueue) -> Option<Vec<StrandState>> {
        let contents = self.read_contents(device, queue)?;
        Some((0..self.layout.strands()).map(|strand| contents.get(&self.layout, strand)).collect())
    }

    /// The same as it lies there.
    pub(super) fn read_contents(
        &self,
        device: &RenderDevice,
        queue: &RenderQueue,
    ) -> Option<Contents> {
        let layout = &self.layout;
        let pose = read_back(device, queue, &self.poses[self.present], layout.vectors(POSE))?;
        let motion = read_back(device, queue, &self.motion, layout.vectors(MOTION))?;
        let bonds = read_back(device, queue, &self.bonds, layout.vectors(BONDS))?;
        Some(Contents { pose, motion, rest: Vec::new(), bonds })
    }

    /// Waits for the device, and reads and resets the report.
    pub fn take_report(&self, device: &RenderDevice, queue: &RenderQueue) -> Option<GpuReport> {
        let words = read_back(device, queue, &self.report, 1)?[0].map(f32::to_bits);
        queue.write_buffer(&self.report, 0, &[0; 16]);
        let first = (words[2] != 0).then(|| self.layout.strand_of(!words[2]));
        Some(GpuReport { put_back: words[0], rebuilt: words[1], first: first.flatten() })
    }
}

/// A led node as lead.wgsl reads it; `None` for one that does not exist.
fn led_words(layout: &Layout, led: &LedNode) -> Option<[u32; 8]> {
    let (strand, node) = (led.strand as usize, led.node as usize);
    if strand >= layout.strands() || node >= layout.nodes(strand) {
        return None;
    }
    let slot = layout.slot(strand, node);
    let root = if led.node == 0 { ROOT } else { 0 };
    let free = if led.place.is_none() { FREE } else { 0 };
    let [x, y, z] = led.place.unwrap_or_default().to_array().map(f32::to_bits);
    let [a, b, c, d] = led.frame.to_array().map(f32::to_bits);
    Some([x, y, z, slot | root | free, a, b, c, d])
}

/// The first vectors of a buffer.
fn read_back(
    device: &RenderDevice,
    queue: &RenderQueue,
    buffer: &Buffer,
    vectors: usize,
) -> Option<Vec<[f32; 4]>> {
    if vectors == 0 {
        return Some(Vec::new());
    }
    let size = 16 * vectors as u64;
    let staging = device.create_buffer(&BufferDescriptor {
        label: Some("hair read back"),
        size,
        usage: BufferUsages::MAP_READ | BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let mut encoder = device.create_command_encoder(&Default::default());
    encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, size);
    queue.submit([encoder.finish()]);
    let (send, receive) = std::sync::mpsc::channel();
    read_mapped(device, &staging, move |bytes| {
        // The receiver is gone if the device did not answer in time.
        let _ = send.send(bytes);
    });
    device.poll(PollType::wait_indefinitely()).ok()?;
    let bytes = receive.recv().ok()??;
    let numbers = bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    let numbers: Vec<f32> = numbers.collect();
    Some(numbers.as_chunks::<4>().0.to_vec())
}

/// Has a buffer mapped and read, all in one: in between the device may be lost, and the mapped bytes with
/// it. `None` where it is.
pub(super) fn read_mapped(
    device: &RenderDevice,
    buffer: &Buffer,
    done: impl FnOnce(Option<Vec<u8>>) + Send + 'static,
) {
    let mapped = buffer.clone();
    device.map_buffer(&buffer.slice(..), MapMode::Read, move |result| {
        done(result.is_ok().then(|| {
            let bytes = mapped.slice(..).get_mapped_range().to_vec();
            mapped.unmap();
            bytes
        }));
    });
}

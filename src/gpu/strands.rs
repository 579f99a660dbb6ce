//! A hair's strands on a device, and their substeps on a command encoder.

use super::{
    fingerprint::Fingerprint,
    followers,
    layout::{BONDS, Contents, Layout, POSE, REST, Reach, SCRATCH, STILL, StrandState, StrandView},
    pipelines::HairKernels,
    record::{REPORT_WORDS, RESTLESS, SubstepRecord, WORDS},
    target_buffer::KinematicTargets,
};
use bevy::render::{
    render_resource::{
        BindGroup, BindGroupEntries, Buffer, BufferBinding, BufferDescriptor, BufferInitDescriptor,
        BufferUsages, CommandEncoder, ComputePass, ComputePipeline, MapMode, PollType,
    },
    renderer::{RenderDevice, RenderQueue},
};
use core::num::NonZeroU64;
use std::sync::{Arc, Mutex, PoisonError};

/// Bytes of a report; behind them stands what the next tick has to know.
pub(super) const REPORT_BYTES: usize = 4 * RESTLESS;

/// Of hair that is not known to be still.
const NEW_REPORT: [u32; REPORT_WORDS] = {
    let mut words = [0; REPORT_WORDS];
    (words[RESTLESS], words[RESTLESS + 1], words[RESTLESS + 2]) = (1, 1, 1);
    words
};

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
    layout: Arc<Layout>,
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
    targets: KinematicTargets,
    /// What writing targets binds beside `targets`.
    scratch: Buffer,
    followers: Option<Followers>,
    /// Where simulated strands have been still, once that is asked for; which uploaded substeps end a tick
    /// after which that is to be looked at.
    still: Option<(Buffer, [BindGroup; 2])>,
    rests: Vec<bool>,
    /// The strands, until the device has them.
    waiting: Mutex<Option<Contents>>,
    reach: Reach,
    /// What the strands were when they were handed over.
    fingerprints: Mutex<Vec<Fingerprint>>,
}

/// What followers bind: their guide offsets in place of scratch.
#[derive(Debug)]
struct Followers {
    offsets: Buffer,
    groups: [BindGroup; 2],
}

impl GpuStrands {
    /// Uploads strands. Each must have two nodes or more, and a bond for each joint.
    pub fn new(device: &RenderDevice, kernels: &HairKernels, strands: &[StrandView<'_>]) -> Self {
        let nodes: Vec<usize> = strands.iter().map(|view| view.positions.len()).collect();
        let layout = Layout::with_followers(&nodes, |strand| strands[strand].follows.is_some())
            .with_spins(strands.iter().any(|view| view.spins.is_some()));
        let layout = Arc::new(layout);
        let (contents, reach) = Contents::with_reach(&layout, strands);
        let usage = BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST;
        let with = |label, contents: &[u8]| {
            let label = Some(label);
            device.create_buffer_with_data(&BufferInitDescriptor { label, contents, usage })
        };
        let of_size = |label, vectors: usize| {
            device.create_buffer(&BufferDescriptor {
                label: Some(label),
                size: 16 * vectors as u64,
                usage,
                mapped_at_creation: false,
            })
        };
        let room = |label, parts| of_size(label, layout.vectors(parts));
        let blocks = with("hair blocks", bytemuck::cast_slice(layout.blocks()));
        let poses = [room("hair pose", POSE), room("hair pose", POSE)];
        let motion = of_size("hair motion", layout.motion_vectors());
        let rest = room("hair rest shapes", REST);
        let bonds = room("hair bonds", BONDS);
        let report = with("hair report", bytemuck::cast_slice(&NEW_REPORT));
        let scratch = room("hair scratch", SCRATCH);
        let group = |from: &Buffer, to: &Buffer, scratch: &Buffer| {
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
        let groups = [group(&poses[0], &poses[1], &scratch), group(&poses[1], &poses[0], &scratch)];
        let following: Vec<_> = strands.iter().map(|view| view.follows).enumerate().collect();
        let following: Vec<_> =
            following.into_iter().filter_map(|(strand, view)| Some((strand, view?))).collect();
        let followers = (!following.is_empty()).then(|| {
            let offsets = followers::pack(&layout, &following);
            let offsets = with("guide offsets", bytemuck::cast_slice(&offsets));
            let groups =
                [group(&poses[0], &poses[1], &offsets), group(&poses[1], &poses[0], &offsets)];
            Followers { offsets, groups }
        });
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
            targets: KinematicTargets::default(),
            scratch,
            followers,
            still: None,
            rests: Vec::new(),
            waiting: Mutex::new(Some(contents)),
            reach,
            fingerprints: Mutex::default(),
        }
    }

    /// Has the device take the strands, if it has not: here and not with their hand-over, which is in the
    /// middle of a tick.
    pub(super) fn settle(&self, queue: &RenderQueue) {
        let waiting = self.waiting.lock().unwrap_or_else(PoisonError::into_inner).take();
        let Some(waiting) = waiting else { return };
        let fingerprints =
            (0..self.layout.strands()).map(|strand| waiting.fingerprint(&self.layout, strand));
        *self.fingerprints.lock().unwrap_or_else(PoisonError::into_inner) = fingerprints.collect();
        let Contents { pose, motion, rest, bonds } = waiting;
        let [one, other] = &self.poses;
        let all = [(one, &pose), (other, &pose), (&self.motion, &motion), (&self.rest, &rest)];
        for (buffer, contents) in all.into_iter().chain([(&self.bonds, &bonds)]) {
            queue.write_buffer(buffer, 0, bytemuck::cast_slice(contents));
        }
    }

    /// How far the strands reach as they are handed over.
    pub(super) fn reach(&self) -> Reach {
        self.reach
    }

    /// What the strands were when they were handed over, once the device has them.
    pub(super) fn take_fingerprints(&self) -> Vec<Fingerprint> {
        core::mem::take(&mut *self.fingerprints.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// The memory layout of the strands.
    pub fn layout(&self) -> &Arc<Layout> {
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
        self.settle(queue);
        if substeps.is_empty() {
            return;
        }
        self.words.clear();
        self.targets.clear();
        self.rests.clear();
        self.rests
            .extend(substeps.iter().map(|record| record.sleep.is_some_and(|sleep| sleep.ends)));
        if self.rests.contains(&true) {
            self.watch_rest(device, kernels);
        }
        for record in substeps {
            let indices = self.targets.push(&self.layout, record);
            record.write_of(&mut self.words, &indices);
        }
        let followers = self.followers.as_ref().map(|followers| &followers.offsets);
        self.targets.upload(device, queue, kernels, &self.rest, [Some(&self.scratch), followers]);
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
        let mut dispatch = |pipeline: &ComputePipeline, group: &BindGroup, count: usize| {
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, group, &[]);
            pass.set_bind_group(1, records, &[record]);
            pass.dispatch_workgroups(count as u32, 1, 1);
        };
        for (pipeline, group, count) in self.targets.of(index, kernels) {
            dispatch(pipeline, group, count);
        }
        let simulated = self.layout.simulated_blocks();
        let solve = if self.layout.has_spins() { &kernels.sweep } else { &kernels.substep };
        dispatch(solve, &self.groups[self.present], simulated);
        if let Some(followers) = &self.followers {
            let others = self.layout.blocks().len() - simulated;
            dispatch(&kernels.follow, &followers.groups[self.present], others);
        }
        self.present = 1 - self.present;
        if let Some((_, groups)) = &self.still
            && self.rests.get(index) == Some(&true)
        {
            dispatch(&kernels.sleep, &groups[self.present], simulated);
        }
    }

    /// Room for where strands are still.
    fn watch_rest(&mut self, device: &RenderDevice, kernels: &HairKernels) {
        self.still.get_or_insert_with(|| {
            let still = device.create_buffer(&BufferDescriptor {
                label: Some("still hair"),
                size: 16 * self.layout.vectors(STILL) as u64,
                usage: BufferUsages::STORAGE,
                mapped_at_creation: false,
            });
            let group = |pose: &Buffer| {
                let entries = BindGroupEntries::sequential((
                    self.blocks.as_entire_binding(),
                    pose.as_entire_binding(),
                    still.as_entire_binding(),
                    self.report.as_entire_binding(),
                ));
                device.create_bind_group("still hair", &kernels.still, &entries)
            };
            let groups = [group(&self.poses[0]), group(&self.poses[1])];
            (still, groups)
        });
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
        let buffers = [&self.poses[self.present], &self.motion, &self.bonds];
        for (buffer, vectors) in buffers.into_iter().zip(self.layout.state()) {
            let size = 16 * vectors as u64;
            encoder.copy_buffer_to_buffer(buffer, 0, to, at, size);
            at += size;
        }
    }

    /// Copies the place of a strand's node, 16 bytes.
    pub(super) fn copy_place(
        &self,
        (strand, node): (usize, usize),
        encoder: &mut CommandEncoder,
        to: &Buffer,
        at: u64,
    ) {
        let from = 16 * self.layout.index(strand, node, 0, POSE) as u64;
        encoder.copy_buffer_to_buffer(&self.poses[self.present], from, to, at, 16);
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
        self.settle(queue);
        let [poses, motions, joints] = self.layout.state();
        let pose = read_back(device, queue, &self.poses[self.present], poses)?;
        let motion = read_back(device, queue, &self.motion, motions)?;
        let bonds = read_back(device, queue, &self.bonds, joints)?;
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

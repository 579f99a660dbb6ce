//! A hair on the GPU as both worlds hold it: the main world, which ticks, and the render world,
//! which runs what was written down.

use super::{
    layout::{Contents, Layout},
    pipelines::HairKernels,
    present::{DrawnMoment, DrawnNodes},
    record::{MAX_TARGETS, SLEPT, SubstepRecord},
    strands::{GpuStrands, REPORT_BYTES, read_mapped},
};
use bevy::{
    math::Vec3,
    render::{
        render_resource::{Buffer, BufferDescriptor, BufferId, BufferUsages, CommandEncoder},
        renderer::{RenderDevice, RenderQueue},
    },
};
use core::sync::atomic::{AtomicBool, Ordering};
use std::{
    collections::VecDeque,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

/// Ticks that wait for later frames at most: what is more is run at once, with a pause.
const MOST_LATE: usize = 60;

/// One hair; whoever has it at hand may run its substeps, which are kept in order.
#[derive(Clone)]
pub(super) struct Link {
    shared: Arc<Mutex<Shared>>,
    replies: Arc<Mutex<Replies>>,
    pub(super) layout: Arc<Layout>,
    /// The number of its device.
    number: u64,
}

/// Locked by the render world while it encodes a frame.
pub(super) struct Shared {
    pub(super) device: RenderDevice,
    pub(super) queue: RenderQueue,
    pub(super) kernels: Arc<HairKernels>,
    pub(super) strands: GpuStrands,
    /// What has been written down and not been run.
    pub(super) pending: Vec<SubstepRecord>,
    /// Where the nodes are drawn from.
    pub(super) drawn: Option<(BufferId, DrawnNodes)>,
    /// The first drawn node of each strand.
    pub(super) firsts: Vec<u32>,
    /// The number of the request for the state, if there is one.
    pub(super) asked: Option<u64>,
    replies: Arc<Mutex<Replies>>,
    /// Strands whose nodes are asked for, and the tick.
    probe: (Vec<u32>, u32),
    /// Frames in a row without a substep; whether late substeps have been reported.
    idle: u32,
    is_late: bool,
}

/// What is on its way from the device. Locked for a moment only: the main world looks for it in every frame.
#[derive(Default)]
pub(super) struct Replies {
    copy: Option<(u64, PendingReadback)>,
    reports: Reports,
    probed: Option<Probed>,
}

/// Nodes of some strands on their way from the device.
struct Probed {
    strands: Vec<u32>,
    tick: u32,
    readback: PendingReadback,
}

impl Link {
    pub(super) fn new(
        (number, device, queue): (u64, &RenderDevice, &RenderQueue),
        kernels: Arc<HairKernels>,
        strands: GpuStrands,
    ) -> Self {
        let (layout, replies) = (strands.layout().clone(), Arc::default());
        let mut next = 0;
        let firsts = (0..layout.strands()).map(|strand| {
            next += layout.nodes(strand) as u32;
            next - layout.nodes(strand) as u32
        });
        let shared = Shared {
            device: device.clone(),
            queue: queue.clone(),
            kernels,
            firsts: firsts.collect(),
            strands,
            pending: Vec::new(),
            drawn: None,
            asked: None,
            replies: Arc::clone(&replies),
            probe: Default::default(),
            idle: 0,
            is_late: false,
        };
        Self { shared: Arc::new(Mutex::new(shared)), replies, layout, number }
    }

    /// May wait until the render world has encoded a frame.
    pub(super) fn lock(&self) -> MutexGuard<'_, Shared> {
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn replies(&self) -> MutexGuard<'_, Replies> {
        self.replies.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether it is on the device of this number.
    pub(super) fn is_on(&self, device: u64) -> bool {
        self.number == device
    }

    /// The nodes of strands that were asked for, and of which tick they are.
    pub(super) fn take_probed(&self) -> Option<(Vec<(u32, Vec<Vec3>)>, u32)> {
        let Probed { strands, tick, readback } = {
            let probed = &mut self.replies().probed;
            probed.take_if(|probed| probed.readback.has_arrived())?
        };
        let bytes = readback.take()??;
        let mut places = bytes.chunks_exact(16).map(|place| {
            let number =
                |i: usize| f32::from_le_bytes([place[i], place[i + 1], place[i + 2], place[i + 3]]);
            Vec3::new(number(0), number(4), number(8))
        });
        let of = |strand: u32| {
            let nodes = self.layout.nodes(strand as usize);
            (strand, places.by_ref().take(nodes).collect())
        };
        Some((strands.into_iter().map(of).collect(), tick))
    }

    /// The state that has arrived, with the number of its request; `Err` where the device failed.
    pub(super) fn take_state(&self) -> Option<(u64, Result<Contents, ()>)> {
        let arrived = |(_, readback): &mut (u64, PendingReadback)| readback.has_arrived();
        let (number, readback) = self.replies().copy.take_if(arrived)?;
        let read = |bytes: Vec<u8>| Contents::of_bytes(&self.layout, &bytes);
        Some((number, readback.take()?.map(read).ok_or(())))
    }

    /// A report that has arrived.
    pub(super) fn take_report(&self) -> Option<Measured> {
        let reports = &mut self.replies().reports;
        let bytes = reports.0.front()?.take()?;
        let readback = reports.0.pop_front()?;
        let report = Measured::of(&bytes?);
        readback.is_mapped.store(false, Ordering::Release);
        reports.1.push(readback);
        Some(report)
    }
}

impl Shared {
    /// Hands pending substeps to the device, of so many ticks at most; returns how many there are. What is left
    /// waits for the next frame, unless the state is asked for or that much waits that it has to be run first.
    pub(super) fn upload(&mut self, ticks: usize) -> usize {
        let waiting = self.waiting_ticks();
        if waiting > ticks + MOST_LATE {
            if !core::mem::replace(&mut self.is_late, true) {
                tracing::warn!(
                    "hair on the GPU is {waiting} ticks late: frames owe more than the {ticks} that \
                     HairGpu::ticks_a_frame lets each run"
                );
            }
            while self.waiting_ticks() > ticks {
                let some = self.first_of(ticks);
                self.run_first(some);
            }
        }
        self.run_excess();
        let count = if self.asked.is_some() { self.pending.len() } else { self.first_of(ticks) };
        let Self { device, queue, kernels, strands, pending, .. } = self;
        strands.upload(device, queue, kernels, &pending[..count]);
        pending.drain(..count);
        self.idle = if count > 0 { 0 } else { self.idle.saturating_add(1) };
        count
    }

    /// How many ticks are pending.
    fn waiting_ticks(&self) -> usize {
        self.pending.iter().filter(|record| record.notes_before).count()
    }

    /// How many records the first ticks of those that are pending have.
    fn first_of(&self, ticks: usize) -> usize {
        let firsts = self.pending.iter().enumerate().filter(|(_, record)| record.notes_before);
        firsts.map(|(index, _)| index).nth(ticks).unwrap_or(self.pending.len())
    }

    /// Runs the first pending substeps by themselves.
    fn run_first(&mut self, count: usize) {
        let Self { device, queue, kernels, strands, pending, .. } = self;
        strands.run(device, queue, kernels, &pending[..count]);
        pending.drain(..count);
    }

    /// Runs the first pending substeps by themselves where all together have too many targets for a buffer.
    fn run_excess(&mut self) {
        loop {
            let mut targets = 0;
            let mut fits = |record: &SubstepRecord| {
                targets += record.targets.len();
                targets <= MAX_TARGETS
            };
            let fit = self.pending.iter().take_while(|record| fits(record)).count().max(1);
            if fit >= self.pending.len() {
                return;
            }
            self.run_first(fit);
        }
    }

    /// Runs what is pending by itself.
    pub(super) fn run_pending(&mut self) {
        self.run_excess();
        if !self.pending.is_empty() {
            self.run_first(self.pending.len());
        }
    }

    /// The pose of the nodes into the buffer that drawing reads, unless that has it because the hair sleeps.
    /// Where `roots` are given, strands are drawn from there.
    pub(super) fn draw(
        &mut self,
        nodes: &Buffer,
        encoder: &mut CommandEncoder,
        overstep: f32,
        (roots, rests): (&[Option<Vec3>], bool),
    ) {
        let Self { device, queue, kernels, strands, drawn, firsts, idle, .. } = self;
        let count: usize = (0..strands.layout().strands()).map(|i| strands.layout().nodes(i)).sum();
        // Drawing knows other strands for as long as the hair takes to come back.
        if nodes.size() != 32 * count as u64 {
            return;
        }
        let known = drawn.as_ref().is_some_and(|(id, _)| *id == nodes.id());
        // Once for where it is, and once more for the motion since.
        if known && rests && *idle > 2 {
            return;
        }
        if !known {
            let new = DrawnNodes::new(device, kernels, strands, nodes, firsts);
            *drawn = Some((nodes.id(), new));
        }
        if let Some((_, drawn)) = drawn {
            let moment = DrawnMoment { overstep, known, roots };
            drawn.encode(queue, kernels, strands, encoder, &moment);
        }
    }

    /// Copies what was asked for, and the report.
    pub(super) fn copy(&mut self, encoder: &mut CommandEncoder, has_run: bool) {
        let replies = self.replies.clone();
        let mut replies = replies.lock().unwrap_or_else(PoisonError::into_inner);
        if replies.copy.is_none()
            && let Some(number) = self.asked.take()
        {
            let size = Contents::bytes(self.strands.layout());
            let readback = PendingReadback::new(&self.device, size);
            self.strands.copy_state(encoder, &readback.buffer);
            replies.copy = Some((number, readback));
        }
        self.copy_probed(&mut replies, encoder);
        if has_run {
            replies.reports.copy(&self.device, &self.strands.report, encoder);
        }
    }

    /// Asks for the nodes of some strands in this tick.
    pub(super) fn ask_for(&mut self, strands: &[u32], tick: u32) {
        self.probe.0.clear();
        self.probe.0.extend_from_slice(strands);
        self.probe.1 = tick;
    }

    fn copy_probed(&mut self, replies: &mut Replies, encoder: &mut CommandEncoder) {
        let late = self.waiting_ticks();
        let (strands, tick) = &mut self.probe;
        if replies.probed.is_some() || strands.is_empty() {
            return;
        }
        let layout = self.strands.layout();
        strands.retain(|strand| (*strand as usize) < layout.strands());
        let nodes = |strand: &u32| {
            let strand = *strand;
            (0..layout.nodes(strand as usize)).map(move |node| (strand, node))
        };
        let count = strands.iter().flat_map(nodes).count() as u64;
        let readback = PendingReadback::new(&self.device, 16 * count.max(1));
        for ((strand, node), to) in strands.iter().flat_map(nodes).zip(0..) {
            self.strands.copy_place((strand as usize, node), encoder, &readback.buffer, 16 * to);
        }
        let tick = tick.saturating_sub(late as u32);
        replies.probed = Some(Probed { strands: core::mem::take(strands), tick, readback });
    }

    /// After the submission: has the copies mapped.
    pub(super) fn map(&self) {
        let replies = self.replies.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, readback)) = &replies.copy {
            readback.map(&self.device);
        }
        if let Some(probed) = &replies.probed {
            probed.readback.map(&self.device);
        }
        replies.reports.0.iter().for_each(|readback| readback.map(&self.device));
    }
}

/// A buffer on its way from the device.
struct PendingReadback {
    buffer: Buffer,
    is_mapped: AtomicBool,
    arrived: Arc<Mutex<Option<Arrived>>>,
}

/// What it held; `None` where the device failed.
type Arrived = Option<Vec<u8>>;

impl PendingReadback {
    fn new(device: &RenderDevice, size: u64) -> Self {
        let buffer = device.create_buffer(&BufferDescriptor {
            label: Some("hair read back"),
            size,
            usage: BufferUsages::MAP_READ | BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        Self { buffer, is_mapped: AtomicBool::new(false), arrived: Arc::default() }
    }

    /// Mapped once, after the commands that fill it have been submitted.
    fn map(&self, device: &RenderDevice) {
        if !self.is_mapped.swap(true, Ordering::AcqRel) {
            let arrived = self.arrived.clone();
            read_mapped(device, &self.buffer, move |bytes| {
                *arrived.lock().unwrap_or_else(PoisonError::into_inner) = Some(bytes);
            });
        }
    }

    /// Whether that is known.
    fn has_arrived(&self) -> bool {
        self.arrived.lock().unwrap_or_else(PoisonError::into_inner).is_some()
    }

    /// What it held, once that is known.
    fn take(&self) -> Option<Arrived> {
        self.arrived.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

/// Reports under way, oldest first, and buffers for more.
#[derive(Default)]
struct Reports(VecDeque<PendingReadback>, Vec<PendingReadback>);

/// How many reports may be under way; later frames' counts are added to the next one's.
const REPORTS: usize = 3;

impl Reports {
    fn copy(&mut self, device: &RenderDevice, report: &Buffer, encoder: &mut CommandEncoder) {
        if self.0.len() == REPORTS {
            return;
        }
        let size = REPORT_BYTES as u64;
        let readback = self.1.pop().unwrap_or_else(|| PendingReadback::new(device, size));
        encoder.copy_buffer_to_buffer(report, 0, &readback.buffer, 0, size);
        encoder.clear_buffer(report, 0, Some(size));
        self.0.push_back(readback);
    }
}

/// What a report says of the substeps since the one before.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Measured {
    /// Strands that were put back, and rebuilt.
    pub(super) put_back: u32,
    pub(super) rebuilt: u32,
    /// The number of one of them.
    pub(super) first: Option<u32>,
    /// Whether a strand with held nodes has to give way.
    pub(super) gives_way: bool,
    /// The corners of the box around all nodes (m), and their highest speed (m/s).
    pub(super) low: [f32; 3],
    pub(super) high: [f32; 3],
    pub(super) speed: f32,
    /// The last tick in which the hair slept.
    pub(super) slept: u32,
}

impl Measured {
    fn of(bytes: &[u8]) -> Self {
        let mut words = [0u32; REPORT_BYTES / 4];
        let own = bytes.len().min(REPORT_BYTES);
        bytemuck::cast_slice_mut::<u32, u8>(&mut words)[..own].copy_from_slice(&bytes[..own]);
        let number =
            |word: u32| f32::from_bits(if word >> 31 == 1 { word ^ 1 << 31 } else { !word });
        Self {
            put_back: words[0],
            rebuilt: words[1],
            first: (words[2] != 0).then_some(!words[2]),
            gives_way: words[3] != 0,
            high: [4, 5, 6].map(|i| number(words[i])),
            low: [7, 8, 9].map(|i| number(!words[i])),
            speed: f32::from_bits(words[10]).sqrt(),
            slept: words[SLEPT],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_report_is_read_as_the_kernel_writes_it() {
        let ordered = |x: f32| {
            let bits = x.to_bits();
            if bits >> 31 == 1 { !bits } else { bits | 1 << 31 }
        };
        let mut words = [0u32; 16];
        (words[0], words[1], words[2], words[3]) = (3, 1, !17, 1);
        let (high, low) = ([0.5, -0.25, 1e-3], [-0.5, -2.0, 0.0]);
        for axis in 0..3 {
            words[4 + axis] = ordered(high[axis]);
            words[7 + axis] = !ordered(low[axis]);
        }
        words[10] = 4.0f32.to_bits();
        words[SLEPT] = 77;
        let read = Measured::of(bytemuck::cast_slice(&words));
        let expected = Measured {
            put_back: 3,
            rebuilt: 1,
            first: Some(17),
            gives_way: true,
            low,
            high,
            speed: 2.0,
            slept: 77,
        };
        assert_eq!(read, expected);
        assert!(ordered(-1.0) < ordered(-0.5) && ordered(-0.5) < ordered(0.25), "in order");
    }
}

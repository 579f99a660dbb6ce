//! Random strands, the same substep in lanes, and a device to run it on.

use crate::offscreen::windowless;
use bevy::{
    math::Isometry3d,
    prelude::*,
    render::renderer::{RenderAdapterInfo, RenderDevice, RenderQueue},
};
use bevy_keratin::{
    StretchProjection, Sweeps,
    base::lanes::{LANES, put3, put4, take3, take4},
    forces::environment::wind::wind,
    gpu::{GpuStrands, HairKernels, StrandState, StrandView, SubstepRecord, SweepRecord},
    keratin::bond::model::{JointBonds, cuticle_factor},
    solver::rod::{
        block::BlockLanes,
        constraint::stiffness_per_iteration,
        direct::{self, DirectParams},
        frame::{darboux, full, parallel_transport},
        step::{self, SweepParams},
    },
};
use fearless_simd::Level;
use std::sync::OnceLock;

/// A fixed sequence of numbers in 0…1.
pub struct Random(pub u32);

impl Random {
    pub fn share(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (self.0 >> 8) as f32 / 16_777_216.0
    }

    pub fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.share()
    }

    /// Each component between −½ and ½.
    pub fn vector(&mut self) -> Vec3 {
        Vec3::new(self.share(), self.share(), self.share()) - 0.5
    }
}

#[derive(Clone, Debug)]
pub struct LabStrand {
    pub positions: Vec<Vec3>,
    pub velocities: Vec<Vec3>,
    pub orientations: Vec<Quat>,
    pub root_frame: Quat,
    pub lengths: Vec<f32>,
    pub tensions: Vec<f32>,
    /// Angular velocities of the edges, where the paper's projections solve; else none.
    pub spins: Vec<Vec3>,
    pub joints: Vec<JointBonds>,
}

impl LabStrand {
    /// At rest along a polyline, with closed bonds.
    pub fn along(points: &[Vec3]) -> Self {
        let orientations = parallel_transport(points, None);
        let mut strand = Self {
            positions: points.to_vec(),
            velocities: vec![Vec3::ZERO; points.len()],
            root_frame: orientations[0],
            lengths: points.windows(2).map(|p| p[0].distance(p[1])).collect(),
            tensions: vec![0.0; orientations.len()],
            spins: Vec::new(),
            joints: Vec::new(),
            orientations,
        };
        let shape = |i: usize| JointBonds::closed(strand.omega(i).xyz());
        strand.joints = (0..strand.lengths.len()).map(shape).collect();
        strand
    }

    /// Of so many nodes, curled, in motion, with bonds of all rates that remember other shapes.
    pub fn random(random: &mut Random, nodes: usize, speed: f32) -> Self {
        let step = random.between(0.004, 0.02);
        let mut way = random.vector().normalize_or(Vec3::X);
        let mut points = vec![random.vector() * 0.2];
        for _ in 1..nodes {
            way = (way + random.vector() * 0.5).normalize();
            points.push(points[points.len() - 1] + way * step * random.between(0.7, 1.3));
        }
        let mut strand = Self::along(&points);
        let drift = random.vector() * speed;
        for v in &mut strand.velocities[1..] {
            *v = drift + random.vector() * 0.1 * speed;
        }
        for (i, tension) in strand.tensions.iter_mut().enumerate() {
            *tension = (nodes - i) as f32 * random.between(0.0, 9.8);
        }
        for i in 0..strand.joints.len() {
            let present = strand.omega(i).xyz();
            let open = random.share() < 0.1;
            let joint = &mut strand.joints[i];
            for (shape, rate) in joint.shapes.iter_mut().zip(&mut joint.rates) {
                *shape = present + random.vector() * 0.2;
                *rate = if open { 0.0 } else { random.share() };
            }
        }
        strand
    }

    /// The same for the paper's projections, with edges that turn by up to so much (rad/s).
    pub fn spinning(mut self, random: &mut Random, speed: f32) -> Self {
        self.spins = self.lengths.iter().map(|_| random.vector() * speed).collect();
        self
    }

    pub fn omega(&self, i: usize) -> Quat {
        darboux(
            if i == 0 { self.root_frame } else { self.orientations[i - 1] },
            self.orientations[i],
        )
    }

    pub fn view(&self) -> StrandView<'_> {
        StrandView {
            positions: &self.positions,
            velocities: &self.velocities,
            orientations: &self.orientations,
            root_frame: self.root_frame,
            lengths: &self.lengths,
            tensions: &self.tensions,
            spins: (!self.spins.is_empty()).then_some(&self.spins),
            joints: &self.joints,
            before: &[],
            follows: None,
        }
    }

    /// Takes over what became of it.
    pub fn take(&mut self, state: &StrandState) {
        self.positions.clone_from(&state.positions);
        self.velocities.clone_from(&state.velocities);
        self.orientations.clone_from(&state.orientations);
        self.tensions.clone_from(&state.tensions);
        self.spins.clone_from(&state.spins);
        self.joints.clone_from(&state.joints);
    }

    pub fn peak_strain(&self) -> f32 {
        let strain = |(p, l): (&[Vec3], &f32)| (p[0].distance(p[1]) / l - 1.0).abs();
        self.positions.windows(2).zip(&self.lengths).map(strain).fold(0.0, f32::max)
    }
}

/// One substep as the tick does it, in lanes of f32. Strands of equal node count, [`LANES`] at most.
pub fn in_lanes(level: Level, strands: &mut [LabStrand], record: &SubstepRecord) {
    let mut block = BlockLanes::default();
    block.resize(strands[0].positions.len());
    let SubstepRecord { dt, retained, .. } = *record;
    let frame_motion = record.frame_motion.unwrap_or_default();
    let mut asked = Vec::new();
    for (lane, s) in strands.iter_mut().enumerate() {
        let (root_from, edges) = (frame_motion * s.positions[0], s.lengths.len());
        if let Some(Isometry3d { rotation, .. }) = record.frame_motion {
            s.positions.iter_mut().skip(1).for_each(|p| *p = frame_motion * *p);
            s.velocities.iter_mut().for_each(|v| *v = rotation * *v);
            s.orientations.iter_mut().for_each(|q| *q = (rotation * *q).normalize());
            s.spins.iter_mut().for_each(|omega| *omega = rotation * *omega);
        }
        s.spins.iter_mut().for_each(|omega| *omega *= retained);
        let mut drying = vec![0.0; edges + 1];
        let before = s.velocities.clone();
        for (i, drying) in drying.iter_mut().enumerate() {
            let e = i.min(edges - 1);
            let edge = s.positions[e + 1] - s.positions[e];
            let mut v = s.velocities[i] * retained + record.gravity * dt;
            for b in &record.blowers {
                let blown = wind(b.strength, b.nozzle, b.aim, s.positions[i], edge);
                v += blown * dt;
                *drying += b.drying * blown.length() * dt;
            }
            s.velocities[i] = v + record.wind * (1.0 - retained);
        }
        asked.push(drying);
        let mut distance = 0.0;
        for i in 0..edges {
            let joint = &s.joints[i];
            let cuticle = record.cuticle;
            let factor = cuticle_factor(distance, cuticle.damage, cuticle.softening);
            let (rest, k) = match record.sweeps {
                Some(SweepRecord { settings }) => {
                    let k = settings.per_substep(dt, factor);
                    let rest = joint.rest_shape(s.omega(i), &record.influence);
                    (rest, stiffness_per_iteration(k, settings.iterations))
                }
                None => {
                    let share = joint.closed_share(&record.influence);
                    let few = share < 1e-3;
                    let rest =
                        if few { s.omega(i) } else { full(joint.relaxed(&record.influence)) };
                    (rest, share.max(1e-3) * factor)
                }
            };
            let edge = &mut block.edges[i];
            put4(&mut edge.rest, lane, rest);
            put4(&mut edge.q, lane, s.orientations[i]);
            put3(&mut edge.omega, lane, s.spins.get(i).copied().unwrap_or_default());
            edge.k[lane] = k;
            (edge.l[lane], edge.tension[lane]) = (s.lengths[i], s.tensions[i]);
            distance += s.lengths[i];
        }
        for (i, node) in block.nodes.iter_mut().enumerate() {
            put3(&mut node.p, lane, s.positions[i]);
            put3(&mut node.v, lane, if i == 0 { Vec3::ZERO } else { s.velocities[i] });
            let push = (s.velocities[i] - before[i]) / dt;
            put3(&mut node.push, lane, if i == 0 { Vec3::ZERO } else { push });
            node.w[lane] = if i == 0 { 0.0 } else { 1.0 };
        }
        let from = if record.sweeps.is_some() { s.positions[0] } else { root_from };
        put3(&mut block.nodes[0].from, lane, from);
        put4(&mut block.root, lane, s.root_frame);
        put4(&mut block.root_from, lane, frame_motion.rotation * s.root_frame);
    }
    assert!(strands.len() <= LANES);
    let params = DirectParams {
        dt,
        damping: record.damping,
        torsion: record.torsion,
        limiter_steps: record.limiter_steps,
        clearance: record.skin,
    };
    // Lanes that nobody uses repeat the first, as in the tick.
    for lane in strands.len()..LANES {
        repeat_first(&mut block, lane);
    }
    match &record.sweeps {
        Some(SweepRecord { settings }) => {
            let params = SweepParams {
                dt,
                iterations: settings.iterations,
                projection: settings.projection,
                limiter_steps: record.limiter_steps,
                internal_damping: settings.internal_damping,
                clearance: record.skin,
            };
            step::weigh(level, &mut block, Some((settings, record.bending_length)));
            step::step(level, &mut block, &params, &record.obstacles);
        }
        None => {
            direct::weigh(level, &mut block, record.bending_length, dt);
            direct::step(level, &mut block, &params, &record.obstacles);
        }
    }
    for (lane, s) in strands.iter_mut().enumerate() {
        for (i, node) in block.nodes.iter().enumerate() {
            s.positions[i] = take3(&node.p, lane);
            s.velocities[i] = take3(&node.v, lane);
        }
        for (i, edge) in block.edges.iter().enumerate() {
            s.orientations[i] = take4(&edge.q, lane);
            s.tensions[i] = edge.tension[lane];
            if let Some(omega) = s.spins.get_mut(i) {
                *omega = take3(&edge.omega, lane);
            }
        }
        for (i, asked) in asked[lane].iter().enumerate().take(s.lengths.len()) {
            let omega = s.omega(i);
            for kind in 0..4 {
                let drying = if kind == 0 { *asked } else { 0.0 };
                s.joints[i].change(kind, record.change[kind] + drying, omega);
            }
        }
    }
}

fn repeat_first(block: &mut BlockLanes, lane: usize) {
    for n in &mut block.nodes {
        for cells in [&mut n.p, &mut n.from, &mut n.v] {
            cells.iter_mut().for_each(|cell| cell[lane] = cell[0]);
        }
        n.w[lane] = n.w[0];
    }
    for e in &mut block.edges {
        for cells in [&mut e.q, &mut e.rest] {
            cells.iter_mut().for_each(|cell| cell[lane] = cell[0]);
        }
        e.omega.iter_mut().for_each(|cell| cell[lane] = cell[0]);
        for cell in [&mut e.l, &mut e.k, &mut e.tension] {
            cell[lane] = cell[0];
        }
    }
    for cells in [&mut block.root, &mut block.root_from] {
        cells.iter_mut().for_each(|cell| cell[lane] = cell[0]);
    }
}

pub struct Device {
    pub device: RenderDevice,
    pub queue: RenderQueue,
    pub kernels: HairKernels,
    /// Whether it is a processor that plays one.
    pub is_software: bool,
}

impl Device {
    /// The one that all tests share.
    pub fn get() -> &'static Self {
        static DEVICE: OnceLock<Device> = OnceLock::new();
        DEVICE.get_or_init(|| {
            let mut app = App::new();
            app.add_plugins(windowless());
            app.finish();
            app.cleanup();
            let device = app.world().resource::<RenderDevice>().clone();
            let queue = app.world().resource::<RenderQueue>().clone();
            let kernels = HairKernels::new(&device);
            let info = app.world().resource::<RenderAdapterInfo>();
            let is_software = format!("{:?}", info.device_type) == "Cpu";
            Device { device, queue, kernels, is_software }
        })
    }

    pub fn hand_over(&self, strands: &[LabStrand]) -> GpuStrands {
        let views: Vec<StrandView<'_>> = strands.iter().map(LabStrand::view).collect();
        GpuStrands::new(&self.device, &self.kernels, &views)
    }

    /// All substeps one after the other, and what became of the strands.
    pub fn run(&self, on: &mut GpuStrands, records: &[SubstepRecord]) -> Vec<StrandState> {
        on.run(&self.device, &self.queue, &self.kernels, records);
        on.read(&self.device, &self.queue).unwrap()
    }
}

/// A substep of 1/180 s with the default settings.
pub fn plain() -> SubstepRecord {
    SubstepRecord {
        dt: 1.0 / 180.0,
        gravity: Vec3::NEG_Y * 9.8,
        retained: (-2.0f32 / 180.0).exp(),
        influence: [0.33, 0.30, 0.20, 0.17],
        bending_length: 0.13,
        damping: 0.01,
        // As the twin has it; the golden vectors hold other ratios.
        torsion: 1.0,
        skin: 1e-3,
        limiter_steps: 6,
        cuticle: default(),
        shapes: true,
        ..default()
    }
}

/// A substep of the paper's 1/360 s by its projections, with the default settings.
pub fn swept(projection: StretchProjection) -> SubstepRecord {
    let settings = Sweeps { projection, internal_damping: 4.0, ..default() };
    let dt = 1.0 / 360.0;
    SubstepRecord {
        dt,
        retained: (-2.0 * dt).exp(),
        limiter_steps: settings.limiter_steps,
        sweeps: Some(SweepRecord { settings }),
        ..plain()
    }
}

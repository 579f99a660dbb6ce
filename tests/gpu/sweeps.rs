//! Hair that the paper's projections solve: golden vectors, bits, closed forms, and in the app.

use crate::{
    lab::{Device, LabStrand, Random, swept},
    residence::grow,
    sleep::{damped, until_asleep},
    stage::{Stage, apart, curls},
    vectors::projections,
};
use bevy::{math::Isometry3d, prelude::*};
use bevy_keratin::{
    LodLevel, SolverMethod,
    StretchProjection::{Coupled, Split},
    Sweeps,
    gpu::{GpuStrands, HairResidence, SOURCE, StrandState, SubstepRecord, Unsupported, WhyCpu},
    hair::strand::StrandSleep,
    keratin::bond::model::JointBonds,
    prelude::*,
    solver::rod::{
        constraint::EPSILON,
        obstacle::{Obstacle, Solid},
    },
};

/// One projection in place of a substep. Inverse masses stand where the root's velocity does, and whether it is an
/// edge's where its tension does.
const ONE_PROJECTION: &str = "
@compute @workgroup_size(32)
fn substep(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_index) index: u32,
) {
    let block = blocks[group.x];
    if index >= block.z {
        return;
    }
    first = block.x;
    lane = index;
    edges = block.y - 1u;
    let w = moving(0u).xyz;
    let q0 = pose_in[slot(0u, 1u, 2u)];
    let q1 = pose_in[slot(1u, 1u, 2u)];
    if 0.0 < moving(0u).w {
        let shares = stretch_shares(w.x, w.y, w.z, edge(0u).x);
        let p0 = pose_in[slot(0u, 0u, 2u)].xyz;
        let c = stretch_shear(p0, pose_in[slot(1u, 0u, 2u)].xyz, q0, shares);
        set_node(0u, c.p1, 0.0);
        set_node(1u, c.p2, 0.0);
        set_frame(0u, c.q);
        set_frame(1u, normalized(q0 + c.q));
        return;
    }
    let c = bend_twist(q0, q1, pose_in[slot(2u, 1u, 2u)], bend_shares(w.x, w.y, 1.0));
    set_frame(0u, c.q1);
    set_frame(1u, c.q2);
    let one = normalized(q0 + c.q1);
    let other = normalized(q1 + c.q2);
    set_moving(0u, one.xyz, one.w);
    set_moving(1u, other.xyz, other.w);
}
";

fn turn(q: [f64; 4]) -> Quat {
    Quat::from_array(q.map(|x| x as f32))
}

fn place(p: [f64; 3]) -> Vec3 {
    Vec3::from(p.map(|x| x as f32))
}

fn size(a: &[f64]) -> f64 {
    a.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// As in tests/golden.rs: within 1e-5 of the largest component, and what rounded input makes of it.
fn same(what: &str, case: usize, found: &[f32], expected: &[f64], absolute: f64) {
    let most = expected.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    for (f, e) in found.iter().zip(expected) {
        let (off, allowed) = ((f64::from(*f) - e).abs(), 1e-5 * most + absolute);
        assert!(off <= allowed, "{what} of {case}: {found:?}, {expected:?}, {off:e} > {allowed:e}");
    }
}

pub fn golden_vectors_of_the_papers_projections() {
    const EPS: f64 = 1.0 / 16_777_216.0;
    let device = Device::get();
    let golden = projections();
    let usual = "fn substep(";
    assert_eq!(SOURCE.matches(usual).count(), 1);
    let source = SOURCE.replace(usual, "fn usual_substep(") + ONE_PROJECTION;
    let kernels = device.kernels.clone().with_substep(&device.device, &source);
    let empty = LabStrand::along(&[Vec3::ZERO, Vec3::X * 0.1, Vec3::X * 0.2]);
    let mut strands = Vec::new();
    for c in &golden.stretch_shear {
        let mut strand = empty.clone();
        strand.positions[..2].copy_from_slice(&[place(c.p0), place(c.p1)]);
        strand.orientations[0] = turn(c.q);
        strand.velocities[0] = place([c.w0, c.w1, c.wq]);
        (strand.lengths[0], strand.tensions[0]) = (c.l as f32, 1.0);
        strands.push(strand);
    }
    for c in &golden.bend_twist {
        let mut strand = empty.clone();
        strand.orientations.copy_from_slice(&[turn(c.q0), turn(c.q1)]);
        strand.root_frame = turn(c.rest_darboux);
        strand.velocities[0] = place([c.w0, c.w1, 0.0]);
        strands.push(strand);
    }
    let views: Vec<_> = strands.iter().map(LabStrand::view).collect();
    let mut on = GpuStrands::new(&device.device, &kernels, &views);
    on.run(&device.device, &device.queue, &kernels, &[swept(Coupled)]);
    let found = on.read(&device.device, &device.queue).unwrap();
    let (stretched, bent) = found.split_at(golden.stretch_shear.len());
    for (i, (c, s)) in golden.stretch_shear.iter().zip(stretched).enumerate() {
        let span = [c.p1[0] - c.p0[0], c.p1[1] - c.p0[1], c.p1[2] - c.p0[2]];
        let moved =
            EPS * (2.0 * (size(&c.p0) + size(&c.p1)) / c.l + 8.0 * (1.0 + size(&span) / c.l));
        let gamma = moved / ((c.w0 + c.w1) / c.l + 4.0 * c.wq * c.l + EPSILON);
        same("corr0", i, &s.positions[0].to_array(), &c.corr0, c.w0 * gamma);
        same("corr1", i, &s.positions[1].to_array(), &c.corr1, c.w1 * gamma);
        let turned = 2.0 * c.wq * c.l * gamma;
        same("corrq", i, &s.orientations[0].to_array(), &c.corrq, turned);
        same("q", i, &s.orientations[1].to_array(), &c.q_after, turned + 4.0 * EPS);
    }
    for (i, (c, s)) in golden.bend_twist.iter().zip(bent).enumerate() {
        let moved = 8.0 * EPS / (c.w0 + c.w1 + EPSILON);
        same("corrq0", i, &s.orientations[0].to_array(), &c.corrq0, c.w0 * moved);
        same("corrq1", i, &s.orientations[1].to_array(), &c.corrq1, c.w1 * moved);
        let after = |i: usize| s.velocities[i].extend(s.tensions[i]).to_array();
        same("q0", i, &after(0), &c.q0_after, c.w0 * moved + 4.0 * EPS);
        same("q1", i, &after(1), &c.q1_after, c.w1 * moved + 4.0 * EPS);
    }
}

/// Strands of mixed lengths that fall onto a ball and a floor.
fn strands(count: usize) -> Vec<LabStrand> {
    let mut random = Random(5);
    let mut strand = |i| {
        let strand = LabStrand::random(&mut random, 2 + i * 7 % 31, 0.5);
        strand.spinning(&mut random, 4.0)
    };
    (0..count).map(&mut strand).collect()
}

fn records(count: usize) -> Vec<SubstepRecord> {
    let solids = [
        Solid::HalfSpace { normal: Vec3::Y, point: Vec3::NEG_Y * 0.12 },
        Solid::Capsule { a: Vec3::ZERO, b: Vec3::ZERO, radius: 0.06 },
    ];
    let obstacles = solids.map(|solid| Obstacle { solid, motion: None, friction: 0.4 });
    let turn = Isometry3d::from_rotation(Quat::from_rotation_y(0.01));
    let record = |i: usize| SubstepRecord {
        obstacles: obstacles.to_vec(),
        frame_motion: (i % 4 < 2).then_some(turn),
        change: [if i.is_multiple_of(2) { -0.01 } else { 0.01 }, 0.0, 0.0, 0.0],
        ..swept(Split)
    };
    (0..count).map(record).collect()
}

fn bits(strand: &StrandState) -> Vec<u32> {
    let vectors = [&strand.positions, &strand.velocities, &strand.spins];
    let mut numbers: Vec<f32> =
        vectors.iter().flat_map(|v| v.iter().flat_map(|v| v.to_array())).collect();
    numbers.extend(strand.orientations.iter().flat_map(|q| q.to_array()));
    numbers.extend(&strand.tensions);
    for JointBonds { shapes, rates } in &strand.joints {
        numbers.extend(shapes.iter().flat_map(|s| s.to_array()).chain(*rates));
    }
    numbers.iter().map(|x| x.to_bits()).collect()
}

pub fn swept_strands_keep_their_bits() {
    let device = Device::get();
    let (strands, records) = (strands(70), records(12));
    let on = device.hand_over(&strands);
    for (strand, back) in strands.iter().zip(on.read(&device.device, &device.queue).unwrap()) {
        assert_eq!(back.spins, strand.spins);
        assert_eq!(back.tensions, strand.tensions);
        assert_eq!(back.velocities, strand.velocities);
    }
    let all = device.run(&mut device.hand_over(&strands), &records);
    for run in 1..10 {
        let mut on = device.hand_over(&strands);
        for some in records.chunks(run) {
            on.run(&device.device, &device.queue, &device.kernels, some);
        }
        let again = on.read(&device.device, &device.queue).unwrap();
        assert!(all.iter().zip(&again).all(|(a, b)| bits(a) == bits(b)), "run {run}");
    }
    // What the direct method left stays for it.
    assert!(all.iter().zip(&strands).all(|(a, b)| a.tensions == b.tensions));
    let mut fewer: Vec<LabStrand> = strands.iter().step_by(3).cloned().collect();
    fewer.reverse();
    let few = device.run(&mut device.hand_over(&fewer), &records);
    for (a, b) in all.iter().step_by(3).zip(few.iter().rev()) {
        assert_eq!(bits(a), bits(b));
    }
}

pub fn nan_stays_with_its_swept_strand() {
    let device = Device::get();
    let (sound, records) = (strands(70), records(6));
    let mut on = device.hand_over(&sound);
    let expected = device.run(&mut on, &records);
    assert_eq!(on.take_report(&device.device, &device.queue), Some(default()));
    let mut broken = sound.clone();
    broken[9].velocities[1] = Vec3::splat(f32::NAN);
    broken[23].spins[0].x = f32::INFINITY;
    broken[40].positions[1].y = f32::NAN;
    broken[55].orientations[0] = Quat::from_xyzw(f32::NAN, 0.0, 0.0, 1.0);
    broken[61].spins[1].z = f32::NAN;
    let mut on = device.hand_over(&broken);
    let found = device.run(&mut on, &records);
    let report = on.take_report(&device.device, &device.queue).unwrap();
    assert_eq!((report.put_back, report.rebuilt), (3, 2));
    let spoilt = [9, 23, 40, 55, 61];
    assert!(spoilt.contains(&report.first.unwrap()));
    for (i, (a, b)) in expected.iter().zip(&found).enumerate() {
        if spoilt.contains(&i) {
            assert!(bits(b).into_iter().all(|x| f32::from_bits(x).is_finite()), "strand {i}");
            assert_eq!(b.positions[0], sound[i].positions[0], "strand {i} keeps its root");
        } else {
            assert_eq!(bits(a), bits(b), "strand {i}");
        }
    }
}

/// The joints' share of a turn of 0.5 rad each that a strand has kept which was straight, has been held so, had its
/// bonds moved as given and was let go without weight.
fn kept(device: &Device, changes: &[[f32; 4]]) -> f32 {
    const EDGES: usize = 8;
    let frame = |i: usize| Quat::from_rotation_x(0.5 * i as f32);
    let mut points = vec![Vec3::ZERO];
    for i in 0..EDGES {
        points.push(points[i] + frame(i + 1) * Vec3::Z * 0.03);
    }
    let mut strand = LabStrand::along(&points);
    strand.root_frame = Quat::IDENTITY;
    strand.spins = vec![Vec3::ZERO; EDGES];
    strand.orientations.iter_mut().enumerate().for_each(|(i, q)| *q = frame(i + 1));
    strand.joints.fill(JointBonds::closed(Vec3::ZERO));
    let held = |change: &[f32; 4]| SubstepRecord {
        dt: 1e-6,
        gravity: Vec3::ZERO,
        change: *change,
        ..swept(Split)
    };
    let held: Vec<_> = changes.iter().map(held).collect();
    let mut on = device.hand_over(std::slice::from_ref(&strand));
    strand.joints = device.run(&mut on, &held).remove(0).joints;
    let free = swept(Split);
    let free = SubstepRecord { gravity: Vec3::ZERO, retained: (-6.0 * free.dt).exp(), ..free };
    let mut on = device.hand_over(std::slice::from_ref(&strand));
    strand.take(&device.run(&mut on, &vec![free; 1440]).remove(0));
    assert_eq!(on.take_report(&device.device, &device.queue), Some(default()));
    let full = Vec3::X * 0.25_f32.sin();
    let shares = (0..EDGES).map(|i| strand.omega(i).xyz().dot(full) / full.length_squared());
    shares.sum::<f32>() / EDGES as f32
}

pub fn closed_forms_by_the_papers_projections() {
    let device = Device::get();
    let (wet, dry) = ([-1.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]);
    let perm = [[-1.0, -1.0, -0.2, 0.0], [0.0, 1.0, 0.2, 0.0], dry];
    let sets: [(&[_], f32); 4] = [
        (&[wet, dry], 0.33),
        (&[wet, [0.5, 0.0, 0.0, 0.0]], 0.19760),
        (&perm, 0.67),
        (&[wet], 0.0),
    ];
    for (changes, expected) in sets {
        let found = kept(device, changes);
        println!("kept {found:.5}, expected {expected:.5}");
        assert!((found - expected).abs() < 0.002, "kept {found}, expected {expected}");
    }
}

/// Hair in place of what was there that the paper's projections solve.
fn grow_swept(stage: &mut Stage, on: SimulateOn, strands: Vec<Strand>) {
    grow(stage, on, strands);
    let solver = HairSolver { method: SolverMethod::Sweeps, ..default() };
    let sweeps = Sweeps { internal_damping: 4.0, ..default() };
    stage.app.world_mut().entity_mut(stage.hair).insert((solver, sweeps));
    stage.run(2);
}

fn turn_head(stage: &mut Stage, tick: usize) {
    let turn = Quat::from_rotation_y(0.4 * (0.2 * tick as f32).sin());
    stage.app.world_mut().entity_mut(stage.hair).insert(Transform::from_rotation(turn));
    stage.run(1);
}

fn spins_apart(a: &[Strand], b: &[Strand]) -> f32 {
    let spins = |s: &[Strand]| -> Vec<Vec3> {
        s.iter().flat_map(|s| s.angular_velocities().to_vec()).collect()
    };
    spins(a).iter().zip(spins(b)).map(|(a, b)| a.distance(b)).fold(0.0, f32::max)
}

pub fn swept_hair_moves_there_as_on_the_processor(stage: &mut Stage) {
    let mut both = [SimulateOn::Cpu, SimulateOn::Gpu].map(|on| {
        grow_swept(stage, SimulateOn::Cpu, curls(40, 7));
        let head = HairCollider::sphere(0.08).unwrap();
        stage.app.world_mut().spawn((head, Transform::default(), ChildOf(stage.hair)));
        stage.run(3);
        let before = (stage.bits(), stage.strands());
        stage.app.world_mut().entity_mut(stage.hair).insert(on);
        (0..30).for_each(|tick| turn_head(stage, tick));
        assert_eq!(stage.is_on_gpu(), on == SimulateOn::Gpu, "{:?}", stage.residence());
        (before, stage.strands())
    });
    let [(cpu_before, cpu), (gpu_before, gpu)] = &mut both;
    assert!(cpu_before.0 == gpu_before.0, "both on the CPU");
    let (went, off) = (apart(&cpu_before.1, cpu), apart(gpu, cpu));
    let (spun, spins) = (spins_apart(&cpu_before.1, cpu), spins_apart(gpu, cpu));
    println!("went {went} m, off by {off} m; {spun} and {spins} rad/s");
    assert!(went > 0.01 && off < 1e-3, "{off} m of {went} m");
    assert!(spun > 1.0 && spins < 0.05 * spun, "{spins} of {spun} rad/s");
    let there = stage.bits();
    assert!(Hairdo::default().apply(stage.app.world_mut(), stage.hair).is_err());
    assert!(!stage.is_on_gpu() && stage.bits() == there);
    assert!(stage.faults().is_empty());
}

pub fn another_solver_takes_over_what_the_one_left(stage: &mut Stage) {
    let mut both = [SimulateOn::Cpu, SimulateOn::Gpu].map(|on| {
        grow_swept(stage, on, curls(8, 7));
        (0..6).for_each(|tick| turn_head(stage, tick));
        let hair = stage.hair;
        let mut ticks = Vec::new();
        for (phase, method) in [SolverMethod::Direct, SolverMethod::Sweeps].into_iter().enumerate()
        {
            stage.app.world_mut().entity_mut(hair).insert(HairSolver { method, ..default() });
            turn_head(stage, 6 + 5 * phase);
            ticks.push(stage.residence());
            (7..11).for_each(|tick| turn_head(stage, tick + 5 * phase));
            ticks.push(stage.residence());
        }
        (ticks, stage.strands())
    });
    let [cpu, gpu] = &mut both;
    let away = HairResidence::Cpu(WhyCpu::Unsupported(Unsupported::OtherSolver));
    assert_eq!(gpu.0, [away, HairResidence::Gpu, away, HairResidence::Gpu]);
    let off = apart(&cpu.1, &gpu.1);
    println!("off by {off} m, {} rad/s", spins_apart(&cpu.1, &gpu.1));
    assert!(off < 1e-3, "{off}");
}

pub fn swept_followers_follow_there(stage: &mut Stage) {
    let both = [SimulateOn::Cpu, SimulateOn::Gpu].map(|on| {
        grow_swept(stage, SimulateOn::Cpu, curls(24, 7));
        let hair = stage.hair;
        let level = LodLevel::new(0.5, 2, 3).unwrap().with_strands(0.5).unwrap();
        let lod = HairLod { levels: vec![level], ..default() };
        stage.app.world_mut().entity_mut(hair).insert((lod, HairScreenShare(0.4)));
        (0..4).for_each(|tick| turn_head(stage, tick));
        stage.app.world_mut().entity_mut(hair).insert(on);
        (4..16).for_each(|tick| turn_head(stage, tick));
        assert_eq!(stage.is_on_gpu(), on == SimulateOn::Gpu, "{:?}", stage.residence());
        let is_follower =
            |e: &Entity| stage.app.world().get::<StrandSleep>(*e).unwrap().is_follower();
        let which: Vec<bool> = stage.members().iter().map(is_follower).collect();
        let mut strands = stage.strands();
        let mut of = which.iter();
        strands.retain(|_| *of.next().unwrap());
        strands
    });
    let [cpu, gpu] = &both;
    assert_eq!((cpu.len(), gpu.len()), (12, 12));
    let rest: Vec<Strand> = cpu.iter().cloned().map(|mut s| (s.rest(), s).1).collect();
    let (off, spun, spins) = (apart(cpu, gpu), spins_apart(&rest, cpu), spins_apart(cpu, gpu));
    println!("off by {off} m; {spins} of {spun} rad/s");
    assert!(off < 1e-3 && spun > 0.3 && spins < 0.05 * spun, "{off} m, {spins} of {spun} rad/s");
}

pub fn swept_nodes_are_held_there(stage: &mut Stage) {
    let both = [SimulateOn::Cpu, SimulateOn::Gpu].map(|on| {
        grow_swept(stage, on, curls(8, 7));
        stage.run(1);
        let strand = stage.members()[3];
        let start = stage.strands()[3].positions()[4];
        for tick in 0..20 {
            let place = start + Vec3::new(0.0, 1.0, 0.5) * (0.02 * (0.3 * tick as f32).sin());
            let targets = vec![None, None, None, None, Some(place)];
            stage.app.world_mut().entity_mut(strand).insert(HeldNodes { targets, ..default() });
            turn_head(stage, tick);
        }
        let held = stage.strands();
        stage.app.world_mut().entity_mut(strand).remove::<HeldNodes>();
        stage.run(10);
        assert_eq!(stage.is_on_gpu(), on == SimulateOn::Gpu, "{:?}", stage.residence());
        (start, held, stage.strands())
    });
    let [(start, held, let_go), (_, gpu_held, gpu_let_go)] = &both;
    let moved = held[3].positions()[4].distance(*start);
    let off = [apart(held, gpu_held), apart(let_go, gpu_let_go)];
    println!("moved by {moved} m; off by {off:?} m");
    assert!(moved > 1e-3 && off.iter().all(|off| *off < 1e-3), "{moved} m, {off:?} m");
}

pub fn swept_hair_sleeps_there(stage: &mut Stage) {
    grow_swept(stage, SimulateOn::Gpu, curls(8, 5));
    stage.app.world_mut().entity_mut(stage.hair).insert(damped());
    let ticks = until_asleep(stage, 1);
    assert!(stage.is_on_gpu(), "{:?}", stage.residence());
    let bits = stage.bits();
    for strand in stage.strands() {
        let moves = strand.velocities().iter().chain(strand.angular_velocities());
        assert!(moves.into_iter().all(|v| *v == Vec3::ZERO), "asleep after {ticks} ticks");
    }
    stage.run(20);
    assert!(stage.bits() == bits);
    // Whoever wakes it finds it where it was.
    turn_head(stage, 3);
    assert!(stage.bits() != bits);
}

//! Hair goes to the device and returns to the CPU, whatever happens on the way.

use crate::{
    bad, handover, lod, pairs, papers, probe, shapes, sleep,
    stage::{Stage, apart, curls, free},
    sweeps, targets,
};
use bevy::{ecs::entity_disabling::Disabled, prelude::*};
use bevy_keratin::{
    FaultKind, HairStep,
    gpu::{HairResidence, Unsupported, WhyCpu},
    hair::strand::OnGpu,
    prelude::*,
};

/// Other hair on the same device, after some ticks there: a software device takes seconds for the kernels.
pub fn on_gpu(stage: &mut Stage, count: usize, ticks: usize) {
    grow(stage, SimulateOn::Gpu, curls(count, 7));
    stage.run(1 + ticks);
    assert_eq!(stage.residence(), HairResidence::Gpu);
}

/// Other hair in place of what was there, as it was planted but for its first tick.
pub fn grow(stage: &mut Stage, on: SimulateOn, strands: Vec<Strand>) {
    stage.app.world_mut().despawn(stage.hair);
    let world = stage.app.world_mut();
    let drops: Vec<Entity> = world.query_filtered::<Entity, With<Droplet>>().iter(world).collect();
    drops.into_iter().for_each(|drop| _ = world.despawn(drop));
    stage.app.insert_resource(HairGravity::default());
    stage.app.insert_resource(HairGpu { software: true, blocking: true, ..default() });
    stage.at_once(1);
    stage.hair = Stage::spawn(&mut stage.app, on, strands);
    stage.run(1);
}

pub fn hair_goes_to_the_device_and_comes_home() {
    let mut stage = Stage::new(SimulateOn::Cpu, Vec::new());
    stage.compile();
    let all: [fn(&mut Stage); 44] = [
        hand_over_and_return_without_a_tick_change_no_bit,
        hair_on_the_device_moves_as_on_the_processor_and_comes_home_as_it_is,
        ten_runs_and_any_number_of_ticks_a_frame_give_the_same_bits,
        treatments_run_where_the_hair_is_and_cross_with_it,
        what_is_not_supported_brings_hair_home_and_is_done_there,
        a_box_brings_hair_home_before_it_passes_through,
        what_is_asked_for_within_a_tick_is_done,
        what_the_game_writes_is_kept,
        probe::probes_tell_where_strands_are,
        resets_and_restyles_work_as_on_the_processor,
        a_teleported_head_takes_its_hair_along_at_rest,
        hair_that_was_away_comes_back_at_rest,
        hairdos_are_asked_for_and_arrive,
        broken_strands_are_put_back_and_reported_once,
        bad::nan_counts_as_on_the_processor_and_is_reported_once,
        bad::what_a_game_spoils_is_mended_and_goes_back,
        bad::a_target_that_is_nan_holds_nothing,
        closed_forms_hold_through_the_app,
        targets::roots_on_a_mesh_go_with_it_there,
        targets::held_nodes_move_there_and_are_released,
        targets::held_nodes_that_have_to_give_way_do_so_on_the_cpu,
        targets::strands_are_wound_there_and_keep_their_curl,
        lod::followers_follow_there_as_on_the_processor,
        lod::a_change_of_level_is_made_on_the_processor,
        lod::a_budget_is_that_of_the_processor,
        lod::roots_of_followers_go_with_their_mesh,
        hair_is_despawned_and_levels_change_on_the_way,
        handover::whatever_happens_on_the_way_is_done,
        handover::it_comes_home_from_a_head_that_moves_as_if_it_had_stayed,
        sweeps::swept_hair_moves_there_as_on_the_processor,
        sweeps::another_solver_takes_over_what_the_one_left,
        sweeps::swept_followers_follow_there,
        sweeps::swept_nodes_are_held_there,
        sweeps::swept_hair_sleeps_there,
        shapes::a_cantilever_sags_as_on_the_processor,
        sleep::it_sleeps_when_the_last_strand_would,
        sleep::asleep_it_has_no_substeps,
        sleep::asleep_its_nodes_are_not_drawn_anew,
        sleep::whatever_disturbs_it_wakes_it_in_the_same_tick,
        sleep::sleep_is_the_same_however_many_ticks_a_frame,
        sleep::hair_with_followers_sleeps_as_well,
        sleep::a_pause_is_caught_up_with_in_some_frames,
        papers::the_papers_scenes_keep_there_what_they_keep_on_the_processor,
        pairs::features_go_together_there,
    ];
    for one in all {
        let start = std::time::Instant::now();
        one(&mut stage);
        println!("{:?}", start.elapsed());
    }
}

/// The hairdo of no hair fits nothing: it changes nothing but that the hair has to be home for it.
fn request_return(world: &mut World, hair: Entity) {
    assert!(Hairdo::default().apply(world, hair).is_err());
}

fn hand_over_and_return_without_a_tick_change_no_bit(stage: &mut Stage) {
    grow(stage, SimulateOn::Cpu, curls(40, 7));
    stage.run(9);
    let before = stage.bits();
    let hair = stage.hair;
    stage.app.world_mut().entity_mut(hair).insert(SimulateOn::Gpu);
    // Between hand-over and the first substep.
    #[derive(Resource, Default)]
    struct Seen(bool);
    let at_once = move |world: &mut World| {
        if world.get::<HairResidence>(hair) == Some(&HairResidence::Gpu) {
            world.resource_mut::<Seen>().0 = true;
            request_return(world, hair);
            // As it is: nothing moves it in this tick.
            world.entity_mut(hair).insert((SimulateOn::Cpu, Disabled));
            let members: Vec<Entity> = world.get::<Strands>(hair).unwrap().iter().collect();
            world.insert_batch(members.into_iter().map(|strand| (strand, Disabled)));
        }
    };
    use bevy::ecs::entity_disabling::Disabled;
    let between = (HairSystems::StrandHistory, HairSystems::Poses);
    stage.app.init_resource::<Seen>();
    stage.app.add_systems(HairTick, at_once.after(between.0).before(between.1));
    stage.run(1);
    assert!(stage.app.world().resource::<Seen>().0, "it was there");
    assert_eq!(stage.residence(), HairResidence::Cpu(WhyCpu::Unsupported(Unsupported::Requested)));
    assert!(stage.bits() == before, "not a bit has changed");
}

fn hair_on_the_device_moves_as_on_the_processor_and_comes_home_as_it_is(stage: &mut Stage) {
    let mut both = [SimulateOn::Cpu, SimulateOn::Gpu].map(|on| {
        grow(stage, SimulateOn::Cpu, curls(40, 7));
        let head = HairCollider::sphere(0.08).unwrap();
        stage.app.world_mut().spawn((head, Transform::default(), ChildOf(stage.hair)));
        stage.run(3);
        let before = (stage.bits(), stage.strands());
        stage.app.world_mut().entity_mut(stage.hair).insert(on);
        for tick in 0..30 {
            let turn = Quat::from_rotation_y(0.4 * (0.2 * tick as f32).sin());
            stage.app.world_mut().entity_mut(stage.hair).insert(Transform::from_rotation(turn));
            stage.run(1);
        }
        assert_eq!(stage.is_on_gpu(), on == SimulateOn::Gpu);
        (before, stage.strands())
    });
    let [(cpu_before, cpu), (gpu_before, gpu)] = &mut both;
    assert!(cpu_before.0 == gpu_before.0, "both on the CPU");
    let went = apart(&cpu_before.1, cpu);
    let off = apart(gpu, cpu);
    println!("went {went} m, off by {off} m");
    assert!(went > 0.01 && off < 1e-3, "{off} m of {went} m");
    let there = stage.bits();
    request_return(stage.app.world_mut(), stage.hair);
    assert!(stage.bits() == there);
    assert!(stage.faults().is_empty());
}

fn ten_runs_and_any_number_of_ticks_a_frame_give_the_same_bits(stage: &mut Stage) {
    let mut first = None;
    for run in 0..10 {
        grow(stage, SimulateOn::Gpu, curls(8, 5));
        stage.run(1);
        assert!(stage.is_on_gpu());
        let at_once = [1, 2, 3, 4, 6, 12][run % 6];
        stage.at_once(at_once);
        stage.run(12 / at_once as usize);
        let bits = stage.bits();
        assert!(*first.get_or_insert_with(|| bits.clone()) == bits, "run {run}");
    }
}

fn treatments_run_where_the_hair_is_and_cross_with_it(stage: &mut Stage) {
    on_gpu(stage, 6, 5);
    let hair = stage.hair;
    stage.app.world_mut().write_message(HairTreatment::wet(hair));
    stage.app.world_mut().write_message(HairTreatment::lotion(hair).joints(0..2));
    stage.run(2);
    assert!(stage.is_on_gpu());
    for bonds in stage.bonds() {
        assert!(bonds.rates(BondKind::Hydrogen).all(|rate| rate == 0.0));
        let left: Vec<f32> = bonds.rates(BondKind::Disulfide).collect();
        assert!(
            left[..2].iter().all(|r| (r - 0.8).abs() < 1e-6)
                && left[2..] == vec![1.0; left.len() - 2]
        );
    }
    // Half of a drying of a second there, the rest on the CPU.
    stage.app.world_mut().write_message(HairTreatment::dry(hair).over(1.0));
    stage.run(30);
    let half = stage.bonds()[0].rates(BondKind::Hydrogen).next().unwrap();
    assert!((0.2..0.9).contains(&half), "{half}");
    stage.app.world_mut().entity_mut(hair).insert(SimulateOn::Cpu);
    stage.run(45);
    assert!(stage.bonds().iter().all(|b| b.rates(BondKind::Hydrogen).all(|rate| rate == 1.0)));
    // Of one strand alone: it returns to the CPU for it.
    on_gpu(stage, 6, 5);
    let strand = stage.members()[2];
    stage.app.world_mut().write_message(HairTreatment::wet(strand));
    stage.run(1);
    assert_eq!(stage.residence(), HairResidence::Cpu(WhyCpu::Unsupported(Unsupported::Treatments)));
    let wet =
        |stage: &mut Stage, i: usize| stage.bonds()[i].rates(BondKind::Hydrogen).all(|r| r == 0.0);
    assert!(wet(stage, 2) && !wet(stage, 1));
}

fn what_is_not_supported_brings_hair_home_and_is_done_there(stage: &mut Stage) {
    on_gpu(stage, 6, 5);
    let hair = stage.hair;
    stage.app.world_mut().write_message(SoakHair::dripping(hair));
    stage.run(1);
    assert_eq!(stage.residence(), HairResidence::Cpu(WhyCpu::Unsupported(Unsupported::Water)));
    let water = |stage: &Stage| {
        let of = |e: Entity| stage.app.world().get::<Moisture>(e).unwrap().volume();
        stage.members().into_iter().map(of).sum::<f64>()
    };
    assert!(water(stage) > 0.0, "it is wet");
    stage.run(70);
    assert_eq!(stage.residence(), HairResidence::Cpu(WhyCpu::Unsupported(Unsupported::Water)));
    // The same without waiting: it answers when it is back.
    on_gpu(stage, 6, 5);
    let hair = stage.hair;
    stage.app.world_mut().resource_mut::<HairGpu>().blocking = false;
    stage.app.world_mut().write_message(SoakHair::dripping(hair));
    stage.run(1);
    assert_eq!(
        stage.residence(),
        HairResidence::Returning(WhyCpu::Unsupported(Unsupported::Water))
    );
    for _ in 0..20 {
        stage.run(1);
    }
    assert!(matches!(stage.residence(), HairResidence::Cpu(_)) && water(stage) > 0.0);
    // Contact, as another setting; and back once that is gone.
    on_gpu(stage, 6, 5);
    let hair = stage.hair;
    stage.app.world_mut().entity_mut(hair).insert(StrandContact::default());
    stage.run(1);
    let contact = HairResidence::Cpu(WhyCpu::Unsupported(Unsupported::StrandContact));
    assert_eq!(stage.residence(), contact);
    stage.app.world_mut().entity_mut(hair).insert(free());
    stage.run(70);
    assert_eq!(stage.residence(), HairResidence::Gpu);
    // Another strand.
    let more = curls(1, 5).remove(0);
    stage.app.world_mut().spawn((StrandOf(hair), more));
    stage.run(1);
    let regroomed = HairResidence::Cpu(WhyCpu::Unsupported(Unsupported::Regroomed));
    assert_eq!(stage.residence(), regroomed);
    // A clone of one that is there: simulated as the others are.
    on_gpu(stage, 6, 5);
    let one = stage.members()[2];
    let clone = stage.app.world_mut().entity_mut(one).clone_and_spawn();
    stage.run(1);
    assert_eq!(stage.residence(), regroomed);
    let tip =
        |stage: &Stage, e| *stage.app.world().get::<Strand>(e).unwrap().positions().last().unwrap();
    let before = tip(stage, clone);
    stage.run(3);
    assert!(!stage.app.world().entity(clone).contains::<OnGpu>());
    assert!(tip(stage, clone) != before, "it stands still");
}

/// No kernel knows of boxes. Other hair settles all the while.
fn a_box_brings_hair_home_before_it_passes_through(stage: &mut Stage) {
    on_gpu(stage, 6, 5);
    let other = Stage::spawn(&mut stage.app, SimulateOn::Cpu, curls(1, 5));
    let settling = SettleSettings { speed: 0.0, ticks: 10_000, ..default() };
    let settling = (Settling::default(), settling, Transform::from_xyz(9.0, 0.0, 0.0));
    stage.app.world_mut().entity_mut(other).insert(settling);
    stage.run(2);
    let before = stage.strands();
    let cuboid = HairCollider::cuboid(Vec3::splat(0.1)).unwrap();
    let cuboid = stage.app.world_mut().spawn((cuboid, Transform::default())).id();
    stage.run(1);
    assert!(stage.is_on_gpu() && apart(&before, &stage.strands()) == 0.0, "it moves unhindered");
    stage.run(1);
    let shape = HairResidence::Cpu(WhyCpu::Unsupported(Unsupported::ColliderShape));
    assert_eq!(stage.residence(), shape);
    for entity in [other, cuboid] {
        stage.app.world_mut().despawn(entity);
    }
}

/// Requests that are written between the substeps of a tick, for the hair and for one strand.
fn what_is_asked_for_within_a_tick_is_done(stage: &mut Stage) {
    #[derive(Resource, Default)]
    struct Request(Option<Entity>);
    stage.app.init_resource::<Request>().add_systems(
        HairTick,
        (|mut request: ResMut<Request>,
          step: Res<HairStep>,
          of: Query<(), With<Hair>>,
          mut soaks: MessageWriter<SoakHair>,
          mut treats: MessageWriter<HairTreatment>| {
            let Some(target) = request.0.take_if(|_| step.index == 2) else { return };
            match of.contains(target) {
                true => _ = soaks.write(SoakHair::dripping(target)),
                false => _ = treats.write(HairTreatment::lotion(target)),
            }
        })
        .in_set(HairSystems::Last),
    );
    for blocking in [true, false] {
        on_gpu(stage, 6, 2);
        stage.app.world_mut().resource_mut::<HairGpu>().blocking = blocking;
        let (hair, strand) = (stage.hair, stage.members()[2]);
        stage.app.world_mut().resource_mut::<Request>().0 = Some(hair);
        (0..20).for_each(|_| stage.run(1));
        let moisture = |e: Entity| stage.app.world().get::<Moisture>(e).unwrap().volume();
        let (one, other) = (moisture(strand), moisture(stage.members()[3]));
        assert!(one > 0.0 && other > 0.0, "{blocking}: {:?}", stage.residence());
        on_gpu(stage, 6, 2);
        stage.app.world_mut().resource_mut::<HairGpu>().blocking = blocking;
        let strand = stage.members()[2];
        stage.app.world_mut().resource_mut::<Request>().0 = Some(strand);
        (0..20).for_each(|_| stage.run(1));
        let rate = |stage: &mut Stage, i: usize| {
            stage.bonds()[i].rates(BondKind::Disulfide).next().unwrap()
        };
        assert!((rate(stage, 2) - 0.8).abs() < 1e-6, "once: {}", rate(stage, 2));
        assert_eq!(rate(stage, 3), 1.0);
    }
}

fn what_the_game_writes_is_kept(stage: &mut Stage) {
    on_gpu(stage, 6, 20);
    let (pushed, posed) = (stage.members()[1], stage.members()[3]);
    let there = stage.strands();
    stage.run(1);
    let world = stage.app.world_mut();
    world.get_mut::<Strand>(pushed).unwrap().velocities_mut().fill(Vec3::Y * 3.0);
    let straight: Vec<Vec3> = curls(6, 7)[3].positions().to_vec();
    world.get_mut::<Strand>(posed).unwrap().positions_mut().copy_from_slice(&straight);
    stage.run(1);
    assert_eq!(stage.residence(), HairResidence::Cpu(WhyCpu::Unsupported(Unsupported::Written)));
    let now = stage.strands();
    let tip = |strands: &[Strand], i: usize| *strands[i].positions().last().unwrap();
    let up = tip(&now, 1) - tip(&there, 1);
    assert!(up.y > 0.02 && up.length() < 0.1, "pushed from where it was: {up}");
    assert!(tip(&now, 3).distance(*straight.last().unwrap()) < 0.02, "where it was put");
    assert!(tip(&now, 2).distance(tip(&there, 2)) < 0.02, "others go on");
}

fn resets_and_restyles_work_as_on_the_processor(stage: &mut Stage) {
    on_gpu(stage, 6, 30);
    let hair = stage.hair;
    let hanging = stage.strands();
    Hair::restyle(stage.app.world_mut().entity_mut(hair));
    let bonds = stage.bonds();
    for (strand, bonds) in hanging.iter().zip(&bonds) {
        for (i, joint) in bonds.joints.iter().enumerate() {
            assert!(joint.shapes[0].distance(strand.darboux(i).xyz()) < 1e-6);
        }
    }
    on_gpu(stage, 6, 30);
    let hair = stage.hair;
    let hanging = stage.strands();
    Hair::reset(stage.app.world_mut().entity_mut(hair));
    let reset = stage.strands();
    assert!(apart(&hanging, &reset) > 5e-3);
    assert!(apart(&reset, &curls(6, 7)) < 1e-4, "as it grew");
}

fn a_teleported_head_takes_its_hair_along_at_rest(stage: &mut Stage) {
    on_gpu(stage, 6, 20);
    let hair = stage.hair;
    let before = stage.strands();
    Hair::teleport(stage.app.world_mut().entity_mut(hair));
    stage.app.world_mut().get_mut::<Transform>(hair).unwrap().translation = Vec3::X * 30.0;
    stage.run(1);
    assert!(stage.is_on_gpu());
    let after = stage.strands();
    assert!(apart(&before, &after) < 2e-3, "{}", apart(&before, &after));
    let fastest = after.iter().flat_map(|s| s.velocities()).map(|v| v.length()).fold(0.0, f32::max);
    assert!(fastest < 0.3, "a tick of gravity at most: {fastest} m/s");
}

/// Pooled, paused, hidden as in first person: carried about meanwhile, it comes back at rest, as it was.
fn hair_that_was_away_comes_back_at_rest(stage: &mut Stage) {
    let pooled = |world: &mut World, hair: Entity, away: bool| {
        let mut hair = world.entity_mut(hair);
        match away {
            true => hair.insert_recursive::<Strands>(Disabled),
            false => hair.remove_recursive::<Strands, Disabled>(),
        };
    };
    let paused = |world: &mut World, _: Entity, away: bool| {
        let mut time = world.resource_mut::<Time<Virtual>>();
        if away { time.pause() } else { time.unpause() }
    };
    let hidden = |world: &mut World, hair: Entity, away: bool| {
        let scale = Vec3::splat(if away { 1e-3 } else { 1.0 });
        world.get_mut::<Transform>(hair).unwrap().scale = scale;
    };
    let ways: [(&str, &dyn Fn(&mut World, Entity, bool)); 3] =
        [("pooled", &pooled), ("paused", &paused), ("hidden", &hidden)];
    for (name, set) in ways {
        grow(stage, SimulateOn::Gpu, curls(6, 7));
        let hair = stage.hair;
        stage.app.world_mut().entity_mut(hair).insert(AirDrag { rate: 6.0 });
        stage.at_once(4);
        stage.run(75);
        stage.at_once(1);
        assert!(stage.is_on_gpu(), "{name}");
        let before = stage.strands();
        stage.run(1);
        assert!(stage.is_on_gpu(), "{name}");
        set(stage.app.world_mut(), hair, true);
        for _ in 0..10 {
            let mut place = stage.app.world_mut().get_mut::<Transform>(hair).unwrap();
            place.translation.x += 0.12;
            place.rotate_y(0.15);
            stage.run(1);
        }
        set(stage.app.world_mut(), hair, false);
        let mut last = before.clone();
        for tick in 0..30 {
            stage.run(1);
            let now = stage.strands();
            let (off, step) = (apart(&before, &now), apart(&last, &now));
            // The strands are back from the first tick on: a tick's way from where they were.
            assert!(off < 1e-3, "{name}: {off} m off after {tick} ticks");
            assert!(step * 60.0 < 0.05, "{name}: {} m/s in tick {tick}", step * 60.0);
            last = now;
        }
        stage.run(2);
        assert!(stage.is_on_gpu(), "{name}: {:?}", stage.residence());
    }
}

fn hairdos_are_asked_for_and_arrive(stage: &mut Stage) {
    on_gpu(stage, 6, 20);
    let hair = stage.hair;
    #[derive(Resource, Default)]
    struct Taken(Option<Hairdo>);
    stage.app.init_resource::<Taken>();
    stage.app.world_mut().entity_mut(hair).observe(
        |taken: On<HairdoCaptured>, mut all: ResMut<Taken>| all.0 = Some(taken.hairdo.clone()),
    );
    let refused = Hairdo::of(stage.app.world(), hair).unwrap_err();
    assert!(refused.to_string().contains("CaptureHairdo"), "{refused}");
    stage.app.world_mut().trigger(CaptureHairdo { entity: hair });
    stage.app.world_mut().flush();
    for _ in 0..20 {
        stage.run(1);
    }
    let hairdo = stage.app.world_mut().resource_mut::<Taken>().0.take().expect("it arrived");
    assert!(stage.is_on_gpu(), "and stayed there");
    // Of the moment when it was asked for, not of the hand-over.
    let grown = curls(6, 7);
    let places = |i: usize| hairdo.strands()[i].positions().to_vec();
    assert!(places(2).last().unwrap().distance(*grown[2].positions().last().unwrap()) > 5e-3);
    let bytes = hairdo.to_bytes();
    Hairdo::from_bytes(&bytes).unwrap().apply(stage.app.world_mut(), hair).unwrap();
    assert!(!stage.is_on_gpu(), "what is put on is put on strands");
    assert!(Hairdo::of(stage.app.world(), hair).unwrap().to_bytes() == bytes);
}

fn broken_strands_are_put_back_and_reported_once(stage: &mut Stage) {
    grow(stage, SimulateOn::Cpu, curls(40, 7));
    let (hair, broken) = (stage.hair, stage.members()[17]);
    stage.app.world_mut().entity_mut(hair).insert(SimulateOn::Gpu);
    let mut strand = stage.app.world_mut().get_mut::<Strand>(broken).unwrap();
    strand.bypass_change_detection().positions_mut()[3] = Vec3::NAN;
    let mut faults = Vec::new();
    for _ in 0..30 {
        stage.run(1);
        faults.extend(stage.faults());
    }
    assert!(stage.is_on_gpu());
    assert_eq!(faults.len(), 1, "{faults:?}");
    assert_eq!((faults[0].entity, faults[0].kind), (Some(broken), FaultKind::Rebuilt));
    assert!(stage.strands().iter().all(Strand::is_finite));
}

fn hair_is_despawned_and_levels_change_on_the_way(stage: &mut Stage) {
    on_gpu(stage, 6, 5);
    stage.app.world_mut().resource_mut::<HairGpu>().blocking = false;
    // On the way home.
    stage.app.world_mut().entity_mut(stage.hair).insert(SimulateOn::Cpu);
    stage.run(1);
    stage.app.world_mut().entity_mut(stage.hair).despawn();
    stage.run(5);
    // A strand of another, and the whole of a third.
    let [a, b] = [0, 1].map(|_| Stage::spawn(&mut stage.app, SimulateOn::Gpu, curls(5, 6)));
    stage.run(3);
    let strand = stage.app.world().get::<Strands>(a).unwrap().iter().next().unwrap();
    stage.app.world_mut().entity_mut(strand).despawn();
    stage.app.world_mut().entity_mut(b).despawn();
    stage.run(10);
    stage.hair = a;
    assert_eq!(stage.members().len(), 4);
    assert!(stage.strands().iter().all(Strand::is_finite));
    // The hair's component alone is taken away.
    stage.run(70);
    assert_eq!(stage.residence(), HairResidence::Gpu);
    stage.app.world_mut().entity_mut(a).remove::<Hair>();
    stage.run(5);
    assert!(!stage.is_on_gpu());
}

fn closed_forms_hold_through_the_app(stage: &mut Stage) {
    use HairTreatment as T;
    // Level strands, each of another hair: they are wet and dried as they hang.
    let straight: Vec<Vec3> = (0..9).map(|i| Vec3::X * (0.02 * i as f32)).collect();
    let mut grow = || {
        let strand = Strand::from_polyline(&straight).unwrap();
        let hair = Stage::spawn(&mut stage.app, SimulateOn::Gpu, vec![strand]);
        let even = Cuticle { damage: 0.0, ..default() };
        stage.app.world_mut().entity_mut(hair).insert((AirDrag { rate: 6.0 }, even));
        hair
    };
    let hairs = [(); 5].map(|()| grow());
    stage.at_once(10);
    stage.run(2);
    let [dried, half, permed, washed, straightened] = hairs;
    let write = |stage: &mut Stage, all: Vec<T>| {
        all.into_iter().for_each(|one| _ = stage.app.world_mut().write_message(one));
    };
    write(stage, vec![T::wet(dried), T::wet(half), T::lotion(permed), T::shampoo(washed)]);
    write(stage, vec![T::lotion(straightened)]);
    stage.run(18);
    let held = hairs.map(|hair| {
        stage.hair = hair;
        stage.strands().remove(0)
    });
    let to_half = T::set(half, BondKind::Hydrogen, 0.5).unwrap();
    write(stage, vec![T::dry(dried), to_half, T::neutraliser(permed), T::neutraliser(washed)]);
    write(stage, vec![T::neutraliser(straightened)]);
    stage.at_once(1);
    stage.run(1);
    write(stage, vec![T::dry(permed), T::dry(washed), T::dry(straightened)]);
    stage.run(1);
    stage.at_once(10);
    stage.app.insert_resource(HairGravity(Vec3::ZERO));
    stage.run(18);
    let keeps = |stage: &mut Stage, which: usize, expected: f32| {
        stage.hair = hairs[which];
        assert!(stage.is_on_gpu(), "{:?}", stage.residence());
        let (now, held) = (stage.strands().remove(0), &held[which]);
        let joints = || (0..now.edges()).map(|i| (now.darboux(i).xyz(), held.darboux(i).xyz()));
        let square: f32 = joints().map(|(_, held)| held.length_squared()).sum();
        let kept = joints().map(|(now, held)| now.dot(held)).sum::<f32>() / square;
        println!("kept {kept:.5}, expected {expected:.5}");
        assert!((kept - expected).abs() < 0.002, "kept {kept}, expected {expected}");
    };
    for (which, expected) in [0.33, 0.19760, 0.67, 0.63, 0.67].into_iter().enumerate() {
        keeps(stage, which, expected);
    }
    // A perm that is washed, and one that is held straight from washing to drying.
    stage.hair = straightened;
    let strand = stage.members()[0];
    let targets: Vec<_> = straight.iter().map(|p| (p.x > 0.0).then_some(*p)).collect();
    stage.app.world_mut().entity_mut(strand).insert(HeldNodes { targets, ..default() });
    stage.at_once(1);
    stage.run(3);
    write(stage, vec![T::shampoo(permed), T::shampoo(straightened)]);
    stage.run(2);
    write(stage, vec![T::neutraliser(straightened)]);
    stage.run(1);
    write(stage, vec![T::dry(straightened)]);
    stage.run(1);
    stage.app.world_mut().entity_mut(strand).remove::<HeldNodes>();
    stage.at_once(10);
    stage.run(18);
    keeps(stage, 2, 0.04 / 0.37);
    keeps(stage, 4, 0.04);
    hairs[..3].iter().for_each(|hair| _ = stage.app.world_mut().despawn(*hair));
}

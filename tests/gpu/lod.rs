//! Levels of detail: strands that are not simulated follow others there as on the CPU.

use crate::{
    residence::grow,
    stage::{Stage, apart, curls},
    targets::{moved, scalp, tied},
};
use bevy::prelude::*;
use bevy_keratin::{
    HairEstimate, LodLevel, PresentLod,
    gpu::{HairResidence, Unsupported, WhyCpu},
    hair::strand::StrandSleep,
    prelude::*,
};

/// Half of the strands, an eighth, none.
fn levels() -> HairLod {
    let level =
        |below: f32, share: f32| LodLevel::new(below, 2, 3).unwrap().with_strands(share).unwrap();
    HairLod { levels: vec![level(0.5, 0.5), level(0.2, 0.125), level(0.05, 0.0)], ..default() }
}

fn level_of_detail() -> WhyCpu {
    WhyCpu::Unsupported(Unsupported::LevelOfDetail)
}

/// Strands that are followers.
fn followers(stage: &Stage) -> usize {
    let is_follower = |e: &Entity| stage.app.world().get::<StrandSleep>(*e).unwrap().is_follower();
    stage.members().iter().filter(|e| is_follower(e)).count()
}

fn turn_head(stage: &mut Stage, tick: usize) {
    let t = tick as f32 / 60.0;
    let turn = Quat::from_rotation_y(0.4 * (12.0 * t).sin());
    let place = Transform::from_rotation(turn).with_translation(Vec3::X * 0.05 * (9.0 * t).sin());
    stage.app.world_mut().entity_mut(stage.hair).insert(place);
    stage.run(1);
}

pub fn followers_follow_there_as_on_the_processor(stage: &mut Stage) {
    let mut both = [SimulateOn::Cpu, SimulateOn::Gpu].map(|on| {
        grow(stage, SimulateOn::Cpu, curls(48, 7));
        let hair = stage.hair;
        stage.app.world_mut().entity_mut(hair).insert((levels(), HairScreenShare(0.4)));
        (0..4).for_each(|tick| turn_head(stage, tick));
        assert_eq!(followers(stage), 24);
        stage.app.world_mut().entity_mut(hair).insert(on);
        let before = stage.strands();
        (4..16).for_each(|tick| turn_head(stage, tick));
        // Bonds act on followers as well: they remember the shape of that moment.
        stage.app.world_mut().write_message(HairTreatment::wet(hair));
        turn_head(stage, 16);
        stage.app.world_mut().write_message(HairTreatment::dry(hair).over(0.1));
        (17..30).for_each(|tick| turn_head(stage, tick));
        assert_eq!(stage.is_on_gpu(), on == SimulateOn::Gpu, "{:?}", stage.residence());
        assert_eq!(followers(stage), 24);
        (before, stage.strands(), stage.bonds())
    });
    let [cpu, gpu] = &mut both;
    let is_follower =
        |stage: &Stage, e: &Entity| stage.app.world().get::<StrandSleep>(*e).unwrap().is_follower();
    let members = stage.members();
    let (mut fastest, mut farthest) = (0.0f32, 0.0f32);
    for (i, strand) in members.iter().enumerate().filter(|(_, e)| is_follower(stage, e)) {
        let (a, b) = (&cpu.1[i], &gpu.1[i]);
        let went = apart(&cpu.0[i..=i], &cpu.1[i..=i]);
        assert!(went > 1e-4, "{strand} went {went} m");
        farthest = farthest.max(went);
        for (a, b) in a.velocities().iter().zip(b.velocities()) {
            fastest = fastest.max(a.length());
            assert!(a.distance(*b) < 0.05, "{a} and {b} m/s");
        }
        for (a, b) in cpu.2[i].joints.iter().zip(&gpu.2[i].joints) {
            assert!(a.shapes[0].distance(b.shapes[0]) < 5e-3 && a.rates == b.rates);
            assert!(a.shapes[0].distance(a.shapes[3]) > 1e-5, "hydrogen remembers another shape");
        }
    }
    println!("off by {} m, up to {fastest} m/s", apart(&cpu.1, &gpu.1));
    assert!(apart(&cpu.1, &gpu.1) < 1e-3 && fastest > 0.3 && farthest > 5e-3, "{farthest}");
}

pub fn a_change_of_level_is_made_on_the_processor(stage: &mut Stage) {
    let mut both = [SimulateOn::Cpu, SimulateOn::Gpu].map(|on| {
        grow(stage, on, curls(48, 7));
        let hair = stage.hair;
        stage.app.world_mut().entity_mut(hair).insert((levels(), HairScreenShare(0.4)));
        let mut counts = Vec::new();
        let mut away = 0;
        let mut jump = 0.0f32;
        let mut last = stage.strands();
        // Smaller, larger than all levels, small, not simulated at all.
        for (phase, share) in [0.4, 0.15, 1.0, 0.15, 0.01].into_iter().enumerate() {
            stage.app.world_mut().entity_mut(hair).insert(HairScreenShare(share));
            for tick in 0..8 {
                turn_head(stage, 8 * phase + tick);
                away += usize::from(!stage.is_on_gpu());
                let now = stage.strands();
                jump = jump.max(apart(&last, &now));
                last = now;
            }
            counts.push(followers(stage));
            let there = on == SimulateOn::Gpu && share > 0.1;
            assert_eq!(stage.is_on_gpu(), there, "{share}: {:?}", stage.residence());
        }
        assert_eq!(counts, [24, 42, 0, 42, 48]);
        (away, jump, last)
    });
    let [cpu, gpu] = &mut both;
    println!("{} ticks on the CPU; jumps of {} and {} m", gpu.0, cpu.1, gpu.1);
    assert_eq!(stage.residence(), HairResidence::Cpu(level_of_detail()));
    assert!(gpu.0 < 20 && gpu.1 < 1.2 * cpu.1 + 1e-3);
    stage.app.world_mut().entity_mut(stage.hair).insert(HairScreenShare(1.0));
    (0..3).for_each(|tick| turn_head(stage, tick));
    assert!(stage.is_on_gpu());
    // Who holds another strand changes which may follow.
    stage.app.world_mut().entity_mut(stage.hair).insert(HairScreenShare(0.4));
    (0..4).for_each(|tick| turn_head(stage, tick));
    assert!(stage.is_on_gpu() && followers(stage) == 24, "{:?}", stage.residence());
    let members = stage.members();
    let follows = |e: &&Entity| stage.app.world().get::<StrandSleep>(**e).unwrap().is_follower();
    let follower = *members.iter().find(follows).unwrap();
    let targets = vec![None, None, None, Some(Vec3::Y * 0.1)];
    stage.app.world_mut().entity_mut(follower).insert(HeldNodes { targets, ..default() });
    stage.run(1);
    assert_eq!(stage.residence(), HairResidence::Cpu(level_of_detail()));
    stage.run(2);
    let sleep = |stage: &Stage| *stage.app.world().get::<StrandSleep>(follower).unwrap();
    assert!(stage.is_on_gpu() && !sleep(stage).is_follower());
    stage.run(5);
    assert!(stage.faults().iter().all(|fault| fault.entity == Some(follower)));
}

pub fn a_budget_is_that_of_the_processor(stage: &mut Stage) {
    grow(stage, SimulateOn::Gpu, curls(48, 7));
    let hair = stage.hair;
    stage.app.world_mut().entity_mut(hair).insert((levels(), HairScreenShare(0.4)));
    (0..4).for_each(|tick| turn_head(stage, tick));
    assert!(stage.is_on_gpu() && followers(stage) == 24);
    stage.app.insert_resource(HairBudget { milliseconds: 1e-6, ..default() });
    (0..4).for_each(|tick| turn_head(stage, tick));
    assert!(stage.is_on_gpu() && followers(stage) == 24, "{:?}", stage.residence());
    assert_eq!(*stage.app.world().resource::<HairEstimate>(), HairEstimate::default());
    // Frozen by the budget, or only made coarser, it goes as soon as it may, at the level of its size, and stays.
    for (milliseconds, coarse) in [(1e-6, 48), (0.1, 24)] {
        let budget = HairBudget { milliseconds, ..default() };
        stage.app.insert_resource(HairBudget::default());
        grow(stage, SimulateOn::Cpu, curls(48, 7));
        let hair = stage.hair;
        stage.app.world_mut().entity_mut(hair).insert((levels(), HairScreenShare(1.0)));
        stage.app.insert_resource(budget);
        (0..4).for_each(|tick| turn_head(stage, tick));
        let lod = |stage: &Stage| *stage.app.world().get::<PresentLod>(hair).unwrap();
        assert!(lod(stage).budget_levels > 0 && followers(stage) == coarse, "{:?}", lod(stage));
        let estimate = |stage: &Stage| *stage.app.world().resource::<HairEstimate>();
        assert!(estimate(stage).present > 0.0);
        stage.app.world_mut().entity_mut(hair).insert(SimulateOn::Gpu);
        let mut away = 0;
        for tick in 4..30 {
            // Smaller on the way, which costs another visit to the CPU.
            let share = if tick < 14 { 1.0 } else { 0.4 };
            stage.app.world_mut().entity_mut(hair).insert(HairScreenShare(share));
            turn_head(stage, tick);
            away += usize::from(!stage.is_on_gpu());
        }
        println!("{milliseconds} ms: {away} of 26 ticks on the CPU");
        assert!(away <= 4 && stage.is_on_gpu(), "{away}: {:?}", stage.residence());
        assert_eq!((lod(stage).budget_levels, followers(stage)), (0, 24));
        assert_eq!(estimate(stage), HairEstimate::default());
        // What cannot go for another reason has what the budget leaves it.
        let parts = (StrandContact::default(), HairScreenShare(1.0));
        stage.app.world_mut().entity_mut(hair).insert(parts);
        (30..36).for_each(|tick| turn_head(stage, tick));
        let contact = HairResidence::Cpu(WhyCpu::Unsupported(Unsupported::StrandContact));
        assert_eq!(stage.residence(), contact);
        assert!(estimate(stage).present > 0.0 && lod(stage).budget_levels > 0);
        stage.app.insert_resource(HairBudget::default());
        (36..38).for_each(|tick| turn_head(stage, tick));
        assert_eq!(lod(stage).budget_levels, 0);
    }
}

pub fn roots_of_followers_go_with_their_mesh(stage: &mut Stage) {
    let mesh = scalp(stage);
    let mut both = [SimulateOn::Cpu, SimulateOn::Gpu].map(|on| {
        grow(stage, SimulateOn::Cpu, curls(40, 7));
        let hair = stage.hair;
        stage.app.world_mut().entity_mut(mesh).insert(Transform::default());
        let parts = (tied(mesh, 40), levels(), HairScreenShare(0.4));
        stage.app.world_mut().entity_mut(hair).insert(parts);
        (0..5).for_each(|tick| moved(stage, mesh, tick));
        stage.app.world_mut().entity_mut(hair).insert(on);
        (5..25).for_each(|tick| moved(stage, mesh, tick));
        assert_eq!(stage.is_on_gpu(), on == SimulateOn::Gpu, "{:?}", stage.residence());
        assert_eq!(followers(stage), 20);
        stage.strands()
    });
    let [cpu, gpu] = &mut both;
    println!("off by {} m", apart(cpu, gpu));
    assert!(apart(cpu, gpu) < 1e-3);
    stage.app.world_mut().despawn(mesh);
}

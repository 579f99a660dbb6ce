//! Strands stiffer and softer than others of their hair.

use crate::common::*;
use bevy::prelude::*;
#[cfg(feature = "gpu")]
use bevy_keratin::{HairResidence, Unsupported, WhyCpu};
use bevy_keratin::{SolverMethod, authoring::groom::GroomStrand, prelude::*};

const LENGTH: f32 = 0.06;
const SHARES: [Option<f32>; 5] = [None, Some(0.5), Some(1.0), Some(4.0), Some(16.0)];

/// Level strands of 6 cm, each with its share of the stiffness.
fn level(app: &mut App) -> (Entity, Vec<Entity>) {
    app.insert_resource(HairDefault(Cuticle { damage: 0.0, ..default() }));
    let hair = app.world_mut().spawn(Hair).id();
    let grow = |(i, share): (usize, Option<f32>)| {
        let node = |k: usize| Vec3::new(LENGTH * k as f32 / 16.0, 0.0, 0.05 * i as f32);
        let strand = Strand::from_polyline(&(0..17).map(node).collect::<Vec<_>>()).unwrap();
        let strand = app.world_mut().spawn((StrandOf(hair), strand)).id();
        if let Some(share) = share {
            app.world_mut()
                .entity_mut(strand)
                .insert(StrandMaterial { stiffness: share, ..default() });
        }
        strand
    };
    let strands = SHARES.into_iter().enumerate().map(grow).collect();
    (hair, strands)
}

fn sags(app: &App, strands: &[Entity]) -> Vec<f32> {
    strands.iter().map(|id| -strand(app, *id).positions()[16].y).collect()
}

/// Of a cantilever under its own weight, w L⁴/(8 E I) = L⁴/(8 L_g³).
fn sag(share: f32) -> f32 {
    let bending_length = HairStiffness::default().bending_length;
    LENGTH.powi(4) / (8.0 * share * bending_length.powi(3))
}

#[test]
fn the_sag_of_a_level_strand_is_that_of_its_own_stiffness() {
    let mut app = test_app(60.0);
    let (_, strands) = level(&mut app);
    run(&mut app, 4.0);
    let found = sags(&app, &strands);
    for (found, share) in found.iter().zip(SHARES) {
        let expected = sag(share.unwrap_or(1.0));
        assert!((found / expected - 1.0).abs() < 0.02, "{found} for {expected}, {share:?}");
    }
    assert!((found[0] / found[2] - 1.0).abs() < 1e-3, "a share of 1 is the hair's own: {found:?}");
    assert_eq!(faults(&mut app), []);

    // All sleep. One that is made softer, and one that is as stiff as its hair again, go to their new sag.
    app.insert_resource(HairDefault(SleepSettings { seconds: 0.2, ..default() }));
    run(&mut app, 3.0);
    let asleep = |app: &App, id| app.world().get::<StrandSleep>(id).unwrap().is_asleep();
    assert!(strands.iter().all(|id| asleep(&app, *id)));
    app.world_mut().get_mut::<StrandMaterial>(strands[3]).unwrap().stiffness = 0.5;
    app.world_mut().entity_mut(strands[4]).remove::<StrandMaterial>();
    run(&mut app, 0.1);
    assert!(!asleep(&app, strands[3]) && !asleep(&app, strands[4]) && asleep(&app, strands[1]));
    run(&mut app, 4.0);
    let found = sags(&app, &strands);
    assert!((found[3] / sag(0.5) - 1.0).abs() < 0.02, "{found:?}");
    assert!((found[4] / sag(1.0) - 1.0).abs() < 0.02, "{found:?}");
}

#[test]
fn shares_out_of_range_are_reported_once_and_the_nearest_acts() {
    let mut app = test_app(60.0);
    let (_, strands) = level(&mut app);
    run(&mut app, 0.1);
    app.world_mut().entity_mut(strands[0]).insert(StrandMaterial { stiffness: -3.0, ..default() });
    app.world_mut().entity_mut(strands[1]).insert(StrandMaterial { stiffness: 1e9, ..default() });
    run(&mut app, 2.0);
    let reported = faults(&mut app);
    assert_eq!(reported.len(), 2, "{reported:?}");
    let says = "StrandMaterial::stiffness is -3, expected 0.01 to 100";
    assert!(reported.iter().any(|fault| fault.message.contains(says)), "{reported:?}");
    let worst = strands.iter().map(|id| strand(&app, *id).peak_strain()).fold(0.0, f32::max);
    assert!(worst < 0.01, "{worst}");
    assert!(sags(&app, &strands)[1] < 1e-4);
}

/// The stiffest and softest beside each other, while the head is shaken, by both solvers.
#[test]
fn strands_of_any_share_keep_their_lengths_on_a_shaken_head() {
    for method in [SolverMethod::Direct, SolverMethod::Sweeps] {
        let mut app = test_app(60.0);
        let (hair, strands) = level(&mut app);
        app.world_mut().entity_mut(hair).insert(HairSolver { method, ..default() });
        for (id, share) in strands.iter().zip([0.01, 0.1, 1.0, 10.0, 100.0]) {
            app.world_mut()
                .entity_mut(*id)
                .insert(StrandMaterial { stiffness: share, ..default() });
        }
        let mut worst = 0.0_f32;
        for tick in 0..120 {
            let turn = Quat::from_rotation_y((0.25 * tick as f32).sin());
            app.world_mut().get_mut::<Transform>(hair).unwrap().rotation = turn;
            app.update();
            for id in &strands {
                worst = worst.max(strand(&app, *id).peak_strain());
            }
        }
        println!("{method:?}: {worst}");
        assert!(worst < 0.05, "{method:?}: {worst}");
        assert_eq!(faults(&mut app), []);
    }
}

#[test]
#[cfg(feature = "gpu")]
fn the_gpu_leaves_such_hair_to_the_processor() {
    let mut app = test_app(60.0);
    let (hair, strands) = level(&mut app);
    let free = StrandContact { strength: 0.0, ..default() };
    app.world_mut().entity_mut(hair).insert((SimulateOn::Gpu, free));
    run(&mut app, 0.1);
    let why = |app: &App| *app.world().get::<HairResidence>(hair).unwrap();
    // Without a device that comes first.
    let is = HairResidence::Cpu(WhyCpu::Unsupported(Unsupported::StrandMaterial));
    assert!(
        why(&app) == is || why(&app) == HairResidence::Cpu(WhyCpu::NoRenderer),
        "{:?}",
        why(&app)
    );
    assert!(Unsupported::StrandMaterial.to_string().contains("own stiffness"));
    assert!(strands.iter().all(|id| strand(&app, *id).is_finite()));
}

/// From a groom to its simulated strands, whichever these are.
#[test]
fn strands_have_the_stiffness_of_their_groom() {
    let root = |i: usize| Vec3::X * 0.01 * i as f32;
    let lines = (0..20).map(|i| [root(i), root(i) + Vec3::Y * 0.1]);
    let shares: Vec<f32> = (0..20).map(|i| 0.5 + 0.1 * i as f32).collect();
    let groom = Groom::from_polylines(lines).unwrap();
    let group = |name: &str| GroomGroup { name: name.to_owned(), ..default() };
    let groom = groom
        .with_stiffness(shares.clone())
        .and_then(|groom| {
            let of = (0..20).map(|i| i % 2).collect();
            groom.with_groups(vec![group("even"), group("odd")], of)
        })
        .unwrap();
    let mut app = test_app(60.0);
    let hair = app.world_mut().spawn(Hair).id();
    let guides = GroomGuides { count: 8, ..default() };
    let strands = groom.spawn(&mut app.world_mut().commands(), hair, &guides).unwrap();
    app.world_mut().flush();
    assert_eq!(strands.len(), 8);
    for id in strands {
        let place = strand(&app, id).positions()[0].x;
        let own = app.world().get::<StrandMaterial>(id).unwrap().stiffness;
        assert_eq!(own, shares[(place / 0.01).round() as usize]);
    }
    let odd = |strand: &GroomStrand| strand.group.is_some_and(|group| group.name == "odd");
    assert_eq!(groom.strands().filter(odd).count(), 10);
    let damped = groom.clone().with_damping(shares.clone()).unwrap();
    let damped = damped.spawn(&mut app.world_mut().commands(), hair, &guides).unwrap();
    app.world_mut().flush();
    for id in damped {
        let own = app.world().get::<StrandMaterial>(id).unwrap();
        assert_eq!(own.damping, own.stiffness, "of the same strand");
    }
    let error = groom.clone().with_damping(vec![-1.0; 20]).unwrap_err().to_string();
    assert!(error.contains("damping 0 of strand 0 is -1, expected a share of 0 to 100"), "{error}");
    let error = groom.clone().with_stiffness(vec![0.0; 20]).unwrap_err().to_string();
    assert!(error.contains("stiffness 0 of strand 0 is 0, expected a share of 0.01"), "{error}");
    assert!(groom.with_stiffness(vec![1.0; 3]).is_err());
}

#[test]
#[cfg(feature = "render")]
fn drawn_strands_are_as_wide_beside_each_other_as_in_their_groom() {
    use bevy_keratin::render::FollowerRoots;
    let root = |i: usize| Vec3::X * 0.01 * i as f32;
    let lines = (0..4).map(|i| [root(i), root(i) + Vec3::Y * 0.1]);
    let groom = Groom::from_polylines(lines).unwrap();
    let widths = [1e-4, 1e-4, 2e-4, 2e-4, 3e-4, 1e-4, 4e-4, 4e-4];
    let groom = groom.with_widths(widths.to_vec()).unwrap();
    let mut app = test_app(60.0);
    let hair = app.world_mut().spawn(Hair).id();
    let guides = GroomGuides { count: 1, ..default() };
    let [guide] = groom.spawn(&mut app.world_mut().commands(), hair, &guides).unwrap()[..] else {
        panic!("one guide");
    };
    app.world_mut().flush();
    let simulated = (strand(&app, guide).positions()[0].x / 0.01).round() as usize;
    let mean = widths.iter().sum::<f32>() / 8.0;
    let expected = (0..4).filter(|i| *i != simulated);
    let expected: Vec<f32> =
        expected.map(|i| 0.5 * (widths[2 * i] + widths[2 * i + 1]) / mean).collect();
    let roots = &app.world().get::<FollowerRoots>(hair).unwrap().0;
    let found: Vec<f32> = roots.iter().map(|root| root.width).collect();
    for (found, expected) in found.iter().zip(&expected) {
        assert!((found / expected - 1.0).abs() < 1e-5, "{found} for {expected}");
    }
    assert_eq!(found.len(), 3);
}

/// One strand of a hair swings as one of another hair that is damped as much.
#[test]
fn a_strand_is_damped_by_its_own_share() {
    let mut app = test_app(60.0);
    app.insert_resource(HairDefault(SleepSettings::never()));
    let grow = |app: &mut App, damping: f32, shares: &[Option<f32>]| -> Vec<Entity> {
        let stiffness = HairStiffness { damping, ..default() };
        let hair = app.world_mut().spawn((Hair, stiffness)).id();
        let mut grown = Vec::new();
        for (i, share) in shares.iter().enumerate() {
            let node = |k: usize| Vec3::new(0.01 * k as f32, 0.0, 0.05 * i as f32);
            let strand = Strand::from_polyline(&(0..16).map(node).collect::<Vec<_>>()).unwrap();
            let strand = app.world_mut().spawn((StrandOf(hair), strand)).id();
            if let Some(damping) = *share {
                app.world_mut().entity_mut(strand).insert(StrandMaterial { damping, ..default() });
            }
            grown.push(strand);
        }
        grown
    };
    let own = grow(&mut app, 0.01, &[None, Some(1.0), Some(4.0), Some(0.0)]);
    let (usual, more) = (grow(&mut app, 0.01, &[None])[0], grow(&mut app, 0.04, &[None])[0]);
    let none = grow(&mut app, 0.0, &[None])[0];
    let tip = |app: &App, id: Entity| strand(app, id).positions()[15].xy();
    let (mut farthest, mut apart) = ([0.0_f32; 4], 0.0_f32);
    for _ in 0..120 {
        app.update();
        let others = [usual, usual, more, none];
        for ((own, other), farthest) in own.iter().zip(others).zip(&mut farthest) {
            *farthest = farthest.max(tip(&app, *own).distance(tip(&app, other)));
        }
        apart = apart.max(tip(&app, usual).distance(tip(&app, more)));
    }
    println!("{farthest:?} of {apart}");
    assert!(apart > 0.01, "damping shows: {apart}");
    assert!(farthest.iter().all(|far| *far < 1e-5), "{farthest:?}");
    assert_eq!(faults(&mut app), []);
}

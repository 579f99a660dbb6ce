//! A groom that changes while hair is grown from it: the hair follows it, and keeps what has been done to it.
#![cfg(feature = "save")]

use crate::{
    common::*,
    wear::{self, worn},
    worlds_measured::wearer::character,
};
use bevy::{
    asset::{
        AssetPlugin,
        io::{
            AssetSourceBuilder, AssetSourceId,
            memory::{Dir, MemoryAssetReader},
        },
    },
    prelude::*,
    time::TimeUpdateStrategy,
};
use bevy_keratin::{authoring::groom::alembic, prelude::*};
use std::path::Path;

const LENGTH: f32 = 0.12;

/// A row of level strands that bend to the side by so much at their tips (m), as a file.
fn file(strands: usize, nodes: usize, bend: f32) -> Vec<u8> {
    let line = |i: usize| {
        (0..nodes).map(move |k| {
            let t = k as f32 / (nodes - 1) as f32;
            Vec3::new(LENGTH * t, 0.0, 0.12 * i as f32 / strands as f32 + bend * t * t)
        })
    };
    alembic::write(&Groom::from_polylines((0..strands).map(line)).unwrap()).unwrap()
}

fn app(dir: &Dir) -> App {
    let mut app = App::new();
    let dir = dir.clone();
    let source = AssetSourceBuilder::new(move || Box::new(MemoryAssetReader { root: dir.clone() }));
    app.register_asset_source(AssetSourceId::Default, source)
        .add_plugins((MinimalPlugins, AssetPlugin::default(), HairPlugins::default()))
        .insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
    ready(&mut app);
    app.update();
    app
}

fn members(app: &App, hair: Entity) -> Vec<Entity> {
    app.world().get::<Strands>(hair).map_or_else(Vec::new, |all| all.iter().collect())
}

fn kept(app: &App, hair: Entity) -> f32 {
    app.world().get::<KeptStyle>(hair).and_then(KeptStyle::kept).expect("a style")
}

/// Puts another version of the file in its place, and waits until hair has grown from it.
fn reload(app: &mut App, dir: &Dir, hair: Entity, bytes: Vec<u8>) {
    let before = members(app, hair);
    dir.insert_asset(Path::new("bob.abc"), bytes);
    app.world().resource::<AssetServer>().reload("bob.abc");
    wait_for(app, |app| {
        let now = members(app, hair);
        // But for the game's own.
        (now.iter().filter(|member| before.contains(member)).count() <= 1).then_some(())
    });
}

/// Wets and dries the hair where it hangs, and watches that style, of which half is left then.
fn style(app: &mut App, hair: Entity) {
    app.world_mut().write_message(HairTreatment::wet(hair));
    run(app, 1.5);
    app.world_mut().write_message(HairTreatment::dry(hair));
    run(app, 0.2);
    app.world_mut().entity_mut(hair).insert(HairStyle { fades_below: 0.1 });
    run(app, 0.1);
    app.world_mut().write_message(HairTreatment::set(hair, BondKind::Hydrogen, 0.4).unwrap());
    run(app, 0.2);
}

#[test]
fn hair_follows_a_changed_file_and_keeps_its_hairdo() {
    let dir = Dir::default();
    dir.insert_asset(Path::new("bob.abc"), file(12, 9, 0.0));
    let mut app = app(&dir);
    let groom = app.world().resource::<AssetServer>().load("bob.abc");
    let guides = GroomGuides { count: 100, nodes: 9, ..default() };
    let hair = app.world_mut().spawn(GroomedHair { groom, guides }).id();
    wait_for(&mut app, |app| (members(app, hair).len() == 12).then_some(()));
    let own = Strand::from_polyline(&[Vec3::ZERO, Vec3::Y * 0.05, Vec3::Y * 0.1]).unwrap();
    let own = app.world_mut().spawn((StrandOf(hair), own)).id();
    let hairs = |app: &App| -> Vec<Entity> {
        members(app, hair).into_iter().filter(|member| *member != own).collect()
    };
    style(&mut app, hair);
    app.world_mut().write_message(SoakHair { target: hair, wetness: 0.5 });
    run(&mut app, 0.1);
    let water = |app: &App| -> f64 {
        let all = hairs(app);
        all.iter().map(|id| app.world().get::<Moisture>(*id).unwrap().volume()).sum()
    };
    let lowest = |app: &App| strand(app, hairs(app)[0]).positions().last().copied().unwrap();
    let (share, tip, soaked) = (kept(&app, hair), lowest(&app), water(&app));
    assert!((0.2..0.9).contains(&share) && tip.y < -0.02, "{share} {tip}");
    let of_game = strand(&app, own).positions().to_vec();

    // As many strands of as many nodes: the same hair.
    reload(&mut app, &dir, hair, file(12, 9, 0.0));
    assert!((kept(&app, hair) - share).abs() < 0.02, "{} of {share}", kept(&app, hair));
    assert!(lowest(&app).distance(tip) < 5e-3, "{} from {tip}", lowest(&app));
    assert!((water(&app) / soaked - 1.0).abs() < 0.01, "{} of {soaked}", water(&app));
    assert!(strand(&app, own).positions()[2].distance(of_game[2]) < 0.01, "the game's own stays");

    // Three times as many, of more nodes.
    app.world_mut().get_mut::<GroomedHair>(hair).unwrap().guides.nodes = 17;
    app.update();
    reload(&mut app, &dir, hair, file(36, 30, 0.0));
    assert_eq!(hairs(&app).len(), 36);
    assert!(hairs(&app).iter().all(|id| strand(&app, *id).nodes() == 17));
    assert!((kept(&app, hair) - share).abs() < 0.05, "{} of {share}", kept(&app, hair));
    assert!((lowest(&app) - tip).xy().length() < 0.01, "{} from {tip}", lowest(&app));
    assert!((water(&app) / (3.0 * soaked) - 1.0).abs() < 0.05, "water is kept per length");
    assert!(app.world().resource::<WaterLedger>().error() < 1e-9);

    // Another shape shows, and what was done to the hair is still done to it.
    let share = kept(&app, hair);
    reload(&mut app, &dir, hair, file(36, 30, 0.05));
    assert!((kept(&app, hair) - share).abs() < 0.05, "{} of {share}", kept(&app, hair));
    let bent = lowest(&app);
    assert!(bent.z > 0.02 && bent.y < -0.01, "{bent} from {tip}");
    // Bonds follow its water meanwhile, as they would have.
    run(&mut app, 1.0);
    assert!(hairs(&app).iter().all(|id| strand(&app, *id).peak_strain() < 0.02));
    assert_eq!(faults(&mut app), []);

    // Another groom is other hair.
    let lines = (0..5).map(|i| [Vec3::Z * 0.01 * i as f32, Vec3::new(0.12, 0.0, 0.01 * i as f32)]);
    let other = Groom::from_polylines(lines).unwrap();
    let other = app.world_mut().resource_mut::<Assets<Groom>>().add(other);
    app.world_mut().get_mut::<GroomedHair>(hair).unwrap().groom = other;
    app.update();
    let grown = hairs(&app);
    assert_eq!(grown.len(), 5);
    assert!(strand(&app, grown[0]).positions().last().unwrap().y > -0.01, "as it grows");
}

#[test]
fn a_tie_holds_the_hair_that_grows_again() {
    let dir = Dir::default();
    dir.insert_asset(Path::new("bob.abc"), file(12, 9, 0.0));
    let mut app = app(&dir);
    let groom = app.world().resource::<AssetServer>().load("bob.abc");
    let guides = GroomGuides { count: 100, nodes: 13, ..default() };
    let hair = app.world_mut().spawn(GroomedHair { groom, guides }).id();
    wait_for(&mut app, |app| (members(app, hair).len() == 12).then_some(()));
    let tie = HairTie { radius: 0.005, seconds: 0.2 };
    let place = Transform::from_xyz(0.05, 0.0, 0.055).looking_to(Vec3::X, Vec3::Y);
    let tie = app.world_mut().spawn((tie, place, ChildOf(hair))).id();
    for member in members(&app, hair) {
        app.world_mut().entity_mut(member).insert(Tied(tie));
    }
    run(&mut app, 1.0);
    let before = strand(&app, members(&app, hair)[0]).positions().to_vec();
    reload(&mut app, &dir, hair, file(20, 9, 0.0));
    assert_eq!(members(&app, hair).len(), 20);
    for member in members(&app, hair) {
        assert_eq!(app.world().get::<Tied>(member), Some(&Tied(tie)), "by the game's own tie");
    }
    run(&mut app, 0.5);
    let after = strand(&app, members(&app, hair)[0]).positions().to_vec();
    assert!(after[5].distance(before[5]) < 0.01, "{} from {}", after[5], before[5]);
    assert_eq!(app.world_mut().query::<&HairTie>().iter(app.world()).count(), 1);
    assert_eq!(faults(&mut app), []);
}

#[test]
fn worn_hair_keeps_its_hairdo_when_its_groom_is_loaded_again() {
    let mut app = wear::app();
    let groom = app.world_mut().resource_mut::<Assets<Groom>>().add(wear::groom());
    let wear = WearHair { colliders: false, style: None, ..WearHair::new(groom.clone()) };
    let root = app.world_mut().spawn((Transform::default(), wear)).id();
    character(&mut app, root, 1.0);
    let hair = worn(&mut app);
    style(&mut app, hair);
    let share = kept(&app, hair);
    assert!((0.2..0.9).contains(&share), "{share}");
    let half = wear::groom().thinned(2).unwrap();
    app.world_mut().resource_mut::<Assets<Groom>>().insert(&groom, half).unwrap();
    let other = worn(&mut app);
    assert_ne!(other, hair);
    assert_eq!(members(&app, other).len(), 150);
    run(&mut app, 0.1);
    assert!((kept(&app, other) - share).abs() < 0.05, "{} of {share}", kept(&app, other));
    // With another seed it is other hair.
    app.world_mut().get_mut::<WearHair>(root).unwrap().seed = 1;
    let fresh = worn(&mut app);
    run(&mut app, 0.1);
    assert_eq!(app.world().get::<KeptStyle>(fresh).and_then(KeptStyle::kept), None);
}

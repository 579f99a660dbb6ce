//! Grooms as assets, and hair that wears them.

use super::files::{Arrays, glb, gltf_bytes, gltf_json, hair, primitive, tfx};
use crate::common::wait_for;
use bevy::{
    asset::{
        AssetPlugin, LoadState,
        io::{
            AssetSourceBuilder, AssetSourceId,
            memory::{Dir, MemoryAssetReader},
        },
    },
    prelude::*,
    time::TimeUpdateStrategy,
};
use bevy_keratin::{
    FaultKind,
    authoring::groom::*,
    prelude::*,
    render::{FollowerRoots, HairLook},
};
use std::path::Path;

#[derive(Resource, Default)]
struct Reported(Vec<HairFault>);

/// An app whose assets are these files.
fn app(files: &[(&str, Vec<u8>)]) -> App {
    let dir = Dir::default();
    for (name, bytes) in files {
        dir.insert_asset(Path::new(name), bytes.clone());
    }
    let mut app = App::new();
    let source = AssetSourceBuilder::new(move || Box::new(MemoryAssetReader { root: dir.clone() }));
    app.register_asset_source(AssetSourceId::Default, source)
        .add_plugins((MinimalPlugins, AssetPlugin::default(), HairPlugins::default()))
        .insert_resource(TimeUpdateStrategy::FixedTimesteps(1))
        .init_resource::<Reported>()
        .add_systems(
            Last,
            |mut faults: MessageReader<HairFault>, mut reported: ResMut<Reported>| {
                reported.0.extend(faults.read().cloned());
            },
        );
    app.finish();
    app.cleanup();
    app
}

fn until(app: &mut App, ready: impl Fn(&mut App) -> bool) {
    wait_for(app, |app| ready(app).then_some(()));
}

fn load(app: &App, name: &str) -> Handle<Groom> {
    app.world().resource::<AssetServer>().load(name.to_owned())
}

fn strands(app: &App, hair: Entity) -> usize {
    app.world().get::<Strands>(hair).map_or(0, |s| s.iter().count())
}

fn followers(app: &App, hair: Entity) -> usize {
    app.world().get::<FollowerRoots>(hair).map_or(0, |f| f.0.len())
}

#[test]
fn every_format_loads_as_an_asset() {
    let json = gltf_json(&primitive(3, false), r#""uri":"my%20hair.bin","#);
    let files = [
        ("a.hair", hair(&[2, 1, 3], 31)),
        ("a.tfx", tfx(4.0, 5, 4, Arrays::ALL)),
        ("a.glb", glb(&gltf_json(&primitive(3, false), ""), &gltf_bytes())),
        ("sub/a.gltf", json.into_bytes()),
        ("sub/my hair.bin", gltf_bytes()),
        ("broken.tfx", vec![1, 2, 3]),
    ];
    let mut app = app(&files);
    for (name, count) in [("a.hair", 3), ("a.tfx", 5), ("a.glb", 1), ("sub/a.gltf", 1)] {
        let groom = load(&app, name);
        until(&mut app, |app| app.world().resource::<Assets<Groom>>().contains(&groom));
        let groom = app.world().resource::<Assets<Groom>>().get(&groom).unwrap();
        assert_eq!(groom.len(), count, "{name}");
    }
    let settings = |s: &mut GroomSettings| (s.scale, s.limit) = (Some(10.0), Some(2));
    let assets = app.world().resource::<AssetServer>();
    let groom: Handle<Groom> = assets.load_builder().with_settings(settings).load("a.tfx");
    until(&mut app, |app| app.world().resource::<Assets<Groom>>().contains(&groom));
    let groom = app.world().resource::<Assets<Groom>>().get(&groom).unwrap();
    assert_eq!((groom.len(), groom.points()[3]), (2, Vec3::Z * 15.0));

    let broken = load(&app, "broken.tfx");
    until(&mut app, |app| {
        let state = app.world().resource::<AssetServer>().load_state(&broken);
        matches!(state, LoadState::Failed(e) if e.to_string().contains("byte 0"))
    });
}

#[test]
fn hair_grows_once_its_groom_is_loaded_and_again_when_that_changes() {
    let files =
        [("a.tfx", tfx(4.0, 30, 8, Arrays::ALL)), ("b.tfx", tfx(4.0, 12, 8, Arrays::default()))];
    let mut app = app(&files);
    let mut groomed = GroomedHair::new(load(&app, "a.tfx"));
    groomed.guides.count = 10;
    let hair = app.world_mut().spawn(groomed).id();
    let own = Strand::from_polyline(&[Vec3::ZERO, Vec3::Y]).unwrap();
    let own = app.world_mut().spawn((StrandOf(hair), own)).id();
    until(&mut app, |app| strands(app, hair) == 11);
    assert_eq!(followers(&app, hair), 20);
    let look = app.world().get::<HairLook>(hair).unwrap();
    assert_eq!(look.width, 5e-3, "widths of metres are kept to what can be hair");
    let nodes: Vec<usize> =
        app.world_mut().query::<&Strand>().iter(app.world()).map(Strand::nodes).collect();
    assert_eq!(nodes.iter().filter(|n| **n == 16).count(), 10);
    for _ in 0..30 {
        app.update();
    }
    assert!(app.world_mut().query::<&Strand>().iter(app.world()).all(Strand::is_finite));

    app.world_mut().get_mut::<GroomedHair>(hair).unwrap().guides.nodes = 5;
    app.update();
    let world = app.world_mut();
    assert_eq!(world.query::<&Strand>().iter(world).filter(|s| s.nodes() == 5).count(), 10);
    assert_eq!(strands(&app, hair), 11, "the game's own strand stays, the old ones go");

    app.world_mut().get_mut::<GroomedHair>(hair).unwrap().groom = load(&app, "b.tfx");
    until(&mut app, |app| followers(app, hair) == 2);
    assert_eq!(strands(&app, hair), 11);
    assert!(app.world().get::<HairLook>(hair).is_none(), "that look was of the other groom");

    let id = app.world().get::<GroomedHair>(hair).unwrap().groom.id();
    let lines = (0..4).map(|i| [Vec3::X * i as f32, Vec3::X * i as f32 + Vec3::Y]);
    let other = Groom::from_polylines(lines).unwrap();
    app.world_mut().resource_mut::<Assets<Groom>>().insert(id, other).unwrap();
    until(&mut app, |app| strands(app, hair) == 5);

    app.world_mut().entity_mut(hair).remove::<GroomedHair>();
    app.update();
    assert_eq!((strands(&app, hair), followers(&app, hair)), (1, 0));
    assert!(app.world().get::<Strand>(own).is_some());
    assert!(app.world().resource::<Reported>().0.is_empty());
    app.world_mut().despawn(hair);
    app.update();
}

#[test]
fn grooms_that_cannot_be_used_are_reported_once() {
    let mut app = app(&[("broken.tfx", vec![0; 200])]);
    let broken = load(&app, "broken.tfx");
    app.world_mut().spawn(GroomedHair::new(broken));
    until(&mut app, |app| !app.world().resource::<Reported>().0.is_empty());
    let empty = app.world_mut().resource_mut::<Assets<Groom>>().add(Groom::default());
    app.world_mut().spawn(GroomedHair::new(empty));
    let one = Groom::from_polylines([[Vec3::ZERO, Vec3::Y]]).unwrap();
    let one = app.world_mut().resource_mut::<Assets<Groom>>().add(one);
    let guides = GroomGuides { nodes: 1, ..default() };
    app.world_mut().spawn(GroomedHair { groom: one, guides });
    for _ in 0..20 {
        app.update();
    }
    let reported = &app.world().resource::<Reported>().0;
    assert!(
        reported[0].kind == FaultKind::Groom && reported[0].message.contains("not loaded"),
        "{reported:?}"
    );
    assert_eq!(reported[1].cause(), Some(&GroomError::Empty));
    assert!(reported[2].to_string().contains("GroomGuides::nodes is 1"), "{}", reported[2]);
    assert_eq!(reported.len(), 3, "{reported:?}");
}

#[test]
fn without_assets_nothing_panics() {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, HairPlugins::default()));
    app.finish();
    app.cleanup();
    app.world_mut().spawn(GroomedHair::default());
    app.update();
    app.update();
}

#[test]
fn short_strands_have_fewer_nodes_and_those_without_length_are_no_guides() {
    let lines =
        [0.3, 0.02, 0.0].map(|length| [Vec3::X * length, Vec3::X * length + Vec3::Y * length]);
    let groom = Groom::from_polylines(lines).unwrap();
    let mut world = World::new();
    let hair = world.spawn(Hair).id();
    let mut commands = world.commands();
    let spawned = groom.spawn(&mut commands, hair, &default()).unwrap();
    world.flush();
    let mut nodes: Vec<usize> =
        spawned.iter().map(|s| world.get::<Strand>(*s).unwrap().nodes()).collect();
    nodes.sort_unstable();
    assert_eq!(nodes, [5, 16]);
}

#[test]
fn guides_are_never_finer_than_a_millimetre() {
    let mut world = World::new();
    let hair = world.spawn(Hair).id();
    let mut grow = |lengths: &[f32], guides: GroomGuides| {
        let lines = lengths.iter().map(|l| [Vec3::X * *l, Vec3::new(*l, *l, 0.0)]);
        let groom = Groom::from_polylines(lines).unwrap();
        let grown = groom.spawn(&mut world.commands(), hair, &guides)?;
        world.flush();
        let segments = grown.iter().map(|s| {
            let strand = world.get::<Strand>(*s).unwrap();
            (strand.nodes(), strand.rest_lengths().iter().copied().fold(f32::MAX, f32::min))
        });
        Ok::<_, GroomError>(segments.collect::<Vec<_>>())
    };
    let fine = GroomGuides { nodes: 4096, segment: 1e-3, ..default() };
    for (length, nodes) in [(0.3, 301), (0.1, 101), (0.0103, 11), (2.2e-3, 3), (1.5e-3, 2)] {
        let [(found, least)] = grow(&[length], fine).unwrap()[..] else {
            panic!("one strand");
        };
        assert!(found.abs_diff(nodes) <= 1 && least > 0.99e-3, "{length}: {found} of {least} m");
    }
    let default = GroomGuides::default();
    // Strands all shorter than asked for are taken, but not those finer than can be simulated.
    assert_eq!(grow(&[4e-3, 5e-4, 1e-4], default).unwrap().len(), 1);
    let error = grow(&[5e-4, 2e-4], default).unwrap_err().to_string();
    assert!(error.starts_with("the longest strand's length (m) is 0.0005"), "{error}");
    let error = grow(&[0.1], GroomGuides { segment: 1e-4, ..fine }).unwrap_err().to_string();
    assert!(error.contains("GroomGuides::segment (m) is 0.0001, expected 0.001"), "{error}");
}

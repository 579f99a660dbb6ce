//! Features in pairs: any of them together with any other, and characters that are mirrored.
#![cfg(all(feature = "groom", feature = "gpu", feature = "save"))]

use crate::all_plugins::{ALL, BASIS};
use bevy::{
    app::PluginGroupBuilder, mesh::skinning::SkinnedMeshInverseBindposes, prelude::*,
    time::TimeUpdateStrategy,
};
use bevy_keratin::{
    authoring::{attach::RootsOnMesh, plant::RootOnMesh},
    prelude::*,
};
use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};
use std::time::{Duration, Instant};

/// Radius of each head (m, in its own measure).
const HEAD: f32 = 0.08;

fn app(plugins: PluginGroupBuilder) -> App {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, TransformPlugin, AssetPlugin::default()))
        .init_asset::<Mesh>()
        .init_asset::<SkinnedMeshInverseBindposes>()
        .add_plugins(plugins)
        .insert_resource(Time::<Fixed>::from_hz(60.0))
        .insert_resource(TimeUpdateStrategy::FixedTimesteps(1))
        .init_resource::<AllFaults>()
        // As those who read faults do without the plugin that has them.
        .add_message::<HairFault>()
        .add_systems(Last, |mut faults: MessageReader<HairFault>, mut all: ResMut<AllFaults>| {
            all.0.extend(faults.read().cloned());
        });
    app.finish();
    app.cleanup();
    app
}

#[derive(Resource, Default)]
struct AllFaults(Vec<HairFault>);

/// A head as a mesh and as a collider, with hair on its upper half; returns the parent, the hair and
/// its strands.
fn head(app: &mut App, place: Transform, tied: bool) -> (Entity, Entity, Vec<Entity>) {
    let mesh = Sphere::new(HEAD).mesh().ico(3).unwrap();
    let world = app.world_mut();
    let skin = world.resource_mut::<Assets<Mesh>>().add(mesh.clone());
    let parent = world.spawn((place, Mesh3d(skin))).id();
    world.spawn((HairCollider::sphere(HEAD).unwrap(), Transform::default(), ChildOf(parent)));
    let hair = world.spawn((Hair, Transform::default(), ChildOf(parent))).id();
    let directions: Vec<Vec3> = (0..10)
        .map(|i| {
            let (y, turn) = (0.3 + 0.06 * i as f32, 2.4 * i as f32);
            let across = (1.0 - y * y).sqrt();
            Vec3::new(across * turn.cos(), y, across * turn.sin())
        })
        .collect();
    if tied {
        let places = directions.iter().map(|d| *d * HEAD);
        let roots = RootOnMesh::nearest(&mesh, places).unwrap().into_iter().map(|(root, _)| root);
        let roots = RootsOnMesh { mesh: Some(parent), roots: roots.collect(), ..default() };
        world.entity_mut(hair).insert(roots);
    }
    // Not along the radius, lest hair stands in balance; none is its own mirror image.
    let line = |d: &Vec3| -> Vec<Vec3> {
        let lean = Vec3::new(0.4, 0.0, 0.2);
        (0..8).map(|k| *d * (HEAD + 0.002) + (*d + lean) * (0.015 * k as f32)).collect()
    };
    let strands = directions.iter().map(|d| Strand::from_polyline(&line(d)).unwrap());
    let strands: Vec<_> = strands.map(|strand| (StrandOf(hair), strand)).collect();
    (parent, hair, strands.into_iter().map(|strand| world.spawn(strand).id()).collect())
}

/// Where the nodes are drawn.
fn drawn(app: &App, hair: Entity, strands: &[Entity]) -> Vec<Vec3> {
    let place = app.world().get::<GlobalTransform>(hair).unwrap();
    let nodes = strands.iter().flat_map(|s| app.world().get::<Strand>(*s).unwrap().positions());
    nodes.map(|p| place.transform_point(*p)).collect()
}

#[test]
fn hair_of_a_mirrored_character_is_the_mirror_image() {
    let shape = |mirror: Vec3, tied: bool| {
        let mut app = app(HairPlugins::default().build());
        let turn = Quat::from_euler(EulerRot::YXZ, 0.5, 0.2, 0.1);
        let place = Transform::from_xyz(0.1, 0.2, 0.3).with_rotation(turn);
        let (parent, hair, strands) = head(&mut app, place, tied);
        // The mirror is in the world, above the character.
        let above = app.world_mut().spawn(Transform::from_scale(mirror)).id();
        app.world_mut().entity_mut(parent).insert(ChildOf(above));
        let wind = WindZone {
            velocity: Vec3::new(1.0, 0.0, 0.4),
            half_size: Vec3::ONE * 9.0,
            ..default()
        };
        app.world_mut().spawn((wind, Transform::default(), ChildOf(above)));
        let aim = Transform::from_xyz(0.6, 0.4, 0.3).looking_at(Vec3::new(0.1, 0.2, 0.3), Vec3::Y);
        app.world_mut().spawn((Blower::default(), aim, ChildOf(above)));
        (0..120).for_each(|_| app.update());
        drawn(&app, hair, &strands)
    };
    for tied in [false, true] {
        let control = shape(Vec3::ONE, tied);
        for mirror in [Vec3::new(-1.0, 1.0, 1.0), Vec3::new(1.0, 1.0, -1.0)] {
            let mirrored = shape(mirror, tied);
            let apart = control.iter().zip(&mirrored).map(|(a, b)| (*a * mirror).distance(*b));
            let worst = apart.fold(0.0, f32::max);
            assert!(worst < 2e-3, "{worst} m apart, mirrored by {mirror}, tied: {tied}");
        }
    }
}

/// How likely a plugin is there: without some of them little is left to be checked.
fn share_with(plugin: &str) -> f64 {
    match plugin {
        _ if BASIS.contains(&plugin) => 0.98,
        "RodPlugin" | "EnvironmentPlugin" => 0.95,
        "WaterPlugin" | "SleepPlugin" | "SettlePlugin" => 0.8,
        "ContactPlugin" => 0.85,
        _ => 0.9,
    }
}

/// Three hairs with features at random: active for `seconds`, then left alone.
fn scenario(seed: u64, seconds: u32) {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut lot = |share: f64| random.random_bool(share);
    let off: Vec<_> = ALL.into_iter().filter(|(what, _)| !lot(share_with(what))).collect();
    let plugins = HairPlugins::default().build();
    let mut app = app(off.iter().fold(plugins, |group, (_, off)| off(group)));
    let off: Vec<&str> = off.into_iter().map(|(what, _)| what).collect();
    let has = |plugin: &str| !off.contains(&plugin);
    let water = has("WaterPlugin");
    // Without these nothing moves, sleeps, settles or is pushed away.
    let works = BASIS.into_iter().all(has);
    let contact = works && has("ContactPlugin");
    // Where nothing settles the renderer shows what was to.
    let shows = works && (has("SettlePlugin") || has("HairRenderPlugin"));
    let [wind, zone, shower, blower] = [0.5, 0.5, 0.4, 0.3].map(&mut lot);
    let humidity = if lot(0.3) { 0.8 } else { 0.45 };
    app.insert_resource(HairClimate { humidity, ..default() });
    let mut hairs = Vec::new();
    let mut is_wet = shower;
    let mut label = format!(
        "seed {seed}: without {off:?}, wind {wind}, zone {zone}, shower {shower}, blower {blower}, \
         humidity {humidity}"
    );
    for i in 0..3 {
        let scales = [
            Vec3::ONE,
            Vec3::splat(-1.0),
            Vec3::new(-1.0, 1.0, 1.0),
            Vec3::splat(2.0),
            Vec3::new(0.5, 0.5, -0.5),
        ];
        let scale = scales[(0..4).filter(|_| lot(0.5)).count()];
        let place = Transform::from_xyz(i as f32 * 1.2, 0.0, 0.0).with_scale(scale);
        let [tied, settling, lod, gpu, soaked, spring, rod, style] =
            [0.5, 0.5, 0.5, 0.3, 0.3, 0.2, 0.2, 0.5].map(&mut lot);
        let (parent, hair, strands) = head(&mut app, place, tied);
        label += &format!(
            "\n  scale {scale}, tied {tied}, settling {settling}, lod {lod}, gpu {gpu}, soaked {soaked}, spring \
             {spring}, rod {rod}, style {style}"
        );
        let world = app.world_mut();
        let mut entity = world.entity_mut(hair);
        if settling {
            entity.insert(Settling::default());
        }
        if lod {
            entity.insert((HairLod::default(), HairScreenShare(0.02)));
        }
        if gpu {
            entity.insert(SimulateOn::Gpu);
        }
        if spring {
            entity.insert(StrandModel::MassSpring);
        }
        if style {
            entity.insert(HairStyle::default());
        }
        if soaked && water {
            world.write_message(SoakHair { target: hair, wetness: 1.5 });
            is_wet = true;
        }
        if rod {
            let at = Transform::from_xyz(0.0, HEAD + 0.06, 0.0);
            let rod = world.spawn((PermRod::new(0.01, 0.1).unwrap(), at, ChildOf(parent))).id();
            let winding = PermWinding { seconds: 0.5, ..default() };
            world.entity_mut(strands[0]).insert((WoundOn(rod), winding));
        }
        hairs.push((parent, hair, strands, rod, place));
    }
    let mut tools = Vec::new();
    let world = app.world_mut();
    if zone {
        let zone = WindZone { velocity: Vec3::new(2.0, 0.0, 1.0), ..default() };
        tools.push(world.spawn((zone, Transform::default())).id());
    }
    if shower {
        let place = Transform::from_xyz(0.0, 0.4, 0.0).looking_at(Vec3::ZERO, Vec3::X);
        tools.push(world.spawn((Shower::default(), place)).id());
    }
    if blower {
        let place = Transform::from_xyz(0.3, 0.1, 0.0).looking_at(Vec3::ZERO, Vec3::Y);
        tools.push(world.spawn((Blower::default(), place)).id());
    }
    if wind {
        app.insert_resource(HairWind { velocity: Vec3::new(1.0, 0.0, 2.0), ..default() });
    }
    for tick in 0..60 * seconds {
        for (parent, .., place) in &hairs {
            let turn = Quat::from_rotation_y((0.1 * tick as f32).sin() * 0.5);
            *app.world_mut().get_mut::<Transform>(*parent).unwrap() = place
                .with_rotation(turn)
                .with_translation(place.translation + turn * Vec3::Z * 0.05);
        }
        app.update();
        for (_, hair, strands, ..) in &hairs {
            let nodes = drawn(&app, *hair, strands);
            assert!(nodes.iter().all(|p| p.is_finite()), "{label}");
        }
    }
    tools.into_iter().for_each(|tool| app.world_mut().entity_mut(tool).despawn());
    app.insert_resource(HairWind::default());
    // Springs have no damping of a swing but the air's, which takes it from 5 cm to what counts as still in 7 s.
    let is_spring = |hair: &Entity| {
        matches!(app.world().get::<StrandModel>(*hair), Some(StrandModel::MassSpring))
    };
    let rest = if hairs.iter().any(|(_, hair, ..)| is_spring(hair)) { 9 } else { 6 };
    (0..60 * rest).for_each(|_| app.update());
    for (i, (_, hair, strands, rod, _)) in hairs.iter().enumerate() {
        let world = app.world();
        let is_hidden = world.entity(*hair).contains::<Settling>();
        assert!(!shows || !is_hidden, "hair {i} is hidden; {label}");
        let strand = |s: &Entity| world.get::<Strand>(*s).unwrap();
        let first = usize::from(*rod);
        assert!(strands.iter().all(|s| strand(s).is_finite()), "{label}");
        let free = strands[first..].iter().flat_map(|s| strand(s).positions());
        let deepest = free.map(|p| HEAD - p.length()).fold(f32::MIN, f32::max);
        // What nothing steps stays where it was.
        let solver = match world.get::<StrandModel>(*hair) {
            Some(StrandModel::MassSpring) => "SpringPlugin",
            _ => "RodPlugin",
        };
        let is_kept_out = contact && has(solver);
        assert!(!is_kept_out || deepest < 0.004, "hair {i} is {deepest} m in its head; {label}");
        let is_awake =
            |s: &&Entity| !world.get::<StrandSleep>(**s).is_some_and(StrandSleep::is_asleep);
        let awake = strands[first..].iter().filter(is_awake).count();
        // Without air nothing brakes springs.
        let is_braked = solver == "RodPlugin" || has("EnvironmentPlugin");
        let may_sleep = works && is_braked && has("SleepPlugin") && !(water && is_wet);
        // Where locks press on each other a few creep on: a fifth of them here, at most.
        assert!(
            !may_sleep || 5 * awake <= strands.len(),
            "{awake} strands of hair {i} are awake; {label}"
        );
    }
    if let Some(ledger) = app.world().get_resource::<WaterLedger>() {
        assert!(ledger.error() < 1e-5, "{ledger:?}; {label}");
    }
    let all = &app.world().resource::<AllFaults>().0;
    for (i, fault) in all.iter().enumerate() {
        assert!(!all[..i].contains(fault), "reported again: {fault}; {label}");
    }
}

#[test]
fn features_go_together() {
    (0..12).for_each(|seed| scenario(seed, 1));
}

/// `KERATIN_PAIRS_SECONDS` is how long it runs; an hour by default. `KERATIN_PAIRS_SEED` is its first seed.
#[test]
#[ignore = "runs for an hour"]
fn features_go_together_for_an_hour() {
    let number = |name| std::env::var(name).ok().and_then(|value| value.parse::<u64>().ok());
    let end = Instant::now() + Duration::from_secs(number("KERATIN_PAIRS_SECONDS").unwrap_or(3600));
    let first = number("KERATIN_PAIRS_SEED").unwrap_or(1000);
    let mut seed = first;
    let mut broken = Vec::new();
    while Instant::now() < end {
        let seconds = 1 + (seed % 3) as u32;
        if std::panic::catch_unwind(|| scenario(seed, seconds)).is_err() {
            broken.push(seed);
        }
        seed += 1;
    }
    println!("{} seeds from {first} on", seed - first);
    assert!(broken.is_empty(), "seeds {broken:?}");
}

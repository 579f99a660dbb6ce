//! What a hair's bits hang on: its own state, not what else lives in the world. And that this state can be taken and put
//! back.

mod cycles;

use crate::common::*;
use bevy::{ecs::system::RunSystemOnce, prelude::*, time::TimeUpdateStrategy};
use bevy_keratin::{MotionOwner, prelude::*};

/// Where the other character stands (m).
const FAR: Vec3 = Vec3::new(50.0, 0.0, 0.0);

/// What hair goes through.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Scene {
    Dry,
    Gusts,
    /// The same where contact is by pairs.
    Pairs,
    Wet,
}

/// A head with so many strands in locks that touch. Returns the hair.
fn character(world: &mut World, at: Vec3, strands: usize) -> Entity {
    let head = HairCollider::sphere(0.09).unwrap();
    world.spawn((head, Transform::from_translation(at)));
    let shoulders = HairCollider::capsule(0.07, 0.3).unwrap();
    let across = Quat::from_rotation_z(core::f32::consts::FRAC_PI_2);
    let below = at - Vec3::Y * 0.2;
    world.spawn((shoulders, Transform::from_translation(below).with_rotation(across)));
    let hair = world.spawn((Hair, Transform::from_translation(at))).id();
    for i in 0..strands {
        let turn = 2.4 * i as f32;
        let up = 0.95 - 0.01 * i as f32;
        let out = (1.0 - up * up).sqrt();
        let out = Vec3::new(turn.cos() * out, up, turn.sin() * out);
        let nodes = 8 + i % 3;
        let along = |k: usize| 0.092 + 0.018 * k as f32;
        let points: Vec<Vec3> = (0..nodes).map(|k| out * along(k)).collect();
        world.spawn((StrandOf(hair), Strand::from_polyline(&points).unwrap()));
    }
    hair
}

/// The same, and what the scene does to it.
fn character_in(world: &mut World, scene: Scene, at: Vec3) -> Entity {
    let hair = character(world, at, 50);
    if scene == Scene::Wet {
        world.trigger(SoakHair::dripping(hair));
        let cloud =
            Transform::from_translation(at + Vec3::Y * 0.4).looking_to(Dir3::NEG_Y, Dir3::X);
        world.spawn((Shower { opening: 0.12, ..Shower::rain(400.0, 0.12).unwrap() }, cloud));
    }
    hair
}

fn set_up(app: &mut App, scene: Scene) {
    let method = if scene == Scene::Pairs { ContactMethod::Pairs } else { ContactMethod::Printed };
    app.insert_resource(HairDefault(StrandContact { radius: 4e-3, method, ..default() }));
    if matches!(scene, Scene::Gusts | Scene::Pairs) {
        let velocity = Vec3::new(3.0, 0.0, 1.0);
        app.insert_resource(HairWind { velocity, gusts: 0.5, ..default() });
    }
}

fn app_in(scene: Scene) -> App {
    let mut app = test_app(60.0);
    set_up(&mut app, scene);
    app
}

fn strands_of(app: &App, hair: Entity) -> Vec<Entity> {
    app.world().get::<Strands>(hair).unwrap().collection().to_vec()
}

/// All the bits of a hair's motion and water.
fn bits(app: &App, hair: Entity) -> Vec<u64> {
    let mut bits = Vec::new();
    for strand in strands_of(app, hair) {
        let world = app.world();
        let water = world.get::<Moisture>(strand).unwrap();
        bits.extend(water.film().iter().chain(water.bound()).map(|water| water.to_bits()));
        let strand = world.get::<Strand>(strand).unwrap();
        let vectors = strand.positions().iter().chain(strand.velocities());
        bits.extend(vectors.flat_map(|v| v.to_array()).map(|x| u64::from(x.to_bits())));
        let turns = strand.orientations().iter().flat_map(|q| q.to_array());
        bits.extend(turns.map(|x| u64::from(x.to_bits())));
    }
    bits
}

/// What else lives in the world.
#[derive(Clone, Copy, Debug)]
enum Other {
    Stays,
    Leaves,
    LosesAStrand,
    Comes,
    /// Nobody, but some strands carry a marker, from the start or from then on.
    Marker,
}

#[derive(Component)]
struct Marker;

/// The bits of a hair after a second, in a world with something else in it or alone.
fn after_a_second(scene: Scene, other: Option<Other>) -> Vec<u64> {
    let mut app = app_in(scene);
    let comes_first = matches!(other, Some(Other::Stays | Other::Leaves | Other::LosesAStrand));
    let before: Vec<Entity> = app.world_mut().query::<Entity>().iter(app.world()).collect();
    let there = comes_first.then(|| character_in(app.world_mut(), scene, FAR));
    let theirs: Vec<Entity> = app.world_mut().query::<Entity>().iter(app.world()).collect();
    let theirs: Vec<Entity> = theirs.into_iter().filter(|e| !before.contains(e)).collect();
    let hair = character_in(app.world_mut(), scene, Vec3::ZERO);
    let mine = strands_of(&app, hair);
    run(&mut app, 0.3);
    match other {
        Some(Other::Leaves) => theirs.into_iter().for_each(|e| {
            app.world_mut().try_despawn(e).ok();
        }),
        Some(Other::LosesAStrand) => {
            let one = strands_of(&app, there.unwrap())[3];
            app.world_mut().despawn(one);
        }
        Some(Other::Comes) => {
            character_in(app.world_mut(), scene, FAR);
        }
        Some(Other::Marker) => mine.iter().step_by(3).for_each(|e| {
            app.world_mut().entity_mut(*e).insert(Marker);
        }),
        Some(Other::Stays) | None => {}
    }
    run(&mut app, 0.7);
    bits(&app, hair)
}

fn hangs_on_nothing_else(scene: Scene) {
    let alone = after_a_second(scene, None);
    use Other::*;
    let different: Vec<Other> = [Stays, Leaves, LosesAStrand, Comes, Marker]
        .into_iter()
        .filter(|other| after_a_second(scene, Some(*other)) != alone)
        .collect();
    assert!(different.is_empty(), "{scene:?}: moved by another that {different:?}");
}

#[test]
fn bits_of_dry_hair_hang_on_nothing_else_in_the_world() {
    hangs_on_nothing_else(Scene::Dry);
}

#[test]
fn bits_of_hair_in_gusts_hang_on_nothing_else_in_the_world() {
    hangs_on_nothing_else(Scene::Gusts);
}

#[test]
fn bits_of_hair_whose_contact_is_by_pairs_hang_on_nothing_else_in_the_world() {
    hangs_on_nothing_else(Scene::Pairs);
}

#[test]
fn bits_of_wet_hair_hang_on_nothing_else_in_the_world() {
    hangs_on_nothing_else(Scene::Wet);
}

/// What a snapshot of a hair says in a system of the app.
fn taken(app: &mut App, hair: Entity) -> Result<HairSnapshot, SnapshotError> {
    let take = move |mut hairs: HairSnapshots| {
        let mut snapshot = HairSnapshot::default();
        hairs.take(hair, &mut snapshot).map(|()| snapshot)
    };
    app.world_mut().run_system_once(take).unwrap()
}

fn put_back(app: &mut App, hair: Entity, snapshot: &HairSnapshot) -> Result<(), SnapshotError> {
    let snapshot = snapshot.clone();
    let restore = move |mut hairs: HairSnapshots| hairs.restore(hair, &snapshot);
    app.world_mut().run_system_once(restore).unwrap()
}

/// Without what all hair shares, which has the balance.
#[test]
fn water_of_hair_that_is_put_back_alone_is_counted() {
    let mut app = test_app(60.0);
    let (wet, _) = one_strand(&mut app, 0.2, 8, Vec3::X);
    let (dry, _) = one_strand(&mut app, 0.2, 8, Vec3::X);
    run(&mut app, 0.1);
    let before = [taken(&mut app, wet).unwrap(), taken(&mut app, dry).unwrap()];
    let is_balanced = |app: &mut App, held: bool| {
        for _ in 0..3 {
            app.update();
            let ledger = app.world().resource::<WaterLedger>();
            assert!(ledger.error() < 1e-9, "{:.1e}, {ledger:?}", ledger.error());
            assert_eq!(ledger.held > 0.0, held, "{ledger:?}");
        }
    };
    app.world_mut().write_message(SoakHair { target: wet, wetness: 0.5 });
    is_balanced(&mut app, true);
    let soaked = taken(&mut app, wet).unwrap();
    put_back(&mut app, dry, &soaked).unwrap();
    is_balanced(&mut app, true);
    put_back(&mut app, wet, &before[0]).unwrap();
    put_back(&mut app, dry, &before[1]).unwrap();
    is_balanced(&mut app, false);
    // Into a world that knows of no water.
    let mut app = test_app(60.0);
    let (hair, strand) = one_strand(&mut app, 0.2, 8, Vec3::X);
    run(&mut app, 0.1);
    put_back(&mut app, hair, &soaked).unwrap();
    is_balanced(&mut app, true);
    let volume = |app: &App| app.world().get::<Moisture>(strand).unwrap().volume();
    let first = volume(&app);
    run(&mut app, 5.0);
    assert!(volume(&app) < first, "it dries");
}

#[test]
fn what_cannot_be_rolled_back_says_so() {
    let mut app = test_app(60.0);
    let (hair, strand) = one_strand(&mut app, 0.2, 8, Vec3::X);
    let (other, _) = one_strand(&mut app, 0.2, 9, Vec3::X);
    run(&mut app, 0.1);
    let snapshot = taken(&mut app, hair).unwrap();
    assert_eq!(put_back(&mut app, hair, &snapshot), Ok(()));
    let nodes = SnapshotError::Nodes { strand: 0, found: 9, expected: 10 };
    assert_eq!(put_back(&mut app, other, &snapshot), Err(nodes));
    let strands = SnapshotError::Strands { found: 0, expected: 1 };
    assert_eq!(put_back(&mut app, hair, &HairSnapshot::default()), Err(strands));
    // Cut off in its last edge it has as many nodes.
    app.world_mut().trigger(CutHair::all(other, CutBy::Length(0.199)));
    app.world_mut().flush();
    let cut = taken(&mut app, other).unwrap();
    assert_eq!(put_back(&mut app, other, &cut), Ok(()));
    app.world_mut().trigger(CutHair::all(other, CutBy::Length(0.198)));
    app.world_mut().flush();
    assert_eq!(put_back(&mut app, other, &cut), Err(SnapshotError::Cut { strand: 0 }));
    assert_eq!(taken(&mut app, strand), Err(SnapshotError::NoHair { entity: strand }));
    app.world_mut().entity_mut(hair).insert(MotionOwner::Gpu);
    assert_eq!(taken(&mut app, hair), Err(SnapshotError::OnGpu { entity: hair }));
    app.world_mut().entity_mut(hair).insert((MotionOwner::Simulated, Settling::default()));
    assert_eq!(taken(&mut app, hair), Err(SnapshotError::Settles { entity: hair }));
    // Bytes.
    let bytes = snapshot.to_bytes();
    assert_eq!(HairSnapshot::from_bytes(&bytes), Ok(snapshot));
    assert_eq!(HairSnapshot::from_bytes(&bytes[..bytes.len() - 1]), Err(SnapshotError::Damaged));
    assert_eq!(HairWorldSnapshot::from_bytes(&bytes), Err(SnapshotError::NotASnapshot));
    // Ticks that run at the end of the frame.
    let second = move |mut hairs: HairSnapshots, mut ticks: Local<u32>| {
        *ticks += 1;
        let found = hairs.take(other, &mut HairSnapshot::default());
        let waits = Err(SnapshotError::TicksWait { ticks: 1 });
        assert_eq!(found, if ticks.is_multiple_of(2) { waits } else { Ok(()) });
    };
    app.add_systems(FixedUpdate, second).insert_resource(TimeUpdateStrategy::FixedTimesteps(2));
    app.update();
}

/// By a library of rollback, which spawns again what was despawned meanwhile; or on another machine.
#[test]
fn a_hat_that_is_spawned_again_is_on_as_it_was() {
    let mut app = test_app(60.0);
    let hair = character(app.world_mut(), Vec3::ZERO, 30);
    let hat = || HairCollider::inside(Vec3::new(0.1, 0.105, 0.1), 0.02).unwrap();
    let first = app.world_mut().spawn(hat()).id();
    run(&mut app, 3.0);
    let snapshot = taken(&mut app, hair).unwrap();
    let before = strands_of(&app, hair);
    let nodes = |app: &App| -> Vec<Vec3> {
        before.iter().flat_map(|id| strand(app, *id).positions().to_vec()).collect()
    };
    let was = nodes(&app);
    let continued = |app: &mut App| {
        run(app, 0.1);
        bits(app, hair)
    };
    let expected = continued(&mut app);
    // One in between takes the entity's place.
    app.world_mut().despawn(first);
    app.world_mut().spawn_empty();
    app.world_mut().spawn(hat());
    run(&mut app, 0.2);
    assert_eq!(put_back(&mut app, hair, &snapshot), Ok(()));
    assert!(taken(&mut app, hair).unwrap() == snapshot && nodes(&app) == was);
    assert!(continued(&mut app) == expected);
}

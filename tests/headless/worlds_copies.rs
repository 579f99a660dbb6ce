//! Worlds that are copied, saved and remodelled: roots that are touched again, clones, meshes that change, scenes.
//! Each measurement is a function of its own; a row is what is expected and what was found.
#![cfg(all(feature = "groom", feature = "save"))]

use crate::{
    common::{app_with_meshes, faults, no_gravity, run},
    wear,
};
use bevy::{
    ecs::{entity::EntityHashMap, reflect::AppTypeRegistry},
    mesh::{
        Mesh, Mesh3d, VertexAttributeValues,
        skinning::{SkinnedMesh, SkinnedMeshInverseBindposes},
    },
    prelude::*,
    world_serialization::{DynamicWorld, DynamicWorldBuilder},
};
use bevy_keratin::{
    FaultKind,
    authoring::{
        attach::{RootsError, RootsOnMesh},
        groom::{Groom, GroomedHair},
        plant::{Planted, Planting, RootOnMesh},
    },
    hair::strand::StrandHistory,
    prelude::*,
};
use std::{thread::sleep, time::Duration};

/// Radius of the head (m) and length of its hair (m).
const HEAD: f32 = 0.1;
const LONG: f32 = 0.2;

fn head(radius: f32) -> Mesh {
    Sphere::new(radius).mesh().uv(24, 16)
}

fn planted() -> Planted {
    let planting = Planting { density: 400.0, length: LONG, nodes: 8, ..default() };
    planting.plant(&head(HEAD)).unwrap()
}

/// A head in a world without gravity, with hair that is no child of it.
struct Groomed {
    app: App,
    planted: Planted,
    body: Entity,
    hair: Entity,
}

/// On a mesh that is `scale` times as large as planted.
fn groomed(scale: f32) -> Groomed {
    let mut app = app_with_meshes(60.0);
    no_gravity(&mut app);
    let body = body_at(&mut app, head(HEAD), place(scale));
    let planted = planted();
    let hair = app.world_mut().spawn((Hair, Transform::from_xyz(0.4, 0.1, 0.0))).id();
    for strand in planted.groom.strands() {
        app.world_mut().spawn((StrandOf(hair), Strand::from_polyline(strand.points).unwrap()));
    }
    let roots = RootsOnMesh { mesh: Some(body), roots: planted.roots.clone(), ..default() };
    app.world_mut().entity_mut(hair).insert(roots);
    run(&mut app, 0.1);
    Groomed { app, planted, body, hair }
}

fn place(scale: f32) -> Transform {
    Transform::from_xyz(0.3, 0.2, -0.1)
        .with_rotation(Quat::from_rotation_x(0.8))
        .with_scale(Vec3::splat(scale))
}

fn body_at(app: &mut App, mesh: Mesh, place: Transform) -> Entity {
    let mesh = app.world_mut().resource_mut::<Assets<Mesh>>().add(mesh);
    app.world_mut().spawn((Mesh3d(mesh), place)).id()
}

fn strands_of(app: &App, hair: Entity) -> Vec<Strand> {
    let world = app.world();
    let members = world.get::<Strands>(hair).map_or(Vec::new(), |all| all.iter().collect());
    members.into_iter().map(|id| world.get::<Strand>(id).unwrap().clone()).collect()
}

fn longest(app: &App, hair: Entity) -> f32 {
    strands_of(app, hair).iter().map(Strand::length).fold(0.0, f32::max)
}

/// The longest way between the same nodes (m).
fn apart(a: &[Strand], b: &[Strand]) -> f32 {
    assert_eq!(a.len(), b.len());
    let nodes = |all: &[Strand]| -> Vec<Vec3> {
        all.iter().flat_map(|strand| strand.positions().to_vec()).collect()
    };
    let (a, b) = (nodes(a), nodes(b));
    assert_eq!(a.len(), b.len());
    a.iter().zip(&b).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max)
}

/// How far roots are at most from where `surface` has them, in the world (m); those of every `step`-th strand.
fn off_skin(groomed: &Groomed, step: usize, surface: impl Fn(Vec3) -> Vec3) -> f32 {
    let world = groomed.app.world();
    let frame = world.get::<Transform>(groomed.hair).unwrap();
    let planted = groomed.planted.groom.strands().step_by(step).map(|strand| strand.points[0]);
    let now = strands_of(&groomed.app, groomed.hair);
    assert_eq!(now.len(), planted.len());
    let off = planted.zip(&now).map(|(planted, strand)| {
        frame.transform_point(strand.positions()[0]).distance(surface(planted))
    });
    off.fold(0.0, f32::max)
}

/// Line 12: what happens to hair whose roots are touched three times, against hair that is left alone: the longest
/// strand (m), and how far any node is from that of the control (m).
fn touched(touch: impl Fn(&mut Groomed)) -> (f32, f32) {
    let [mut own, mut control] = [groomed(2.0), groomed(2.0)];
    for _ in 0..3 {
        touch(&mut own);
        [&mut own.app, &mut control.app].into_iter().for_each(|app| run(app, 0.05));
    }
    assert_eq!(faults(&mut own.app), []);
    let (own, control) = (strands_of(&own.app, own.hair), strands_of(&control.app, control.hair));
    let longest = own.iter().map(Strand::length).fold(0.0, f32::max);
    (longest, apart(&own, &control))
}

#[test]
fn roots_that_are_touched_again_move_nothing() {
    let touches: [(&str, fn(&mut Groomed)); 3] = [
        ("untouched, the control", |_| {}),
        ("set_changed", |own| {
            own.app.world_mut().get_mut::<RootsOnMesh>(own.hair).unwrap().set_changed();
        }),
        ("an equal value", |own| {
            let equal = own.app.world().get::<RootsOnMesh>(own.hair).unwrap().clone();
            own.app.world_mut().entity_mut(own.hair).insert(equal);
        }),
    ];
    for (how, touch) in touches {
        let (length, apart) = touched(touch);
        println!("{how}: {length} m long, {apart} m off");
        assert!((length - 2.0 * LONG).abs() < 1e-3, "{how}: {length} m");
        assert!(apart < 1e-4, "{how}: {apart} m off");
    }
}

/// A head between two joints with blended weights, bent by `bend` rad.
fn neck(bend: f32) -> Groomed {
    let mut groomed = groomed(1.0);
    let world = groomed.app.world_mut();
    let joints = [Vec3::ZERO, Vec3::new(0.0, 0.0, 0.02)];
    let mut mesh = head(HEAD);
    let Some(VertexAttributeValues::Float32x3(at)) = mesh.attribute(Mesh::ATTRIBUTE_POSITION)
    else {
        unreachable!()
    };
    let share = |p: &[f32; 3]| (0.5 + 5.0 * p[2]).clamp(0.0, 1.0);
    let weights: Vec<[f32; 4]> = at.iter().map(|p| [1.0 - share(p), share(p), 0.0, 0.0]).collect();
    let indices = VertexAttributeValues::Uint16x4(vec![[0, 1, 0, 0]; at.len()]);
    mesh.insert_attribute(Mesh::ATTRIBUTE_JOINT_INDEX, indices);
    mesh.insert_attribute(Mesh::ATTRIBUTE_JOINT_WEIGHT, weights);
    let inverse = joints.map(|at| Mat4::from_translation(-at)).to_vec();
    let inverse_bindposes =
        world.resource_mut::<Assets<_>>().add(SkinnedMeshInverseBindposes::from(inverse));
    let joints = joints.map(|at| world.spawn(Transform::from_translation(at)).id()).to_vec();
    let upper = joints[1];
    let mesh = world.resource_mut::<Assets<Mesh>>().add(mesh);
    let body = world.spawn((Mesh3d(mesh), SkinnedMesh { inverse_bindposes, joints })).id();
    let roots = groomed.planted.roots.clone();
    let hair = world.spawn(Hair).id();
    for strand in groomed.planted.groom.strands() {
        world.spawn((StrandOf(hair), Strand::from_polyline(strand.points).unwrap()));
    }
    world.entity_mut(hair).insert(RootsOnMesh { mesh: Some(body), roots, ..default() });
    (groomed.body, groomed.hair) = (body, hair);
    run(&mut groomed.app, 0.05);
    *groomed.app.world_mut().get_mut::<Transform>(upper).unwrap() =
        Transform::from_xyz(0.0, 0.0, 0.02).with_rotation(Quat::from_rotation_x(bend));
    run(&mut groomed.app, 1.0);
    groomed
}

/// Line 12: how far roots and nodes jump in the tick after a touch in a bent pose (m).
fn jump_when_touched(touch: bool) -> f32 {
    let mut own = neck(1.2);
    let before = strands_of(&own.app, own.hair);
    if touch {
        own.app.world_mut().get_mut::<RootsOnMesh>(own.hair).unwrap().set_changed();
    }
    run(&mut own.app, 1.0 / 60.0);
    apart(&before, &strands_of(&own.app, own.hair))
}

#[test]
fn blended_skin_that_is_touched_when_bent_does_not_jump() {
    let [control, touched] = [false, true].map(jump_when_touched);
    println!("{touched} m, untouched {control} m");
    assert!((touched - control).abs() < 1e-6, "{touched} m, untouched {control} m");
}

/// Line 12: another mesh is named that is as large as planted, elsewhere: how far roots are off it (m), and the
/// longest strand (m).
fn moved_to_another_mesh(is_other: bool) -> (f32, f32) {
    let mut own = groomed(2.0);
    let there = Transform::from_xyz(-2.0, 0.0, 1.0);
    let other = body_at(&mut own.app, head(HEAD), there);
    let shape = shape(&own);
    if is_other {
        own.app.world_mut().get_mut::<RootsOnMesh>(own.hair).unwrap().mesh = Some(other);
    }
    run(&mut own.app, 0.1);
    assert_eq!(faults(&mut own.app), []);
    let surface = if is_other { there } else { place(2.0) };
    let bent = self::shape(&own).iter().zip(&shape).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    assert!(bent < 0.01, "it keeps its shape: {bent} rad");
    (off_skin(&own, 1, |p| surface.transform_point(p)), longest(&own.app, own.hair))
}

/// How much each joint is bent (rad).
fn shape(groomed: &Groomed) -> Vec<f32> {
    let bend = |strand: &Strand| -> Vec<f32> {
        (1..strand.edges()).map(|i| 2.0 * strand.darboux(i).xyz().length()).collect()
    };
    strands_of(&groomed.app, groomed.hair).iter().flat_map(bend).collect()
}

#[test]
fn hair_is_moved_to_another_mesh_that_is_named() {
    for (is_other, scale) in [(false, 2.0), (true, 1.0)] {
        let (off, length) = moved_to_another_mesh(is_other);
        println!("other mesh {is_other}: {off} m off, {length} m long");
        assert!(off < 1e-4, "{off} m off the mesh");
        assert!((length - scale * LONG).abs() < 1e-3, "{length} m");
    }
}

/// Line 12: every second strand is shaved off, roots are touched, and the mesh moves: how far roots are off (m).
fn shaved(touch: bool) -> f32 {
    let mut own = groomed(1.0);
    let members: Vec<Entity> = own.app.world().get::<Strands>(own.hair).unwrap().iter().collect();
    for shaved in members.iter().skip(1).step_by(2) {
        own.app.world_mut().entity_mut(*shaved).despawn();
    }
    if touch {
        own.app.world_mut().get_mut::<RootsOnMesh>(own.hair).unwrap().set_changed();
    }
    run(&mut own.app, 0.05);
    let there = Transform::from_xyz(0.35, 0.2, -0.1).with_rotation(Quat::from_rotation_y(0.3));
    *own.app.world_mut().get_mut::<Transform>(own.body).unwrap() = there;
    run(&mut own.app, 0.2);
    assert_eq!(faults(&mut own.app), [], "touched {touch}");
    off_skin(&own, 2, |p| there.transform_point(p))
}

#[test]
fn what_is_left_after_shaving_finds_its_roots() {
    for touch in [false, true] {
        let off = shaved(touch);
        println!("touched {touch}: {off} m off");
        assert!(off < 1e-4, "touched {touch}: {off} m off");
    }
}

/// A character with worn hair, and another of it that stands `AWAY` from it.
struct Pair {
    app: App,
    /// The wearer, its hair and the mesh of its head: the original's, then the other's.
    wearers: Vec<Entity>,
}

const AWAY: Vec3 = Vec3::new(3.0, 0.0, 0.0);

/// How the other character comes to be.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Copied {
    /// There is only the original.
    No,
    Cloned,
    /// Saved as a scene and loaded beside it.
    Loaded,
}

/// A few strands that stand off the upper half of an ellipsoid.
fn short_groom(app: &mut App, middle: Vec3, half: Vec3) -> Handle<Groom> {
    let strand = |k: usize| {
        let (sine, cosine) = (2.4 * k as f32).sin_cos();
        let up = 0.3 + 0.03 * k as f32;
        let wide = (1.0 - up * up).sqrt();
        let way = Vec3::new(wide * cosine, up, wide * sine);
        [0.0, 0.02, 0.04, 0.06].map(|out| middle + half * way + out * way)
    };
    let groom = Groom::from_polylines((0..20).map(strand)).unwrap();
    app.world_mut().resource_mut::<Assets<Groom>>().add(groom)
}

fn pair(copied: Copied, colliders: bool) -> Pair {
    let mut app = wear::app();
    let groom = short_groom(&mut app, wear::MIDDLE, wear::HALF);
    let wear = WearHair { colliders, ..WearHair::new(groom) };
    let root = app.world_mut().spawn((Transform::default(), wear)).id();
    wear::character(&mut app, root, 1.0);
    let hair = wear::worn(&mut app);
    run(&mut app, 0.2);
    // A style to be remembered.
    app.world_mut().write_message(HairTreatment::set(hair, BondKind::Hydrogen, 0.25).unwrap());
    run(&mut app, 0.1);
    let mut wearers = vec![root];
    match copied {
        Copied::No => {}
        Copied::Cloned => wearers.push(clone(&mut app, root)),
        Copied::Loaded => {
            let saved = save(&mut app, root);
            wearers.push(load(&mut app, &saved)[&root]);
        }
    }
    if let Some(copy) = wearers.get(1) {
        app.world_mut().get_mut::<Transform>(*copy).unwrap().translation = AWAY;
    }
    Pair { app, wearers }
}

/// An entity and all below it, strands included, in an order that is the same in copies.
fn everything(world: &World, root: Entity) -> Vec<Entity> {
    let mut found = vec![root];
    let mut next = 0;
    while let Some(&at) = found.get(next) {
        found.extend(world.get::<Children>(at).into_iter().flatten());
        found.extend(world.get::<Strands>(at).into_iter().flat_map(|strands| strands.iter()));
        next += 1;
    }
    found
}

fn clone(app: &mut App, root: Entity) -> Entity {
    let world = app.world_mut();
    let copy = world.entity_mut(root).clone_and_spawn_with_opt_out(|cloner| {
        cloner.linked_cloning(true);
    });
    // Bevy leaves joints that are deeper than their mesh at the original's.
    let map: EntityHashMap<Entity> =
        everything(world, root).into_iter().zip(everything(world, copy)).collect();
    for mesh in map.values() {
        if let Some(mut skin) = world.get_mut::<SkinnedMesh>(*mesh) {
            skin.joints.iter_mut().for_each(|joint| *joint = *map.get(joint).unwrap_or(joint));
        }
    }
    copy
}

/// What scenes need to know of Bevy's components.
fn register(app: &mut App) {
    app.register_type::<Transform>()
        .register_type::<ChildOf>()
        .register_type::<Children>()
        .register_type::<Name>()
        .register_type::<Mesh3d>()
        .register_type::<SkinnedMesh>();
}

fn save(app: &mut App, root: Entity) -> DynamicWorld {
    register(app);
    let all = everything(app.world(), root);
    let registry = app.world().resource::<AppTypeRegistry>().clone();
    let registry = registry.read();
    DynamicWorldBuilder::from_world(app.world(), &registry)
        .extract_entities(all.into_iter())
        .build()
}

fn load(app: &mut App, saved: &DynamicWorld) -> EntityHashMap<Entity> {
    register(app);
    let mut map = EntityHashMap::default();
    saved.write_to_world(app.world_mut(), &mut map).unwrap();
    map
}

fn hair_of(app: &mut App, wearer: Entity) -> Vec<Entity> {
    let mut worn = app.world_mut().query::<(Entity, &WornHair)>();
    worn.iter(app.world()).filter(|(_, worn)| worn.wearer == wearer).map(|(hair, _)| hair).collect()
}

fn count<T: Component>(app: &mut App) -> usize {
    app.world_mut().query::<&T>().iter(app.world()).count()
}

/// Roots in the world, strand by strand.
fn roots_in_world(app: &App, hair: Entity) -> Vec<Vec3> {
    let frame = app.world().get::<GlobalTransform>(hair).unwrap();
    strands_of(app, hair).iter().map(|s| frame.transform_point(s.positions()[0])).collect()
}

/// Lines 11 and 14: how many hairs there are of each wearer, and the ratio of colliders to those of one.
fn hairs_and_colliders(copied: Copied) -> (Vec<usize>, f32) {
    let mut alone = pair(Copied::No, true);
    run(&mut alone.app, 0.2);
    let mut own = pair(copied, true);
    // Time for a second hair to be made, if one is.
    for _ in 0..60 {
        own.app.update();
        sleep(Duration::from_millis(1));
    }
    let hairs = own.wearers.clone().into_iter().map(|wearer| hair_of(&mut own.app, wearer).len());
    let hairs = hairs.collect();
    let colliders = count::<HairCollider>(&mut own.app) as f32;
    (hairs, colliders / count::<HairCollider>(&mut alone.app) as f32)
}

/// Lines 11 and 14: how far roots of the other character are from those of the original at most, less where it
/// stands (m), at once and after it has walked away.
fn roots_of_copy(copied: Copied) -> [f32; 2] {
    let mut own = pair(copied, false);
    let hairs: Vec<Entity> =
        own.wearers.clone().into_iter().map(|wearer| hair_of(&mut own.app, wearer)[0]).collect();
    let mut walked = Vec3::ZERO;
    [(); 2].map(|()| {
        own.app.world_mut().get_mut::<Transform>(own.wearers[1]).unwrap().translation =
            AWAY + walked;
        run(&mut own.app, 0.2);
        let [original, other] = [hairs[0], hairs[1]].map(|hair| roots_in_world(&own.app, hair));
        assert_eq!(original.len(), other.len());
        let pairs = original.iter().zip(&other);
        let off = pairs.map(|(a, b)| (*a + AWAY + walked).distance(*b)).fold(0.0, f32::max);
        walked += Vec3::new(0.0, 0.0, 0.4);
        off
    })
}

/// Lines 11 and 14: the largest difference of any joint's bonds and of any length (m) between both hairs at once.
fn style_of_copy(copied: Copied) -> f32 {
    let mut own = pair(copied, false);
    let wearers = own.wearers.clone();
    let hairs: Vec<Entity> = wearers.iter().map(|w| hair_of(&mut own.app, *w)[0]).collect();
    let world = own.app.world();
    let of = |hair: Entity| -> Vec<(Strand, Bonds)> {
        let members = world.get::<Strands>(hair).unwrap().iter();
        members
            .map(|id| {
                (world.get::<Strand>(id).unwrap().clone(), world.get::<Bonds>(id).unwrap().clone())
            })
            .collect()
    };
    let mut off = 0.0_f32;
    for ((a, bonds_a), (b, bonds_b)) in of(hairs[0]).iter().zip(&of(hairs[1])) {
        off = off.max((a.length() - b.length()).abs());
        for (a, b) in bonds_a.joints.iter().zip(&bonds_b.joints) {
            let rates = a.rates.iter().zip(&b.rates).map(|(a, b)| (a - b).abs());
            let shapes = a.shapes.iter().zip(&b.shapes).map(|(a, b)| a.distance(*b));
            off = rates.chain(shapes).fold(off, f32::max);
        }
    }
    off
}

#[test]
fn a_copy_of_a_character_has_one_hair_on_its_own_head() {
    for copied in [Copied::Cloned, Copied::Loaded] {
        let (hairs, colliders) = hairs_and_colliders(copied);
        println!("{copied:?}: hairs {hairs:?}, {colliders} times the colliders");
        assert_eq!((hairs, colliders), (vec![1, 1], 2.0), "{copied:?}");
        let off = roots_of_copy(copied);
        println!("{copied:?}: roots {off:?} m off");
        assert!(off.iter().all(|off| *off < 1e-4), "{copied:?}: roots {off:?} m off");
        assert_eq!(style_of_copy(copied), 0.0, "{copied:?}");
    }
}

#[test]
fn the_original_stays_as_it_is_to_the_bit() {
    let hair_after = |copied| {
        let mut own = pair(copied, false);
        run(&mut own.app, 0.3);
        let hair = hair_of(&mut own.app, own.wearers[0])[0];
        strands_of(&own.app, hair)
    };
    let alone = hair_after(Copied::No);
    for copied in [Copied::Cloned, Copied::Loaded] {
        let beside = hair_after(copied);
        let bits = |all: &[Strand]| -> Vec<[u32; 3]> {
            let nodes = all.iter().flat_map(|s| s.positions().to_vec());
            nodes.map(|p| p.to_array().map(f32::to_bits)).collect()
        };
        assert!(bits(&alone) == bits(&beside), "{copied:?}: {} m", apart(&alone, &beside));
    }
}

#[test]
fn a_copy_takes_off_its_own_hair_only() {
    for copied in [Copied::Cloned, Copied::Loaded] {
        for wait in [0.0, 0.2] {
            let mut own = pair(copied, wait > 0.0);
            run(&mut own.app, wait);
            let before = count::<HairCollider>(&mut own.app);
            own.app.world_mut().entity_mut(own.wearers[1]).remove::<WearHair>();
            own.app.update();
            let left: Vec<usize> =
                own.wearers.clone().iter().map(|w| hair_of(&mut own.app, *w).len()).collect();
            assert_eq!(left, [1, 0], "{copied:?} after {wait} s");
            assert_eq!(2 * count::<HairCollider>(&mut own.app), before, "{copied:?}");
        }
    }
}

/// Line 11: strands of hair that is grown from a groom and cloned, and of its clone.
fn strands_of_cloned_groom() -> [usize; 2] {
    let mut app = app_with_meshes(60.0);
    let lines = (0..20).map(|k| {
        let root = Vec3::X * (0.01 * k as f32);
        [root, root + Vec3::Y * 0.05, root + Vec3::Y * 0.1]
    });
    let groom = Groom::from_polylines(lines).unwrap();
    let groom = app.world_mut().resource_mut::<Assets<Groom>>().add(groom);
    let hair = app.world_mut().spawn((GroomedHair::new(groom), Transform::default())).id();
    run(&mut app, 0.1);
    let copy = clone(&mut app, hair);
    run(&mut app, 0.1);
    let counts = [hair, copy].map(|hair| strands_of(&app, hair).len());
    app.world_mut().entity_mut(copy).remove::<GroomedHair>();
    run(&mut app, 0.1);
    assert_eq!(strands_of(&app, copy).len(), 0);
    assert_eq!(strands_of(&app, hair).len(), counts[0], "the original keeps its own");
    counts
}

#[test]
fn hair_that_is_grown_from_a_groom_is_cloned_once() {
    assert_eq!(strands_of_cloned_groom(), [20, 20]);
}

/// Line 14: hair on a mesh of twice its size, saved and loaded beside the original, or into an app with strangers:
/// the longest strand (m), and how far roots are off the loaded mesh after that has moved (m).
fn loaded(elsewhere: bool) -> (f32, f32) {
    let mut own = groomed(2.0);
    let world = own.app.world_mut();
    let top = world.spawn(Transform::default()).id();
    world.entity_mut(top).add_children(&[own.body, own.hair]);
    let saved = save(&mut own.app, top);
    if elsewhere {
        own.app = app_with_meshes(60.0);
        no_gravity(&mut own.app);
        // Its entities and meshes have the same numbers.
        let mut meshes = own.app.world_mut().resource_mut::<Assets<Mesh>>();
        let mesh = meshes.add(head(HEAD));
        for _ in 0..400 {
            let stranger = Transform::from_xyz(5.0, 0.0, 0.0);
            own.app.world_mut().spawn((Mesh3d(mesh.clone()), stranger));
        }
        run(&mut own.app, 0.05);
        std::mem::forget(mesh);
    }
    let map = load(&mut own.app, &saved);
    (own.body, own.hair) = (map[&own.body], map[&own.hair]);
    run(&mut own.app, 0.1);
    let there = place(2.0).with_rotation(Quat::from_rotation_x(0.6));
    *own.app.world_mut().get_mut::<Transform>(own.body).unwrap() = there;
    run(&mut own.app, 0.2);
    assert_eq!(faults(&mut own.app), []);
    (longest(&own.app, own.hair), off_skin(&own, 1, |p| there.transform_point(p)))
}

#[test]
fn hair_on_a_scaled_mesh_comes_back_from_a_scene_as_it_was() {
    for elsewhere in [false, true] {
        let (length, off) = loaded(elsewhere);
        println!("elsewhere {elsewhere}: {length} m long, {off} m off");
        assert!((length - 2.0 * LONG).abs() < 1e-3, "elsewhere {elsewhere}: {length} m");
        assert!(off < 1e-4, "elsewhere {elsewhere}: {off} m off");
    }
}

/// How a mesh is changed.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Edit {
    Not,
    Vertices,
    Mesh3d,
}

/// Makes a mesh larger.
fn enlarge(app: &mut App, body: Entity, mesh: Mesh, by: f32, edit: Edit) {
    let world = app.world_mut();
    let larger = mesh.scaled_by(Vec3::splat(by));
    let handle = world.get::<Mesh3d>(body).unwrap().0.clone();
    match edit {
        Edit::Not => {}
        Edit::Vertices => {
            let mut meshes = world.resource_mut::<Assets<Mesh>>();
            *meshes.get_mut(&handle).unwrap() = larger;
        }
        Edit::Mesh3d => {
            let larger = world.resource_mut::<Assets<Mesh>>().add(larger);
            world.get_mut::<Mesh3d>(body).unwrap().0 = larger;
        }
    }
}

/// Line 13: a mesh is edited to 1.25 times its size: how far roots are off it then (m), and the longest strand (m).
fn edited(edit: Edit) -> (f32, f32) {
    let mut own = groomed(1.0);
    enlarge(&mut own.app, own.body, head(HEAD), 1.25, edit);
    run(&mut own.app, 0.2);
    assert_eq!(faults(&mut own.app), []);
    let by = if edit == Edit::Not { 1.0 } else { 1.25 };
    (off_skin(&own, 1, |p| place(1.0).transform_point(p * by)), longest(&own.app, own.hair))
}

#[test]
fn roots_follow_vertices_that_are_edited() {
    for edit in [Edit::Not, Edit::Vertices, Edit::Mesh3d] {
        let (off, length) = edited(edit);
        println!("{edit:?}: {off} m off, {length} m long");
        assert!(off < 1e-4, "{edit:?}: roots {off} m off the skin");
        assert!((length - LONG).abs() < 1e-3, "{edit:?}: {length} m long");
    }
}

/// Line 13: a mesh that is edited in every frame: how far drawn roots are off it at most, as it was a
/// frame ago (m).
fn drawn_off_pulsing_mesh() -> f32 {
    let mut own = groomed(1.0);
    let (mut worst, mut before) = (0.0_f32, 1.0);
    for frame in 0..30 {
        let by = 1.0 + 0.2 * (0.3 * frame as f32).sin();
        enlarge(&mut own.app, own.body, head(HEAD), by, Edit::Vertices);
        own.app.update();
        let world = own.app.world();
        let members = world.get::<Strands>(own.hair).unwrap();
        let overstep = world.resource::<Time<Fixed>>().overstep_fraction();
        let frame = world.get::<GlobalTransform>(own.hair).unwrap();
        for (id, planted) in members.iter().zip(own.planted.groom.strands()) {
            let history = world.get::<StrandHistory>(id).unwrap();
            let drawn = history.drawn(world.get::<Strand>(id).unwrap(), 0, overstep);
            let skin = place(1.0).transform_point(planted.points[0] * before);
            worst = worst.max(frame.transform_point(drawn).distance(skin));
        }
        before = by;
    }
    worst
}

#[test]
fn roots_are_drawn_a_frame_later_on_a_mesh_that_is_edited_in_every_frame() {
    let off = drawn_off_pulsing_mesh();
    println!("{off} m off");
    assert!(off < 1e-4, "{off} m off");
}

#[test]
fn a_mesh_of_other_triangles_is_told_of_once_and_may_be_planted_on() {
    let mut own = groomed(1.0);
    let before = off_skin(&own, 1, |p| place(1.0).transform_point(p));
    let other = Sphere::new(1.2 * HEAD).mesh().uv(30, 20);
    let mut meshes = own.app.world_mut().resource_mut::<Assets<Mesh>>();
    let handle = meshes.add(other.clone());
    own.app.world_mut().entity_mut(own.body).insert(Mesh3d(handle));
    run(&mut own.app, 0.3);
    let reported = faults(&mut own.app);
    assert!(
        matches!(&reported[..], [f] if f.kind == FaultKind::Roots
            && matches!(f.cause::<RootsError>(), Some(RootsError::Triangles { .. }))),
        "{reported:?}"
    );
    let after = off_skin(&own, 1, |p| place(1.0).transform_point(p));
    assert!((after - before).abs() < 1e-5, "they stay on the mesh as it was");
    let places = own.planted.groom.strands().map(|strand| strand.points[0]);
    let nearest = RootOnMesh::nearest(&other, places).unwrap();
    let mut roots = own.app.world_mut().get_mut::<RootsOnMesh>(own.hair).unwrap();
    roots.roots = nearest.into_iter().map(|(root, _)| root).collect();
    run(&mut own.app, 0.3);
    assert_eq!(faults(&mut own.app), []);
    let frame = *own.app.world().get::<Transform>(own.hair).unwrap();
    for strand in strands_of(&own.app, own.hair) {
        let root = frame.transform_point(strand.positions()[0]);
        let at = place(1.0).to_matrix().inverse().transform_point3(root);
        assert!((at.length() - 1.2 * HEAD).abs() < 2e-3, "{} m from the middle", at.length());
    }
    assert!((longest(&own.app, own.hair) - LONG).abs() < 1e-3);
}

/// The farthest reach of worn hair's colliders from the middle of a head on its own mesh (m).
fn reach_of_colliders(app: &mut App) -> f32 {
    let world = app.world_mut();
    let mut all = world.query::<(&HairCollider, &GlobalTransform)>();
    let reach = all.iter(world).map(|(collider, place)| {
        let ball = match collider.shape {
            ColliderShape::Sphere(ball) => ball.radius * place.scale().max_element(),
            _ => 0.0,
        };
        place.translation().length() + ball
    });
    reach.fold(0.0, f32::max)
}

/// Line 13: how much farther the colliders of worn hair reach, and the median of its roots is from the middle, after
/// an edit to 1.3 times the size; and whether hair was made again.
fn worn_on_edited_head(edit: Edit) -> ([f32; 2], bool) {
    let mut app = wear::app();
    let mesh = app.world_mut().resource_mut::<Assets<Mesh>>().add(wear::ball(0.1));
    let wear = WearHair::new(short_groom(&mut app, Vec3::ZERO, Vec3::splat(0.1)));
    let head = app.world_mut().spawn((Mesh3d(mesh), Transform::default(), wear)).id();
    let hair = wear::worn(&mut app);
    run(&mut app, 0.1);
    let measure = |app: &mut App, hair| {
        let mut roots: Vec<f32> = roots_in_world(app, hair).iter().map(|p| p.length()).collect();
        roots.sort_by(f32::total_cmp);
        [reach_of_colliders(app), roots[roots.len() / 2]]
    };
    let before = measure(&mut app, hair);
    enlarge(&mut app, head, wear::ball(0.1), 1.3, edit);
    for _ in 0..400 {
        app.update();
        sleep(Duration::from_millis(2));
        let after = measure(&mut app, hair);
        if edit != Edit::Not && after.iter().zip(&before).all(|(a, b)| a / b > 1.25) {
            break;
        }
    }
    let hairs = hair_of(&mut app, head);
    let after = measure(&mut app, hairs[0]);
    ([after[0] / before[0], after[1] / before[1]], hairs != [hair])
}

#[test]
fn colliders_of_worn_hair_are_fitted_to_the_edited_head() {
    for (edit, expected) in [(Edit::Not, 1.0), (Edit::Vertices, 1.3), (Edit::Mesh3d, 1.3)] {
        let (grown, is_new) = worn_on_edited_head(edit);
        println!("{edit:?}: colliders and roots {grown:?} times as far, made again {is_new}");
        assert!(grown.iter().all(|by| (by - expected).abs() < 0.03), "{edit:?}: {grown:?}");
        assert!(!is_new, "{edit:?}");
    }
}

#[test]
fn hair_is_planted_again_on_a_head_of_other_triangles() {
    let mut app = wear::app();
    let mesh = app.world_mut().resource_mut::<Assets<Mesh>>().add(wear::ball(0.1));
    let wear = WearHair::new(short_groom(&mut app, Vec3::ZERO, Vec3::splat(0.1)));
    let head = app.world_mut().spawn((Mesh3d(mesh), Transform::default(), wear)).id();
    let hair = wear::worn(&mut app);
    run(&mut app, 0.1);
    let other = Sphere::new(0.1).mesh().uv(40, 30);
    let other = app.world_mut().resource_mut::<Assets<Mesh>>().add(other);
    app.world_mut().get_mut::<Mesh3d>(head).unwrap().0 = other;
    let again = wear::worn(&mut app);
    assert_ne!(hair, again);
    run(&mut app, 0.1);
    assert_eq!(faults(&mut app), []);
    assert_eq!(hair_of(&mut app, head), [again]);
    for root in roots_in_world(&app, again) {
        assert!((root.length() - 0.1).abs() < 2e-3, "{} m", root.length());
    }
}

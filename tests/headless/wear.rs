//! Hair worn by one component: when it comes, how it lies, and what happens when it cannot.
#![cfg(all(feature = "groom", feature = "save"))]

use crate::{
    common::{app_with_meshes, faults, wait_for},
    worlds_measured::wearer::{BONES, HALF, MIDDLE, ball, character},
};
use bevy::{
    asset::RenderAssetUsages,
    mesh::{Indices, PrimitiveTopology, VertexAttributeValues, skinning::SkinnedMesh},
    prelude::*,
};
use bevy_keratin::{
    FaultKind, HairSource, WearError,
    authoring::{groom::Groom, plant::*},
    prelude::*,
};

#[derive(Resource, Default)]
pub(super) struct Reported {
    pub(super) worn: Vec<HairWorn>,
    pub(super) refused: Vec<(Entity, WearError)>,
}

pub(super) fn app() -> App {
    let mut app = app_with_meshes(60.0);
    listen(&mut app);
    app
}

pub(super) fn listen(app: &mut App) {
    app.init_resource::<Reported>()
        .add_observer(|worn: On<HairWorn>, mut reported: ResMut<Reported>| {
            reported.worn.push(worn.event().clone());
        })
        .add_observer(|not: On<HairNotWorn>, mut reported: ResMut<Reported>| {
            reported.refused.push((not.entity, not.error.clone()));
        });
}

fn reported(app: &mut App) -> Reported {
    core::mem::take(&mut *app.world_mut().resource_mut::<Reported>())
}

/// Updates until an event of wearing is triggered.
pub(super) fn wait(app: &mut App) -> Reported {
    wait_for(app, |app| {
        let reported = reported(app);
        let any = !(reported.worn.is_empty() && reported.refused.is_empty());
        any.then_some(reported)
    })
}

pub(super) fn worn(app: &mut App) -> Entity {
    let reported = wait(app);
    assert_eq!(reported.refused, [], "refused");
    reported.worn[0].hair
}

pub(super) fn strands(app: &mut App, hair: Entity) -> Vec<Strand> {
    let world = app.world_mut();
    let members: Vec<Entity> = world.get::<Strands>(hair).unwrap().iter().collect();
    members.into_iter().map(|s| world.get::<Strand>(s).unwrap().clone()).collect()
}

/// From the hair's frame to the wearer's, as transforms are now.
pub(super) fn place_in(app: &App, entity: Entity, root: Entity) -> Mat4 {
    let (mut at, mut place) = (entity, Mat4::IDENTITY);
    while at != root {
        place = app.world().get::<Transform>(at).unwrap().to_matrix() * place;
        at = app.world().get::<ChildOf>(at).unwrap().parent();
    }
    place
}

/// How far a place of the character is off its head's skin, about (m).
fn off_head(p: Vec3) -> f32 {
    let scaled = (p - MIDDLE) / HALF;
    (scaled.length() - 1.0) * HALF.min_element()
}

fn wearers(app: &mut App) -> usize {
    app.world_mut().query::<&WornAs>().iter(app.world()).count()
}

#[test]
fn a_preset_waits_for_the_character_and_is_planted_on_its_head() {
    let mut app = app();
    let at = Transform::from_xyz(3.0, 0.5, -1.0).with_rotation(Quat::from_rotation_y(0.7));
    let root = app.world_mut().spawn((at, WearHair::new(HairPreset::Short))).id();
    (0..20).for_each(|_| app.update());
    assert_eq!(reported(&mut app).worn, []);
    let (head, _) = character(&mut app, root, 1.0);
    let hair = worn(&mut app);
    let world = app.world();
    assert_eq!(world.get::<ChildOf>(hair).unwrap().parent(), head);
    assert_eq!(world.get::<WornBy>(hair), Some(&WornBy(root)));
    assert_eq!(world.get::<WornAs>(hair).unwrap().preset(), Some(HairPreset::Short));
    assert_eq!(world.get::<HairStiffness>(hair), Some(&HairPreset::Short.settings().stiffness));
    // 223 fibres for each cm², 0.8 guides.
    let fibres = world.get::<HairWetting>(hair).unwrap().fibres;
    assert!((fibres - 223.0 / 0.8).abs() < 1.5, "{fibres} fibres");
    let to_root = place_in(&app, hair, root);
    let all = strands(&mut app, hair);
    assert!(all.len() > 200, "{} strands", all.len());
    let mut behind = 0;
    for strand in &all {
        let root = to_root.transform_point3(strand.positions()[0]);
        assert!(off_head(root).abs() < 2e-3, "{root} is {} m off the head", off_head(root));
        behind += usize::from(root.z > 0.0);
    }
    // It looks along −Z, and hair grows on crown and nape.
    assert!(behind * 10 > all.len() * 6, "{behind} of {} behind the middle", all.len());
    assert!(faults(&mut app).is_empty());
    // Later ticks move no root off the head, and nothing is reported twice.
    (0..30).for_each(|_| app.update());
    for strand in strands(&mut app, hair) {
        let root = to_root.transform_point3(strand.positions()[0]);
        assert!(off_head(root).abs() < 2e-3 && strand.is_finite());
    }
    assert_eq!(reported(&mut app).worn, []);
    assert!(faults(&mut app).is_empty());
}

#[test]
fn hair_is_swapped_when_the_new_is_ready_and_gone_with_its_component() {
    let mut app = app();
    let root = app.world_mut().spawn((Transform::default(), WearHair::new(HairPreset::Bob))).id();
    character(&mut app, root, 1.0);
    let bob = worn(&mut app);
    app.world_mut().get_mut::<WearHair>(root).unwrap().hair = HairPreset::Coily.into();
    app.update();
    assert!(app.world().get::<Hair>(bob).is_some(), "the old stays while the new is made");
    let coily = worn(&mut app);
    let world = app.world();
    assert!(world.get_entity(bob).is_err(), "the old is gone with the new");
    assert_eq!(world.get::<WornAs>(coily).unwrap().preset(), Some(HairPreset::Coily));
    assert_eq!(wearers(&mut app), 1);
    // A write without a change makes no new hair.
    app.world_mut().get_mut::<WearHair>(root).unwrap().hair = HairPreset::Coily.into();
    (0..20).for_each(|_| app.update());
    assert_eq!(reported(&mut app).worn, []);
    let colliders =
        |app: &mut App| app.world_mut().query::<&HairCollider>().iter(app.world()).count();
    assert!((8..80).contains(&colliders(&mut app)), "{} colliders", colliders(&mut app));
    app.world_mut().entity_mut(root).remove::<WearHair>();
    app.update();
    assert_eq!((wearers(&mut app), colliders(&mut app)), (0, 0));
    let left = app.world_mut().query::<&Strand>().iter(app.world()).count();
    assert_eq!(left, 0, "strands are left");
    // In the middle of being made, too.
    app.world_mut().entity_mut(root).insert(WearHair::new(HairPreset::Bob));
    app.update();
    app.world_mut().entity_mut(root).remove::<WearHair>();
    (0..100).for_each(|_| app.update());
    assert_eq!((wearers(&mut app), reported(&mut app).worn.len()), (0, 0));
}

#[test]
fn a_bone_that_is_not_there_is_reported_once_with_those_that_are() {
    let mut app = app();
    let wear = WearHair::new(HairPreset::Short).on("Skull");
    let root = app.world_mut().spawn((Transform::default(), wear)).id();
    (0..10).for_each(|_| app.update());
    assert!(faults(&mut app).is_empty(), "before the scene is there nothing is missing");
    let (head, _) = character(&mut app, root, 1.0);
    (0..50).for_each(|_| app.update());
    let reported = faults(&mut app);
    assert_eq!(reported.len(), 1, "{reported:?}");
    let fault = &reported[0];
    assert_eq!((fault.kind, fault.entity), (FaultKind::Wear, Some(root)));
    for name in ["\"Skull\"", "\"Hips\"", "\"Head\""] {
        assert!(fault.message.contains(name), "{}", fault.message);
    }
    // It may still come, or be another.
    app.world_mut().get_mut::<WearHair>(root).unwrap().on = Some("Head".into());
    let hair = {
        let reported = wait(&mut app);
        reported.worn.first().map(|w| w.hair).unwrap_or_else(|| worn(&mut app))
    };
    assert_eq!(app.world().get::<ChildOf>(hair).unwrap().parent(), head);
}

#[test]
fn nothing_to_wear_hair_on_is_reported_after_a_while() {
    let mut app = app();
    let id = app.world_mut().spawn((Transform::default(), WearHair::default())).id();
    (0..60 * 9).for_each(|_| app.update());
    assert!(faults(&mut app).is_empty());
    (0..60 * 4).for_each(|_| app.update());
    let reported = faults(&mut app);
    assert_eq!(reported.len(), 1, "{reported:?}");
    assert_eq!((reported[0].kind, reported[0].entity), (FaultKind::Wear, Some(id)));
}

#[test]
fn meshes_that_are_no_heads_are_refused_in_one_clear_fault() {
    let points = Mesh::new(PrimitiveTopology::PointList, RenderAssetUsages::default())
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, vec![[0.0, 0.1, 0.0]; 9]);
    let empty = Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default())
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, Vec::<[f32; 3]>::new())
        .with_inserted_indices(Indices::U32(vec![]));
    let bare = Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default());
    let mut nan = ball(0.1);
    if let Some(VertexAttributeValues::Float32x3(places)) =
        nan.attribute_mut(Mesh::ATTRIBUTE_POSITION)
    {
        places[100][1] = f32::NAN;
    }
    let all_nan = {
        let mut mesh = ball(0.1);
        if let Some(VertexAttributeValues::Float32x3(places)) =
            mesh.attribute_mut(Mesh::ATTRIBUTE_POSITION)
        {
            places.fill([f32::NAN; 3]);
        }
        mesh
    };
    let mut flat = ball(0.1);
    if let Some(VertexAttributeValues::Float32x3(places)) =
        flat.attribute_mut(Mesh::ATTRIBUTE_POSITION)
    {
        places.iter_mut().for_each(|p| *p = [p[0], 0.0, 0.0]);
    }
    let bad = [
        ("points", points, "PointList"),
        ("empty", empty, "no triangle"),
        ("bare", bare, "no positions"),
        ("NaN", nan, "not finite"),
        ("all NaN", all_nan, "not finite"),
        ("10 µm", ball(1e-5), "m from the middle"),
        ("10 km", ball(1e4), "m from the middle"),
        ("flat", flat, "degenerate"),
    ];
    for (what, mesh, expected) in bad {
        let mut app = app();
        let good = app.world_mut().resource_mut::<Assets<Mesh>>().add(ball(0.1));
        let bad = app.world_mut().resource_mut::<Assets<Mesh>>().add(mesh);
        let wear = || WearHair::new(HairPreset::Short);
        let bad = app.world_mut().spawn((Mesh3d(bad), Transform::default(), wear())).id();
        let good = app.world_mut().spawn((Mesh3d(good), Transform::default(), wear())).id();
        let (mut refused, mut worn) = (Vec::new(), Vec::new());
        while worn.is_empty() || refused.is_empty() {
            let reported = wait(&mut app);
            refused.extend(reported.refused);
            worn.extend(reported.worn);
        }
        (0..30).for_each(|_| app.update());
        refused.extend(reported(&mut app).refused);
        let reported = faults(&mut app);
        println!("{what}: {}", reported[0].message);
        assert_eq!((refused.len(), reported.len(), worn.len()), (1, 1, 1), "{what}: {reported:?}");
        assert_eq!((refused[0].0, worn[0].entity), (bad, good), "{what}");
        assert_eq!((reported[0].kind, reported[0].entity), (FaultKind::Wear, Some(bad)), "{what}");
        assert!(reported[0].message.contains(expected), "{what}: {}", reported[0].message);
    }
}

#[test]
fn numbers_that_are_none_are_refused() {
    let head =
        |app: &mut App| Mesh3d(app.world_mut().resource_mut::<Assets<Mesh>>().add(ball(0.1)));
    let nan = WearHair {
        scalp: Some(Scalp { height: f32::NAN, ..default() }),
        ..WearHair::new(HairPreset::Bob)
    };
    let up = WearHair::new(HairPreset::Bob).facing(Dir3::Y);
    let nowhere = [("scalp", nan), ("up", up)];
    for (what, wear) in nowhere {
        let mut app = app();
        let mesh = head(&mut app);
        let id = app.world_mut().spawn((mesh, Transform::default(), wear)).id();
        let reported = wait(&mut app);
        assert_eq!((reported.worn.len(), reported.refused.len()), (0, 1), "{what}");
        assert_eq!(reported.refused[0].0, id);
        assert_eq!(faults(&mut app).len(), 1, "{what}");
    }
    // A head of no size on a body, which may grow.
    let mut app = app();
    let mesh = head(&mut app);
    let root = app.world_mut().spawn((Transform::default(), WearHair::new(HairPreset::Bob))).id();
    let place = Transform::from_scale(Vec3::NAN);
    app.world_mut().spawn((mesh, Name::new("head"), place, ChildOf(root)));
    let reported = wait(&mut app);
    assert_eq!((reported.worn.len(), reported.refused.len()), (0, 1));
    assert_eq!(reported.refused[0].1, WearError::Pose);
}

#[test]
fn a_second_preset_on_one_head_is_refused() {
    let mut app = app();
    let root = app.world_mut().spawn((Transform::default(), WearHair::new(HairPreset::Bob))).id();
    let (head, _) = character(&mut app, root, 1.0);
    let bob = worn(&mut app);
    // What the character stands on.
    let wear = WearHair::new(HairPreset::Curly);
    let other = app.world_mut().spawn((Transform::default(), wear)).id();
    app.world_mut().entity_mut(root).insert(ChildOf(other));
    let reported = wait(&mut app);
    assert_eq!(reported.refused, [(other, WearError::Taken { by: root })]);
    (0..30).for_each(|_| app.update());
    assert_eq!((wearers(&mut app), faults(&mut app).len()), (1, 1));
    assert!(app.world().get::<Hair>(bob).is_some());
    // A hat may have hair of its own.
    app.world_mut().entity_mut(other).remove::<WearHair>();
    let hat = app.world_mut().resource_mut::<Assets<Mesh>>().add(ball(0.1));
    let wear = WearHair::new(HairPreset::Curly);
    app.world_mut().spawn((Mesh3d(hat), wear, Transform::default(), ChildOf(head)));
    let hat = worn(&mut app);
    assert_ne!(hat, bob);
    assert_eq!(wearers(&mut app), 2);
}

#[test]
fn a_head_is_free_again_when_its_wearer_is_gone() {
    let mut app = app();
    let root = app.world_mut().spawn((Transform::default(), WearHair::new(HairPreset::Bob))).id();
    character(&mut app, root, 1.0);
    worn(&mut app);
    let wear = WearHair::new(HairPreset::Curly);
    let other = app.world_mut().spawn((Transform::default(), wear)).id();
    app.world_mut().entity_mut(root).insert(ChildOf(other));
    assert_eq!(wait(&mut app).refused, [(other, WearError::Taken { by: root })]);
    (0..150).for_each(|_| app.update());
    assert_eq!(faults(&mut app).len(), 1, "reported once");
    app.world_mut().entity_mut(root).remove::<WearHair>();
    let hair = worn(&mut app);
    assert_eq!(app.world().get::<WornBy>(hair), Some(&WornBy(other)));
    assert_eq!(wearers(&mut app), 1);
}

#[test]
fn a_mirrored_character_wears_mirrored_hair() {
    let shape = |scale: Vec3| {
        let mut app = app();
        let place = Transform::from_scale(scale);
        let root = app.world_mut().spawn((place, WearHair::new(HairPreset::Bob))).id();
        character(&mut app, root, 1.0);
        let hair = worn(&mut app);
        (0..20).for_each(|_| app.update());
        strands(&mut app, hair)
    };
    let (one, mirrored) = (shape(Vec3::ONE), shape(Vec3::new(-1.0, 1.0, 1.0)));
    assert_eq!(one.len(), mirrored.len());
    // In the wearer's own space, where both are the same.
    let apart =
        one.iter().zip(&mirrored).flat_map(|(a, b)| a.positions().iter().zip(b.positions()));
    let mut apart: Vec<f32> = apart.map(|(a, b)| a.distance(*b)).collect();
    apart.sort_by(f32::total_cmp);
    let (middle, worst) = (apart[apart.len() / 2], apart[apart.len() - 1]);
    println!("{middle} m apart, at most {worst} m");
    // Where a strand sticks to the skin hangs on the last bits.
    assert!(middle < 1e-5 && worst < 1e-2, "{middle} m apart, at most {worst} m");
}

#[test]
fn dolls_and_giants_wear_the_same_hair() {
    let shape = |size: f32, units: f32| {
        let mut app = app();
        let root = app
            .world_mut()
            .spawn((Transform::from_scale(Vec3::splat(size)), WearHair::new(HairPreset::Bob)))
            .id();
        character(&mut app, root, units);
        let hair = worn(&mut app);
        let all = strands(&mut app, hair);
        let count = all.len() as f32;
        let tips: Vec3 = all.iter().map(|s| *s.positions().last().unwrap()).sum();
        let length: f32 = all.iter().map(Strand::length).sum();
        (0..10).for_each(|_| app.update());
        let sound = strands(&mut app, hair).iter().all(|s| s.is_finite() && s.peak_strain() < 0.05);
        assert!(sound, "size {size}, units {units}");
        (all.len(), tips / count, length / count)
    };
    let one = shape(1.0, 1.0);
    for (size, units) in [(0.1, 1.0), (30.0, 1.0), (1.0, 100.0), (1.0, 0.01)] {
        let (count, tip, length) = shape(size, units);
        // Rounding may move the hairline by a vertex.
        assert!(count.abs_diff(one.0) * 50 <= one.0, "size {size}, units {units}: {count} strands");
        let apart = tip.distance(one.1).max((length - one.2).abs());
        assert!(apart < 4e-3, "size {size}, units {units}: {apart} m apart");
    }
}

#[test]
fn a_character_whose_units_make_its_head_large_gets_as_much_more_hair() {
    let lengths = |scale: f32| {
        let mut app = app();
        let mesh = ball(0.11 * scale);
        let mesh = app.world_mut().resource_mut::<Assets<Mesh>>().add(mesh);
        let wear = WearHair::new(HairPreset::Bob);
        let root = app.world_mut().spawn((Mesh3d(mesh), Transform::default(), wear)).id();
        let hair = worn(&mut app);
        let size = place_in(&app, hair, root).transform_vector3(Vec3::X).length();
        let all = strands(&mut app, hair);
        size * all.iter().map(Strand::length).sum::<f32>() / all.len() as f32
    };
    let [small, one, large] = [0.01, 1.0, 50.0].map(lengths);
    println!("mean lengths {small} {one} {large}");
    assert!(small < 0.05 * one && large > 10.0 * one);
}

#[test]
fn faces_may_look_anywhere_and_skins_may_lie() {
    for facing in [Dir3::Z, Dir3::X, Dir3::NEG_Z] {
        let mut app = app();
        let wear = WearHair::new(HairPreset::Short).facing(facing);
        let root = app.world_mut().spawn((Transform::default(), wear)).id();
        character(&mut app, root, 1.0);
        let hair = worn(&mut app);
        let to_root = place_in(&app, hair, root);
        let forward = to_root.transform_vector3(Vec3::NEG_Z);
        assert!(forward.dot(*facing) > 0.99, "{facing:?}: {forward}");
        let up = to_root.transform_vector3(Vec3::Y);
        assert!(up.dot(Vec3::Y) > 0.99, "{up}");
    }
}

#[test]
fn a_saved_hairdo_is_worn_again() {
    let mut app = app();
    let wear = WearHair::new(HairPreset::Wavy);
    let root = app.world_mut().spawn((Transform::default(), wear.clone())).id();
    character(&mut app, root, 1.0);
    let hair = worn(&mut app);
    (0..20).for_each(|_| app.update());
    app.world_mut().write_message(HairTreatment::wet(hair));
    (0..20).for_each(|_| app.update());
    let saved = Hairdo::of(app.world(), hair).unwrap();
    let bytes = saved.to_bytes();
    // Another run of the game, paused.
    let mut app = self::app();
    let hairdo = Hairdo::from_bytes(&bytes).unwrap();
    let root = app.world_mut().spawn((Transform::default(), wear.clone().styled(hairdo))).id();
    character(&mut app, root, 1.0);
    app.world_mut().resource_mut::<Time<Virtual>>().pause();
    let hair = worn(&mut app);
    app.update();
    let apart = |hairdo: &Hairdo| {
        assert_eq!(hairdo.strands().len(), saved.strands().len());
        let both = hairdo.strands().iter().zip(saved.strands());
        let apart = both.flat_map(|(a, b)| {
            a.positions().iter().zip(b.positions()).map(|(a, b)| a.distance(*b))
        });
        apart.fold(0.0, f32::max)
    };
    let open = |hairdo: &Hairdo| {
        let rates = hairdo.strands().iter().flat_map(|s| s.joints()).map(|j| j.rates[0]);
        rates.clone().sum::<f32>() / rates.count() as f32
    };
    let now = Hairdo::of(app.world(), hair).unwrap();
    assert!(apart(&now) < 1e-3, "{} m from the saved hairdo", apart(&now));
    assert!(open(&now) < 0.9 && open(&now) == open(&saved), "{}", open(&now));
    // It is tied and goes on from there.
    app.world_mut().resource_mut::<Time<Virtual>>().unpause();
    (0..3).for_each(|_| app.update());
    let now = Hairdo::of(app.world(), hair).unwrap();
    assert!(apart(&now) < 0.03, "{} m from the saved hairdo after three ticks", apart(&now));
    assert!((open(&now) - open(&saved)).abs() < 0.05, "{} {}", open(&now), open(&saved));
    // On another preset it is resampled.
    app.world_mut().get_mut::<WearHair>(root).unwrap().hair = HairPreset::Long.into();
    let hair = worn(&mut app);
    (0..3).for_each(|_| app.update());
    assert!(strands(&mut app, hair).iter().all(Strand::is_finite));
    assert!(faults(&mut app).is_empty());
}

pub(super) fn groom() -> Groom {
    let golden = 2.399_963;
    let strand = |i: usize| {
        let y = 0.2 + 0.8 * (i as f32 + 0.5) / 300.0;
        let (sine, cosine) = (golden * i as f32).sin_cos();
        let flat = (1.0 - y * y).sqrt();
        let way = Vec3::new(flat * cosine, y, flat * sine);
        let root = MIDDLE + way * HALF;
        (0..8).map(move |k| root + way * 0.01 * k as f32)
    };
    Groom::from_polylines((0..300).map(strand)).unwrap()
}

#[test]
fn a_groom_is_worn_where_it_was_made() {
    let mut app = app();
    let handle = app.world().resource::<Assets<Groom>>().reserve_handle();
    let wear = WearHair::new(handle.clone());
    let root = app.world_mut().spawn((Transform::from_xyz(1.0, 0.0, 0.0), wear)).id();
    character(&mut app, root, 1.0);
    (0..20).for_each(|_| app.update());
    assert_eq!(reported(&mut app).worn, [], "it waits for the groom");
    app.world_mut().resource_mut::<Assets<Groom>>().insert(&handle, groom()).unwrap();
    let hair = worn(&mut app);
    let is = app.world().get::<WornAs>(hair).unwrap();
    assert!(matches!(&is.wear.hair, HairSource::Groom { groom, .. } if *groom == handle));
    assert_eq!(is.preset(), None);
    // Each stands for the skin around it: the upper 0.4 of 0.12 m² at 223 a cm², 300 strands.
    let fibres = app.world().get::<HairWetting>(hair).unwrap().fibres;
    assert!((200.0..900.0).contains(&fibres), "{fibres} fibres");
    let to_root = place_in(&app, hair, root);
    for _ in 0..10 {
        for strand in strands(&mut app, hair) {
            let root = to_root.transform_point3(strand.positions()[0]);
            assert!(off_head(root).abs() < 2e-3, "{root}");
        }
        app.update();
    }
    // Reloaded it is made again.
    let half = groom().thinned(2).unwrap();
    app.world_mut().resource_mut::<Assets<Groom>>().insert(&handle, half).unwrap();
    let hair = worn(&mut app);
    assert_eq!(strands(&mut app, hair).len(), 150);
    // In centimetres it is told so, as it is by any unit.
    for unit in [0.01f32, 10.0] {
        let other = groom().scaled(1.0 / unit).unwrap();
        let other = app.world_mut().resource_mut::<Assets<Groom>>().add(other);
        app.world_mut().get_mut::<WearHair>(root).unwrap().hair = other.into();
        let refused = wait(&mut app).refused;
        let WearError::Beside { scale, .. } = &refused[0].1 else { panic!("{refused:?}") };
        assert_eq!(*scale, Some(unit));
        let message = refused[0].1.to_string();
        assert!(message.contains(&format!("at {unit} times its size")), "{message}");
    }
    app.world_mut().get_mut::<WearHair>(root).unwrap().hair = handle.clone().into();
    let hair = worn(&mut app);
    // A groom far from the character is an error.
    app.world_mut().get_mut::<WearHair>(root).unwrap().place = Transform::from_xyz(0.0, 0.0, 0.5);
    let reported = wait(&mut app);
    assert!(
        matches!(reported.refused[0].1, WearError::Beside { scale: None, .. }),
        "{:?}",
        reported.refused
    );
    assert!(app.world().get::<Hair>(hair).is_some(), "the old stays");
    app.world_mut().get_mut::<WearHair>(root).unwrap().place =
        Transform::from_translation(Vec3::NAN);
    let reported = wait(&mut app);
    assert!(matches!(reported.refused[0].1, WearError::Groom(_)), "{:?}", reported.refused);
}

#[test]
fn the_same_seed_wears_the_same_hair_and_another_other() {
    let hair = |seed: u64| {
        let mut app = app();
        let wear = WearHair { seed, ..WearHair::new(HairPreset::Curly) };
        let mut hairs = Vec::new();
        // Several at once, on as many threads as there are.
        for _ in 0..3 {
            let root = app.world_mut().spawn((Transform::default(), wear.clone())).id();
            character(&mut app, root, 1.0);
        }
        while hairs.len() < 3 {
            hairs.extend(wait(&mut app).worn);
        }
        let mut all = hairs.iter().map(|w| strands(&mut app, w.hair)).collect::<Vec<_>>();
        let nodes = |all: &[Strand]| -> Vec<Vec3> {
            all.iter().flat_map(|s| s.rest_lengths().to_vec()).map(Vec3::splat).collect()
        };
        let first = nodes(&all.remove(0));
        all.iter().for_each(|other| assert!(nodes(other) == first));
        first
    };
    let [a, b, c] = [7, 7, 8].map(hair);
    assert!(a == b && a != c);
}

/// A collider of the game's own.
#[derive(Component)]
struct Own;

/// How many colliders are fitted to each of the bones, where `add` adds some of the game's own.
fn fitted(add: impl Fn(&mut World, &[Entity])) -> Vec<usize> {
    let mut app = app();
    let root = app.world_mut().spawn((Transform::default(), WearHair::new(HairPreset::Bob))).id();
    let (_, body) = character(&mut app, root, 1.0);
    let bones = app.world().get::<SkinnedMesh>(body).unwrap().joints.clone();
    add(app.world_mut(), &bones);
    let hair = worn(&mut app);
    let world = app.world_mut();
    let mut all = world.query_filtered::<&ChildOf, (With<HairCollider>, Without<Own>)>();
    let parents: Vec<Entity> = all.iter(world).map(ChildOf::parent).collect();
    let on = |bone: &Entity| parents.iter().filter(|parent| *parent == bone).count();
    // The head's are below its hair.
    bones[..3].iter().map(on).chain([on(&hair)]).collect()
}

#[test]
fn own_colliders_replace_the_fitted_ones_of_their_bone_only() {
    let solid = || (Own, HairCollider::sphere(0.08).unwrap());
    let all = fitted(|_, _| {});
    println!("colliders of {:?}: {all:?}", BONES.map(|bone| bone.0));
    assert!(all[1..].iter().all(|count| *count > 0), "{all:?}");
    let without = |bone: usize| {
        let mut left = all.clone();
        left[bone] = 0;
        left
    };
    for bone in [1, 3] {
        let on = fitted(|world, bones| {
            world.entity_mut(bones[bone]).insert(solid());
        });
        assert_eq!(on, without(bone), "on {}", BONES[bone].0);
    }
    for bone in [2, 3] {
        let below = fitted(|world, bones| {
            let held = world.spawn((Transform::default(), ChildOf(bones[bone]))).id();
            world.spawn((solid(), ChildOf(held)));
        });
        assert_eq!(below, without(bone), "below {}", BONES[bone].0);
    }
    // What is on the character or beside it is on no bone.
    let beside = fitted(|world, bones| {
        let armature = world.get::<ChildOf>(bones[0]).unwrap().parent();
        world.spawn((solid(), ChildOf(armature)));
        let root = world.get::<ChildOf>(armature).unwrap().parent();
        world.entity_mut(root).insert(solid());
        world.spawn(solid());
    });
    assert_eq!(beside, all);
}

#[test]
fn a_mesh_with_a_collider_of_its_own_keeps_to_it() {
    let mut app = app();
    let head = app.world_mut().resource_mut::<Assets<Mesh>>().add(ball(0.1));
    let wear = WearHair::new(HairPreset::Bob);
    let solid = HairCollider::sphere(0.1).unwrap();
    app.world_mut().spawn((Mesh3d(head), Transform::default(), wear, solid));
    worn(&mut app);
    let colliders = app.world_mut().query::<&HairCollider>().iter(app.world()).count();
    assert_eq!(colliders, 1);
}

#[test]
fn hair_comes_back_with_a_scene_that_is_spawned_again() {
    let mut app = app();
    let root = app.world_mut().spawn((Transform::default(), WearHair::new(HairPreset::Short))).id();
    character(&mut app, root, 1.0);
    worn(&mut app);
    app.world_mut().entity_mut(root).despawn_children();
    (0..5).for_each(|_| app.update());
    assert_eq!(wearers(&mut app), 0);
    character(&mut app, root, 1.0);
    worn(&mut app);
    assert_eq!(wearers(&mut app), 1);
    // And goes with its wearer.
    app.world_mut().entity_mut(root).despawn();
    (0..5).for_each(|_| app.update());
    assert_eq!(app.world_mut().query::<&Strand>().iter(app.world()).count(), 0);
    assert!(faults(&mut app).is_empty());
}

fn mean_length(app: &mut App, hair: Entity) -> f32 {
    let all = strands(app, hair);
    all.iter().map(Strand::length).sum::<f32>() / all.len() as f32
}

#[test]
fn hair_is_worn_longer_and_remembers_what_it_is() {
    let mut app = app();
    let wear = WearHair { seed: 5, ..WearHair::new(HairPreset::Curly) };
    let root = app.world_mut().spawn((Transform::default(), wear.clone())).id();
    character(&mut app, root, 1.0);
    let hair = worn(&mut app);
    let own = mean_length(&mut app, hair);
    let nodes = strands(&mut app, hair)[0].nodes();
    app.world_mut().entity_mut(root).insert(wear.clone().long(0.5));
    let short = worn(&mut app);
    let half = mean_length(&mut app, short);
    println!("{own} m, at a half {half} m");
    assert!((half / own - 0.5).abs() < 0.02);
    // Segments stay as long as they are.
    assert!(strands(&mut app, short)[0].nodes().abs_diff(nodes / 2) <= 1);
    let is = app.world().get::<WornPreset>(short).unwrap();
    assert_eq!((is.preset(), is.seed, is.length), (Some(HairPreset::Curly), 5, 0.5));
    app.world_mut().entity_mut(root).insert(wear.long(f32::NAN));
    let reported = wait(&mut app);
    let [(by, WearError::Setting(wrong))] = &reported.refused[..] else {
        panic!("{:?}", reported.refused)
    };
    assert_eq!((*by, wrong.what), (root, "WearHair::length"));
    assert_eq!(wearers(&mut app), 1, "it keeps the hair that it has");
}

#[test]
fn looks_change_on_the_hair_that_is_worn() {
    let mut app = app();
    let wear = WearHair::new(HairPreset::Short).dyed(HairDye::pink());
    let root = app.world_mut().spawn((Transform::default(), wear)).id();
    character(&mut app, root, 1.0);
    let hair = worn(&mut app);
    let world = app.world();
    assert_eq!(world.get::<HairDye>(hair), Some(&HairDye::pink()));
    assert_eq!(world.get::<HairStyle>(hair), Some(&HairStyle::default()));
    let look = HairLook { melanin: Melanin::RED, ..default() };
    let mut wear = app.world_mut().get_mut::<WearHair>(root).unwrap();
    (wear.look, wear.dye, wear.style) = (Some(look.clone()), None, None);
    (0..20).for_each(|_| app.update());
    assert_eq!(reported(&mut app).worn, [], "nothing is made anew");
    let world = app.world();
    assert_eq!(world.get::<HairLook>(hair), Some(&look));
    assert!(
        !world.entity(hair).contains::<HairDye>() && !world.entity(hair).contains::<HairStyle>()
    );
    // Hair that nobody has styled has no style to keep.
    app.world_mut().entity_mut(hair).insert(HairStyle::default());
    (0..5).for_each(|_| app.update());
    assert_eq!(app.world().get::<KeptStyle>(hair).unwrap().kept(), None);
}

#[test]
fn a_hairdo_grows_its_preset_again_and_is_worn_strand_by_strand() {
    let mut app = app();
    let wear = WearHair { seed: 3, ..WearHair::new(HairPreset::Bob) }.long(0.8);
    let root = app.world_mut().spawn((Transform::default(), wear)).id();
    character(&mut app, root, 1.0);
    let hair = worn(&mut app);
    app.world_mut().entity_mut(hair).insert(HairDye::from_color(HairColor::COBALT));
    (0..10).for_each(|_| app.update());
    app.world_mut().write_message(HairTreatment::set(hair, BondKind::Hydrogen, 0.25).unwrap());
    (0..5).for_each(|_| app.update());
    let saved = Hairdo::of(app.world(), hair).unwrap().to_bytes();

    app.world_mut().entity_mut(root).insert(WearHair::new(HairPreset::Short));
    worn(&mut app);
    let hairdo = Hairdo::from_bytes(&saved).unwrap();
    let wear = WearHair::try_from(hairdo.clone()).unwrap();
    assert_eq!((wear.hair.clone(), wear.seed, wear.length), (HairPreset::Bob.into(), 3, 0.8));
    app.world_mut().entity_mut(root).insert(wear);
    let again = worn(&mut app);
    let now = Hairdo::of(app.world(), again).unwrap();
    assert_eq!(
        (now.preset(), now.dye(), now.look()),
        (hairdo.preset(), hairdo.dye(), hairdo.look())
    );
    assert_eq!(now.strands().len(), hairdo.strands().len());
    for (now, saved) in now.strands().iter().zip(hairdo.strands()) {
        assert_eq!(now.joints(), saved.joints(), "strand by strand, not resampled");
    }
    assert!(faults(&mut app).is_empty());
    let error = WearHair::try_from(Hairdo::default()).unwrap_err();
    assert_eq!(error, HairdoError::NoPreset);
}

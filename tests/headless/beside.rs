//! Several hairs of one wear, such as a beard beside short hair: made together, on one set of colliders.
#![cfg(all(feature = "groom", feature = "save", feature = "render"))]

use crate::{
    characters::edit,
    common::{app_with_meshes, faults, wait_for},
    figure::figure,
    wear::{self, app, groom, wait, worn},
    worlds_measured::wearer::character,
};
use bevy::prelude::*;
use bevy_keratin::{
    ColliderShape, FaultKind, MotionOwner, WearError, authoring::groom::Groom, prelude::*,
};

fn short_and_beard() -> WearHair {
    WearHair::new(HairPreset::Short).and(HairPreset::Beard)
}

/// A character that wears this, and its hairs in the component's order.
fn dressed(app: &mut App, wear: WearHair) -> (Entity, Vec<Entity>) {
    let root = app.world_mut().spawn((Transform::default(), wear)).id();
    character(app, root, 1.0);
    let hairs = all_worn(app);
    (root, hairs)
}

/// Those of the next event, which is the only one.
fn all_worn(app: &mut App) -> Vec<Entity> {
    let reported = wait(app);
    assert_eq!(reported.refused, []);
    let [worn] = &reported.worn[..] else { panic!("{:?}", reported.worn) };
    core::iter::once(worn.hair).chain(worn.beside.iter().copied()).collect()
}

fn hairs(app: &App, wearer: Entity) -> Vec<Entity> {
    app.world().get::<WornHair>(wearer).map_or_else(Vec::new, |worn| worn.iter().collect())
}

fn presets(app: &App, hairs: &[Entity]) -> Vec<Option<HairPreset>> {
    hairs.iter().map(|hair| app.world().get::<WornAs>(*hair).unwrap().preset()).collect()
}

/// Its strands' nodes and edges.
fn strands(app: &mut App, hair: Entity) -> Vec<(Vec<Vec3>, Vec<Quat>)> {
    let all = wear::strands(app, hair);
    let bits = |s: &Strand| (s.positions().to_vec(), s.orientations().to_vec());
    all.iter().map(bits).collect()
}

/// The balls that hang on a hair, those of a head, with their radii.
fn on_heads(app: &mut App) -> Vec<(Entity, Vec3, f32)> {
    let mut all = app.world_mut().query::<(&ChildOf, &Transform, &HairCollider)>();
    let all = all.iter(app.world()).filter_map(|(of, at, ball)| match ball.shape {
        ColliderShape::Sphere(ball) => Some((of.parent(), at.translation, ball.radius)),
        _ => None,
    });
    all.filter(|(of, ..)| app.world().get::<Hair>(*of).is_some()).collect()
}

/// How many worn hairs, strands and colliders there are.
fn counts(app: &mut App) -> [usize; 3] {
    let world = app.world_mut();
    [
        world.query::<&WornAs>().iter(world).count(),
        world.query::<&Strand>().iter(world).count(),
        world.query::<&HairCollider>().iter(world).count(),
    ]
}

/// The largest strain of all hair; every strand is finite.
fn most_strain(app: &mut App) -> f32 {
    let mut all = app.world_mut().query::<&Strand>();
    let all = all.iter(app.world()).inspect(|strand| assert!(strand.is_finite()));
    all.map(Strand::peak_strain).fold(0.0, f32::max)
}

/// How far all go aside that are shaken four times a second (m).
fn shaken(time: f32) -> f32 {
    0.03 * (core::f32::consts::TAU * 4.0 * time).sin()
}

/// On a vehicle, of another size.
#[test]
fn a_beard_and_short_hair_keep_their_length_from_the_first_frame_on() {
    let mut app = app_with_meshes(60.0);
    let vehicle = app.world_mut().spawn(Transform::from_scale(Vec3::splat(1.6))).id();
    let (root, ..) = figure(&mut app, &crate::body::mesh_of(0.009, 0.009));
    let wear = short_and_beard().facing(Dir3::Z);
    app.world_mut().entity_mut(root).insert((wear, ChildOf(vehicle)));
    app.world_mut().resource_mut::<Time<Virtual>>().pause();
    let [hair, beard] = wait_for(&mut app, |app| match hairs(app, root)[..] {
        [] => None,
        [hair, beard] => Some([hair, beard]),
        _ => panic!("one has come alone"),
    });
    for hair in [hair, beard] {
        assert_ne!(app.world().get(hair), Some(&MotionOwner::Settling), "it is not drawn yet");
    }
    app.world_mut().resource_mut::<Time<Virtual>>().unpause();
    // Once for the head, not once for each hair.
    let balls = on_heads(&mut app);
    let own = |hair: Entity| balls.iter().filter(|(of, ..)| *of == hair).count();
    assert!((20..=48).contains(&own(hair)) && own(beard) == 0, "{} {}", own(hair), own(beard));
    let mut most = [most_strain(&mut app), 0.0, 0.0];
    for tick in 0..360 {
        let time = tick as f32 / 60.0;
        let (phase, aside) = if tick < 300 { (1, 0.0) } else { (2, shaken(time)) };
        let at = Vec3::new(aside, 0.0, 1.5 * time);
        app.world_mut().get_mut::<Transform>(vehicle).unwrap().translation = at;
        app.update();
        most[phase] = most[phase].max(most_strain(&mut app));
    }
    println!("strain at first, in five seconds, shaken: {most:?}");
    assert!(most.iter().all(|most| *most < 0.05), "{most:?}");
    assert_eq!(faults(&mut app), []);
}

/// Of short hair some roots lie between ear and temple, where the ellipsoid of an ear reaches beyond what is bare.
#[test]
fn no_root_lies_in_an_ear_and_hair_beside_it_keeps_its_length() {
    let mut app = app_with_meshes(60.0);
    let (root, ..) = figure(&mut app, &crate::body::mesh_of(0.009, 0.009));
    let wear = WearHair::new(HairPreset::Short).facing(Dir3::Z);
    app.world_mut().entity_mut(root).insert(wear);
    app.world_mut().resource_mut::<Time<Virtual>>().pause();
    let hair = wait_for(&mut app, |app| hairs(app, root).first().copied());
    app.world_mut().resource_mut::<Time<Virtual>>().unpause();
    let mut all = app.world_mut().query::<(&ChildOf, &Transform, &HairCollider)>();
    let ears = all.iter(app.world()).filter_map(|(of, at, ear)| match ear.shape {
        ColliderShape::Ellipsoid { radii } if of.parent() == hair => Some((*at, radii)),
        _ => None,
    });
    let ears: Vec<_> = ears.collect();
    assert!(ears.len() >= 2, "{} ears", ears.len());
    let roots: Vec<Vec3> = strands(&mut app, hair).iter().map(|(nodes, _)| nodes[0]).collect();
    for (at, radii) in ears {
        let share = |p: &Vec3| (at.rotation.inverse() * (*p - at.translation) / radii).length();
        let nearest = roots.iter().map(share).fold(f32::MAX, f32::min);
        assert!(nearest > 0.999, "a root lies in an ear, at {nearest} of the way out");
    }
    let mut most = 0.0f32;
    for tick in 0..60 {
        let aside = shaken(tick as f32 / 60.0);
        app.world_mut().get_mut::<Transform>(root).unwrap().translation.x = aside;
        app.update();
        most = most.max(most_strain(&mut app));
    }
    println!("strain, shaken: {most}");
    assert!(most < 0.05, "{most}");
    assert_eq!(faults(&mut app), []);
}

#[test]
fn one_is_swapped_or_taken_off_and_the_other_stays_as_it_is() {
    let mut app = app();
    let (root, before) = dressed(&mut app, short_and_beard());
    let [short, beard] = before[..] else { panic!("{before:?}") };
    assert_eq!(hairs(&app, root), before);
    assert_eq!(presets(&app, &before), [Some(HairPreset::Short), Some(HairPreset::Beard)]);
    (0..20).for_each(|_| app.update());
    app.world_mut().resource_mut::<Time<Virtual>>().pause();
    app.world_mut().entity_mut(beard).insert(AirDrag { rate: 7.0 });
    let bits = strands(&mut app, beard);
    let mut wear = app.world_mut().get_mut::<WearHair>(root).unwrap();
    wear.hair = HairPreset::Pixie.into();
    // What can be put on at once comes with it.
    wear.beside[0].dye = Some(HairDye::pink());
    app.update();
    assert_eq!(hairs(&app, root), [short, beard], "none is bald meanwhile");
    let after = all_worn(&mut app);
    let pixie = after[0];
    assert_eq!(after, [pixie, beard]);
    assert_eq!(presets(&app, &after), [Some(HairPreset::Pixie), Some(HairPreset::Beard)]);
    assert!(app.world().get_entity(short).is_err());
    assert!(strands(&mut app, beard) == bits, "it has moved");
    assert_eq!(app.world().get::<HairDye>(beard), Some(&HairDye::pink()));
    assert_eq!(app.world().get::<AirDrag>(beard), Some(&AirDrag { rate: 7.0 }));
    let balls = on_heads(&mut app);
    assert!((8..=52).contains(&balls.len()) && balls.iter().all(|(of, ..)| *of == pixie));

    // A slider of the beard: strands that fell take over how they lay.
    app.world_mut().get_mut::<WearHair>(root).unwrap().beside[0].length = 1.3;
    let after = all_worn(&mut app);
    assert_eq!(after[0], pixie);
    assert_ne!(after[1], beard);
    assert_eq!(app.world().get::<WornPreset>(after[1]).unwrap().length, 1.3);

    // What is left after one is taken off is not made again, and is as if it had come alone.
    app.world_mut().resource_mut::<Time<Virtual>>().unpause();
    app.world_mut().get_mut::<WearHair>(root).unwrap().beside.clear();
    assert_eq!(all_worn(&mut app), [pixie]);
    assert_eq!(hairs(&app, root), [pixie]);
    assert_eq!(counts(&mut app)[0], 1);
    assert!(on_heads(&mut app).iter().all(|(of, ..)| *of == pixie));
    assert_eq!(faults(&mut app), []);
}

#[test]
fn their_order_decides_nothing_but_their_order() {
    let lists = [short_and_beard(), WearHair::new(HairPreset::Beard).and(HairPreset::Short)];
    let [one, other] = lists.map(|wear| {
        let mut app = app();
        app.world_mut().resource_mut::<Time<Virtual>>().pause();
        let (_, hairs) = dressed(&mut app, wear);
        app.world_mut().resource_mut::<Time<Virtual>>().unpause();
        (0..10).for_each(|_| app.update());
        let of = |preset: HairPreset| {
            let at = presets(&app, &hairs).iter().position(|of| *of == Some(preset));
            hairs[at.unwrap()]
        };
        let [short, beard] = [of(HairPreset::Short), of(HairPreset::Beard)];
        assert_eq!(faults(&mut app), []);
        [strands(&mut app, short), strands(&mut app, beard)]
    });
    assert!(one[0].len() > 200 && one[1].len() > 100);
    assert!(one == other);
}

#[test]
fn the_same_roots_twice_are_an_error() {
    let mut app = app();
    let (root, before) = dressed(&mut app, WearHair::new(HairPreset::Beard));
    let twice = short_and_beard().and(HairBeside::new(HairPreset::Beard).long(1.5));
    app.world_mut().entity_mut(root).insert(twice);
    let refused = wait(&mut app).refused;
    let [(of, WearError::Twice { .. })] = &refused[..] else { panic!("{refused:?}") };
    assert_eq!((*of, hairs(&app, root)), (root, before), "it keeps what it has");
    (0..70).for_each(|_| app.update());
    let reported = faults(&mut app);
    assert_eq!(reported.len(), 1, "{reported:?}");
    assert_eq!((reported[0].kind, reported[0].entity), (FaultKind::Wear, Some(root)));
    assert!(reported[0].message.contains("the preset Beard is in WearHair twice"), "{reported:?}");
    // So is a groom, unless it lies elsewhere.
    let bun = app.world_mut().resource_mut::<Assets<Groom>>().add(groom());
    let wear = WearHair::new(bun.clone()).and(bun.clone());
    app.world_mut().entity_mut(root).insert(wear);
    assert!(matches!(wait(&mut app).refused[0].1, WearError::Twice { .. }));
    let place = Transform::from_xyz(0.0, 0.01, 0.0);
    let wear = WearHair::new(bun.clone()).and(HairBeside { place, ..HairBeside::new(bun) });
    app.world_mut().entity_mut(root).insert(wear);
    assert_eq!(all_worn(&mut app).len(), 2);
}

#[test]
fn both_come_at_the_tick_of_the_games_choice_and_are_saved_and_copied() {
    let mut app = app();
    let tick = app.world().resource::<Time<Fixed>>().timestep();
    let wear = WearHair::new(HairPreset::Short)
        .and(HairBeside::new(HairPreset::Beard).dyed(HairDye::pink()))
        .at(tick * 20);
    let root = app.world_mut().spawn((Transform::default(), wear, AirDrag { rate: 5.0 })).id();
    character(&mut app, root, 1.0);
    while app.world().resource::<Time<Fixed>>().elapsed() < tick * 30 {
        let is_due = app.world().resource::<Time<Fixed>>().elapsed() >= tick * 20;
        assert_eq!(hairs(&app, root).len(), if is_due { 2 } else { 0 });
        app.update();
    }
    let own = hairs(&app, root);
    let each = |app: &App, of: &[Entity]| -> Vec<_> {
        let world = app.world();
        let dye = |hair: &Entity| world.get::<HairDye>(*hair).is_some();
        let drag = |hair: &Entity| world.get::<AirDrag>(*hair).map(|drag| drag.rate);
        of.iter().map(|hair| (dye(hair), drag(hair))).collect()
    };
    assert_eq!(each(&app, &own), [(false, Some(5.0)), (true, Some(5.0))]);

    // A copy has its own, and what it takes off is its own.
    let copy = app.world_mut().entity_mut(root).clone_and_spawn_with_opt_out(|cloner| {
        cloner.linked_cloning(true);
    });
    (0..3).for_each(|_| app.update());
    let copied = hairs(&app, copy);
    assert_eq!(presets(&app, &copied), presets(&app, &own));
    assert!(copied.iter().all(|hair| !own.contains(hair)));
    app.world_mut().entity_mut(copy).remove::<WearHair>();
    (0..2).for_each(|_| app.update());
    assert_eq!((hairs(&app, copy), hairs(&app, root)), (vec![], own.clone()));
    assert_eq!(counts(&mut app)[0], 2);

    // One request saves both, and each finds its hair again.
    #[derive(Resource, Default)]
    struct Saved(Vec<HairdoCaptured>);
    app.init_resource::<Saved>().add_observer(
        |taken: On<HairdoCaptured>, mut saved: ResMut<Saved>| saved.0.push(taken.event().clone()),
    );
    app.world_mut().trigger(CaptureHairdo { entity: root });
    app.world_mut().flush();
    let saved = app.world_mut().remove_resource::<Saved>().unwrap().0;
    assert!(saved.iter().map(|taken| taken.hair).eq(own.iter().copied()));
    assert!(saved.iter().all(|taken| taken.entity == root));
    app.world_mut().resource_mut::<Time<Virtual>>().pause();
    let [short, beard] = [0, 1].map(|i| saved[i].hairdo.clone());
    app.world_mut().commands().trigger(CutHair::all(root, CutBy::Length(0.01)));
    app.world_mut().flush();
    for hairdo in [&beard, &short] {
        app.world_mut().trigger(ApplyHairdo { entity: root, hairdo: hairdo.clone() });
    }
    app.world_mut().flush();
    for (hair, hairdo) in own.iter().zip([&short, &beard]) {
        assert_eq!(Hairdo::of(app.world(), *hair).unwrap().strands(), hairdo.strands());
    }
    // So does a new wear of them.
    let wear = WearHair::try_from(short.clone()).unwrap();
    let wear = wear.and(HairBeside::try_from(beard.clone()).unwrap());
    app.world_mut().entity_mut(root).insert(wear);
    let again = all_worn(&mut app);
    app.update();
    for (hair, hairdo) in again.iter().zip([&short, &beard]) {
        let now = Hairdo::of(app.world(), *hair).unwrap();
        assert_eq!((now.preset(), now.dye()), (hairdo.preset(), hairdo.dye()));
        assert_eq!(now.strands().len(), hairdo.strands().len());
    }
    app.world_mut().entity_mut(root).remove::<WearHair>();
    app.update();
    assert_eq!(counts(&mut app), [0; 3]);
    assert_eq!(faults(&mut app), []);
}

#[test]
fn colliders_are_fitted_again_for_both() {
    let mut app = app();
    let root = app.world_mut().spawn((Transform::default(), short_and_beard())).id();
    let (_, body) = character(&mut app, root, 1.0);
    let hair = worn(&mut app);
    let before = on_heads(&mut app);
    edit(&mut app, body, |mesh| mesh.scale_by(Vec3::new(1.1, 1.0, 1.0)));
    let after = wait_for(&mut app, |app| Some(on_heads(app)).filter(|after| *after != before));
    assert!((8..=52).contains(&after.len()), "{}", after.len());
    assert!(after.iter().all(|(of, ..)| *of == hair));
    let wide = |all: &[(Entity, Vec3, f32)]| {
        all.iter().map(|(_, at, radius)| at.x + radius).fold(0.0, f32::max)
    };
    assert!(wide(&after) > 1.03 * wide(&before), "{} {}", wide(&after), wide(&before));
    // One that a game has removed comes back, beside the other.
    let beard = hairs(&app, root)[1];
    app.world_mut().despawn(beard);
    let again = all_worn(&mut app);
    assert_eq!((again.len(), again[0]), (2, hair));
    assert_eq!(on_heads(&mut app).len(), after.len());
    assert_eq!(faults(&mut app), []);
}

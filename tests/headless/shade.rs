//! Skin under worn hair is shaded: where, in which colour, and for how long.
#![cfg(all(feature = "render", feature = "groom", feature = "save"))]

use crate::{
    characters::{edit, keep, on_head},
    common::{faults, wait_for},
    wear::{app, place_in, worn},
    worlds_measured::wearer::{HALF, MIDDLE, ball, character},
};
use bevy::{
    camera::visibility::RenderLayers,
    mesh::{VertexAttributeValues as Values, skinning::SkinnedMesh},
    prelude::*,
};
use bevy_keratin::{authoring::plant::HairPreset, prelude::*};
use std::{thread::sleep, time::Duration};

/// A character that wears this on its root, in an app with materials.
fn wearing(wear: WearHair) -> (App, Entity, Entity, Entity) {
    let mut app = app();
    app.init_asset::<StandardMaterial>();
    let root = app.world_mut().spawn((Transform::default(), wear)).id();
    let (_, body) = character(&mut app, root, 1.0);
    let hair = worn(&mut app);
    (app, root, body, hair)
}

fn shells_now(app: &App, hair: Entity) -> Vec<Entity> {
    let children = app.world().get::<Children>(hair).into_iter().flatten().copied();
    let is_shell =
        |e: &Entity| app.world().get::<Name>(*e).is_some_and(|name| name.as_str() == "scalp shade");
    children.filter(is_shell).collect()
}

/// What shades the skin under a hair, once it does.
fn shells(app: &mut App, hair: Entity) -> Vec<Entity> {
    let shells = wait_for(app, |app| {
        let shells = shells_now(app, hair);
        (!shells.is_empty()).then_some(shells)
    });
    // Its colour, and its place in the world.
    app.update();
    shells
}

/// All of it in the world, those of hair that is gone too.
fn all_shells(app: &mut App) -> usize {
    let mut names = app.world_mut().query::<&Name>();
    names.iter(app.world()).filter(|name| name.as_str() == "scalp shade").count()
}

/// Place and opacity of each vertex, as in its mesh.
fn vertices(app: &App, shell: Entity) -> Vec<(Vec3, f32)> {
    let mesh = &app.world().get::<Mesh3d>(shell).unwrap().0;
    let mesh = app.world().resource::<Assets<Mesh>>().get(mesh).unwrap();
    let (Some(Values::Float32x3(places)), Some(Values::Float32x4(colors))) =
        (mesh.attribute(Mesh::ATTRIBUTE_POSITION), mesh.attribute(Mesh::ATTRIBUTE_COLOR))
    else {
        panic!("places and colours")
    };
    places.iter().zip(colors).map(|(p, c)| (Vec3::from(*p), c[3])).collect()
}

fn color(app: &App, shell: Entity) -> LinearRgba {
    let material = &app.world().get::<MeshMaterial3d<StandardMaterial>>(shell).unwrap().0;
    app.world().resource::<Assets<StandardMaterial>>().get(material).unwrap().base_color.into()
}

/// How far off the head of the character a place is (m).
fn off_head(p: Vec3) -> f32 {
    (((p - MIDDLE) / HALF).length() - 1.0) * HALF.min_element()
}

/// The largest opacity where a place of the head, from its middle, `is_there`; 0 where nothing is drawn.
fn opacity(vertices: &[(Vec3, f32)], is_there: impl Fn(Vec3) -> bool) -> f32 {
    let there = vertices.iter().filter(|(p, _)| is_there(*p - MIDDLE));
    there.map(|(_, opacity)| *opacity).fold(0.0, f32::max)
}

#[test]
fn skin_is_shaded_where_hair_grows_and_follows_its_joints() {
    let (mut app, _, body, hair) = wearing(WearHair::new(HairPreset::Bob));
    let shells = shells(&mut app, hair);
    assert_eq!(shells.len(), 1);
    let all = vertices(&app, shells[0]);
    assert!(all.iter().all(|(p, _)| (5e-5..1e-3).contains(&off_head(*p))), "on the skin");
    let least =
        all.iter().filter(|(p, _)| p.y > MIDDLE.y + 0.1).map(|(_, a)| *a).fold(1.0, f32::min);
    assert!(least > 0.9, "crown and parting: {least}");
    // It looks along −Z; the nape has hair, face and neck have none.
    assert!(opacity(&all, |p| p.z > 0.08 && p.y.abs() < 0.02) > 0.5);
    assert_eq!(opacity(&all, |p| p.z < -0.06 && p.y < 0.04), 0.0);
    assert_eq!(opacity(&all, |p| p.y < -0.11), 0.0);
    let skin = |entity| app.world().get::<SkinnedMesh>(entity).unwrap();
    assert_eq!(skin(shells[0]).joints, skin(body).joints);
    assert!(faults(&mut app).is_empty());
}

#[test]
fn it_has_the_colour_of_the_hair_at_its_roots() {
    let (mut app, _, _, hair) = wearing(WearHair::new(HairPreset::Bob));
    let shell = shells(&mut app, hair)[0];
    let set = |app: &mut App, change: &dyn Fn(&mut EntityWorldMut)| {
        change(&mut app.world_mut().entity_mut(hair));
        app.update();
        color(app, shell)
    };
    let look = |melanin| HairLook { melanin, ..default() };
    let black = set(&mut app, &|hair| {
        hair.insert(look(Melanin::BLACK));
    });
    let blond = set(&mut app, &|hair| {
        hair.insert(look(Melanin::BLOND));
    });
    let pink = set(&mut app, &|hair| {
        hair.insert(HairDye::pink());
    });
    let tips = set(&mut app, &|hair| {
        hair.insert(HairDye::of(DyeLayer::bleached(HairColor::COBALT).tips(0.3)));
    });
    assert!(black.luminance() < 0.01 && blond.luminance() > 0.05, "{black:?} {blond:?}");
    assert!(pink.red > 3.0 * pink.green && pink.red > 1.5 * pink.blue, "{pink:?}");
    assert_eq!(tips, blond, "dyed tips are not there");
}

#[test]
fn it_goes_with_its_hair_and_where_it_is_not_wanted() {
    let (mut app, root, _, hair) = wearing(WearHair::new(HairPreset::Short));
    shells(&mut app, hair);
    // Other hair brings its own.
    app.world_mut().entity_mut(root).insert(WearHair::new(HairPreset::Bob));
    let hair = worn(&mut app);
    shells(&mut app, hair);
    assert_eq!(all_shells(&mut app), 1);
    app.world_mut().entity_mut(hair).insert(ScalpShade { strength: 0.0 });
    (0..3).for_each(|_| app.update());
    assert_eq!(all_shells(&mut app), 0);
    app.world_mut().entity_mut(hair).insert(ScalpShade { strength: 0.4 });
    let shell = shells(&mut app, hair)[0];
    assert_eq!(color(&app, shell).alpha, 0.4);
    app.world_mut().entity_mut(root).remove::<WearHair>();
    (0..3).for_each(|_| app.update());
    assert_eq!(all_shells(&mut app), 0);
}

#[test]
fn hair_and_beard_have_one_each() {
    let (mut app, _, body, hair) = wearing(WearHair::new(HairPreset::Short));
    let above = shells(&mut app, hair)[0];
    app.world_mut().entity_mut(body).insert(WearHair::new(HairPreset::Beard));
    let beard = worn(&mut app);
    let below = shells(&mut app, beard)[0];
    assert_eq!((shells_now(&app, hair), all_shells(&mut app)), (vec![above], 2));
    let [above, below] = [above, below].map(|shell| vertices(&app, shell));
    let chin = |p: Vec3| p.z < -0.05 && p.y < -0.07;
    let crown = |p: Vec3| p.y > 0.1;
    assert!(opacity(&above, crown) > 0.5 && opacity(&above, chin) == 0.0);
    assert!(opacity(&below, chin) > 0.5 && opacity(&below, crown) == 0.0);
}

#[test]
fn each_part_of_a_head_is_shaded() {
    let mut app = app();
    app.init_asset::<StandardMaterial>();
    let root = app.world_mut().spawn(Transform::default()).id();
    let (_, body) = character(&mut app, root, 1.0);
    edit(&mut app, body, |mesh| keep(mesh, |p| p.y < 1.45 || p.z > -0.02));
    let face = on_head(&mut app, body, "Face", HALF);
    edit(&mut app, face, |mesh| keep(mesh, |p| p.z <= -0.02));
    app.world_mut().entity_mut(root).insert(WearHair::new(HairPreset::Short));
    let hair = worn(&mut app);
    let shells = shells(&mut app, hair);
    let found: Vec<_> = shells.iter().map(|shell| vertices(&app, *shell)).collect();
    let [back, front] = [|p: Vec3| p.y > 0.08 && p.z > 0.03, |p: Vec3| p.y > 0.08 && p.z < -0.04];
    assert_eq!(found.len(), 2);
    assert!(opacity(&found[0], back) > 0.9 && opacity(&found[1], front) > 0.9);
    // Where they meet both are as dark.
    let seam = |p: Vec3| p.y > 0.08 && (-0.035..-0.005).contains(&p.z);
    assert!(opacity(&found[0], seam) > 0.9 && opacity(&found[1], seam) > 0.9);
}

#[test]
fn it_lies_on_mirrored_and_scaled_heads_without_joints() {
    for scale in [Vec3::ONE, Vec3::new(-1.0, 1.0, 1.0), Vec3::splat(2.5), Vec3::new(1.0, 1.0, -0.3)]
    {
        let mut app = app();
        app.init_asset::<StandardMaterial>();
        let mesh = app.world_mut().resource_mut::<Assets<Mesh>>().add(ball(0.1));
        let at = Transform::from_xyz(0.4, 1.0, 2.0)
            .with_rotation(Quat::from_rotation_y(1.0))
            .with_scale(scale);
        let head = app.world_mut().spawn((Mesh3d(mesh), at, WearHair::new(HairPreset::Short))).id();
        let hair = worn(&mut app);
        let shell = shells(&mut app, hair)[0];
        let to_head = place_in(&app, shell, head);
        let all = vertices(&app, shell);
        for (p, _) in &all {
            let off = to_head.transform_point3(*p).length() - 0.1;
            assert!((5e-5..1e-3).contains(&off), "{scale}: {off}");
        }
        let top = all.iter().map(|(p, _)| to_head.transform_point3(*p).y).fold(0.0, f32::max);
        assert!(top > 0.0999, "{scale}: {top}");
    }
}

#[test]
fn it_follows_a_mesh_that_is_edited() {
    let (mut app, _, body, hair) = wearing(WearHair::new(HairPreset::Short));
    let shell = shells(&mut app, hair)[0];
    let before = vertices(&app, shell);
    edit(&mut app, body, |mesh| mesh.translate_by(Vec3::X * 0.02));
    (0..3).for_each(|_| app.update());
    let now = vertices(&app, shell);
    let moved = now.iter().zip(&before).map(|(now, before)| now.0 - before.0 - Vec3::X * 0.02);
    assert!(moved.map(Vec3::length).fold(0.0, f32::max) < 1e-5);
}

#[test]
fn it_is_in_the_render_layers_of_its_hair() {
    let (mut app, _, _, hair) = wearing(WearHair::new(HairPreset::Short));
    let shell = shells(&mut app, hair)[0];
    let layers = |app: &App| app.world().get::<RenderLayers>(shell).cloned();
    app.world_mut().entity_mut(hair).insert(RenderLayers::layer(3));
    app.update();
    assert_eq!(layers(&app), Some(RenderLayers::layer(3)));
    app.world_mut().entity_mut(hair).remove::<RenderLayers>();
    app.update();
    assert_eq!(layers(&app), None);
}

#[test]
fn a_copy_of_a_character_has_its_own() {
    let (mut app, root, _, hair) = wearing(WearHair::new(HairPreset::Short));
    let shell = shells(&mut app, hair)[0];
    app.world_mut().entity_mut(root).clone_and_spawn_with_opt_out(|cloner| {
        cloner.linked_cloning(true);
    });
    (0..200).for_each(|_| {
        app.update();
        sleep(Duration::from_millis(1));
    });
    let mut worn = app.world_mut().query::<(Entity, &WornAs)>();
    let copy = worn.iter(app.world()).map(|(hair, _)| hair).find(|other| *other != hair).unwrap();
    assert_eq!((shells_now(&app, hair).len(), shells_now(&app, copy).len()), (1, 1));
    app.world_mut().entity_mut(copy).insert(HairDye::pink());
    app.update();
    let own = color(&app, shells_now(&app, copy)[0]);
    assert!(own.red > 2.0 * own.green && color(&app, shell).red < 0.1, "{own:?}");
}

//! Bleach and dye as they are drawn. Skipped, with the reason printed, where nothing can draw.

use crate::offscreen::{Offscreen, Picture};
use bevy::{core_pipeline::tonemapping::Tonemapping, prelude::*};
use bevy_keratin::prelude::*;

const SIZE: u32 = 100;

/// A curtain of hanging hair before the camera, as wide and high as the picture, under light from the
/// camera's side and from all around.
fn curtain(look: HairLook) -> (Offscreen, Entity) {
    let mut scene = Offscreen::new(SIZE, SIZE);
    scene.look(Vec3::new(0.0, 0.0, 0.5), Vec3::ZERO);
    let camera = scene.camera;
    let world = scene.app.world_mut();
    // Colours as they are.
    world.entity_mut(camera).insert(Tonemapping::None);
    world.insert_resource(GlobalAmbientLight { brightness: 300.0, ..default() });
    let sun = DirectionalLight { illuminance: 800.0, ..default() };
    world.spawn((sun, Transform::from_xyz(0.2, 0.2, 1.0).looking_at(Vec3::ZERO, Vec3::Y)));
    let hair = world.spawn((Hair, look, HairFollowers::new(700))).id();
    for k in 0..40 {
        let x = 0.5 * (k as f32 / 39.0 - 0.5);
        let nodes: Vec<Vec3> = (0..9).map(|i| Vec3::new(x, 0.2 - 0.05 * i as f32, 0.0)).collect();
        world.spawn((StrandOf(hair), Strand::from_polyline(&nodes).unwrap()));
    }
    (scene, hair)
}

fn look(melanin: Melanin) -> HairLook {
    // Nine layers, as on a head, without the highlights, which have the light's colour.
    let plain = HairLook { gloss: 0.0, variation: 0.0, tip_bleach: 0.0, ..default() };
    HairLook { melanin, width: 1.2e-3, taper: 1.0, shadow_density: 5.0, ..plain }
}

fn drawn(scene: &mut Offscreen, hair: Entity, dye: HairDye) -> Picture {
    scene.app.world_mut().entity_mut(hair).insert(dye);
    scene.draw()
}

fn linear(byte: u8) -> f32 {
    Color::srgb_u8(byte, 0, 0).to_linear().red
}

/// The mean colour of the rows between, linear.
fn mean(picture: &Picture, rows: core::ops::Range<u32>) -> Vec3 {
    let places = rows.flat_map(|y| (20..SIZE - 20).map(move |x| (x, y)));
    let colors: Vec<Vec3> = places.map(|(x, y)| Vec3::from(picture.at(x, y).map(linear))).collect();
    colors.iter().sum::<Vec3>() / colors.len() as f32
}

/// Of which share of all light a colour has how much.
fn hue(color: Vec3) -> Vec3 {
    color / color.element_sum()
}

pub fn black_hair_is_drawn_pink_and_roots_and_tips_apart() {
    let (mut scene, hair) = curtain(look(Melanin::BLACK));
    let black = mean(&drawn(&mut scene, hair, HairDye::default()), 30..70);
    let pink = mean(&drawn(&mut scene, hair, HairDye::pink()), 30..70);
    // White hair with the same colour as its look: the dye of an artist's choice.
    let dye = HairColor::PINK;
    let white = HairLook { dye, ..look(Melanin::new(0.0, 0.0)) };
    scene.app.world_mut().entity_mut(hair).insert(white);
    let wanted = mean(&drawn(&mut scene, hair, HairDye::default()), 30..70);
    println!("black {black}, dyed {pink}, wanted {wanted}");
    assert!(black.element_sum() < 0.3 * pink.element_sum(), "it was black");
    assert!(pink.distance(wanted) < 2e-3, "black hair that is dyed is as pink as white hair");
    let expected = hue(Vec3::new(dye.red, dye.green, dye.blue));
    println!("hue {} for {expected}", hue(pink));
    // Light that comes through the hair from behind is of a deeper colour than what is reflected.
    assert!(hue(pink).distance(expected) < 0.03, "as pink as was said");
    assert!(pink.x > 1.5 * pink.z && pink.z > 1.2 * pink.y, "pink");

    // Up to two fifths from the roots: black below, to the bit.
    scene.app.world_mut().entity_mut(hair).insert(look(Melanin::BLACK));
    let bare = drawn(&mut scene, hair, HairDye::default());
    let roots = DyeLayer::bleached(HairColor::PINK).roots(0.4);
    let roots = drawn(&mut scene, hair, HairDye::of(roots));
    let (top, bottom) = (5..30, 60..95);
    assert!(hue(mean(&roots, top.clone())).distance(hue(pink)) < 0.05, "the roots are pink");
    let below = mean(&roots, bottom.clone()).distance(mean(&bare, bottom));
    assert!(below < 1e-4, "tips differ by {below}");
}

pub fn streaks_are_the_share_of_strands_that_was_asked_for() {
    // What light lobes do to one strand is not what they do to the next: the flat look of white on black.
    let (mut scene, hair) = curtain(look(Melanin::BLACK));
    let luma = |picture: &Picture| mean(picture, 10..90).element_sum();
    let black = luma(&drawn(&mut scene, hair, HairDye::default()));
    let white = luma(&drawn(&mut scene, hair, HairDye::of(DyeLayer::bleach(1.0))));
    let streaks = |share: f32, width: f32| {
        let streaks = Some(Streaks { share, width, seed: 3 });
        HairDye::of(DyeLayer { streaks, ..DyeLayer::bleach(1.0) })
    };
    for (share, width) in [(0.25, 0.0), (0.5, 0.0), (0.5, 0.01), (0.0, 0.01), (1.0, 0.01)] {
        let now = luma(&drawn(&mut scene, hair, streaks(share, width)));
        let found = (now - black) / (white - black);
        println!("{share} in streaks of {width} m: {found} are bright");
        assert!((found - share).abs() < 0.1, "{found} for {share}");
    }
}

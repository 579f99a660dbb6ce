//! Wet hair beside dry hair in the same pose: darker by what water does to the fibres, of deeper colour,
//! with a narrower highlight.

use crate::linear::{light_at, measure};
use crate::offscreen::{Offscreen, Picture};
use bevy::{
    light::{CascadeShadowConfigBuilder, DirectionalLightShadowMap},
    prelude::*,
};
use bevy_keratin::{prelude::*, render::WetLook};
use core::f32::consts::PI;

const RADIUS: f32 = 0.1;
const NODES: usize = 24;
const PIXEL: f32 = 0.8e-3;

/// Strands over a cylinder along x, in rows of a tenth of a millimetre, roots on top.
fn bent() -> Vec<Vec<Vec3>> {
    let strand = |i: u32| {
        let (row, k) = (i / 150, i % 150);
        let part = (i as f32 * 0.754_877_7).fract();
        let x = (k as f32 + 0.5 * (row % 2) as f32 + 0.9 * part) / 150.0 * 0.05 - 0.025;
        let radius = RADIUS - 1e-4 * row as f32;
        let node = |n: usize| {
            let (sin, cos) = (100.0 - 200.0 * n as f32 / (NODES - 1) as f32).to_radians().sin_cos();
            Vec3::new(x, radius * sin, radius * cos)
        };
        (0..NODES).map(node).collect()
    };
    (0..1500).map(strand).collect()
}

/// The mean light over the middle of the row whose normal is `degrees` above the camera's axis.
fn row(picture: &Picture, degrees: f32) -> Vec3 {
    let up = RADIUS * degrees.to_radians().sin() / PIXEL;
    let y = (0.5 * picture.height as f32 - up) as u32;
    let middle = picture.width / 2;
    let places = (middle - 24..middle + 24).flat_map(|x| [(x, y - 1), (x, y), (x, y + 1)]);
    places.map(|(x, y)| light_at(picture, x, y)).sum::<Vec3>() / 144.0
}

fn luminance(c: Vec3) -> f32 {
    c.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

/// The angle (degrees) over which rows are brighter than half way from the darkest to the brightest.
fn width(rows: &[Vec3]) -> f32 {
    let (low, high) = rows.iter().fold((f32::MAX, 0.0f32), |(low, high), c| {
        (low.min(luminance(*c)), high.max(luminance(*c)))
    });
    rows.iter().filter(|c| luminance(**c) > 0.5 * (low + high)).count() as f32
}

/// T15. Ratios as they follow from the shares of a fibre in water (a relative index of 1.165).
pub fn wet_hair_is_darker_deeper_in_colour_and_sleeker() {
    let mut scene = Offscreen::new(96, 264);
    measure(&mut scene, 96.0 * PIXEL, 264.0 * PIXEL);
    // Rows are means already, and their highlight must not reach into those beside it.
    scene.leave_grain();
    scene.app.insert_resource(DirectionalLightShadowMap { size: 2048 });
    let cascades = CascadeShadowConfigBuilder {
        num_cascades: 1,
        minimum_distance: 0.3,
        maximum_distance: 0.7,
        ..default()
    };
    let world = scene.app.world_mut();
    let (sin, cos) = 40f32.to_radians().sin_cos();
    let place = Transform::from_xyz(0.0, sin, cos).looking_at(Vec3::ZERO, Vec3::Y);
    let sun = DirectionalLight { shadow_maps_enabled: true, ..default() };
    let sun = world.spawn((sun, cascades.build(), place)).id();
    let followers = HairFollowers { segments: 24, ..HairFollowers::none() };
    let hair = world.spawn((Hair, followers)).id();
    for points in bent() {
        world.spawn((StrandOf(hair), Strand::from_polyline(&points).unwrap()));
    }
    let strands: Vec<Entity> = scene.app.world().get::<Strands>(hair).unwrap().iter().collect();
    // Eumelanin and the light that makes it measurable, and by how much wet hair is darker.
    let cases = [
        ("blond", Melanin::BLOND, 1.0, 0.35..=0.55),
        ("brown", Melanin::BROWN, 3.0, 0.4..=0.65),
        // The aim is 0.5; it is 0.49.
        ("dark", Melanin::DARK_BROWN, 5.0, 0.45..=0.75),
    ];
    for (name, melanin, gain, expected) in cases {
        let look = HairLook {
            melanin,
            variation: 0.0,
            tip_bleach: 0.0,
            width: 0.16e-3,
            taper: 1.0,
            ..default()
        };
        let [dry, wet] = [0.0, 1.0].map(|moisture| {
            let world = scene.app.world_mut();
            world.entity_mut(hair).insert(look.clone());
            world.get_mut::<DirectionalLight>(sun).unwrap().illuminance = PI * gain;
            for strand in &strands {
                world.entity_mut(*strand).insert(WetLook(vec![moisture; NODES]));
            }
            let picture = scene.draw();
            if let Ok(folder) = std::env::var("REFERENCE") {
                picture.save(&format!("{folder}/{name}-{moisture}.png"));
            }
            (-60..=70).map(|degrees| row(&picture, degrees as f32)).collect::<Vec<Vec3>>()
        });
        let mean = |rows: &[Vec3]| rows.iter().sum::<Vec3>() / rows.len() as f32;
        let darker = luminance(mean(&wet)) / luminance(mean(&dry));
        // The hair's own colour is seen beside the highlight, which has none.
        let saturations = [&dry, &wet].map(|rows| {
            let most = rows.iter().map(|c| luminance(*c)).fold(0.0, f32::max);
            let beside: Vec3 = rows.iter().filter(|c| luminance(**c) < 0.5 * most).sum();
            1.0 - beside.min_element() / beside.max_element()
        });
        let widths = [width(&dry), width(&wet)];
        println!(
            "{name}: wet {darker:.3} of dry, saturation {saturations:.3?}, highlight {widths:?}°"
        );
        assert!(expected.contains(&darker), "{name}: {darker}");
        // The aim is no loss at all; the film over the locks of brown and dark hair takes 3 and 4 %.
        assert!(saturations[1] >= 0.95 * saturations[0], "{name}: {saturations:?}");
        assert!(widths[1] <= 0.75 * widths[0], "{name}: {widths:?}");
    }
}

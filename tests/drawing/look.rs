//! What a look must not do: return more light than it gets, differ from its mirror image, or break on bad
//! values.

use crate::linear::{light_at, measure};
use crate::offscreen::{Offscreen, head_of_guides};
use bevy::{
    camera::{Hdr, RenderTarget},
    light::{CascadeShadowConfigBuilder, EnvironmentMapLight},
    prelude::*,
    render::{
        render_resource::{TextureFormat, TextureUsages},
        view::screenshot::{Screenshot, ScreenshotCaptured},
    },
};
use bevy_keratin::prelude::*;

fn wear(scene: &mut Offscreen, guides: &[Vec<Vec3>], parts: impl Bundle) -> Entity {
    let world = scene.app.world_mut();
    let hair = world.spawn((Hair, parts)).id();
    for points in guides {
        world.spawn((StrandOf(hair), Strand::from_polyline(points).unwrap()));
    }
    hair
}

/// T2. Under a sky of 1 everywhere, and no light, hair without pigment is as bright as the sky; hair with
/// pigment is darker.
pub fn white_hair_vanishes_in_a_white_sky() {
    let mut scene = Offscreen::new(128, 128);
    measure(&mut scene, 0.4, 0.4);
    let followers = HairFollowers { segments: 12, ..HairFollowers::new(6000) };
    let hair = wear(&mut scene, &head_of_guides(200, 0.09, 0.2, 12), followers);
    let camera = scene.camera;
    let world = scene.app.world_mut();
    let mut images = world.resource_mut::<Assets<Image>>();
    // Half as bright as a screen can show, so that too much would be seen.
    let sky = EnvironmentMapLight {
        intensity: 0.5,
        ..EnvironmentMapLight::solid_color(&mut images, Color::WHITE)
    };
    world.entity_mut(camera).insert(sky);
    world.insert_resource(ClearColor(Color::linear_rgb(0.5, 0.5, 0.5)));
    let mut before = 2.0;
    for (name, melanin) in [
        ("white", Melanin::new(0.0, 0.0)),
        ("blond", Melanin::BLOND),
        ("brown", Melanin::BROWN),
        ("black", Melanin::BLACK),
    ] {
        let look =
            HairLook { melanin, variation: 0.0, root_shade: 0.0, width: 2.5e-3, ..default() };
        scene.app.world_mut().entity_mut(hair).insert(look);
        let picture = scene.draw();
        if let Ok(folder) = std::env::var("REFERENCE") {
            picture.save(&format!("{folder}/sky-{name}.png"));
        }
        // Of the hair's inner part.
        let inner = (0..40).flat_map(|y| (0..24).map(move |x| (52 + x, 36 + y)));
        let light: Vec<f32> = inner.map(|(x, y)| 2.0 * light_at(&picture, x, y).y).collect();
        let mean = light.iter().sum::<f32>() / light.len() as f32;
        let most = light.iter().copied().fold(0.0, f32::max);
        println!("{name}: {mean:.3} of the sky, at most {most:.3}");
        if name == "white" {
            assert!((0.85..=1.02).contains(&mean) && most <= 1.05, "{mean}, {most}");
        } else {
            assert!(mean < 0.9 * before && mean > 0.01, "{name}: {mean}");
        }
        before = mean;
    }
}

/// T10. A symmetric tress under light from one side is the mirror image of it under light from the other,
/// and light does not jump from one column to the next.
pub fn light_from_the_other_side_makes_the_mirror_image() {
    let mut scene = Offscreen::new(96, 96);
    measure(&mut scene, 0.12, 0.12);
    let strand = |i: u32| {
        let x = ((i % 400) as f32 + 0.5) / 400.0 * 0.08 - 0.04;
        let z = -2e-4 * (i / 400) as f32;
        (0..5).map(|n| Vec3::new(x, 0.08 - 0.04 * n as f32, z)).collect()
    };
    let guides: Vec<Vec<Vec3>> = (0..1600).map(strand).collect();
    let look = HairLook {
        melanin: Melanin::BLOND,
        variation: 0.0,
        width: 0.25e-3,
        taper: 1.0,
        ..default()
    };
    wear(&mut scene, &guides, (look, HairFollowers { segments: 4, ..HairFollowers::none() }));
    let columns = [0.6, -0.6].map(|x| {
        let cascades =
            CascadeShadowConfigBuilder { num_cascades: 1, maximum_distance: 1.0, ..default() };
        let place = Transform::from_xyz(x, 0.2, 0.8).looking_at(Vec3::ZERO, Vec3::Y);
        let sun = DirectionalLight { illuminance: 3.0, shadow_maps_enabled: true, ..default() };
        let sun = scene.app.world_mut().spawn((sun, cascades.build(), place)).id();
        let picture = scene.draw();
        scene.app.world_mut().despawn(sun);
        let column = |x: u32| (24..72).map(|y| light_at(&picture, x, y).y).sum::<f32>() / 48.0;
        (0..96).map(column).collect::<Vec<f32>>()
    });
    let mean = columns[0][20..76].iter().sum::<f32>() / 56.0;
    let mirrored = (20..76).map(|x| (columns[0][x] - columns[1][95 - x]).abs()).sum::<f32>() / 56.0;
    let steps = columns.iter().flat_map(|c| c[20..76].windows(9));
    // Means of four columns beside each other: single ones have the noise of strands.
    let step = steps.map(|w| {
        let [left, right] = [&w[..4], &w[5..]].map(|side| side.iter().sum::<f32>() / 4.0);
        (left - right).abs()
    });
    let step = step.fold(0.0, f32::max) / mean;
    println!("mirror images differ by {:.4}, steps of {step:.4} of the mean", mirrored / mean);
    assert!(mirrored < 0.02 * mean && step < 0.05, "{mirrored} {step} {mean}");
}

/// All numbers of a picture of halves.
fn numbers(scene: &mut Offscreen, target: &Handle<Image>) -> Vec<f32> {
    #[derive(Resource, Default)]
    struct Raw(Vec<u8>);
    scene.app.insert_resource(Raw::default());
    scene.app.update();
    scene.app.world_mut().spawn(Screenshot::image(target.clone())).observe(
        |shot: On<ScreenshotCaptured>, mut raw: ResMut<Raw>| {
            raw.0 = shot.image.data.clone().unwrap_or_default();
        },
    );
    for _ in 0..20 {
        scene.app.update();
        let raw = &scene.app.world().resource::<Raw>().0;
        if !raw.is_empty() {
            let half = |b: &[u8]| half::f16::from_le_bytes([b[0], b[1]]).to_f32();
            return raw.chunks_exact(2).map(half).collect();
        }
    }
    panic!("no picture came back");
}

pub fn no_look_however_absurd_leaves_a_pixel_without_a_number() {
    let mut scene = Offscreen::new(48, 48);
    let mut image = Image::new_target_texture(48, 48, TextureFormat::Rgba16Float, None);
    image.texture_descriptor.usage |= TextureUsages::COPY_SRC;
    let world = scene.app.world_mut();
    let target = world.resource_mut::<Assets<Image>>().add(image);
    let camera = scene.camera;
    world.entity_mut(camera).insert((
        RenderTarget::Image(target.clone().into()),
        Hdr,
        bevy::core_pipeline::tonemapping::Tonemapping::None,
    ));
    let followers = HairFollowers { segments: 8, ..HairFollowers::new(400) };
    let hair = wear(&mut scene, &head_of_guides(60, 0.09, 0.2, 9), followers);
    let world = scene.app.world_mut();
    world.insert_resource(GlobalAmbientLight::default());
    world.spawn((HairCollider::sphere(0.09).unwrap(), Transform::IDENTITY));
    let place = Transform::from_xyz(0.5, 0.6, 0.7).looking_at(Vec3::ZERO, Vec3::Y);
    let of = |look: HairLook| (look, HairDetail::default());
    let thin = HairDetail { strands: 0.0, least_width: 1e30, least_strands: 0 };
    let looks = [
        ("usual", of(HairLook::default())),
        ("endless width", of(HairLook { width: f32::INFINITY, ..default() })),
        ("no width", of(HairLook { width: 0.0, taper: 0.0, ..default() })),
        ("NaN width", of(HairLook { width: f32::NAN, ..default() })),
        ("endless pigment", of(HairLook { melanin: Melanin::new(f32::MAX, 1e9), ..default() })),
        ("pigment below none", of(HairLook { melanin: Melanin::new(-1e9, f32::NAN), ..default() })),
        ("mirrors", of(HairLook { roughness: 0.0, gloss: 1e9, ..default() })),
        ("endless density", of(HairLook { shadow_density: 1e30, root_fade: 0.0, ..default() })),
        ("no density", of(HairLook { shadow_density: 0.0, backlight: 1e9, ..default() })),
        ("least detail", (HairLook::default(), thin)),
    ];
    let views = [
        ("from outside", Vec3::new(0.1, 0.05, 0.5), Vec3::ZERO),
        ("inside the hair", Vec3::new(0.098, 0.0, 0.0), Vec3::new(0.09, -0.1, 0.03)),
    ];
    for shadows in [true, false] {
        let light = DirectionalLight { shadow_maps_enabled: shadows, ..default() };
        let light = scene.app.world_mut().spawn((light, place)).id();
        // Without shadow maps another way through hair is taken; looks differ in nothing else.
        let count = if shadows { looks.len() } else { 4 };
        for (what, parts) in &looks[..count] {
            scene.app.world_mut().entity_mut(hair).insert(parts.clone());
            for (from_where, from, at) in views {
                scene.look(from, at);
                let numbers = numbers(&mut scene, &target);
                let bad = numbers.iter().filter(|x| !x.is_finite() || **x < 0.0).count();
                assert_eq!(bad, 0, "{what}, {from_where}, shadows {shadows}");
                let lit = numbers.chunks_exact(4).filter(|p| p[0] > 1e-4).count();
                println!("{what}, {from_where}, shadows {shadows}: {lit} pixels lit");
            }
        }
        scene.app.world_mut().despawn(light);
    }
}

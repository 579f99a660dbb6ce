//! Pictures to look at, not run by default:
//! `cargo test --test render_pictures -- --ignored --nocapture`, then open the files in /tmp.

mod common;
#[path = "common/offscreen.rs"]
mod offscreen;

use bevy::{light::CascadeShadowConfigBuilder, prelude::*};
use bevy_keratin::prelude::*;
use offscreen::{Offscreen, head_of_guides};

fn studio(scene: &mut Offscreen) {
    let world = scene.app.world_mut();
    let ball = world.resource_mut::<Assets<Mesh>>().add(Sphere::new(0.09));
    let skin = StandardMaterial {
        base_color: Color::srgb(0.8, 0.6, 0.5),
        perceptual_roughness: 0.6,
        ..default()
    };
    let skin = world.resource_mut::<Assets<StandardMaterial>>().add(skin);
    world.spawn((Mesh3d(ball), MeshMaterial3d(skin)));
    let light = |at: Vec3, lux: f32, color: Color, shadows: bool| {
        (
            DirectionalLight { illuminance: lux, color, shadow_maps_enabled: shadows, ..default() },
            CascadeShadowConfigBuilder { num_cascades: 1, maximum_distance: 2.0, ..default() }
                .build(),
            Transform::from_translation(at).looking_at(Vec3::ZERO, Vec3::Y),
        )
    };
    world.spawn(light(Vec3::new(1.0, 1.6, 1.4), 9000.0, Color::srgb(1.0, 0.95, 0.88), true));
    world.spawn(light(Vec3::new(-1.6, 0.4, 0.9), 2500.0, Color::srgb(0.8, 0.88, 1.0), false));
    world.spawn(light(Vec3::new(-0.5, 1.2, -1.6), 4500.0, Color::WHITE, true));
    world.insert_resource(GlobalAmbientLight { brightness: 350.0, ..default() });
    world.insert_resource(ClearColor(Color::srgb(0.18, 0.19, 0.21)));
    scene.look(Vec3::new(0.22, 0.08, 0.5), Vec3::new(0.0, -0.05, 0.0));
}

/// With `CURL` as radius (m) of the curls.
fn groom(scene: &mut Offscreen, guides: usize) -> Entity {
    let world = scene.app.world_mut();
    let hair = world.spawn(Hair).id();
    let curl: f32 = setting("CURL", 0.0);
    for (k, mut points) in head_of_guides(guides, 0.09, 0.26, 28).into_iter().enumerate() {
        for (i, point) in points.iter_mut().enumerate() {
            let (sin, cos) = (0.9 * i as f32 + 2.4 * k as f32).sin_cos();
            let grown = (i as f32 / 9.0).min(1.0);
            *point += Vec3::new(cos, 0.2 * sin, sin) * (curl * grown);
        }
        let strand = Strand::from_polyline(&points).unwrap();
        let mut bonds = Bonds::of(&strand);
        // For the heat map: cut toward the tips, as if they had hung in water.
        for (i, joint) in bonds.joints.iter_mut().enumerate() {
            joint.rates[0] = (1.4 - i as f32 / 9.0).clamp(0.0, 1.0);
        }
        world.spawn((StrandOf(hair), strand, bonds));
    }
    hair
}

/// A setting of the pictures, from the environment.
fn setting<T: std::str::FromStr>(name: &str, otherwise: T) -> T {
    let given = std::env::var(name).ok().and_then(|v| v.parse().ok());
    given.unwrap_or(otherwise)
}

#[test]
#[ignore = "writes pictures"]
fn studio_pictures() {
    let size = setting("SIZE", 400);
    let Some(mut scene) = Offscreen::new(size, size) else {
        return;
    };
    let fine = bevy::light::DirectionalLightShadowMap { size: 2048 };
    scene.app.insert_resource(fine);
    studio(&mut scene);
    let hair = groom(&mut scene, setting("GUIDES", 220));
    let count = setting("FOLLOWERS", 5000);
    let only: String = setting("ONLY", String::new());
    let msaa = match setting("MSAA", 4) {
        4 => Msaa::Sample4,
        _ => Msaa::Off,
    };
    let camera = scene.camera;
    scene
        .app
        .world_mut()
        .entity_mut(camera)
        .insert((msaa, bevy::light::ShadowFilteringMethod::Hardware2x2));
    if setting("SHADOWS", 1) == 0 {
        let world = scene.app.world_mut();
        for mut light in world.query::<&mut DirectionalLight>().iter_mut(world) {
            light.shadow_maps_enabled = false;
        }
    }
    let of = |melanin| HairLook { melanin, ..default() };
    let kajiya = HairLook { melanin: Melanin::RED, shading: HairShading::KajiyaKay, ..default() };
    let views = [
        ("brown", HairLook::default(), count, HairView::Natural),
        ("guides", HairLook::default(), 0, HairView::Natural),
        ("black", of(Melanin::BLACK), count, HairView::Natural),
        ("blond", of(Melanin::BLOND), count, HairView::Natural),
        ("red", of(Melanin::RED), count, HairView::Natural),
        ("kajiya", kajiya, count, HairView::Natural),
        ("heat", HairLook::default(), count, HairView::Bond(BondKind::Hydrogen)),
    ];
    for (name, look, count, view) in views {
        if !only.is_empty() && !only.split(',').any(|o| o == name) {
            continue;
        }
        let followers = HairFollowers::new(count);
        scene.app.world_mut().entity_mut(hair).insert((look, followers, view));
        scene.app.update();
        scene.app.update();
        let start = std::time::Instant::now();
        let picture = scene.draw_now();
        println!("{name}: {:?} for two frames", start.elapsed());
        for pipeline in scene.unready_pipelines() {
            println!("{pipeline}");
        }
        picture.save(&format!("/tmp/hair_{name}.png"));
    }
}

//! Pictures to look at, not run by default:
//! `cargo test --test render_pictures -- --ignored --nocapture`, then open the files in /tmp.

use crate::offscreen::{Offscreen, head_of_guides};
/// What the mannequin takes from the scenes.
use bevy::{light::CascadeShadowConfigBuilder, prelude::*};
use bevy_keratin::prelude::*;
use bevy_keratin::render::WetLook;

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

pub fn studio_pictures() {
    let size = setting("SIZE", 400);
    let mut scene = Offscreen::new(size, size);
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
        println!("{name}: {:?}", start.elapsed());
        for pipeline in scene.unready_pipelines() {
            println!("{pipeline}");
        }
        picture.save(&format!("/tmp/hair_{name}.png"));
    }
}

/// The mannequin lies; upright its crown is up and its face looks along +z.
fn upright(p: Vec3) -> Vec3 {
    Vec3::new(p.z, p.x, p.y)
}

fn lying(p: Vec3) -> Vec3 {
    Vec3::new(p.y, p.z, p.x)
}

/// How high the hairline is (m) at `front` (m) before the middle of the head.
fn hairline(front: f32) -> f32 {
    let line = [(-0.045, -0.05), (-0.022, -0.02), (0.0, 0.03), (0.03, 0.052), (0.06, 0.082)];
    if front <= line[0].0 {
        return line[0].1;
    }
    let piece = line.windows(2).find(|w| front < w[1].0);
    piece.map_or(0.084, |w| w[0].1 + (w[1].1 - w[0].1) * (front - w[0].0) / (w[1].0 - w[0].0))
}

/// Guides all over the scalp, parted in the middle, lying over head, neck and shoulders.
fn long_hair(spacing: f32, length: f32, nodes: usize) -> Vec<Vec<Vec3>> {
    let mut roots: Vec<Vec3> = Vec::new();
    let golden = core::f32::consts::PI * (3.0 - 5.0f32.sqrt());
    for i in 0..6000 {
        let y = 1.0 - 2.0 * (i as f32 + 0.5) / 6000.0;
        let (sin, cos) = (golden * i as f32).sin_cos();
        let flat = (1.0 - y * y).sqrt();
        // From outside onto the skin.
        let mut p = Vec3::new(0.018, 0.0, 0.0) + lying(Vec3::new(cos * flat, y, sin * flat)) * 0.1;
        for _ in 0..12 {
            p -= crate::mannequin::normal(&crate::mannequin::head, p) * crate::mannequin::head(p);
        }
        let at = upright(p);
        let ear = (p - Vec3::new(-0.016, -0.002, p.z.signum() * 0.08)).length() < 0.034;
        let free = roots.iter().all(|r| r.distance(at) > spacing);
        if at.y > hairline(at.z) && !ear && free && p.x > -0.06 {
            roots.push(at);
        }
    }
    roots.iter().map(|root| draped(*root, length, nodes)).collect()
}

fn draped(root: Vec3, length: f32, nodes: usize) -> Vec<Vec3> {
    let step = length / (nodes - 1) as f32;
    let side = if root.x < 0.0 { -1.0 } else { 1.0 };
    let normal = |p: Vec3| upright(crate::mannequin::normal(&crate::mannequin::head, lying(p)));
    let mut points = vec![root];
    let mut way = (normal(root) + Vec3::new(0.8 * side, 0.2, -0.5)).normalize();
    // Hair from higher up lies on that from below.
    let layer = 0.008 + 0.1 * (root.y - 0.0).max(0.0);
    for i in 1..nodes {
        let p = points[i - 1];
        let pull = Vec3::new(0.25 * side, -1.0, if p.z > 0.02 { -0.9 } else { -0.1 });
        way = (way + pull * (step * 45.0)).normalize();
        let mut next = p + way * step;
        let clear = layer * (i as f32 / 3.0).min(1.0);
        for _ in 0..3 {
            let depth = clear - crate::mannequin::head(lying(next));
            if depth > 0.0 {
                next += normal(next) * depth;
            }
        }
        way = (next - p).normalize_or(way);
        points.push(p + way * step);
    }
    points
}

/// The skin under the hair, darker, fading out at the hairline.
fn with_scalp(mut mesh: Mesh) -> Mesh {
    use bevy::mesh::VertexAttributeValues::{Float32x3, Float32x4};
    let Some(Float32x3(places)) = mesh.attribute(Mesh::ATTRIBUTE_POSITION).cloned() else {
        return mesh;
    };
    if let Some(Float32x4(colors)) = mesh.attribute_mut(Mesh::ATTRIBUTE_COLOR) {
        for (color, place) in colors.iter_mut().zip(places) {
            let at = upright(Vec3::from(place));
            let share = ((at.y - hairline(at.z)) / 0.012 + 0.3).clamp(0.0, 1.0) * 0.85;
            let skin = Vec4::from(*color);
            *color = skin.lerp(Vec4::new(0.05, 0.03, 0.022, 1.0), share).to_array();
        }
    }
    mesh
}

/// `cargo test --test render_pictures portraits -- --ignored --nocapture`: a whole head of long hair in
/// four looks. `WIDTH`, `HEIGHT`, `FOLLOWERS`, `ONLY` choose.
pub fn portraits() {
    let (width, height) = (setting("WIDTH", 1920), setting("HEIGHT", 1080));
    let mut scene = Offscreen::new(width, height);
    let fine = bevy::light::DirectionalLightShadowMap { size: 2048 };
    scene.app.insert_resource(fine);
    let only: String = setting("ONLY", String::new());
    let world = scene.app.world_mut();
    let head = world.resource_mut::<Assets<Mesh>>().add(with_scalp(crate::mannequin::mesh()));
    let skin = StandardMaterial { perceptual_roughness: 0.55, ..default() };
    let skin = world.resource_mut::<Assets<StandardMaterial>>().add(skin);
    let turn = Mat3::from_cols(Vec3::Y, Vec3::Z, Vec3::X);
    let upright = Transform::from_rotation(Quat::from_mat3(&turn));
    world.spawn((Mesh3d(head), MeshMaterial3d(skin), upright));
    let light = |at: Vec3, lux: f32, color: Color, shadows: bool| {
        let light = DirectionalLight {
            illuminance: lux,
            color,
            shadow_maps_enabled: shadows,
            shadow_normal_bias: 0.6,
            ..default()
        };
        let cascades =
            CascadeShadowConfigBuilder { num_cascades: 1, maximum_distance: 1.6, ..default() };
        let at = Transform::from_translation(at).looking_at(Vec3::ZERO, Vec3::Y);
        (light, cascades.build(), at)
    };
    world.spawn(light(Vec3::new(1.0, 1.3, 1.2), 9000.0, Color::srgb(1.0, 0.95, 0.88), true));
    world.spawn(light(Vec3::new(-1.5, 0.3, 0.9), 2200.0, Color::srgb(0.8, 0.88, 1.0), false));
    world.spawn(light(Vec3::new(-0.7, 1.0, -1.5), 5000.0, Color::WHITE, false));
    world.insert_resource(GlobalAmbientLight { brightness: 300.0, ..default() });
    world.insert_resource(ClearColor(Color::srgb(0.17, 0.18, 0.2)));
    scene.look(Vec3::new(0.29, 0.03, 0.52), Vec3::new(0.0, -0.085, 0.0));

    // Hair that hair hides is not shaded: many times faster.
    if setting("PREPASS", 1) == 1 {
        let camera = scene.camera;
        let prepass = bevy::core_pipeline::prepass::DepthPrepass;
        scene.app.world_mut().entity_mut(camera).insert(prepass);
    }
    let camera = scene.camera;
    let soft = bevy::light::ShadowFilteringMethod::Hardware2x2;
    scene.app.world_mut().entity_mut(camera).insert(soft);
    let world = scene.app.world_mut();
    let hair = world.spawn(Hair).id();
    let guides = long_hair(0.0125, setting("LENGTH", 0.36), 20);
    println!("{} guides", guides.len());
    for points in &guides {
        let strand = Strand::from_polyline(points).unwrap();
        let mut bonds = Bonds::of(&strand);
        // For the heat map: cut toward the tips, as if they had hung in water.
        for (i, joint) in bonds.joints.iter_mut().enumerate() {
            joint.rates[0] = (1.3 - i as f32 / 12.0).clamp(0.0, 1.0);
        }
        world.spawn((StrandOf(hair), strand, bonds));
    }
    let of = |melanin| HairLook { melanin, width: 0.2e-3, ..default() };
    let dark = Melanin::new(2.2, 0.1);
    let views = [
        ("dark", of(dark), HairView::Natural, false),
        ("blond", of(Melanin::BLOND), HairView::Natural, false),
        ("wet", of(dark), HairView::Natural, true),
        ("heat", of(dark), HairView::Bond(BondKind::Hydrogen), false),
    ];
    let followers = HairFollowers {
        segments: 24,
        stray: 0.02,
        clump: 0.35,
        ..HairFollowers::new(setting("FOLLOWERS", 20_000))
    };
    for (name, look, view, wet) in views {
        if !only.is_empty() && !only.split(',').any(|o| o == name) {
            continue;
        }
        scene.app.world_mut().entity_mut(hair).insert((look, followers, view));
        let strands: Vec<Entity> = scene.app.world().get::<Strands>(hair).unwrap().iter().collect();
        for strand in strands {
            let moisture = if wet { 1.0 } else { 0.0 };
            scene.app.world_mut().entity_mut(strand).insert(WetLook(vec![moisture; 20]));
        }
        let start = std::time::Instant::now();
        let picture = scene.draw_once();
        println!("{name}: {:?}", start.elapsed());
        picture.save(&format!("/tmp/portrait_{name}.png"));
    }
}

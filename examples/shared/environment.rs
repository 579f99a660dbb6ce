//! What surrounds the studio as a picture to be reflected: two soft boxes over a dark floor, painted
//! by rule, with what rougher surfaces see of it in smaller and smaller pictures.

use bevy::{
    asset::RenderAssetUsages,
    light::CascadeShadowConfigBuilder,
    prelude::*,
    render::render_resource::{
        Extent3d, TextureDimension, TextureFormat, TextureViewDescriptor, TextureViewDimension,
    },
};

/// Pixels along the side of the largest picture; every next has half as many.
const SIDE: u32 = 64;
const LEVELS: u32 = 7;

/// Where a soft box is, how wide it is (the cosine to its edge), and its light.
const BOXES: [(Vec3, f32, Vec3); 2] = [
    (Vec3::new(0.55, 0.65, 0.55), 0.86, Vec3::new(5.0, 4.7, 4.4)),
    (Vec3::new(-0.8, 0.35, 0.3), 0.82, Vec3::new(1.6, 1.8, 2.0)),
];
const CEILING: Vec3 = Vec3::new(0.55, 0.58, 0.62);
const WALL: Vec3 = Vec3::new(0.32, 0.33, 0.35);
const FLOOR: Vec3 = Vec3::new(0.07, 0.065, 0.06);

/// For a camera in the studio. `intensity` in cd/m².
pub fn studio(images: &mut Assets<Image>, intensity: f32) -> EnvironmentMapLight {
    EnvironmentMapLight {
        // Light on matt surfaces comes from half of the sky: so rough that no box is seen.
        diffuse_map: images.add(cube(1, |_| 1.0)),
        specular_map: images.add(cube(LEVELS, |level| level as f32 / (LEVELS - 1) as f32)),
        intensity,
        ..default()
    }
}

/// What comes from `way`, blurred as a surface of that roughness reflects it.
fn light_from(way: Vec3, roughness: f32) -> Vec3 {
    let up = way.y;
    let horizon = 0.08 + 0.9 * roughness;
    let sky = WALL.lerp(CEILING, up.clamp(0.0, 1.0));
    let room = FLOOR.lerp(sky, ((up + horizon) / (2.0 * horizon)).clamp(0.0, 1.0));
    let blur = 0.02 + 0.6 * roughness * roughness;
    let boxes = BOXES.map(|(place, edge, light)| {
        let inside = (way.dot(place.normalize()) - edge) / blur;
        // A box keeps its light however far it is spread.
        let size = 1.0 - edge;
        light * (1.0 / (1.0 + (-4.0 * inside).exp())) * (size / (size + 0.5 * blur))
    });
    room + boxes[0] + boxes[1]
}

/// The way through the middle of a pixel of a face: +x, −x, +y, −y, +z, −z.
fn way(face: u32, u: f32, v: f32) -> Vec3 {
    let way = match face {
        0 => Vec3::new(1.0, -v, -u),
        1 => Vec3::new(-1.0, -v, u),
        2 => Vec3::new(u, 1.0, v),
        3 => Vec3::new(u, -1.0, -v),
        4 => Vec3::new(u, -v, 1.0),
        _ => Vec3::new(-u, -v, -1.0),
    };
    // Cubes to be reflected are seen from inside.
    (way * Vec3::new(1.0, 1.0, -1.0)).normalize()
}

fn cube(levels: u32, roughness: impl Fn(u32) -> f32) -> Image {
    let mut data = Vec::new();
    for face in 0..6 {
        for level in 0..levels {
            let side = if levels == 1 { 16 } else { SIDE >> level };
            for y in 0..side {
                for x in 0..side {
                    let at = |i: u32| 2.0 * (i as f32 + 0.5) / side as f32 - 1.0;
                    let light = light_from(way(face, at(x), at(y)), roughness(level));
                    data.extend(light.extend(1.0).to_array().map(f32::to_le_bytes).as_flattened());
                }
            }
        }
    }
    let side = if levels == 1 { 16 } else { SIDE };
    let size = Extent3d { width: side, height: side, depth_or_array_layers: 6 };
    let mut image = Image::new_uninit(
        size,
        TextureDimension::D2,
        TextureFormat::Rgba32Float,
        RenderAssetUsages::RENDER_WORLD,
    );
    image.data = Some(data);
    image.texture_descriptor.mip_level_count = levels;
    image.texture_view_descriptor =
        Some(TextureViewDescriptor { dimension: Some(TextureViewDimension::Cube), ..default() });
    image
}

/// Key and fill from the front, which is +Z, two kickers so far behind that they draw an edge and do not light the
/// hair before the ears, for heads of life size times `size`. All cast shadows, or light from one side would shine
/// through the head.
#[allow(dead_code, reason = "the salon has its own")]
pub fn lights(world: &mut World, size: f32) {
    let light = |at: Vec3, lux: f32, color: Color| {
        let light = DirectionalLight {
            illuminance: lux,
            color,
            shadow_maps_enabled: true,
            shadow_normal_bias: 0.6,
            shadow_depth_bias: 0.002,
            ..default()
        };
        let cascades = CascadeShadowConfigBuilder {
            num_cascades: 1,
            minimum_distance: 0.3 * size,
            maximum_distance: 1.1 * size,
            ..default()
        };
        let at = Transform::from_translation(at).looking_at(Vec3::ZERO, Vec3::Y);
        (light, cascades.build(), at)
    };
    world.spawn(light(Vec3::new(1.0, 1.1, 1.2), 8000.0, Color::srgb(1.0, 0.95, 0.88)));
    world.spawn(light(Vec3::new(-1.5, 0.3, 0.9), 2000.0, Color::srgb(0.8, 0.88, 1.0)));
    world.spawn(light(Vec3::new(0.62, 0.5, -1.5), 2000.0, Color::WHITE));
    world.spawn(light(Vec3::new(-0.62, 0.5, -1.5), 2000.0, Color::WHITE));
}

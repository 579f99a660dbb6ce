// Drops of water: squares that face the eye, on which clear spheres are shaded that bend the light of what
// is behind them.

#import bevy_pbr::mesh_view_bindings::{view, view_transmission_texture}
#import bevy_pbr::mesh_bindings::mesh
#import bevy_pbr::view_transformations::position_world_to_clip
#import bevy_pbr::pbr_types::{pbr_input_new, STANDARD_MATERIAL_FLAGS_FOG_ENABLED_BIT}
#import bevy_pbr::transmission::fetch_transmissive_background_non_rough
#import bevy_pbr::pbr_functions::{apply_pbr_lighting, main_pass_post_lighting_processing}

struct Bead {
    position: vec3<f32>,
    radius: f32,
    velocity: vec3<f32>,
    unused: f32,
}

@group(#{MATERIAL_BIND_GROUP}) @binding(0) var<storage, read> beads: array<Bead>;

// How long a film is exposed (s): a bead is drawn as long as what it flies in this time.
const EXPOSURE: f32 = 0.006;
const MOST_STRETCH: f32 = 3.0;
// Beads smaller than this (pixels) are drawn so large and paler.
const LEAST_PIXELS: f32 = 0.7;

struct BeadVertex {
    @builtin(position) position: vec4<f32>,
    @location(0) world_position: vec3<f32>,
    // Place on the unit disc, and how much of it counts.
    @location(1) disc: vec3<f32>,
    // The square's axes in the world; the third looks to the eye.
    @location(2) along: vec3<f32>,
    @location(3) across: vec3<f32>,
    @location(4) @interpolate(flat) instance: u32,
    // Half its length and width (m).
    @location(5) @interpolate(flat) size: vec2<f32>,
    @location(6) @interpolate(flat) center: vec3<f32>,
}

fn toward_eye(position: vec3<f32>) -> vec3<f32> {
    if view.clip_from_view[3][3] == 1.0 {
        return normalize(view.world_from_view[2].xyz);
    }
    return normalize(view.world_position - position);
}

@vertex
fn vertex(@builtin(instance_index) instance: u32, @location(0) corner: u32) -> BeadVertex {
    var out: BeadVertex;
    let bead = beads[corner / 4u];
    if bead.radius <= 0.0 {
        out.position = vec4(0.0, 0.0, 0.0, 1.0);
        return out;
    }
    let side = vec2(f32(corner & 1u), f32((corner >> 1u) & 1u)) * 2.0 - 1.0;
    let eye = toward_eye(bead.position);
    // Along what is seen of the flight; along the screen at rest.
    let seen = bead.velocity - eye * dot(bead.velocity, eye);
    let speed = length(seen);
    let right = view.world_from_view[0].xyz;
    let still = normalize(right - eye * dot(right, eye));
    out.along = select(still, seen / max(speed, 1e-9), speed > 1e-3);
    out.across = cross(eye, out.along);
    let stretch = 1.0 + min(0.5 * speed * EXPOSURE / bead.radius, MOST_STRETCH - 1.0);
    let w = abs((view.clip_from_world * vec4(bead.position, 1.0)).w);
    let pixel = 2.0 * w / (abs(view.clip_from_view[1][1]) * max(view.viewport.w, 1.0));
    // Its volume stays: long beads are slim.
    let size = bead.radius * vec2(stretch, inverseSqrt(stretch));
    let drawn = max(size, vec2(LEAST_PIXELS * pixel));
    let world = bead.position + out.along * (side.x * drawn.x) + out.across * (side.y * drawn.y);
    out.world_position = world;
    out.position = position_world_to_clip(world);
    out.disc = vec3(side, size.x * size.y / (drawn.x * drawn.y));
    out.instance = instance;
    out.size = drawn;
    out.center = bead.position;
    return out;
}

// How far behind it a bead's light is taken to come from, in its radii.
const BEHIND: f32 = 3.0;
// The index of refraction of water.
const WATER: f32 = 1.33;

// What has been drawn behind the beads at a place of the world.
fn background(place: vec3<f32>, frag_coord: vec4<f32>) -> vec4<f32> {
    let clip = view.clip_from_world * vec4(place, 1.0);
    let part = clip.xy / max(clip.w, 1e-6) * vec2(0.5, -0.5) + 0.5;
    let size = vec2<f32>(textureDimensions(view_transmission_texture));
    let at = (clamp(part, vec2(0.0), vec2(1.0)) * view.viewport.zw + view.viewport.xy) / size;
    return fetch_transmissive_background_non_rough(at, frag_coord.xyz);
}

// Light that comes through the sphere, refracted where it goes in and where it comes out.
fn refracted(in: BeadVertex, normal: vec3<f32>, eye: vec3<f32>) -> vec3<f32> {
    let inside = refract(vec3(0.0, 0.0, -1.0), normal, 1.0 / WATER);
    let exit = normal - 2.0 * dot(normal, inside) * inside;
    let onward = refract(inside, -exit, WATER);
    let far = exit + BEHIND * onward;
    let place = in.center + in.along * (far.x * in.size.x) + in.across * (far.y * in.size.y)
        + eye * (far.z * in.size.y);
    let seen = background(place, in.position);
    // What is nearer than the bead is not seen through it.
    let straight = background(in.world_position, in.position);
    return mix(straight.rgb, seen.rgb, seen.a);
}

@fragment
fn fragment(in: BeadVertex) -> @location(0) vec4<f32> {
    let square = dot(in.disc.xy, in.disc.xy);
    if square >= 1.0 {
        discard;
    }
    let eye = toward_eye(in.world_position);
    let own = vec3(in.disc.xy, sqrt(1.0 - square));
    let normal = normalize(in.along * own.x + in.across * own.y + eye * own.z);

    var pbr = pbr_input_new();
    pbr.flags = mesh[in.instance].flags;
    pbr.frag_coord = in.position;
    pbr.world_position = vec4(in.world_position, 1.0);
    pbr.is_orthographic = view.clip_from_view[3][3] == 1.0;
    pbr.world_normal = normal;
    pbr.N = normal;
    pbr.V = eye;
    pbr.material.reflectance = vec3(0.354);
    pbr.material.perceptual_roughness = 0.22;
    // What lamps throw through the drop onto its far side.
    pbr.material.base_color = vec4(vec3(0.12), 1.0);
    pbr.material.diffuse_transmission = 1.0;
    pbr.material.flags = STANDARD_MATERIAL_FLAGS_FOG_ENABLED_BIT;
    let mirrored = 0.02 + 0.98 * pow(1.0 - own.z, 5.0);
    let light = apply_pbr_lighting(pbr).rgb + (1.0 - mirrored) * refracted(in, own, eye);
    let shown = mix(background(in.world_position, in.position).rgb, light, in.disc.z);
    return main_pass_post_lighting_processing(pbr, vec4(shown, 1.0));
}

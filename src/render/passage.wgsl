// How much hair light goes through before it comes to a place: from shadow maps, whose texels hold
// where light meets the first fibre. Strands are drawn into them at their true share of a texel, so
// what passes is e^-depth in the mean, and depth is 1 for that fibre and the hair's density for the
// way on from it (Yuksel and Keyser 2008 have such layers; here the first is random).
#define_import_path bevy_keratin::passage

#import bevy_pbr::mesh_view_bindings as view_bindings
#import bevy_pbr::mesh_view_bindings::{view, lights}
#import bevy_pbr::mesh_view_types::POINT_LIGHT_FLAGS_SPOT_LIGHT_Y_NEGATIVE
#import bevy_pbr::shadows
#import bevy_render::maths::orthonormalize
#import bevy_keratin::fibre::Passage

// Where light goes to, and what it meets before.
struct Way {
    from_eye: vec3<f32>,
    density: f32,           // fibres that it meets on a metre
    // By how much the fibre there comes nearer to the light, for a metre across it.
    slope: f32,
}

// A place counts as shaded by what is nearer to the light than by so many texels. Half of one is
// what a texel's middle is beside the strand; the spline below sees its own strand 1.5 aside.
fn bias_of(way: Way) -> f32 {
    return 0.5 + 1.5 * way.slope;
}

const OPEN: Passage = Passage(1.0, 0.0, 0.0);

// `separation` (m): mean way from the first fibre, where light met any.
fn passage_of(lit: f32, separation: f32, density: f32) -> Passage {
    let behind = max(density * separation, 0.0);
    return Passage(lit, (1.0 - lit) * (1.0 + behind), behind);
}

// How the numbers in a shadow map are distances from the light: near / z for spots, linear otherwise.
struct DepthScale {
    near: f32,
    metres: f32,
}

fn distance_of(z: f32, scale: DepthScale) -> f32 {
    if scale.near > 0.0 {
        return scale.near / max(z, 1e-6);
    }
    return (1.0 - z) * scale.metres;
}

fn spline(f: f32) -> vec3<f32> {
    return vec3(0.5 * (0.5 - f) * (0.5 - f), 0.75 - f * f, 0.5 * (0.5 + f) * (0.5 + f));
}

// Three by three texels around `uv`, weighted by a quadratic spline. `stretch` is the light's way
// for a metre of depth.
fn first_fibres(
    layer: i32, uv: vec2<f32>, depth: f32, bias: f32, scale: DepthScale, stretch: f32, density: f32,
) -> Passage {
    let size = vec2<f32>(textureDimensions(view_bindings::directional_shadow_textures));
    let place = uv * size;
    let middle = floor(place);
    let across = spline(place.x - middle.x - 0.5);
    let down = spline(place.y - middle.y - 0.5);
    var shaded = 0.0;
    var separation = 0.0;
    for (var y = 0; y < 3; y++) {
        for (var x = 0; x < 3; x++) {
            let texel = clamp(middle + vec2(f32(x), f32(y)) - 1.0, vec2(0.0), size - 1.0);
            let z = textureLoad(view_bindings::directional_shadow_textures, vec2<i32>(texel), layer, 0);
            let apart = depth - distance_of(z, scale);
            let weight = select(0.0, across[x] * down[y], z > 0.0 && apart > bias);
            shaded += weight;
            separation += weight * apart;
        }
    }
    return passage_of(saturate(1.0 - shaded), stretch * separation / max(shaded, 1e-4), density);
}

fn sun_passage(id: u32, way: Way, view_z: f32) -> Passage {
    let light = &view_bindings::lights.directional_lights[id];
    let cascade_index = shadows::get_cascade_index(id, view_z);
    if cascade_index >= (*light).num_cascades {
        return OPEN;
    }
    let cascade = &(*light).cascades[cascade_index];
    let m = (*cascade).clip_from_world;
    // What is rounded is the same for all of a picture.
    let clip = m * vec4(view.world_position, 1.0) + m * vec4(way.from_eye, 0.0);
    if clip.w <= 0.0 || any(abs(clip.xy) > vec2(clip.w)) || clip.z < 0.0 {
        return OPEN;
    }
    let ndc = clip.xyz / clip.w;
    let metres = inverseSqrt(max(m[0].z * m[0].z + m[1].z * m[1].z + m[2].z * m[2].z, 1e-12));
    let scale = DepthScale(0.0, metres);
    let layer = i32((*light).depth_texture_base_index + cascade_index);
    return first_fibres(layer, ndc.xy * vec2(0.5, -0.5) + 0.5, distance_of(ndc.z, scale),
        bias_of(way) * (*cascade).texel_size, scale, 1.0, way.density);
}

fn spot_passage(id: u32, way: Way) -> Passage {
    let light = &view_bindings::clustered_lights.data[id];
    let from_light = way.from_eye - ((*light).position_radius.xyz - view.world_position);
    var axis = vec3((*light).light_custom_data.x, 0.0, (*light).light_custom_data.y);
    axis.y = sqrt(max(0.0, 1.0 - axis.x * axis.x - axis.z * axis.z));
    if ((*light).flags & POINT_LIGHT_FLAGS_SPOT_LIGHT_Y_NEGATIVE) != 0u {
        axis.y = -axis.y;
    }
    let seen = from_light * orthonormalize(-axis);
    let depth = -seen.z;
    if depth <= (*light).shadow_map_near_z {
        return OPEN;
    }
    let ndc = seen.xy / ((*light).spot_light_tan_angle * depth);
    if any(abs(ndc) > vec2(1.0)) {
        return OPEN;
    }
    let size = f32(textureDimensions(view_bindings::directional_shadow_textures).x);
    let texel = 2.0 * (*light).spot_light_tan_angle * depth / size;
    let layer = i32(id) + lights.spot_light_shadowmap_offset;
    return first_fibres(layer, ndc * vec2(0.5, -0.5) + 0.5, depth, bias_of(way) * texel,
        DepthScale((*light).shadow_map_near_z, 0.0), length(from_light) / depth, way.density);
}

// Cube maps can only be compared with: how many texels' first fibres are nearer than 0, 1, 3 and 9
// fibres before the place bounds how far away they are.
fn point_passage(id: u32, way: Way, frag_coord: vec2<f32>) -> Passage {
    let light = &view_bindings::clustered_lights.data[id];
    let to_light = (*light).position_radius.xyz - view.world_position - way.from_eye;
    let far = max(length(to_light), 1e-6);
    let size = f32(textureDimensions(view_bindings::point_shadow_textures).x);
    let bias = bias_of(way) * 2.0 * far / size;
    let fibre = 1.0 / max(way.density, 1.0);
    var lit = 1.0;
    var behind = 0.0;
    var steps = array<f32, 5>(0.0, 1.0, 3.0, 9.0, 27.0);
    for (var i = 0; i < 4; i++) {
        // The light's own bias suits walls; hair is thinner.
        let ahead = min(bias + steps[i] * fibre, far) - (*light).shadow_depth_bias;
        let place = vec4(view.world_position + way.from_eye + to_light * (ahead / far), 1.0);
        let open = shadows::fetch_point_shadow(id, place, vec3(0.0), frag_coord);
        if i == 0 {
            lit = open;
        }
        behind += (1.0 - open) * (steps[i + 1] - steps[i]);
    }
    return passage_of(lit, behind * fibre / max(1.0 - lit, 1e-4), way.density);
}

// For lights without a shadow map: hair is taken for a plane layer that faces the eye, `toward` the
// cosine between its normal and the light, and the place for the first fibre that the eye meets.
fn slab_passage(toward: f32, layers: f32) -> Passage {
    let c = max(abs(toward), 0.05);
    let fibres = select(layers, min(1.0, layers), toward > 0.0) / c;
    let lit = select(exp(-fibres), max(c / (1.0 + c), exp(-layers / c)), toward > 0.0);
    return Passage(lit, fibres, fibres);
}

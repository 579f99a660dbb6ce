// How hair reflects light: Kajiya-Kay as in [W] equation 3, and a Marschner-like fibre with the
// lobes R, TT and TRT in the real-time form of Karis (2016, "Physically based hair shading in
// Unreal"), under all of Bevy's lights.
#define_import_path bevy_keratin::shading

#import bevy_pbr::mesh_view_bindings as view_bindings
#import bevy_pbr::mesh_view_bindings::{view, lights}
#import bevy_pbr::mesh_view_types
#import bevy_pbr::clustered_forward as clustering
#import bevy_pbr::lighting
#import bevy_pbr::shadows
#ifdef ENVIRONMENT_MAP
#import bevy_pbr::environment_map
#endif
#import bevy_render::maths::PI
#import bevy_keratin::strands::{ribbon, hash}

struct Fibre {
    position: vec3<f32>,
    frag_coord: vec4<f32>,
    tangent: vec3<f32>,
    eye: vec3<f32>,
    outward: vec3<f32>,
    along: f32,
    seed: u32,
    moisture: f32,
}

// What a fibre is made of at one place.
struct Surface {
    color: vec3<f32>,
    roughness: f32,
    gloss: f32,
    // Light that the cuticles' rough edges scatter before it meets a pigment.
    pale: f32,
}

fn surface_of(fibre: Fibre) -> Surface {
    var surface: Surface;
    let color = mix(ribbon.root_color, ribbon.tip_color, fibre.along);
    // Absorption varies with the melanin of each strand: colour = exp(-k sqrt(melanin)).
    let melanin = max(1.0 + ribbon.variation * (4.0 * hash(fibre.seed + 7u) - 2.0), 0.0);
    // Water fills the gaps between fibres: darker and glossier.
    let wet = fibre.moisture;
    surface.color = pow(max(color, vec3(1e-4)), vec3(sqrt(melanin) * (1.0 + 0.7 * wet)));
    let uneven = 1.0 + 0.3 * (hash(fibre.seed + 11u) - 0.5);
    surface.roughness = clamp(ribbon.roughness * uneven * (1.0 - 0.35 * wet), 0.04, 1.0);
    surface.gloss = ribbon.gloss * (1.0 + 1.2 * wet);
    // No two strands are alike, which even black hair shows; a film of water smooths the edges.
    surface.pale = 0.012 * (0.4 + 1.2 * hash(fibre.seed + 13u)) * (1.0 - 0.8 * wet);
    return surface;
}

// [W] equation 3: l to the light, v to the eye, t the tangent.
fn kajiya_kay(t: vec3<f32>, l: vec3<f32>, v: vec3<f32>, exponent: f32) -> vec2<f32> {
    let lt = dot(l, t);
    let vt = dot(v, t);
    let sin_l = sqrt(max(1.0 - lt * lt, 0.0));
    let sin_v = sqrt(max(1.0 - vt * vt, 0.0));
    return vec2(sin_l, pow(max(sin_l * sin_v - lt * vt, 0.0), exponent));
}

fn gauss(width: f32, x: f32) -> f32 {
    return exp(-0.5 * x * x / (width * width)) / (sqrt(2.0 * PI) * width);
}

// Schlick, for keratin's index of refraction 1.55.
fn fresnel(cosine: f32) -> f32 {
    let f0 = 0.0465;
    return f0 + (1.0 - f0) * pow(1.0 - saturate(cosine), 5.0);
}

fn luminance(color: vec3<f32>) -> f32 {
    return dot(color, vec3(0.2126, 0.7152, 0.0722));
}

// Light that has bounced between fibres: soft, tinted more the deeper it went.
fn scattered(fibre: Fibre, surface: Surface, l: vec3<f32>, shadow: f32) -> vec3<f32> {
    let lt = dot(l, fibre.tangent);
    let cylinder = sqrt(max(1.0 - lt * lt, 0.0));
    let wrapped = saturate((dot(fibre.outward, l) + 0.5) / 2.25);
    let tint = pow(surface.color / max(luminance(surface.color), 1e-4), vec3(1.0 - shadow));
    let pale = surface.color + surface.pale;
    return sqrt(surface.color) * surface.color * tint * mix(wrapped, cylinder, 0.4) * (1.0 / PI)
        + pale * wrapped / PI;
}

// Reflected share of light from `l`, shadow (1 lit) included. Not yet weighted by the light.
fn reflected(fibre: Fibre, surface: Surface, l: vec3<f32>, shadow: f32) -> vec3<f32> {
    // The far side of the head is dark even where lights cast no shadow.
    let facing = smoothstep(-0.45, 0.25, dot(fibre.outward, l));
    let t = fibre.tangent;
    let v = fibre.eye;
    let r = surface.roughness;

#ifdef HAIR_KAJIYA_KAY
    // Two lobes, shifted to root and tip; the second went through the fibre and is tinted.
    let exponent = 2.0 / (r * r);
    let first = kajiya_kay(normalize(t + 0.05 * fibre.outward), l, v, exponent);
    let second = kajiya_kay(normalize(t - 0.1 * fibre.outward), l, v, 0.25 * exponent);
    let bright = surface.gloss * facing * (exponent + 2.0) / (64.0 * PI);
    return shadow * (surface.color * first.x * mix(0.4, 1.0, facing) / PI
        + bright * first.y * 0.35
        + bright * second.y * 0.5 * sqrt(surface.color));
#else
    let sin_l = clamp(dot(t, l), -1.0, 1.0);
    let sin_v = clamp(dot(t, v), -1.0, 1.0);
    let cos_d = cos(0.5 * abs(asin(sin_v) - asin(sin_l)));
    let l_across = l - sin_l * t;
    let v_across = v - sin_v * t;
    let cos_phi = dot(l_across, v_across)
        * inverseSqrt(dot(l_across, l_across) * dot(v_across, v_across) + 1e-4);
    let cos_half = sqrt(saturate(0.5 + 0.5 * cos_phi));
    let n = 1.19 / cos_d + 0.36 * cos_d;
    let shift = 0.035;
    let b = r * r;
    let sum = sin_l + sin_v;

    // R: off the cuticle, uncoloured, shifted to the root by its scales.
    let sa = sin(-2.0 * shift);
    let ca = cos(-2.0 * shift);
    let r_shift = 2.0 * sa * (ca * cos_half * sqrt(1.0 - sin_v * sin_v) + sa * sin_v);
    let r_lobe = gauss(b * 1.4142 * max(cos_half, 0.1), sum - r_shift) * 0.25 * cos_half
        * fresnel(sqrt(saturate(0.5 + 0.5 * dot(v, l))));

    // TT: straight through, the glow around hair against the light.
    let a = 1.0 / n;
    let h = cos_half * (1.0 + a * (0.6 - 0.8 * cos_phi));
    let f_tt = fresnel(cos_d * sqrt(saturate(1.0 - h * h)));
    let tt_color = pow(surface.color, vec3(0.5 * sqrt(saturate(1.0 - h * h * a * a)) / cos_d));
    let tt_lobe = gauss(b * 0.5 + 0.02, sum - shift) * exp(-3.65 * cos_phi - 3.98)
        * (1.0 - f_tt) * (1.0 - f_tt) * tt_color;

    // TRT: off the far wall inside, coloured, shifted to the tip.
    let f_trt = fresnel(cos_d * 0.5);
    let trt_lobe = gauss(b * 2.0, sum - 4.0 * shift) * exp(17.0 * cos_phi - 16.78)
        * (1.0 - f_trt) * (1.0 - f_trt) * f_trt * pow(surface.color, vec3(0.8 / cos_d));

    let through = ribbon.backlight * tt_lobe * smoothstep(-1.0, -0.2, -abs(dot(fibre.outward, l)));
    let mirror = surface.gloss * facing * (r_lobe + trt_lobe * 2.0);
    return shadow * (mirror + through) + shadow * scattered(fibre, surface, l, shadow);
#endif
}

// Shadow is looked up at two places above: hair is not a wall, light fades as it goes in.
const DEPTHS: vec2<f32> = vec2(0.4, 1.6);

fn at_depth(fibre: Fibre, l: vec3<f32>, depth: f32) -> vec4<f32> {
    return vec4(fibre.position + l * depth, 1.0);
}

fn local_light(id: u32, spot: bool, fibre: Fibre, surface: Surface) -> vec3<f32> {
    let light = &view_bindings::clustered_lights.data[id];
    let way = (*light).position_radius.xyz - fibre.position;
    let square = dot(way, way);
    let l = way * inverseSqrt(max(square, 1e-8));
    var strength = lighting::getDistanceAttenuation(square, (*light).color_inverse_square_range.w);
    if spot {
        var axis = vec3((*light).light_custom_data.x, 0.0, (*light).light_custom_data.y);
        axis.y = sqrt(max(0.0, 1.0 - axis.x * axis.x - axis.z * axis.z));
        if ((*light).flags & mesh_view_types::POINT_LIGHT_FLAGS_SPOT_LIGHT_Y_NEGATIVE) != 0u {
            axis.y = -axis.y;
        }
        let cone = saturate(dot(-axis, l) * (*light).light_custom_data.z + (*light).light_custom_data.w);
        strength *= cone * cone;
    }
    if strength <= 0.0 {
        return vec3(0.0);
    }
    var shadow = 1.0;
    if ((*light).flags & mesh_view_types::POINT_LIGHT_FLAGS_SHADOWS_ENABLED_BIT) != 0u {
        shadow = 0.0;
        for (var i = 0; i < 2; i++) {
            let place = at_depth(fibre, l, ribbon.self_shadow * DEPTHS[i]);
            if spot {
                shadow += 0.5 * shadows::fetch_spot_shadow(
                    id, place, fibre.outward, (*light).shadow_map_near_z, fibre.frag_coord.xy);
            } else {
                shadow += 0.5 * shadows::fetch_point_shadow(
                    id, place, fibre.outward, fibre.frag_coord.xy);
            }
        }
    }
    return reflected(fibre, surface, l, shadow) * (*light).color_inverse_square_range.rgb * strength;
}

fn lit_hair(fibre: Fibre) -> vec3<f32> {
    let surface = surface_of(fibre);
    let orthographic = view.clip_from_view[3][3] == 1.0;
    let view_z = (view.view_from_world * vec4(fibre.position, 1.0)).z;
    let cluster = clustering::view_fragment_cluster_index(fibre.frag_coord.xy, view_z, orthographic);
    var ranges = clustering::unpack_clusterable_object_index_ranges(cluster);

    var light = vec3(0.0);
    for (var i = ranges.first_point_light_index_offset; i < ranges.first_spot_light_index_offset; i++) {
        light += local_light(clustering::get_clusterable_object_id(i), false, fibre, surface);
    }
    for (var i = ranges.first_spot_light_index_offset; i < ranges.first_reflection_probe_index_offset; i++) {
        light += local_light(clustering::get_clusterable_object_id(i), true, fibre, surface);
    }
    for (var i = 0u; i < lights.n_directional_lights; i++) {
        let sun = &view_bindings::lights.directional_lights[i];
        let l = (*sun).direction_to_light;
        var shadow = 1.0;
        if ((*sun).flags & mesh_view_types::DIRECTIONAL_LIGHT_FLAGS_SHADOWS_ENABLED_BIT) != 0u {
            shadow = 0.0;
            for (var k = 0; k < 2; k++) {
                shadow += 0.5 * shadows::fetch_directional_shadow(
                    i, at_depth(fibre, l, ribbon.self_shadow * DEPTHS[k]), fibre.outward, view_z, fibre.frag_coord.xy);
            }
        }
        light += reflected(fibre, surface, l, shadow) * (*sun).color.rgb;
    }
    // A rectangle is a point at its middle that shines to its front, spread by its size.
    for (var i = 0u; i < lights.n_rect_lights; i++) {
        let panel = &view_bindings::lights.rect_lights[i];
        let way = (*panel).position - fibre.position;
        let square = max(dot(way, way), 1e-8);
        let l = way * inverseSqrt(square);
        let front = saturate(dot(cross((*panel).up, (*panel).right), -l));
        let area = (*panel).width * (*panel).height;
        let falloff = lighting::getRangeFalloff(square, 1.0 / max((*panel).range * (*panel).range, 1e-4));
        light += reflected(fibre, surface, l, 1.0) * (*panel).color.rgb
            * (front * area / (square + area) * falloff);
    }

    // What comes from everywhere reaches roots least.
    let open = 1.0 - ribbon.root_shade * (1.0 - smoothstep(0.0, 0.35, fibre.along));
    let indirect_color = surface.color * (0.8 + 0.2 * sqrt(surface.color)) + surface.pale * surface.gloss;
    var indirect = lights.ambient_color.rgb * indirect_color;
#ifdef ENVIRONMENT_MAP
    var input: lighting::LightingInput;
    let toward = safe_outward(fibre);
    input.layers[0].NdotV = max(dot(toward, fibre.eye), 0.05);
    input.layers[0].N = toward;
    input.layers[0].R = reflect(-fibre.eye, toward);
    input.layers[0].perceptual_roughness = sqrt(surface.roughness);
    input.layers[0].roughness = surface.roughness;
    input.P = fibre.position;
    input.V = fibre.eye;
    input.diffuse_color = surface.color;
    input.F0_dielectric = vec3(0.0465 * 0.5 * surface.gloss);
    input.F0_metallic = vec3(0.0);
    input.F_ab = lighting::F_AB(sqrt(surface.roughness), input.layers[0].NdotV);
    let surround = environment_map::environment_map_light(&input, &ranges, false);
    indirect += surround.diffuse + surround.specular;
#endif
    // Shade from the strands above also holds for direct light without shadow maps, in part.
    return view.exposure * (light * mix(1.0, open, 0.6) + indirect * open);
}

// The outward direction, turned toward the eye as a shiny cylinder's normal is.
fn safe_outward(fibre: Fibre) -> vec3<f32> {
    let across = fibre.eye - fibre.tangent * dot(fibre.eye, fibre.tangent);
    let n = fibre.outward + across;
    return n * inverseSqrt(max(dot(n, n), 1e-8));
}

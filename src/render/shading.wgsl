// How hair reflects light: the fibre of fibre.wgsl, or Kajiya-Kay as in [W] equation 3, under all of
// Bevy's lights.
#define_import_path bevy_keratin::shading

#import bevy_pbr::mesh_view_bindings as view_bindings
#import bevy_pbr::mesh_view_bindings::{view, lights}
#import bevy_pbr::mesh_view_types
#import bevy_pbr::clustered_forward as clustering
#import bevy_pbr::lighting
#ifdef ENVIRONMENT_MAP
#import bevy_pbr::environment_map
#endif
#ifdef IRRADIANCE_VOLUME
#import bevy_pbr::irradiance_volume::irradiance_volume_light
#endif
#ifdef ATMOSPHERE
#import bevy_pbr::atmosphere::functions::{calculate_visible_sun_ratio, clamp_to_surface}
#endif
#import bevy_render::maths::PI
#import bevy_keratin::strands::{ribbon, frame, hash, DrawnSolid}
#import bevy_keratin::fibre::{
    DIFFUSE, Optics, Passage, angles_of, scattered, forward_share, backward_share, bulk_of,
}
#import bevy_keratin::passage::{Way, slab_passage, sun_passage, spot_passage, point_passage}
#import bevy_keratin::volume::{VolumePlace, light_in_volume, fibres_toward}

struct Fibre {
    // In the world, and to there from the eye, which is exact far from the origin too.
    position: vec3<f32>,
    from_eye: vec3<f32>,
    frag_coord: vec4<f32>,
    tangent: vec3<f32>,
    eye: vec3<f32>,
    // Faces the eye as far as it can across the fibre: a normal that never flips (Karis 2016).
    normal: vec3<f32>,
    along: f32,
    seed: u32,
    moisture: f32,
    // Of strands around, seen from beside (1/m).
    density: f32,
    // The layers of dye whose streaks it is in, a bit each.
    streaks: u32,
    // From the middle of the lock that water draws together (m).
    outward: vec3<f32>,
    // Of what is drawn, that the strand covers: the rest of a pixel belongs to others.
    share: f32,
    // In the hair's frame (m), and that frame's axes and scale in the world.
    local: vec3<f32>,
    turn: mat3x3<f32>,
    scale: f32,
    place: VolumePlace,
    // Whether shadow maps act on it.
    shadowed: bool,
}

// What a fibre is made of at one place.
struct Surface {
    optics: Optics,
    // Of strands around, one behind the other.
    layers: f32,
    // Of all the hair, under light from all around.
    reflectance: vec3<f32>,
    transmittance: vec3<f32>,
}

// How far strands keep their looks, as a share of the length: some millimetres.
const PIECES: f32 = 48.0;

// Noise of a strand's own in -1 ... 1, smooth along it.
fn along_noise(seed: u32, share: f32) -> f32 {
    let place = share * PIECES;
    let piece = u32(max(place, 0.0));
    let f = fract(place);
    let low = hash(seed + piece * 1013u);
    let high = hash(seed + (piece + 1u) * 1013u);
    return 2.0 * mix(low, high, f * f * (3.0 - 2.0 * f)) - 1.0;
}

// What a fibre absorbs that has been bleached and dyed. Rust twin: `HairDye::absorption`.
fn dyed(natural: vec3<f32>, along: f32, in_streaks: u32) -> vec3<f32> {
    var absorption = natural;
    for (var i = 0u; i < ribbon.dye_count; i++) {
        let dye = ribbon.dyes[i];
        if dye.in_streaks != 0u && (in_streaks & (1u << i)) == 0u {
            continue;
        }
        let half = max(0.5 * dye.fade, 5e-7);
        let begun = select(smoothstep(dye.begin - half, dye.begin + half, along), 1.0, dye.begin <= 0.0);
        let ended = select(smoothstep(dye.end - half, dye.end + half, along), 0.0, dye.end >= 1.0);
        let cover = begun * (1.0 - ended);
        absorption = absorption * (1.0 - dye.bleach * cover) + dye.absorption * cover;
    }
    return absorption;
}

fn surface_of(fibre: Fibre) -> Surface {
    var surface: Surface;
    // Strands in one pixel differ from their mean by the root of their number: what one sample sees of
    // them would be noise.
    let apart = sqrt(saturate(fibre.share));
    // Pigment varies from strand to strand; grey hair is a mixture with strands that have none.
    let melanin = max(1.0 + apart * ribbon.variation * (4.0 * hash(fibre.seed + 7u) - 2.0), 0.0)
        * step(ribbon.grey, hash(fibre.seed + 17u));
    let natural = melanin * mix(ribbon.root_absorption, ribbon.tip_absorption, fibre.along);
    let absorption = dyed(natural, fibre.along, fibre.streaks);
    // No two strands are alike, nor two pieces of one: 15 % in roughness, 1.5 degrees in tilt.
    let uneven = 1.0 + 0.15 * apart * (2.0 * hash(fibre.seed + 11u) - 1.0);
    let rough = clamp(ribbon.roughness * uneven, 0.05, 1.0);
    let tilt = 0.026 * apart * along_noise(fibre.seed, fibre.along);
    surface.optics = Optics(absorption, rough * rough * rough * rough, ribbon.gloss,
        ribbon.backlight, fibre.moisture, tilt, 0.0, fibre.moisture, fibre.place.disarray);
    surface.layers = select(ribbon.layers, fibre.place.thickness, fibre.place.is_known);
    let bulk = bulk_of(forward_share(surface.optics), backward_share(surface.optics), DIFFUSE * surface.layers);
    surface.reflectance = bulk.reflectance;
    surface.transmittance = bulk.transmittance;
    return surface;
}

// Spread of the film's normals about a lock's own (1/rad^2), and the peak that makes their mean 1.
const LOCK_FOCUS: f32 = 11.0;
const LOCK_PEAK: f32 = 2.66;
// From this far from its middle a strand lies on the surface of a lock (m).
const LOCK_SURFACE: f32 = 1e-3;
// Share of the film that lies so; the rest lies around the strands.
const LOCK_STREAKS: f32 = 0.6;

// A film of water covers a lock as a whole and mirrors about the lock's normal: how strongly where this
// strand lies on it, against the mean over the lock.
fn film_of(fibre: Fibre, l: vec3<f32>) -> f32 {
    let h = l + fibre.eye;
    let across = h - fibre.tangent * dot(h, fibre.tangent);
    let out = fibre.outward - fibre.tangent * dot(fibre.outward, fibre.tangent);
    let far = dot(out, out);
    let facing = dot(across, out) * inverseSqrt(max(dot(across, across) * far, 1e-20));
    let on = LOCK_STREAKS * smoothstep(0.0, LOCK_SURFACE, sqrt(far));
    return fibre.moisture * mix(1.0, LOCK_PEAK * exp(LOCK_FOCUS * (facing - 1.0)), on);
}

// [W] equation 3: l to the light, v to the eye, t the tangent.
fn kajiya_kay(t: vec3<f32>, l: vec3<f32>, v: vec3<f32>, exponent: f32) -> vec2<f32> {
    let lt = dot(l, t);
    let vt = dot(v, t);
    let sin_l = sqrt(max(1.0 - lt * lt, 0.0));
    let sin_v = sqrt(max(1.0 - vt * vt, 0.0));
    return vec2(sin_l, pow(max(sin_l * sin_v - lt * vt, 0.0), exponent));
}

// How light has come to a fibre.
struct Arrival {
    passage: Passage,
    // On the light's whole way through the hair.
    whole: f32,
}

// Reflected share of light from `l`. Not yet weighted by the light.
fn reflected(fibre: Fibre, surface: Surface, l: vec3<f32>, arrival: Arrival) -> vec3<f32> {
    let p = arrival.passage;
#ifdef HAIR_KAJIYA_KAY
    // Two lobes, shifted to tip and root; the second went through the fibre and is tinted.
    let t = fibre.tangent;
    let exponent = 2.0 / sqrt(surface.optics.variance);
    let first = kajiya_kay(normalize(t + 0.05 * fibre.normal), l, fibre.eye, exponent);
    let second = kajiya_kay(normalize(t - 0.1 * fibre.normal), l, fibre.eye, 0.25 * exponent);
    let facing = smoothstep(-0.45, 0.25, dot(fibre.normal, l));
    let bright = surface.optics.gloss * facing * (exponent + 2.0) / (64.0 * PI);
    // What goes into the fibres; the lobes are what their surface reflects.
    let body = max(surface.reflectance - backward_share(surface.optics), vec3(0.0));
    return p.lit * (body * first.x * mix(0.4, 1.0, facing) / PI
        + bright * first.y * 0.35
        + bright * second.y * 0.5 * sqrt(body));
#else
    var optics = surface.optics;
    optics.film = film_of(fibre, l);
    return scattered(angles_of(fibre.tangent, l, fibre.eye), optics, p, surface.layers, arrival.whole);
#endif
}

// Across the light's way, fibres are met as their length is seen.
fn way_of(fibre: Fibre, l: vec3<f32>) -> Way {
    let lt = dot(l, fibre.tangent);
    let sine = sqrt(max(1.0 - lt * lt, 0.0));
    return Way(fibre.from_eye, fibre.density * sine, min(abs(lt) / max(sine, 0.1), 3.0));
}

// What a shadow map says of a light's way, with the number of fibres from the grid: the map knows how far away
// the first fibre is, the grid how many there are, but not of the nearest ones. Where they are less than so dense as
// here, it may be no fibre that is in the way.
fn counted(p: Passage, fibre: Fibre, way: Way, l: vec3<f32>, light: vec4<f32>) -> Arrival {
    let slot = light_in_volume(fibre.place, light);
    if slot < 0 {
        return Arrival(p, ribbon.layers);
    }
    let fibres = fibres_toward(fibre.place, slot, l * fibre.turn);
    let near = fibres.near * fibre.scale;
    let density = max(way.density, 1e-3);
    // Thin hair is no thicker than a texel of the map; fibres farther off say that there are nearer ones, too.
    let far = max(smoothstep(near, 2.0 * near, p.behind / density), smoothstep(0.5, 1.0, fibres.ahead));
    let behind = max(p.behind, near * density + fibres.ahead) * far + p.behind * (1.0 - far);
    return Arrival(Passage(p.lit, (1.0 - p.lit) * (1.0 + behind), behind), fibres.whole);
}

// The way of a light without a shadow map: hair is taken for a plane layer as far as the grid does not know of
// more.
fn uncounted(fibre: Fibre, l: vec3<f32>, light: vec4<f32>) -> Arrival {
    let slot = light_in_volume(fibre.place, light);
    if slot < 0 {
        return Arrival(slab_passage(dot(fibre.normal, l), ribbon.layers), ribbon.layers);
    }
    let fibres = fibres_toward(fibre.place, slot, l * fibre.turn);
    let out = fibre.turn * fibre.place.open.xyz;
    let c = dot(out, l) * inverseSqrt(max(dot(out, out), 1e-12));
    // Before the surface the eye sees the first fibres, behind it as many more as the grid has left out.
    let front = slab_passage(max(c, 0.05), fibre.place.thickness);
    let near = fibre.density * fibres.near * fibre.scale;
    let behind = mix(near, front.behind, smoothstep(-0.3, 0.3, c)) + fibres.ahead;
    let lit = mix(exp(-near), front.lit, smoothstep(-0.3, 0.3, c)) * exp(-fibres.ahead);
    return Arrival(Passage(lit, behind, behind), fibres.whole);
}

// How far away the sun is (m).
const FAR: f32 = 1e6;

// How much of a sun's light the air lets through to a place, as Bevy has it for other things.
fn through_air(id: u32, position: vec3<f32>) -> vec3<f32> {
#ifdef ATMOSPHERE
    let sun = &view_bindings::lights.directional_lights[id];
    let air = view_bindings::atmosphere;
    let place = clamp_to_surface(air, (air.world_to_atmosphere * vec4(position, 1.0)).xyz);
    let height = length(place);
    let up = dot((*sun).direction_to_light, place / height);
    return lighting::sample_transmittance_lut(height, up)
        * calculate_visible_sun_ratio(air, height, up, (*sun).sun_disk_angular_size);
#else
    return vec3(1.0);
#endif
}

// How much of the way of light from a place is free of a solid: 0 where it goes through its middle.
fn beside(solid: DrawnSolid, place: vec4<f32>, l: vec3<f32>, away: f32) -> f32 {
    let begin = vec3(dot(solid.x, place), dot(solid.y, place), dot(solid.z, place));
    let way = vec3(dot(solid.x.xyz, l), dot(solid.y.xyz, l), dot(solid.z.xyz, l));
    let square = max(dot(way, way), 1e-12);
    // A hat's mesh casts its own shadow.
    if solid.half < 0.0 {
        return 1.0;
    }
    // Nearest places of the ray and of the segment, in turn.
    var nearest = 0.0;
    var t = 0.0;
    for (var i = 0; i < 3; i++) {
        t = clamp(dot(vec3(0.0, nearest, 0.0) - begin, way) / square, 0.0, away);
        nearest = clamp(begin.y + t * way.y, -solid.half, solid.half);
    }
    let off = begin + t * way - vec3(0.0, nearest, 0.0);
    // What lies on the surface is lit until light grazes it.
    return select(smoothstep(0.96, 1.0, dot(off, off)), 1.0, t <= 0.0);
}

// How much of a light that shines from `l`, `away` metres from here, is let by solids that strands are
// pushed out of: a head. Lights without shadow maps do not shine through a head either.
fn past_solids(fibre: Fibre, l: vec3<f32>, away: f32) -> f32 {
    var free = 1.0;
    if frame.solid_count == 0u {
        return free;
    }
    let toward = l * fibre.turn / fibre.scale;
    // The largest come first; the small ones fill creases between them.
    for (var i = 0u; i < min(frame.solid_count, 16u); i++) {
        free = min(free, beside(frame.solids[i], vec4(fibre.local, 1.0), toward, away));
    }
    return free;
}

fn local_light(id: u32, spot: bool, fibre: Fibre, surface: Surface) -> vec3<f32> {
    let light = &view_bindings::clustered_lights.data[id];
    let way = (*light).position_radius.xyz - view.world_position - fibre.from_eye;
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
    var p: Arrival;
    let known = vec4((*light).position_radius.xyz, 1.0);
    let hair = way_of(fibre, l);
    if !fibre.shadowed || ((*light).flags & mesh_view_types::POINT_LIGHT_FLAGS_SHADOWS_ENABLED_BIT) == 0u {
        p = uncounted(fibre, l, known);
    } else if spot {
        p = counted(spot_passage(id, hair), fibre, hair, l, known);
    } else {
        p = counted(point_passage(id, hair, fibre.frag_coord.xy), fibre, hair, l, known);
    }
    strength *= past_solids(fibre, l, sqrt(square));
    return reflected(fibre, surface, l, p) * (*light).color_inverse_square_range.rgb * strength;
}

// How much of what the cuticle would mirror irradiance volumes do not stand for: all where a sky does, else what Bevy takes
// from a sky for its roughness.
#ifdef ENVIRONMENT_MAP
const UNMIRRORED: f32 = 1.0;
#else
const UNMIRRORED: f32 = 0.32;
#endif

// How open the grid says it is where the eye sees a plane layer.
const OPEN_PLANE: f32 = 0.36;

fn lit_hair(fibre: Fibre) -> vec3<f32> {
    let surface = surface_of(fibre);
    let orthographic = view.clip_from_view[3][3] == 1.0;
    let view_z = (view.view_from_world * vec4(fibre.from_eye, 0.0)).z;
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
        var p: Arrival;
        let hair = way_of(fibre, l);
        if !fibre.shadowed || ((*sun).flags & mesh_view_types::DIRECTIONAL_LIGHT_FLAGS_SHADOWS_ENABLED_BIT) == 0u {
            p = uncounted(fibre, l, vec4(l, 0.0));
        } else {
            p = counted(sun_passage(i, hair, view_z), fibre, hair, l, vec4(l, 0.0));
        }
        light += reflected(fibre, surface, l, p) * (*sun).color.rgb * through_air(i, fibre.position)
            * past_solids(fibre, l, FAR);
    }
    // A rectangle is a point at its middle that shines to its front, spread by its size.
    for (var i = 0u; i < lights.n_rect_lights; i++) {
        let panel = &view_bindings::lights.rect_lights[i];
        let way = (*panel).position - view.world_position - fibre.from_eye;
        let square = max(dot(way, way), 1e-8);
        let l = way * inverseSqrt(square);
        let front = saturate(dot(cross((*panel).up, (*panel).right), -l));
        let area = (*panel).width * (*panel).height;
        let falloff = lighting::getRangeFalloff(square, 1.0 / max((*panel).range * (*panel).range, 1e-4));
        let p = uncounted(fibre, l, vec4((*panel).position, 1.0));
        light += reflected(fibre, surface, l, p) * (*panel).color.rgb
            * (front * area / (square + area) * falloff * past_solids(fibre, l, sqrt(square)));
    }

    // What comes from everywhere reaches roots least, and places that hair lies around.
    var open = vec3(1.0 - ribbon.root_shade * (1.0 - smoothstep(0.0, 0.35, fibre.along)));
    var normal = fibre.normal;
    if fibre.place.is_known {
        let around = fibre.place.open;
        open *= pow(vec3(clamp(around.w / OPEN_PLANE, 1e-3, 1.0)), 1.0 - forward_share(surface.optics));
        let out = fibre.turn * around.xyz;
        let across = out - fibre.tangent * dot(out, fibre.tangent);
        // Away from the hair, and to the eye where it does not say.
        let mean = fibre.normal + 10.0 * across;
        normal = mean * inverseSqrt(max(dot(mean, mean), 1e-12));
    }
    var indirect = lights.ambient_color.rgb * (surface.reflectance + surface.transmittance);
    // Irradiance volumes take the place of the sky's matt light.
    var has_volume = false;
#ifdef IRRADIANCE_VOLUME
    has_volume = true;
    // What the cuticle mirrors comes from a sky, where there is one.
    let matt = surface.reflectance - UNMIRRORED * min(backward_share(surface.optics), surface.reflectance).b;
    indirect += matt * irradiance_volume_light(fibre.position, normal, &ranges)
        + surface.transmittance * irradiance_volume_light(fibre.position, -normal, &ranges);
#endif
#ifdef ENVIRONMENT_MAP
    // The cuticle mirrors about the normal, stretched along the fibre; the rest comes out as from
    // a matt body.
    let mirrored = min(backward_share(surface.optics), surface.reflectance).b;
    var input: lighting::LightingInput;
    input.layers[0].NdotV = max(dot(fibre.normal, fibre.eye), 0.05);
    input.layers[0].N = normal;
    input.layers[0].R = reflect(-fibre.eye, fibre.normal);
    input.layers[0].perceptual_roughness = pow(surface.optics.variance, 0.125);
    input.layers[0].roughness = pow(surface.optics.variance, 0.25);
    input.P = fibre.position;
    input.V = fibre.eye;
    input.diffuse_color = surface.reflectance - mirrored;
    input.F0_dielectric = vec3(mirrored);
    input.F0_metallic = vec3(0.0);
    input.F_ab = lighting::F_AB(input.layers[0].perceptual_roughness, input.layers[0].NdotV);
    let surround = environment_map::environment_map_light(&input, &ranges, has_volume);
    indirect += surround.diffuse + surround.specular;
    // And what shines through from behind.
    input.layers[0].N = -normal;
    input.layers[0].R = -fibre.eye;
    input.diffuse_color = surface.transmittance;
    input.F0_dielectric = vec3(0.0);
    indirect += environment_map::environment_map_light(&input, &ranges, has_volume).diffuse;
#endif
    return view.exposure * (light + indirect * open);
}

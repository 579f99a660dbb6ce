// Hair as the camera sees it, in two draws: depth with stochastic coverage, then light on what is in front.

#import bevy_pbr::mesh_functions
#import bevy_pbr::mesh_bindings::mesh
#import bevy_pbr::mesh_types::MESH_FLAGS_SHADOW_RECEIVER_BIT
#import bevy_pbr::mesh_view_bindings::view
#import bevy_pbr::pbr_types::{pbr_input_new, STANDARD_MATERIAL_FLAGS_FOG_ENABLED_BIT}
#import bevy_pbr::pbr_functions::main_pass_post_lighting_processing
#import bevy_keratin::ribbon::{ribbon_vertex, in_clip, toward_eye, facing_normal, safe_normalize}
#import bevy_keratin::strands::{ribbon, streaks, density_at}
#import bevy_keratin::coverage::covered_samples
#import bevy_keratin::shading::{Fibre, lit_hair}
#import bevy_keratin::volume::volume_place

// The strain that is drawn red.
const STRAIN_FULL: f32 = 0.05;

struct ForwardVertex {
    @invariant @builtin(position) position: vec4<f32>,
    // To the middle of the strand: beside it a ribbon would lie in its own shadow.
    @location(0) from_eye: vec3<f32>,
    @location(1) tangent: vec3<f32>,
    // Along the strand, value of the heat map, moisture, density of strands around.
    @location(2) along: vec4<f32>,
    // Share of what is drawn that the strand covers, and how far it has come out of the scalp.
    @location(3) share: vec2<f32>,
    // And the layers of dye whose streaks it is in.
    @location(4) @interpolate(flat) seed: vec2<u32>,
    // From the middle of the lock that water draws together.
    @location(5) outward: vec3<f32>,
    // Of the hair's frame.
    @location(6) @interpolate(flat) instance: u32,
    // Of the middle of the strand, in the hair's frame.
    @location(7) local: vec3<f32>,
}

struct Fragment {
    @location(0) color: vec4<f32>,
    // Which way it lies on the screen, see `material.rs`.
    @location(1) mark: vec4<f32>,
#ifdef HAIR_DEPTH
    @builtin(sample_mask) samples: u32,
#endif
}

@vertex
fn vertex(@builtin(instance_index) instance: u32, @location(0) corner: u32) -> ForwardVertex {
    var out: ForwardVertex;
    let vertex = ribbon_vertex(corner, instance);
    if !vertex.shown {
        out.position = vec4(0.0, 0.0, 0.0, 1.0);
        return out;
    }
    out.from_eye = vertex.center;
    out.position = in_clip(vertex.from_eye);
    out.tangent = vertex.tangent;
    out.outward = vertex.outward;
    out.instance = instance;
    out.local = vertex.local;
    let strand = min(corner / (2u * (ribbon.segments + 1u)), arrayLength(&streaks) - 1u);
    out.seed = vec2(vertex.seed, streaks[strand]);
    out.share = vec2(vertex.share, vertex.grown);
    var value = 0.0;
    switch ribbon.view {
        case 1u, 2u, 3u, 4u: { value = vertex.state.rates[ribbon.view - 1u]; }
        case 5u: { value = vertex.state.strain / STRAIN_FULL; }
        case 7u: { value = vertex.state.moisture; }
        default: {}
    }
    out.along = vec4(vertex.whole, value, vertex.state.moisture, density_at(vertex.along) / max(vertex.scale, 1e-6));
    return out;
}

// Blue 0, red 1, over a pale violet. Rust twin: `heat`.
fn heat(value: f32) -> vec3<f32> {
    let v = saturate(value);
    let srgb = vec3(v, 1.6 * v * (1.0 - v), 1.0 - v);
    return select(pow((srgb + 0.055) / 1.055, vec3(2.4)), srgb / 12.92, srgb <= vec3(0.04045));
}

// The direction of a strand on the screen, whose y goes down.
fn way_on_screen(from_eye: vec3<f32>, tangent: vec3<f32>) -> vec2<f32> {
    let place = in_clip(from_eye);
    let along = view.clip_from_world * vec4(tangent, 0.0);
    return (along.xy * place.w - place.xy * along.w) * view.viewport.zw * vec2(1.0, -1.0);
}

// Up or down, and none along the line of sight.
fn mark_of(way: vec2<f32>) -> vec4<f32> {
    let square = dot(way, way);
    let twice = vec2(way.x * way.x - way.y * way.y, 2.0 * way.x * way.y) / max(square, 1e-30);
    return vec4(select(vec2(0.5), 0.5 + 0.5 * twice, square > 1e-20), 1.0, 1.0);
}

@fragment
fn fragment(in: ForwardVertex) -> Fragment {
    var out: Fragment;
#ifdef HAIR_DEPTH
    out.samples = covered_samples(in.share.x * saturate(in.share.y), in.seed.x, in.position.xy);
    if out.samples == 0u {
        discard;
    }
#ifdef HAIR_MARKED
    out.mark = mark_of(way_on_screen(in.from_eye, in.tangent));
#else
    out.mark = vec4(0.5, 0.5, 0.0, 0.0);
#endif
#else ifdef HAIR_HEAT
    out.color = vec4(heat(in.along.y), 1.0);
#else
    var fibre: Fibre;
    fibre.from_eye = in.from_eye;
    fibre.position = view.world_position + in.from_eye;
    fibre.frag_coord = in.position;
    fibre.tangent = safe_normalize(in.tangent, vec3(0.0, 1.0, 0.0));
    fibre.eye = toward_eye(in.from_eye);
    fibre.normal = facing_normal(fibre.tangent, fibre.eye);
    fibre.along = in.along.x;
    fibre.seed = in.seed.x;
    fibre.streaks = in.seed.y;
    fibre.moisture = saturate(in.along.z);
    fibre.density = in.along.w;
    fibre.outward = in.outward;
    fibre.share = in.share.x;
    let world = mesh_functions::get_world_from_local(in.instance);
    let linear = mat3x3(world[0].xyz, world[1].xyz, world[2].xyz);
    // It turns and scales alike all ways.
    fibre.scale = max(length(world[0].xyz), 1e-6);
    fibre.turn = linear * (1.0 / fibre.scale);
    fibre.local = in.local;
    fibre.place = volume_place(in.local);
    fibre.shadowed = (mesh[in.instance].flags & MESH_FLAGS_SHADOW_RECEIVER_BIT) != 0u;
    let lit = lit_hair(fibre);

    var pbr = pbr_input_new();
    pbr.frag_coord = in.position;
    pbr.world_position = vec4(fibre.position, 1.0);
    pbr.material.flags |= STANDARD_MATERIAL_FLAGS_FOG_ENABLED_BIT;
    out.color = main_pass_post_lighting_processing(pbr, vec4(lit, 1.0));
#endif
    return out;
}

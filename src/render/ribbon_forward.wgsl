// Hair as the camera sees it.

#import bevy_pbr::view_transformations::position_world_to_clip
#import bevy_pbr::mesh_view_bindings::view
#import bevy_pbr::pbr_types::{pbr_input_new, STANDARD_MATERIAL_FLAGS_FOG_ENABLED_BIT}
#import bevy_pbr::pbr_functions::main_pass_post_lighting_processing
#import bevy_keratin::ribbon::{ribbon_vertex, toward_eye}
#import bevy_keratin::strands::ribbon
#import bevy_keratin::shading::{Fibre, lit_hair}

// The strain that is drawn red.
const STRAIN_FULL: f32 = 0.05;

struct ForwardVertex {
    @invariant @builtin(position) position: vec4<f32>,
    @location(0) world_position: vec3<f32>,
    @location(1) tangent: vec3<f32>,
    @location(2) outward: vec3<f32>,
    // Along the strand, value of the heat map, moisture.
    @location(3) along: vec3<f32>,
    @location(4) @interpolate(flat) seed: u32,
}

@vertex
fn vertex(@builtin(instance_index) instance: u32, @location(0) corner: u32) -> ForwardVertex {
    var out: ForwardVertex;
    let vertex = ribbon_vertex(corner, instance);
    if !vertex.shown {
        out.position = vec4(0.0, 0.0, 0.0, 1.0);
        return out;
    }
    out.world_position = vertex.world_position;
    out.position = position_world_to_clip(vertex.world_position);
    out.tangent = vertex.tangent;
    out.outward = vertex.outward;
    out.seed = vertex.seed;
    var value = 0.0;
    switch ribbon.view {
        case 1u, 2u, 3u, 4u: { value = vertex.state.rates[ribbon.view - 1u]; }
        case 5u: { value = vertex.state.strain / STRAIN_FULL; }
        case 7u: { value = vertex.state.moisture; }
        default: {}
    }
    out.along = vec3(vertex.along, value, vertex.state.moisture);
    return out;
}

// Blue 0, red 1, over a pale violet. Rust twin: `heat`.
fn heat(value: f32) -> vec3<f32> {
    let v = saturate(value);
    let srgb = vec3(v, 1.6 * v * (1.0 - v), 1.0 - v);
    return select(pow((srgb + 0.055) / 1.055, vec3(2.4)), srgb / 12.92, srgb <= vec3(0.04045));
}

@fragment
fn fragment(in: ForwardVertex) -> @location(0) vec4<f32> {
#ifdef HAIR_HEAT
    return vec4(heat(in.along.y), 1.0);
#else
    var fibre: Fibre;
    fibre.position = in.world_position;
    fibre.frag_coord = in.position;
    fibre.tangent = normalize(in.tangent);
    fibre.eye = toward_eye(in.world_position);
    fibre.outward = normalize(in.outward);
    fibre.along = in.along.x;
    fibre.seed = in.seed;
    fibre.moisture = saturate(in.along.z);
    let lit = lit_hair(fibre);

    var pbr = pbr_input_new();
    pbr.frag_coord = in.position;
    pbr.world_position = vec4(in.world_position, 1.0);
    pbr.material.flags |= STANDARD_MATERIAL_FLAGS_FOG_ENABLED_BIT;
    return main_pass_post_lighting_processing(pbr, vec4(lit, 1.0));
#endif
}

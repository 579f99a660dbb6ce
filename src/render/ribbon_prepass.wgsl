// Hair in shadow maps, as seen from the light, and in the camera's prepasses: depth, normals, motion.

#import bevy_keratin::ribbon::{ribbon_vertex, in_clip, toward_eye, facing_normal}
#import bevy_keratin::coverage::covered_samples
#ifdef MOTION_VECTOR_PREPASS
#import bevy_keratin::ribbon::place_before
#import bevy_pbr::mesh_view_bindings::view
#import bevy_pbr::prepass_bindings
#endif

struct PrepassVertex {
    @invariant @builtin(position) position: vec4<f32>,
    @location(0) share: vec2<f32>,
    @location(1) @interpolate(flat) seed: u32,
#ifdef NORMAL_PREPASS_OR_DEFERRED_PREPASS
    @location(2) world_normal: vec3<f32>,
#endif
#ifdef MOTION_VECTOR_PREPASS
    @location(3) from_eye: vec3<f32>,
    @location(4) previous_from_eye: vec3<f32>,
#endif
#ifdef UNCLIPPED_DEPTH_ORTHO_EMULATION
    @location(5) unclipped_depth: f32,
#endif
}

struct PrepassFragment {
    @builtin(sample_mask) samples: u32,
#ifdef NORMAL_PREPASS
    @location(0) normal: vec4<f32>,
#endif
#ifdef MOTION_VECTOR_PREPASS
    @location(1) motion: vec2<f32>,
#endif
#ifdef UNCLIPPED_DEPTH_ORTHO_EMULATION
    @builtin(frag_depth) depth: f32,
#endif
}

@vertex
fn vertex(@builtin(instance_index) instance: u32, @location(0) corner: u32) -> PrepassVertex {
    var out: PrepassVertex;
    let ribbon = ribbon_vertex(corner, instance);
    out.position = in_clip(ribbon.from_eye);
    out.share = vec2(ribbon.share, ribbon.grown);
    out.seed = ribbon.seed;
#ifdef NORMAL_PREPASS_OR_DEFERRED_PREPASS
    out.world_normal = facing_normal(ribbon.tangent, toward_eye(ribbon.center));
#endif
#ifdef MOTION_VECTOR_PREPASS
    out.from_eye = ribbon.from_eye;
    out.previous_from_eye = place_before(ribbon, corner, instance);
#endif
    if !ribbon.shown {
        out.position = vec4(0.0, 0.0, 0.0, 1.0);
    }
#ifdef UNCLIPPED_DEPTH_ORTHO_EMULATION
    out.unclipped_depth = out.position.z;
    out.position.z = min(out.position.z, 1.0);
#endif
    return out;
}

@fragment
fn fragment(in: PrepassVertex) -> PrepassFragment {
    var out: PrepassFragment;
    out.samples = covered_samples(in.share.x * saturate(in.share.y), in.seed, in.position.xy);
    if out.samples == 0u {
        discard;
    }
#ifdef NORMAL_PREPASS
    out.normal = vec4(in.world_normal * 0.5 + 0.5, 1.0);
#endif
#ifdef MOTION_VECTOR_PREPASS
    let now = view.unjittered_clip_from_world * vec4(view.world_position + in.from_eye, 1.0);
    let before = prepass_bindings::previous_view_uniforms.clip_from_world
        * vec4(view.world_position + in.previous_from_eye, 1.0);
    // Across the screen, whose y goes down.
    out.motion = (now.xy / now.w - before.xy / before.w) * vec2(0.5, -0.5);
#endif
#ifdef UNCLIPPED_DEPTH_ORTHO_EMULATION
    out.depth = in.unclipped_depth;
#endif
    return out;
}

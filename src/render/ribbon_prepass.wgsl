// Hair in shadow maps, as seen from the light, and in the camera's prepasses: depth, normals, motion.
// What follows in the fragment stage is Bevy's own prepass, which reads these locations.

#import bevy_pbr::view_transformations::position_world_to_clip
#import bevy_keratin::ribbon::ribbon_vertex
#ifdef MOTION_VECTOR_PREPASS
#import bevy_keratin::ribbon::place_before
#endif

struct PrepassVertex {
    @invariant @builtin(position) position: vec4<f32>,
#ifdef NORMAL_PREPASS_OR_DEFERRED_PREPASS
    @location(2) world_normal: vec3<f32>,
#endif
    @location(4) world_position: vec4<f32>,
#ifdef MOTION_VECTOR_PREPASS
    @location(5) previous_world_position: vec4<f32>,
#endif
#ifdef UNCLIPPED_DEPTH_ORTHO_EMULATION
    @location(6) unclipped_depth: f32,
#endif
#ifdef VERTEX_OUTPUT_INSTANCE_INDEX
    @location(7) instance_index: u32,
#endif
}

@vertex
fn vertex(@builtin(instance_index) instance: u32, @location(0) corner: u32) -> PrepassVertex {
    var out: PrepassVertex;
    let ribbon = ribbon_vertex(corner, instance);
    out.world_position = vec4(ribbon.world_position, 1.0);
    out.position = position_world_to_clip(ribbon.world_position);
#ifdef NORMAL_PREPASS_OR_DEFERRED_PREPASS
    out.world_normal = ribbon.outward;
#endif
#ifdef MOTION_VECTOR_PREPASS
    out.previous_world_position = vec4(place_before(ribbon, corner, instance), 1.0);
#endif
    if !ribbon.shown {
        out.position = vec4(0.0, 0.0, 0.0, 1.0);
    }
#ifdef UNCLIPPED_DEPTH_ORTHO_EMULATION
    out.unclipped_depth = out.position.z;
    out.position.z = min(out.position.z, 1.0);
#endif
#ifdef VERTEX_OUTPUT_INSTANCE_INDEX
    out.instance_index = instance;
#endif
    return out;
}

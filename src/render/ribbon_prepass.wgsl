// Hair in shadow maps: the strands as seen from the light.

#import bevy_pbr::prepass_io::VertexOutput
#import bevy_pbr::view_transformations::position_world_to_clip
#import bevy_keratin::ribbon::ribbon_vertex

@vertex
fn vertex(@builtin(instance_index) instance: u32, @location(0) corner: u32) -> VertexOutput {
    var out: VertexOutput;
    let ribbon = ribbon_vertex(corner, instance);
    out.world_position = vec4(ribbon.world_position, 1.0);
    out.position = position_world_to_clip(ribbon.world_position);
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

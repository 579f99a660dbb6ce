// Computes all rings of the strands that are drawn in this frame.

#import bevy_keratin::strands::{ribbon, strands, strand_alpha, ring_share}
#import bevy_keratin::rings::{PackedRing, ring_of, packed}

@group(0) @binding(6) var<storage, read_write> rings: array<PackedRing>;

@compute @workgroup_size(64)
fn expand(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let at = (group.y * groups.x + group.x) * 64u + lane;
    let count = ribbon.segments + 1u;
    let index = at / count;
    if index >= ribbon.strands || strand_alpha(index) <= 0.0 {
        return;
    }
    rings[at] = packed(ring_of(strands[index], ring_share(at - index * count)));
}

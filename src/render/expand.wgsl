// Computes all rings of the strands that are drawn in this frame.

#import bevy_keratin::strands::{ribbon, strands, alpha_of_rank, strand_of_rank, ring_share, VIEW_GUIDES}
#import bevy_keratin::rings::{PackedRing, ring_of, packed, rings_of_strand}

@group(0) @binding(6) var<storage, read_write> rings: array<PackedRing>;

@compute @workgroup_size(64)
fn expand(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let at = (group.y * groups.x + group.x) * 64u + lane;
    let count = rings_of_strand();
    let rank = at / count;
    if rank >= ribbon.ring_ranks || alpha_of_rank(rank) <= 0.0 {
        return;
    }
    let index = strand_of_rank(rank);
    if ribbon.view == VIEW_GUIDES && index >= ribbon.guides {
        return;
    }
    let ring = min((at - rank * count) * ribbon.ring_every, ribbon.segments);
    rings[at] = packed(ring_of(strands[index], ring_share(ring)));
}

// Adds the strands up in the cells of a grid: the area that they block, by their direction.

#import bevy_keratin::strands::{ribbon, strands, frame, alpha_of_rank, strand_of_rank, strand_width, hash, VIEW_GUIDES}
#import bevy_keratin::rings::{PackedRing, unpacked, rings_of_strand}
#import bevy_keratin::counts::UNIT

@group(0) @binding(6) var<storage, read> rings: array<PackedRing>;
// Six for each cell.
@group(0) @binding(7) var<storage, read_write> cells: array<atomic<i32>>;

// So many strands stand for all: any part from the first rank on is spread evenly over the hair.
const ENOUGH: u32 = #{ENOUGH}u;
// Pieces of a segment at most, each as long as a cell.
const PIECES: f32 = 8.0;
// Of what one piece adds: as many fibres one behind the other.
const MOST: f32 = 64.0;

fn add(cell: u32, what: f32) {
    atomicAdd(&cells[cell], i32(round(clamp(what, -MOST, MOST) * UNIT)));
}

@compute @workgroup_size(64)
fn fill(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let at = (group.y * groups.x + group.x) * 64u + lane;
    let segments = rings_of_strand() - 1u;
    let rank = at / segments;
    let drawn = min(u32(ceil(frame.share * f32(ribbon.strands))), ribbon.ring_ranks);
    let counted = min(drawn, ENOUGH);
    if rank >= counted {
        return;
    }
    let strand = strand_of_rank(rank);
    if ribbon.view == VIEW_GUIDES && strand >= ribbon.guides {
        return;
    }
    let first = rank * rings_of_strand() + (at - rank * segments);
    let low = unpacked(rings[first]);
    let high = unpacked(rings[first + 1u]);
    if !low.shown || !high.shown {
        return;
    }
    let way = high.position - low.position;
    let length = length(way);
    let width = ribbon.width * ribbon.shadow_density * frame.wider * strand_width(strands[strand]) * alpha_of_rank(rank);
    let size = frame.volume_cell;
    // As fibres one behind the other in a cell as deep as it is on average.
    let deep = pow(size.x * size.y * size.z, 1.0 / 3.0);
    let blocked = length * width * (f32(drawn) / f32(counted)) / (deep * deep);
    if !(blocked > 0.0) {
        return;
    }
    let t = way / length;
    let across = abs(way) / size;
    let pieces = clamp(ceil(max(across.x, max(across.y, across.z))), 1.0, PIECES);
    let side = i32(frame.volume_side);
    for (var i = 0.0; i < pieces; i += 1.0) {
        // At random within a cell: in the mean as if each were spread over those around it.
        let seed = strands[strand].seed + (first * 8u + u32(i)) * 4u;
        let aside = vec3(hash(seed), hash(seed + 1u), hash(seed + 2u)) - 0.5;
        let place = mix(low.position, high.position, (i + hash(seed + 3u)) / pieces);
        let cell = vec3<i32>(floor((place - frame.volume_begin) / size + aside));
        if any(cell < vec3(0)) || any(cell >= vec3(side)) {
            continue;
        }
        let begin = 6u * u32((cell.z * side + cell.y) * side + cell.x);
        let share = blocked / pieces;
        add(begin, share * t.x * t.x);
        add(begin + 1u, share * t.y * t.y);
        add(begin + 2u, share * t.z * t.z);
        add(begin + 3u, share * t.x * t.y);
        add(begin + 4u, share * t.x * t.z);
        add(begin + 5u, share * t.y * t.z);
    }
}

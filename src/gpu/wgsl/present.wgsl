// Packs nodes into the buffer that drawing reads. Rust twin: src/render/buffers.rs, DrawnNodes::pack.

struct Frame {
    // How far drawing is from the tick before to the present one.
    overstep: f32,
    // Whether the buffer holds the nodes of the frame before.
    known: u32,
    // Whether roots are drawn elsewhere than they are simulated, and strands with them.
    rooted: u32,
    unused: u32,
}

@group(0) @binding(0) var<storage, read> blocks: array<vec4<u32>>;
@group(0) @binding(1) var<storage, read> pose: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read> motion: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> rest: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read> bonds: array<vec4<f32>>;
// The first drawn node of each strand, by its number, and where its root is drawn.
@group(0) @binding(5) var<storage, read> firsts: array<vec4<u32>>;
@group(0) @binding(6) var<storage, read_write> drawn: array<vec4<u32>>;
@group(0) @binding(7) var<uniform> shown_frame: Frame;

fn is_usable(p: vec3<f32>) -> bool {
    let bits = bitcast<vec3<u32>>(p) & vec3(0x7f800000u);
    return all(bits != vec3(0x7f800000u)) && all(abs(p) < vec3(FAR));
}

// How far the strand is drawn from where it is simulated.
var<private> aside: vec3<f32>;

// Where a node is drawn: between the tick before and the present, if both are known.
fn drawn_place(slot: u32) -> vec3<f32> {
    let now = pose[slot].xyz;
    let before = motion[slot + GROUP_SIZE].xyz;
    if !is_usable(before) {
        return now + aside;
    }
    return mix(before, now, shown_frame.overstep) + aside;
}

fn halves(a: f32, b: f32) -> u32 {
    return pack2x16float(clamp(vec2(a, b), vec2(-65504.0), vec2(65504.0)));
}

fn byte(rate: f32) -> u32 {
    return u32(clamp(rate, 0.0, 1.0) * 255.0 + 0.5);
}

@compute @workgroup_size(32)
fn present(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let block = blocks[group.x];
    if lane >= block.z {
        return;
    }
    let nodes = block.y;
    let first = firsts[block.w + lane].x;
    aside = vec3(0.0);
    if shown_frame.rooted != 0u {
        let root = bitcast<vec3<f32>>(firsts[block.w + lane].yzw);
        let simulated = drawn_place(block.x * 2u * GROUP_SIZE + lane);
        if is_usable(root) && is_usable(simulated) {
            aside = root - simulated;
        }
    }
    // Of a strand without any usable node nothing is shown.
    var last = vec3(0.0);
    var shown = 0.0;
    for (var i = 0u; i < nodes && shown == 0.0; i++) {
        let slot = (block.x + i) * 2u * GROUP_SIZE + lane;
        let p = drawn_place(slot);
        if is_usable(p) {
            last = p;
            shown = 1.0;
        }
    }
    var along = 0.0;
    var strain_below = -1.0;
    for (var i = 0u; i < nodes; i++) {
        let slot = (block.x + i) * 2u * GROUP_SIZE + lane;
        let now = pose[slot].xyz;
        let p = drawn_place(slot);
        if is_usable(p) {
            last = p;
        }
        let length = rest[slot + GROUP_SIZE].x;
        var strain_above = -1.0;
        if i + 1u < nodes {
            strain_above = abs(distance(pose[slot + 2u * GROUP_SIZE].xyz, now) / length - 1.0);
        }
        var strain = max(strain_below, strain_above);
        if strain_below >= 0.0 && strain_above >= 0.0 {
            strain = 0.5 * (strain_below + strain_above);
        }
        strain_below = strain_above;
        // The tip has no joint: it shows the last one's.
        let joint = ((block.x + min(i, nodes - 2u)) * 4u) * GROUP_SIZE + lane;
        let rates = byte(bonds[joint].w)
            | byte(bonds[joint + GROUP_SIZE].w) << 8u
            | byte(bonds[joint + 2u * GROUP_SIZE].w) << 16u
            | byte(bonds[joint + 3u * GROUP_SIZE].w) << 24u;
        let at = 2u * (first + i);
        var moved = vec3(0.0);
        if shown_frame.known != 0u && shown != 0.0 {
            moved = (last - bitcast<vec3<f32>>(drawn[at].xyz)) * MOTION_UNITS;
        }
        drawn[at] = vec4(bitcast<vec3<u32>>(last), rates);
        drawn[at + 1u] = vec4(
            halves(strain, 0.0),
            bitcast<u32>(along),
            halves(moved.x, moved.y),
            halves(moved.z, shown),
        );
        along += length;
    }
}

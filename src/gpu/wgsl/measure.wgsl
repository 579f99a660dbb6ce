// The box around a hair's nodes and their highest speed, once a frame. The largest of whole numbers is the
// same in any order.

@group(0) @binding(0) var<storage, read> blocks: array<vec4<u32>>;
@group(0) @binding(1) var<storage, read> pose: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read> motion: array<vec4<f32>>;
// Of the words before these the substeps take care. High corner, low corner turned over, speed squared.
@group(0) @binding(3) var<storage, read_write> report: array<atomic<u32>, 16>;

// A whole number that grows with x.
fn ordered(x: f32) -> u32 {
    let bits = bitcast<u32>(x);
    return select(bits | 0x80000000u, ~bits, (bits & 0x80000000u) != 0u);
}

fn is_usable(p: vec3<f32>) -> bool {
    let bits = bitcast<vec3<u32>>(p) & vec3(0x7f800000u);
    return all(bits != vec3(0x7f800000u)) && all(abs(p) < vec3(FAR));
}

@compute @workgroup_size(32)
fn measure(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let block = blocks[group.x];
    if lane >= block.z {
        return;
    }
    var low = vec3(FAR);
    var high = vec3(-FAR);
    var speed = 0.0;
    for (var i = 0u; i < block.y; i++) {
        let slot = (block.x + i) * 2u * GROUP_SIZE + lane;
        let now = pose[slot].xyz;
        let before = motion[slot + GROUP_SIZE].xyz;
        let v = motion[slot].xyz;
        if is_usable(now) {
            low = min(low, now);
            high = max(high, now);
        }
        // It is drawn on the way from there.
        if is_usable(before) {
            low = min(low, before);
            high = max(high, before);
        }
        if is_usable(v) {
            speed = max(speed, dot(v, v));
        }
    }
    for (var axis = 0u; axis < 3u; axis++) {
        atomicMax(&report[4u + axis], ordered(high[axis]));
        atomicMax(&report[7u + axis], ~ordered(low[axis]));
    }
    atomicMax(&report[10], bitcast<u32>(speed));
}

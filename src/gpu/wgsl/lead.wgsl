// Puts where led nodes come to, and whether they are led, where the substep finds it. One node a thread.

struct Substep {
    // As in strand.wgsl.
    before: array<vec4<u32>, 30>,
    treatments: u32,
    first_led: u32,
    led: u32,
    first_follower_led: u32,
    follower_led: u32,
}

// Two a node: place and slot; frame.
@group(0) @binding(0) var<storage, read> leads: array<vec4<u32>>;
@group(0) @binding(1) var<storage, read_write> rest: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read_write> scratch: array<vec4<f32>>;
@group(1) @binding(0) var<uniform> record: Substep;

@compute @workgroup_size(64)
fn lead(@builtin(global_invocation_id) id: vec3<u32>) {
    if record.led <= id.x {
        return;
    }
    let entry = leads[2u * (record.first_led + id.x)];
    let frame = leads[2u * (record.first_led + id.x) + 1u];
    let bits = entry.w;
    let slot = bits & ~(ROOT | FREE);
    let of_node = slot / GROUP_SIZE;
    let lane = slot % GROUP_SIZE;
    if (bits & ROOT) == 0u {
        rest[(of_node * 2u + 1u) * GROUP_SIZE + lane].z = select(0.0, 1.0, (bits & FREE) != 0u);
    }
    scratch[(of_node * SCRATCH) * GROUP_SIZE + lane] = vec4(bitcast<vec3<f32>>(entry.xyz), 0.0);
    scratch[(of_node * SCRATCH + 1u) * GROUP_SIZE + lane] = bitcast<vec4<f32>>(frame);
}

// The root of a follower, into what ties it: `scratch` holds that, and the slot is that of its last node's.
@compute @workgroup_size(64)
fn lead_followers(@builtin(global_invocation_id) id: vec3<u32>) {
    if record.follower_led <= id.x {
        return;
    }
    let entry = leads[2u * (record.first_follower_led + id.x)];
    let frame = leads[2u * (record.first_follower_led + id.x) + 1u];
    scratch[entry.w] = vec4(bitcast<vec3<f32>>(entry.xyz), 0.0);
    scratch[entry.w + GROUP_SIZE] = bitcast<vec4<f32>>(frame);
}

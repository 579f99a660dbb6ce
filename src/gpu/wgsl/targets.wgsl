// Puts kinematic targets, and whether nodes have one, where the substep finds them. One node a thread.

struct Substep {
    // As in strand.wgsl.
    before: array<vec4<u32>, 30>,
    treatments: u32,
    first_target: u32,
    targets: u32,
    first_root_target: u32,
    root_targets: u32,
}

// Two a node: place and slot; frame.
@group(0) @binding(0) var<storage, read> targets: array<vec4<u32>>;
@group(0) @binding(1) var<storage, read_write> rest: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read_write> scratch: array<vec4<f32>>;
@group(1) @binding(0) var<uniform> record: Substep;

@compute @workgroup_size(64)
fn set_targets(@builtin(global_invocation_id) id: vec3<u32>) {
    if record.targets <= id.x {
        return;
    }
    let entry = targets[2u * (record.first_target + id.x)];
    let frame = targets[2u * (record.first_target + id.x) + 1u];
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

// The root of a follower, into its guide offsets: `scratch` holds those, and the slot is that of its last node's.
@compute @workgroup_size(64)
fn set_root_targets(@builtin(global_invocation_id) id: vec3<u32>) {
    if record.root_targets <= id.x {
        return;
    }
    let entry = targets[2u * (record.first_root_target + id.x)];
    let frame = targets[2u * (record.first_root_target + id.x) + 1u];
    scratch[entry.w] = vec4(bitcast<vec3<f32>>(entry.xyz), 0.0);
    scratch[entry.w + GROUP_SIZE] = bitcast<vec4<f32>>(frame);
}

// Whether a hair sleeps from the next tick on: all its simulated strands have been still for so long. Once a tick,
// after its substeps. Rust twin: `decide` in src/simulation/sleep/systems.rs, for one strand.

struct Substep {
    // As in strand.wgsl.
    gravity: vec4<f32>,
    frame_turn: vec4<f32>,
    frame_move: vec3<f32>,
    flags: u32,
    between: array<vec4<u32>, 32>,
    // How far a node may move (m), an edge turn (rad), for how long (s); the length of the tick (s).
    sleep: vec4<f32>,
    tick: u32,
    restless: u32,
    restless_before: u32,
    restless_next: u32,
}

@group(0) @binding(0) var<storage, read> blocks: array<vec4<u32>>;
@group(0) @binding(1) var<storage, read> pose: array<vec4<f32>>;
// Two a node: where it was when its strand was last not still; its frame. Beside the root's place for how long
// it has been still (s).
@group(0) @binding(2) var<storage, read_write> still: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read_write> report: array<atomic<u32>, 20>;
@group(1) @binding(0) var<uniform> record: Substep;

// The angle between two frames, exact where it is small.
fn turn(a: vec4<f32>, b: vec4<f32>) -> f32 {
    let one = a - b;
    let other = a + b;
    return 2.0 * sqrt(min(dot(one, one), dot(other, other)));
}

@compute @workgroup_size(32)
fn sleep(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_index) lane: u32,
) {
    let block = blocks[group.x];
    if lane >= block.z {
        return;
    }
    let wakes = (record.flags & WAKES) != 0u;
    if group.x == 0u && lane == 0u {
        atomicStore(&report[record.restless_next], 0u);
        if !wakes && atomicLoad(&report[record.restless_before]) == 0u {
            atomicMax(&report[SLEPT], record.tick);
        }
    }
    let root = block.x * 2u * GROUP_SIZE + lane;
    var is_still = !wakes;
    for (var i = 0u; i < block.y && is_still; i++) {
        let at = root + i * 2u * GROUP_SIZE;
        let apart = pose[at].xyz - still[at].xyz;
        is_still = dot(apart, apart) <= record.sleep.x * record.sleep.x
            && turn(pose[at + GROUP_SIZE], still[at + GROUP_SIZE]) <= record.sleep.y;
    }
    var seconds = 0.0;
    if is_still {
        seconds = still[root].w + record.sleep.w;
        still[root].w = seconds;
    } else {
        for (var i = 0u; i < block.y; i++) {
            let at = root + i * 2u * GROUP_SIZE;
            still[at] = vec4(pose[at].xyz, 0.0);
            still[at + GROUP_SIZE] = pose[at + GROUP_SIZE];
        }
    }
    if !(record.sleep.z <= seconds) {
        atomicStore(&report[record.restless], 1u);
    }
}

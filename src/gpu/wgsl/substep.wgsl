// A substep of a hair: one strand a thread, root to tip, in the CPU's order. No barriers, no float atomics,
// so one device gives the same bits every time.

// The place of a node and the frame behind it, as the substep finds them after the frame's motion.
fn carried_place(i: u32) -> vec3<f32> {
    let p = pose_in[slot(i, 0u, 2u)].xyz;
    if i == 0u || (record.flags & FRAME_MOVES) == 0u {
        return p;
    }
    return rotated(record.frame_turn, p) + record.frame_move;
}

fn carried_frame(i: u32) -> vec4<f32> {
    let q = pose_in[slot(i, 1u, 2u)];
    if i == edges || (record.flags & FRAME_MOVES) == 0u {
        return q;
    }
    return normalized(product(record.frame_turn, q));
}

fn load() {
    let frame_moves = (record.flags & FRAME_MOVES) != 0u;
    let rests = (record.flags & RESTS) != 0u;
    let holds = (record.flags & HOLDS) != 0u;
    for (var i = 0u; i <= edges; i++) {
        let p = carried_place(i);
        var to = p;
        if holds && 0u < i && is_held(edge(i).z) {
            to = row(i, 0u).xyz;
        }
        set_node(i, to, 0.0);
        set_frame(i, carried_frame(i));
        set_start(i, p);
        var m = moving(i);
        if frame_moves {
            m = vec4(rotated(record.frame_turn, m.xyz), m.w);
        }
        if rests {
            m = vec4(0.0);
        }
        set_moving(i, m.xyz, m.w);
        if (record.flags & NOTES_BEFORE) != 0u {
            motion[slot(i, 1u, 2u)] = vec4(pose_in[slot(i, 0u, 2u)].xyz, 0.0);
        }
    }
    if (record.flags & ROOT_TARGETS) != 0u {
        set_node(0u, row(0u, 0u).xyz, 0.0);
        set_frame(edges, row(0u, 1u));
    }
    if frame_moves {
        set_start(0u, rotated(record.frame_turn, pose_in[slot(0u, 0u, 2u)].xyz) + record.frame_move);
    }
}

// Where the scalp's frame was as the substep began.
fn root_from() -> vec4<f32> {
    let before = pose_in[slot(edges, 1u, 2u)];
    if (record.flags & FRAME_MOVES) == 0u {
        return before;
    }
    return product(record.frame_turn, before);
}

fn is_finite_strand() -> bool {
    for (var i = 0u; i <= edges; i++) {
        let v = moving(i).xyz;
        let q = frame(i);
        if is_broken3(node(i).xyz) || is_broken(dot(v, v)) || is_broken(dot(q, q)) {
            return false;
        }
    }
    return true;
}

fn began_finite() -> bool {
    for (var i = 0u; i <= edges; i++) {
        let q = carried_frame(i);
        if is_broken3(carried_place(i)) || is_broken4(q) || !(0.25 < dot(q, q)) {
            return false;
        }
        // A torn edge: no step leads back from there.
        if 0u < i {
            let e = carried_place(i) - carried_place(i - 1u);
            let most = 1e3 * edge(i - 1u).x;
            if !(dot(e, e) < most * most) {
                return false;
            }
        }
    }
    return true;
}

// Back to where the substep began, at rest; where that was broken or torn, to the pose of its bonds.
fn put_back() {
    atomicMax(&report[2], 0xffffffffu - number);
    if began_finite() {
        atomicAdd(&report[0], 1u);
        // The root is where its scalp is.
        set_moving(0u, vec3(0.0), 0.0);
        for (var i = 0u; i < edges; i++) {
            set_node(i + 1u, carried_place(i + 1u), 0.0);
            set_frame(i, carried_frame(i));
            set_moving(i + 1u, vec3(0.0), 0.0);
        }
        return;
    }
    atomicAdd(&report[1], 1u);
    var p = node(0u).xyz;
    if is_broken3(p) {
        p = vec3(0.0);
    }
    var q = root_frame();
    if is_broken4(q) || !(0.25 < dot(q, q)) {
        q = vec4(0.0, 0.0, 0.0, 1.0);
    }
    set_frame(edges, q);
    for (var i = 0u; i < edges; i++) {
        var sum = vec3(0.0);
        var closed = 0.0;
        for (var kind = 0u; kind < 4u; kind++) {
            let b = bond(i, kind);
            let f = record.influence[kind] * b.w;
            sum = fma(b.xyz, vec3(f), sum);
            closed += f;
        }
        var v = sum * (1.0 / max(closed, 1e-30));
        if is_broken3(v) || !(0.0 < closed) {
            v = vec3(0.0);
        }
        q = normalized(product(q, vec4(v, sqrt(max(1.0 - dot(v, v), 0.0)))));
        set_node(i, p, 0.0);
        set_frame(i, q);
        set_moving(i, vec3(0.0), 0.0);
        p += tangent(q) * edge(i).x;
    }
    set_node(edges, p, 0.0);
    set_moving(edges, vec3(0.0), 0.0);
}

// Says whether a strand with held nodes is strained so much that it has to give way, as it does on the CPU.
fn watch_held(most: f32) {
    if (record.flags & HOLDS) == 0u {
        return;
    }
    var holds = false;
    var is_strained = false;
    for (var i = 1u; i <= edges; i++) {
        holds |= is_held(edge(i).z);
        let l = edge(i - 1u).x;
        is_strained |= abs(distance(node(i).xyz, node(i - 1u).xyz) - l) > most * l;
    }
    if holds && is_strained {
        atomicStore(&report[3], 1u);
    }
}

// Whether the whole hair sleeps.
fn sleeps() -> bool {
    return (record.flags & WAKES) == 0u && atomicLoad(&report[record.restless_before]) == 0u;
}

// Asleep: where it is, at rest. As often as this is done it is the same.
fn lie_still() {
    for (var i = 0u; i <= edges; i++) {
        let p = pose_in[slot(i, 0u, 2u)];
        pose_out[slot(i, 0u, 2u)] = p;
        set_frame(i, pose_in[slot(i, 1u, 2u)]);
        set_moving(i, vec3(0.0), 0.0);
        motion[slot(i, 1u, 2u)] = vec4(p.xyz, 0.0);
    }
}

@compute @workgroup_size(32)
fn substep(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_index) index: u32,
) {
    let block = blocks[group.x];
    if index >= block.z {
        return;
    }
    first = block.x;
    lane = index;
    edges = block.y - 1u;
    number = block.w + index;
    if sleeps() {
        lie_still();
        return;
    }
    load();
    blow();
    if (record.flags & SHAPES) != 0u {
        shape_joints();
    }
    direct_step(root_from());
    if !is_finite_strand() {
        put_back();
        return;
    }
    watch_held(MOST_STRAIN);
    if (record.flags & REMEMBERS) != 0u {
        remember();
    }
}

// The same by sweeps, in a kernel of its own: together they would need more registers.
@compute @workgroup_size(32)
fn sweep(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_index) index: u32,
) {
    let block = blocks[group.x];
    if index >= block.z {
        return;
    }
    first = block.x;
    lane = index;
    edges = block.y - 1u;
    number = block.w + index;
    if sleeps() {
        lie_still();
        rest_spins();
        return;
    }
    load();
    load_spins();
    blow();
    if (record.flags & SHAPES) != 0u {
        shape_swept_joints();
    }
    sweep_step();
    if !is_finite_strand() || !are_finite_spins() {
        // No projection moves it, but NaN overwrites it.
        set_node(0u, start_of(0u), 0.0);
        put_back();
        rest_spins();
        return;
    }
    watch_held(MOST_SWEPT_STRAIN);
    if (record.flags & REMEMBERS) != 0u {
        remember();
    }
}

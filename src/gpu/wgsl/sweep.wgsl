// The paper's projections: sweeps over a strand from root to tip. Rust twins: src/solver/rod/{constraint,stiffness,step,
// sweep}.rs; of rest shapes src/keratin/bond/{model,systems}.rs.

// The factors of a stretch–shear projection.
struct StretchShares {
    inverse_length: f32,
    along: f32,
    across: f32,
    turn: f32,
    start: f32,
    end: f32,
}

fn stretch_shares(w1: f32, w2: f32, wq: f32, l: f32) -> StretchShares {
    let axial = fma(EPSILON, l, w1 + w2);
    let wql2 = wq * l * l;
    let across = 1.0 / fma(wql2, 4.0, axial);
    let along = select(across, 1.0 / axial, record.projection == SPLIT);
    let turn = wql2 * select(2.0, 1.0, record.projection == PRINTED);
    return StretchShares(1.0 / l, along, across, turn, w1 * l, w2 * l);
}

// What a joint's two edges take up of its error.
fn bend_shares(w1: f32, w2: f32, stiffness: f32) -> vec2<f32> {
    return vec2(w1, w2) * (stiffness / (w1 + w2 + EPSILON));
}

struct StretchCorrection {
    p1: vec3<f32>,
    p2: vec3<f32>,
    q: vec4<f32>,
}

// Equations 1 to 5.
fn stretch_shear(p1: vec3<f32>, p2: vec3<f32>, q: vec4<f32>, e: StretchShares) -> StretchCorrection {
    let t = tangent(q);
    let c = (p2 - p1) * e.inverse_length - t;
    // Otherwise the part along the edge is treated as the one across it.
    let axial = select(0.0, dot(c, t), record.projection == SPLIT);
    let rotating = fma(t, vec3(-axial), c) * e.across;
    let gamma = fma(t, vec3(axial * e.along), rotating);
    // q e3‾.
    let turned = vec4(-q.y, q.x, -q.w, q.z);
    return StretchCorrection(gamma * e.start, gamma * -e.end, after_vector(turned, rotating) * e.turn);
}

struct BendCorrection {
    q1: vec4<f32>,
    q2: vec4<f32>,
}

// Equations 6 to 11, toward ±Ω0, whichever is nearer as a full quaternion.
fn bend_twist(q1: vec4<f32>, q2: vec4<f32>, rest_at: vec4<f32>, shares: vec2<f32>) -> BendCorrection {
    let omega = product(conjugate(q1), q2);
    let side = select(-1.0, 1.0, dot(omega, rest_at) < 0.0);
    let off = fma(rest_at.xyz, vec3(side), omega.xyz);
    return BendCorrection(times_vector(q2, off * shares.x), times_vector(q1, off * -shares.y));
}

// k′ of equation 12 from k/(1 − k): 1 − (1 − k)^(1/n), so that nothing cancels where k is small.
fn stiffness_per_iteration(ratio: f32) -> f32 {
    var exponent = log(1.0 + ratio);
    if ratio < 0.5 {
        // ln(1 + x) = 2 artanh(x/(2 + x)).
        let z = ratio / (2.0 + ratio);
        let s = z * z;
        exponent = 2.0 * z * (1.0 + s * (1.0 / 3.0 + s * (0.2 + s * (1.0 / 7.0 + s * (1.0 / 9.0)))));
    }
    let x = exponent / f32(max(record.iterations, 1u));
    if x < 0.1 {
        return x * (1.0 - x * (0.5 - x * (1.0 / 6.0 - x * (1.0 / 24.0 - x * (1.0 / 120.0)))));
    }
    return 1.0 - exp(-x);
}

// Equation 15, and equation 13 spread over the iterations.
fn shape_swept_joints() {
    var distance = 0.0;
    for (var i = 0u; i < edges; i++) {
        let omega = present_shape(i);
        var remembered = vec3(0.0);
        var present = 0.0;
        var total = 0.0;
        for (var kind = 0u; kind < 4u; kind++) {
            let b = bond(i, kind);
            let f = record.influence[kind];
            let closed = f * b.w;
            let open = f - closed;
            remembered = fma(b.xyz, vec3(closed), remembered);
            present += select(open, -open, is_opposite(b.xyz, omega));
            total += f;
        }
        let v = fma(omega.xyz, vec3(present), remembered) * (1.0 / total);
        rest[slot(i, 0u, 2u)] = vec4(v, sqrt(max(1.0 - dot(v, v), 0.0)));
        let e = edge(i);
        let factor = cuticle_factor(distance) * (1.0 - e.w);
        rest[slot(i, 1u, 2u)] = vec4(e.x, stiffness_per_iteration(record.bend * factor), e.z, e.w);
        distance += e.x;
    }
}

// Inverse masses beside the places, and the factors that all iterations use.
fn weigh_swept() {
    var sum = 0.0;
    for (var i = 0u; i < edges; i++) {
        sum += edge(i).x;
    }
    let mean = sum / f32(edges);
    var before = 0.0;
    var w1 = 0.0;
    var wq_before = 0.0;
    for (var i = 0u; i <= edges; i++) {
        let e = edge(i);
        let after = select(e.x, 0.0, i == edges);
        let w = select(2.0 * mean / ((before + after) * e.z), 0.0, is_held(e.z));
        set_node(i, node(i).xyz, w);
        if 0u < i {
            // Of the edge that ends here.
            let stretch = stretch_shares(w1, w, wq_before, before);
            set_row(i - 1u, 2u, vec4(stretch.inverse_length, stretch.along, stretch.across, stretch.turn));
            set_row(i - 1u, 3u, vec4(stretch.start, stretch.end, row(i - 1u, 3u).zw));
        }
        if i < edges {
            let wq = select(record.spin_weight * mean * after, record.chi / (after * mean), 0.0 < record.chi);
            set_row(i, 3u, vec4(vec2(0.0), bend_shares(wq_before, wq, e.y)));
            wq_before = wq;
        }
        before = after;
        w1 = w;
    }
}

// Angular velocities as the substep finds them after the frame's motion, and what the air takes of them.
fn load_spins() {
    for (var i = 0u; i < edges; i++) {
        var omega = spin(i) * record.retained;
        if (record.flags & FRAME_MOVES) != 0u {
            omega = rotated(record.frame_turn, omega);
        }
        set_spin(i, select(omega, vec3(0.0), (record.flags & RESTS) != 0u));
    }
}

fn rest_spins() {
    for (var i = 0u; i < edges; i++) {
        set_spin(i, vec3(0.0));
    }
}

fn are_finite_spins() -> bool {
    for (var i = 0u; i < edges; i++) {
        let omega = spin(i);
        if is_broken(dot(omega, omega)) {
            return false;
        }
    }
    return true;
}

// Frames after the substep by their angular velocities.
fn predict_frames() {
    for (var i = 0u; i < edges; i++) {
        let q = frame(i);
        set_row(i, 4u, q);
        set_frame(i, normalized(fma(after_vector(q, spin(i)), vec4(0.5 * record.dt), q)));
    }
}

// One iteration: at each edge its bend–twist joint, then its stretch–shear, then its start node against
// obstacles, which nothing else in this iteration moves.
fn sweep_over() {
    var before = root_frame();
    var n1 = node(0u);
    let touching = any(near != vec4(0u));
    for (var i = 0u; i < edges; i++) {
        let one = row(i, 2u);
        let other = row(i, 3u);
        let q_at = frame(i);
        let bend = bend_twist(before, q_at, rest_shape(i), other.zw);
        let q = renormalized(q_at + bend.q2);
        let n2 = node(i + 1u);
        let e = StretchShares(one.x, one.y, one.z, one.w, other.x, other.y);
        let c = stretch_shear(n1.xyz, n2.xyz, q, e);
        if 0u < i {
            set_frame(i - 1u, renormalized(before + bend.q1));
        }
        set_node(i, n1.xyz + c.p1, n1.w);
        if touching {
            touch(i, 0.0, FRICTION_PASS_DEPTH);
        }
        before = renormalized(q + c.q);
        n1 = vec4(n2.xyz + c.p2, n2.w);
    }
    set_frame(edges - 1u, before);
    set_node(edges, n1.xyz, n1.w);
    if touching {
        touch(edges, 0.0, FRICTION_PASS_DEPTH);
    }
}

// Velocities from the change in the step, and the joints' damping.
fn finish_sweeps() {
    let rate = 1.0 / record.dt;
    for (var i = 0u; i <= edges; i++) {
        set_moving(i, (node(i).xyz - start_of(i)) * rate, moving(i).w);
        if i == edges {
            break;
        }
        let q = normalized(frame(i));
        set_frame(i, q);
        let change = product(q, conjugate(row(i, 4u)));
        set_spin(i, change.xyz * select(rate + rate, -(rate + rate), change.w < 0.0));
    }
    for (var i = 1u; 0.0 < record.exchange && i < edges; i++) {
        let a = spin(i - 1u);
        let c = spin(i);
        let d = (c - a) * record.exchange;
        set_spin(i - 1u, a + d);
        set_spin(i, c - d);
    }
}

// One Newton step on all lengths. Where nothing touches, supports are of no meaning.
fn limit_all() {
    if touched {
        _ = limit(0.0, false, true);
    } else {
        _ = limit(0.0, false, false);
    }
}

// One substep.
fn sweep_step() {
    weigh_swept();
    // A root has no velocity, wherever its target is.
    set_start(0u, node(0u).xyz);
    choose_near();
    for (var i = 0u; i <= edges; i++) {
        release(i);
    }
    // Sweeps push all nodes.
    escape_length = 0.0;
    predict_nodes(record.dt);
    predict_frames();
    for (var done = 0u; done < record.iterations; done++) {
        touched = false;
        sweep_over();
    }
    for (var done = 0u; done < record.limiter_steps; done++) {
        limit_all();
        contacts(FRICTION_PASS_DEPTH);
        // Hair pressed on a surface has to fold; each pass can fold it further.
        for (var again = 1u; again < PASSES_IN_TOUCH; again++) {
            if touched {
                _ = limit(0.0, false, true);
                contacts(FRICTION_PASS_DEPTH);
            }
        }
    }
    finish_sweeps();
}

// One direct implicit step of a strand. Rust twins: src/solver/rod/direct/{mod,kernel}.rs.

// What makes masses and stiffnesses of a strand.
var<private> density: f32;
var<private> bending: f32;
var<private> axial_stiffness: f32;
var<private> firmest: f32;
// Largest twist that counts in the Hessian, as a moment over EI (1/m).
var<private> max_twist: f32;
// The scalp's frame as the substep began, and at θ of it.
var<private> root_between: vec4<f32>;

fn weigh() {
    var sum = 0.0;
    for (var i = 0u; i < edges; i++) {
        sum += edge(i).x;
    }
    let count = f32(edges);
    density = count / sum;
    let stiff = min(record.bending_length, sum * MAX_BENDING_LENGTH);
    bending = density * (2.0 * REFERENCE_GRAVITY) * stiff * stiff * stiff;
    axial_stiffness = REFERENCE_GRAVITY * count / STRAIN;
    firmest = MAX_STIFFNESS / (count * count * record.dt * record.dt);
    let length = 1.0 / density;
    let stiffest = min(bending * 0.5, firmest * length * length * length);
    let inertia = density * (3.0 / (record.dt * record.dt));
    max_twist = max(BUCKLING_TWIST / sum, sqrt(sqrt(inertia / max(stiffest, 1e-30))));
}

// Of a node between edges of lengths `before` and `after`.
fn mass_of(before: f32, after: f32, weight: f32) -> f32 {
    return (before + after) * weight * density * 0.5;
}

fn joint_of(before: f32, after: f32, share: f32) -> f32 {
    return min(share * bending / (before + after), firmest * after * after);
}

fn axial_of(length: f32) -> f32 {
    let least = bending * (0.5 * STRETCH_RATIO) / (length * length * length);
    return max(min(axial_stiffness / length, firmest), min(least, STRETCH_SHARE * firmest));
}

// Inverse masses beside the places.
fn weigh_nodes() {
    var before = 0.0;
    for (var i = 0u; i <= edges; i++) {
        let e = edge(i);
        let after = select(e.x, 0.0, i == edges);
        set_node(i, node(i).xyz, select(1.0 / mass_of(before, after, e.z), 0.0, is_held(e.z)));
        before = after;
    }
}

struct Stage {
    theta: f32,
    ahead: f32,
    beyond: f32,
    root_turn: vec3<f32>,
    damping: f32,
    // Whether the strand may take several Newton steps, and whether this is not the first.
    twice: bool,
    second: bool,
}

struct CarriedEdge {
    q: vec4<f32>,
    t: vec3<f32>,
    r: f32,
    turn: vec3<f32>,
    // The same without twist: across itself.
    swing: vec3<f32>,
    across: f32,
    axial: f32,
    pull: vec3<f32>,
    coupling: Matrix,
}

struct Left {
    next: Symmetric,
    after: Symmetric,
    between: Matrix,
    b_next: vec3<f32>,
    b_after: vec3<f32>,
}

// Where a node is at θ of the substep: held ones are on the way to their targets.
fn place_at(i: u32, theta: f32) -> vec3<f32> {
    let n = node(i);
    if is_held(n.w) {
        let start = start_of(i);
        return fma(n.xyz - start, vec3(theta), start);
    }
    return n.xyz;
}

// How far an edge has turned since the substep began until it points along t.
fn turned_since(i: u32, t: vec3<f32>) -> vec3<f32> {
    let e = start_of(i + 1u) - start_of(i);
    let length = sqrt(max(dot(e, e), 1e-30));
    let cosine = length + dot(e, t);
    let scale = 2.0 / sqrt(max(2.0 * length * cosine, 1e-30));
    return select(cross(e, t) * scale, vec3(0.0), cosine < length * 1e-6);
}

fn newton_down(stage: Stage) {
    let rate = 1.0 / stage.ahead;
    let inertia = rate * rate;
    let damped = stage.damping * rate;
    let stiffer = 1.0 + damped;
    var before = CarriedEdge(
        root_between, tangent(root_between), 0.0, stage.root_turn, stage.root_turn, 0.0, 0.0, vec3(0.0),
        NO_MATRIX,
    );
    var stiff_before = NO_SYMMETRIC;
    var pull_before = vec3(0.0);
    var left = Left(NO_SYMMETRIC, NO_SYMMETRIC, NO_MATRIX, vec3(0.0), vec3(0.0));
    var x = place_at(0u, stage.theta);
    var length_before = 0.0;
    for (var j = 0u; j <= edges; j++) {
        var now = before;
        now.r = 0.0;
        now.coupling = NO_MATRIX;
        var couple = vec3(0.0);
        var stiff = 0.0;
        let props = edge(j);
        let l = select(props.x, 0.0, j == edges);
        if j < edges {
            let to = place_at(j + 1u, stage.theta);
            let e = to - x;
            x = to;
            let axial = axial_of(l);
            let length = sqrt(max(dot(e, e), 1e-30));
            let crushed = length < l * 0.5;
            let kept = frame(j);
            let carried = parallel_transport(kept, e, length);
            let q = select(carried.q, kept, crushed);
            let lever = max(length, l * 0.2);
            let r = 1.0 / lever;
            let t = select(e * r, tangent(q), crushed);
            var turn = carried.turn;
            if stage.second {
                turn = turned_since(j, t);
            }
            let swing = select(turn, vec3(0.0), crushed);
            turn = fma(t, vec3(dot(before.turn, t)), swing);
            set_frame(j, q);
            // Positions are rounded, and edges so stiff that this would pull like gravity.
            let taut = moving(j).w;
            let stretch = select(length, dot(t, e), crushed) - l;
            let rounding = sqrt(dot(x, x)) * ROUNDING;
            let wanted = taut / axial;
            if !stage.second {
                let left = min(wanted, TOLERANCE * l);
                set_taken(j, max(min(wanted, MAX_TENSION * l), left) - left);
            }
            let strained = stretch + taken_of(j);
            let kept_stretch = clamp(wanted, strained - rounding, strained + rounding);
            let off = kept_stretch - stretch;
            let stretched = axial * kept_stretch;
            set_moving(j, moving(j).xyz, stretched);
            let tension = max(max(stretched, taut), 0.0);
            let across = select(tension * r, axial, crushed);
            let k = joint_of(length_before, l, props.y);
            let elastic = moment(before.q, q, rest_shape(j), k, record.torsion);
            // Friction only ever takes energy, also where twist gives way along the strand.
            let rate = turn - before.turn;
            let square = max(dot(rate, rate), 1e-30);
            let taken = clamp(dot(rate, swing - before.swing) / square, 0.0, 1.0);
            couple = fma(rate, vec3(k * damped * taken), elastic);
            stiff = k * stiffer;
            // How the moment of twist turns with the edges; without, twisted strands flutter.
            let most = k * lever * max_twist;
            let twist = clamp(dot(elastic, t), -most, most) * -0.25 * r * before.r;
            let coupling = coupling_of(before.t, t, dot(t, before.t), stiff * r * before.r);
            now = CarriedEdge(
                q, t, r, turn, swing,
                fma(stiff * r, r, across),
                axial,
                fma(cross(couple, t), vec3(r), fma(t, vec3(off - l), e) * axial),
                plus_cross(coupling, (t + before.t) * twist),
            );
        }
        if j > 0u {
            // The edge before is whole now.
            let across = fma(stiff * before.r, before.r, before.across);
            let h = uniaxial(before.t, before.axial - across, across);
            let pull = fma(cross(couple, before.t), vec3(-before.r), before.pull);
            let i = j - 1u;
            if i > 0u {
                let e = edge(i);
                let mass = mass_of(edge(i - 1u).x, e.x, e.z);
                left = eliminate(
                    i, mass, stage, inertia,
                    minus_both(plus_symmetric(stiff_before, h), before.coupling),
                    minus_symmetric(plus_matrix(before.coupling, now.coupling), h),
                    now.coupling,
                    pull - pull_before,
                    left,
                );
            }
            stiff_before = h;
            pull_before = pull;
        }
        before = now;
        length_before = l;
    }
    let tip = mass_of(edge(edges - 1u).x, 0.0, edge(edges).z);
    _ = eliminate(edges, tip, stage, inertia, stiff_before, NO_MATRIX, NO_MATRIX, -pull_before, left);
}

// Node i out of the system: `diagonal` and `next` its blocks, −`far` that with the node after the next,
// `force` what edges pull it with.
fn eliminate(
    i: u32,
    mass: f32,
    stage: Stage,
    inertia: f32,
    diagonal: Symmetric,
    next: Matrix,
    far: Matrix,
    force: vec3<f32>,
    left: Left,
) -> Left {
    let n = node(i);
    let inert = mass * inertia;
    var a = plus_symmetric(diagonal, left.next);
    a.d += vec3(inert);
    var b = fma(push_of(i), vec3(mass), force + left.b_next);
    if stage.twice {
        let support = support_of(i);
        let sticks = select(0.0, 1.0, 0.0 < support.w);
        let hold = inert * HOLD;
        a = plus_symmetric(a, uniaxial(support.xyz, hold - hold * sticks, 0.0));
        a.d += vec3(hold * sticks);
        let start = start_of(i);
        var to = fma(moving(i).xyz, vec3(stage.ahead), start) - n.xyz;
        if support.w != 0.0 {
            // Friction: where the node sticks as stiff as the support, where it slides a force.
            let off = back_of(i, n.xyz, sticks);
            let back = off - support.xyz * dot(off, support.xyz);
            let way = sqrt(max(dot(back, back), 1e-24));
            to += back * fma(HOLD, sticks, max(-support.w, 0.0) / way);
        }
        b = fma(to, vec3(inert), b);
    }
    let pivot = pivot_of(a, inert * 1e-3, is_held(n.w));
    let near_unscaled = unscaled(pivot, plus_matrix(next, left.between));
    let far_unscaled = unscaled(pivot, far);
    let near_block = scaled(pivot, near_unscaled);
    let far_block = scaled(pivot, far_unscaled);
    let y = forward(pivot, b);
    let solution = y * pivot.inverse;
    let k = i - 1u;
    set_row(k, 0u, vec4(near_block.x, solution.x));
    set_row(k, 1u, vec4(near_block.y, solution.y));
    set_row(k, 2u, vec4(near_block.z, solution.z));
    set_row(k, 3u, vec4(far_block.x, pivot.l.x));
    set_row(k, 4u, vec4(far_block.y, pivot.l.y));
    set_row(k, 5u, vec4(far_block.z, pivot.l.z));
    return Left(
        minus_product(left.after, near_block, near_unscaled),
        minus_product(NO_SYMMETRIC, far_block, far_unscaled),
        // `far` is minus the block, so this adds.
        Matrix(
            row_from(vec3(0.0), -far_block.x, near_unscaled),
            row_from(vec3(0.0), -far_block.y, near_unscaled),
            row_from(vec3(0.0), -far_block.z, near_unscaled),
        ),
        times_from(near_block, y, left.b_after),
        times_from(far_block, -y, vec3(0.0)),
    );
}

// Which way friction acts on a node: towards its start, or if it slides against what pulls it.
fn back_of(i: u32, p: vec3<f32>, sticks: f32) -> vec3<f32> {
    if 0.0 < sticks {
        return taken_along(bearer_of(i), start_of(i)) - p;
    }
    return slowed_along(i);
}

// From the tip to the root.
fn newton_up(stage: Stage) {
    var next = vec3(0.0);
    var after = vec3(0.0);
    var ahead = vec3(0.0);
    for (var k = 0u; k <= edges; k++) {
        let i = edges - k;
        let n = node(i);
        var y = place_at(i, stage.theta);
        var solved = vec3(0.0);
        if i > 0u {
            let n0 = row(i - 1u, 0u);
            let n1 = row(i - 1u, 1u);
            let n2 = row(i - 1u, 2u);
            let f0 = row(i - 1u, 3u);
            let f1 = row(i - 1u, 4u);
            let f2 = row(i - 1u, 5u);
            let start = transposed_from(
                Matrix(f0.xyz, f1.xyz, f2.xyz), -after,
                transposed_from(Matrix(n0.xyz, n1.xyz, n2.xyz), next, vec3(n0.w, n1.w, n2.w)),
            );
            let y1 = fma(-f2.w, start.z, start.y);
            solved = vec3(fma(-f1.w, start.z, fma(-f0.w, y1, start.x)), y1, start.z);
        }
        var moved = solved;
        var reaction = vec3(0.0);
        let support = support_of(i);
        if stage.twice && 0u < i && dot(support.xyz, support.xyz) > 0.0 {
            // Supports do not give way: what they are given to, so that there is a solution, tells their force.
            let sticks = select(0.0, 1.0, 0.0 < support.w);
            let drag = max(-support.w, 0.0);
            var back = vec3(0.0);
            if support.w != 0.0 {
                let off = back_of(i, n.xyz, sticks);
                back = off - support.xyz * dot(off, support.xyz);
            }
            moved = fma(solved - support.xyz * dot(support.xyz, solved), vec3(1.0 - sticks), back * sticks);
            let way = sqrt(max(dot(back, back), 1e-24));
            reaction = fma(moved - solved, vec3(HOLD), back * (drag / way));
        }
        set_reaction(i, reaction);
        y += moved;
        if !is_held(n.w) {
            let start = start_of(i);
            set_node(i, fma(y - start, vec3(stage.beyond), start), n.w);
        }
        if i < edges {
            // Not from places, which are rounded.
            let m = moving(i);
            set_moving(i, m.xyz, fma(axial_of(edge(i).x), dot(tangent(frame(i)), ahead - moved), m.w));
        }
        after = next;
        next = solved;
        ahead = moved;
    }
}

// Frames to where nodes have come to, velocities, and the twist of all edges.
fn finish(stage: Stage) {
    let rate = 1.0 / record.dt;
    let forth = rate * stage.beyond;
    let back = stage.beyond * (stage.ahead * rate - 1.0);
    var x = vec3(0.0);
    var q_before = root_frame();
    var t_before = tangent(q_before);
    var k_before = 0.0;
    var moment_before = 0.0;
    var coupling_before = 0.0;
    var turns = Elimination(0.0, 0.0, 0.0);
    var length_before = 0.0;
    for (var i = 0u; i <= edges; i++) {
        let n = node(i);
        let moved = n.xyz - start_of(i);
        let m = moving(i);
        var v = fma(m.xyz, vec3(back), moved * forth);
        if is_held(n.w) {
            v = moved * rate;
        }
        set_moving(i, v, m.w);
        let e = n.xyz - x;
        x = n.xyz;
        if i == 0u {
            continue;
        }
        let props = edge(i - 1u);
        let length = sqrt(max(dot(e, e), 1e-30));
        var q = frame(i - 1u);
        if !(length < props.x * 0.5) {
            q = parallel_transport(q, e, length).q;
        }
        set_frame(i - 1u, q);
        let t = tangent(q);
        let k = joint_of(length_before, props.x, props.y);
        let rest_q = rest_shape(i - 1u);
        let elastic = moment(q_before, q, rest_q, k, record.torsion);
        var stiffness = vec2(1.0, -dot(t, t_before));
        if record.torsion != 1.0 {
            stiffness = twist_stiffness(q_before, q, rest_q, record.torsion);
        }
        if i > 1u {
            moment_before -= dot(elastic, t_before);
            turns = eliminated(turns, coupling_before, k_before + k * stiffness.x, -moment_before, 1e-30);
            note_twist(i - 2u, turns);
        }
        coupling_before = k * stiffness.y;
        moment_before = dot(elastic, t);
        q_before = q;
        t_before = t;
        k_before = k * stiffness.x;
        length_before = props.x;
    }
    turns = eliminated(turns, coupling_before, k_before, -moment_before, 1e-30);
    note_twist(edges - 1u, turns);
}

fn note_twist(i: u32, turns: Elimination) {
    if i > 0u {
        scratch[slot(i - 1u, 0u, SCRATCH)].y = turns.upper;
    }
    set_row(i, 0u, vec4(turns.rhs, 0.0, 0.0, 0.0));
}

// Turns edges about their tangents until twist is in balance.
fn untwist() {
    var twist = 0.0;
    for (var k = 0u; k < edges; k++) {
        let i = edges - 1u - k;
        let r = row(i, 0u);
        twist = clamp(r.x - r.y * twist, -1.5, 1.5);
        let q = frame(i);
        set_frame(i, normalized(fma(turned_by_e3(q), vec4(twist * 0.5), q)));
    }
}

// How deep the strand is in obstacles beyond what its root allows: the most, and the sum (m).
fn penetration() -> vec2<f32> {
    var deepest = 0.0;
    var sum = 0.0;
    var next = 0.0;
    for (var i = 0u; i <= edges; i++) {
        let n = node(i);
        let along = next;
        next = farther(along, i);
        if is_held(n.w) {
            continue;
        }
        for (var o = next_near(0u); o < record.obstacles; o = next_near(o + 1u)) {
            let depth = max(depth_in(o, taken_along(o, n.xyz)).w - allowed(o, along, n.xyz), 0.0);
            deepest = max(deepest, depth);
            sum += depth;
        }
    }
    return vec2(deepest, sum);
}

// The largest strain of an edge.
fn worst_strain() -> f32 {
    var worst = 0.0;
    for (var i = 0u; i < edges; i++) {
        let l = edge(i).x;
        worst = max(worst, abs(span(node(i).xyz, node(i + 1u).xyz).w - l) / l);
    }
    return worst;
}

// What begins deep inside an obstacle gets out of it with its lengths before the step. Where it does not, it keeps
// its lengths and is trapped: in the step it goes no deeper, and what has brought it nearer to the surface stays.
fn surface() {
    if record.obstacles == 0u {
        return;
    }
    let deep = edge(0u).x * DEEP_SHARE;
    let before = penetration();
    if !(deep < before.x) {
        return;
    }
    sweeps = false;
    near = vec4(0xffffffffu);
    for (var i = 0u; i <= edges; i++) {
        let n = node(i);
        if !is_held(n.w) {
            set_start(i, n.xyz);
        }
        release(i);
    }
    for (var round = 0u; round < min(LEAVING, 2u * edges); round++) {
        contacts(FRICTION_PASS_NONE);
        if !limit_strained(TORN) {
            return;
        }
    }
    let torn = TORN < worst_strain();
    _ = clamp_lengths(TORN);
    let after = penetration();
    trapped = torn || deep < after.x;
    if trapped && !(after.y < before.y * NEARER) {
        for (var i = 0u; i <= edges; i++) {
            let n = node(i);
            if !is_held(n.w) {
                set_node(i, start_of(i), n.w);
            }
        }
    }
}

// Nodes on by their velocities. Not by air and gravity, which elastic forces balance in hair at rest.
fn advance(ahead: f32) {
    predict_nodes(ahead);
    contacts(FRICTION_PASS_ASSUMED);
}

// Nodes to the first guess, and what touches. Returns θ.
fn predict() -> f32 {
    choose_near();
    for (var i = 0u; i <= edges; i++) {
        let m = moving(i);
        set_moving(i, fma(push_of(i), vec3(-record.dt), m.xyz), m.w);
        release(i);
    }
    surface();
    var theta = THETA;
    advance(record.dt * theta);
    if touched {
        theta = 1.0;
        for (var i = 0u; i <= edges; i++) {
            let n = node(i);
            if !is_held(n.w) {
                set_node(i, start_of(i), n.w);
            }
        }
        advance(record.dt);
    }
    return theta;
}

// Whether an edge is about to turn far.
fn whips() -> bool {
    var before = moving(0u).xyz;
    var fastest = 0.0;
    for (var i = 0u; i < edges; i++) {
        let v = moving(i + 1u).xyz;
        let apart = v - before;
        let l = edge(i).x;
        fastest = max(fastest, dot(apart, apart) / (l * l));
        before = v;
    }
    return (FAST_TURN / record.dt) * (FAST_TURN / record.dt) < fastest;
}

// One substep; the scalp's frame was `root_from` when it began.
fn direct_step(root_from: vec4<f32>) {
    weigh();
    weigh_nodes();
    let theta = predict();
    let fast = whips();
    let twice = touched || fast;
    let root = root_frame();
    let share = select(theta, -theta, dot(root_from, root) < 0.0);
    root_between = normalized(fma(root, vec4(share), root_from * (1.0 - theta)));
    let turn = product(root_between, conjugate(root_from));
    let own = (2.0 * theta - 1.0) * record.dt;
    var stage = Stage(
        theta,
        theta * record.dt,
        select(1.0 / theta, 1.0, twice),
        turn.xyz * select(2.0, -2.0, turn.w < 0.0),
        max(record.damping - own, 0.0),
        twice,
        false,
    );
    newton_down(stage);
    newton_up(stage);
    stage.beyond = 1.0 / theta;
    // Which nodes an obstacle bears, and which of them stick, is not known before: each step shows.
    stage.second = true;
    // A strand that cannot get out stays where it touches.
    for (var step = 1u; twice && !trapped && step < MOST_STEPS; step++) {
        contacts(FRICTION_PASS_JUDGED);
        if !(contact_changed || (fast && step == 1u)) {
            break;
        }
        newton_down(stage);
        newton_up(stage);
    }
    contacts(FRICTION_PASS_SOLVED);
    for (var done = 0u; done < record.limiter_steps; done++) {
        if !limit_strained(select(TOLERANCE, -1.0, done == 0u)) {
            break;
        }
        contacts(FRICTION_PASS_BETWEEN);
        for (var k = 0u; done + 1u == record.limiter_steps && k <= MAX_REPAIRS; k++) {
            let is_last = k == MAX_REPAIRS;
            if !clamp_lengths(select(TORN, MAX_STRAIN, is_last && !trapped)) || is_last {
                break;
            }
            contacts(FRICTION_PASS_BETWEEN);
        }
    }
    finish(stage);
    untwist();
}

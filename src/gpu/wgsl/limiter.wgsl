// Lengths of a whole strand at once. Rust twin: src/solver/rod/limiter.rs.

struct Elimination {
    inverse: f32,
    rhs: f32,
    upper: f32,
}

// A row of a symmetric tridiagonal system; where its pivot is below `least`, nothing moves.
fn eliminated(e: Elimination, coupling: f32, diagonal: f32, rhs: f32, least: f32) -> Elimination {
    let upper = coupling * e.inverse;
    let pivot = diagonal - coupling * upper;
    let inverse = select(1.0 / pivot, 0.0, pivot < least);
    return Elimination(inverse, (rhs - coupling * e.rhs) * inverse, upper);
}

// Direction from one node to the next, and the distance.
fn span(start: vec3<f32>, to: vec3<f32>) -> vec4<f32> {
    let along = to - start;
    let length = sqrt(max(dot(along, along), 1e-20));
    return vec4(along * (1.0 / length), length);
}

// x · W y of a node.
fn mobility(w: f32, support: vec4<f32>, firm: f32, x: vec3<f32>, y: vec3<f32>, touching: bool) -> f32 {
    let free = dot(x, y);
    if !touching {
        return w * free;
    }
    let stuck = select(0.0, 1.0, 0.0 < support.w);
    return w * (free - stuck * free - (firm - stuck) * dot(x, support.xyz) * dot(y, support.xyz));
}

// Whether the solve has found that it presses what it rests on.
fn presses(i: u32, support: vec4<f32>) -> bool {
    return 0.0 < dot(reaction_of(i), support.xyz);
}

// The share of its mobility that its support removes: of a tip not all, on which a straight strand may stand.
fn firmness(i: u32, support: vec4<f32>) -> f32 {
    return select(FIRMNESS, 1.0, i != edges && presses(i, support));
}

// One damped Newton step on the lengths where one is off by more than the share `tolerance`; whether there was.
fn limit_strained(tolerance: f32) -> bool {
    return limit(tolerance, true, true);
}

// One Newton step on all lengths; by `guarded` compressed strands fold no farther than necessary and taut ones do
// not zigzag.
fn limit(tolerance: f32, guarded: bool, touching: bool) -> bool {
    var worst = 0.0;
    var start = node(0u);
    var start_support = vec4(0.0);
    var start_firm = 0.0;
    if touching {
        start_support = support_of(0u);
        start_firm = firmness(0u, start_support);
    }
    var end = node(1u);
    var d = span(start.xyz, end.xyz);
    var coupling = 0.0;
    var rows = Elimination(0.0, 0.0, 0.0);
    for (var i = 0u; i < edges; i++) {
        var end_support = vec4(0.0);
        var end_firm = 0.0;
        if touching {
            end_support = support_of(i + 1u);
            end_firm = firmness(i + 1u, end_support);
        }
        var diagonal = mobility(start.w, start_support, start_firm, d.xyz, d.xyz, touching)
            + mobility(end.w, end_support, end_firm, d.xyz, d.xyz, touching);
        let l = edge(i).x;
        var off = d.w - l;
        let strain = abs(off) / l;
        worst = max(worst, strain);
        if guarded {
            // What its tension stretches or presses it by stays.
            off -= clamp(moving(i).w / axial_of(l), -TOLERANCE * l, TOLERANCE * l);
        }
        if guarded && off < 0.0 {
            // Levenberg-Marquardt, where there is something to be folded.
            diagonal = fma(FOLDING * max(strain - TOLERANCE, 0.0), diagonal, diagonal);
        }
        rows = eliminated(rows, coupling, diagonal, off, 1e-6);
        if i > 0u {
            scratch[slot(i - 1u, 1u, SCRATCH)].x = rows.upper;
        }
        set_row(i, 0u, vec4(d.xyz, rows.rhs));
        scratch[slot(i, 1u, SCRATCH)].x = 0.0;
        if i + 1u < edges {
            let next = node(i + 2u);
            let ahead = span(end.xyz, next.xyz);
            coupling = -mobility(end.w, end_support, end_firm, d.xyz, ahead.xyz, touching);
            d = ahead;
            start = end;
            start_support = end_support;
            start_firm = end_firm;
            end = next;
        }
    }
    if guarded && !(tolerance < worst) {
        return false;
    }
    var lambda = 0.0;
    var pull = vec3(0.0);
    // The edge after this one: its λ and direction.
    var after = vec4(0.0);
    for (var k = 0u; k < edges; k++) {
        let i = edges - 1u - k;
        let direction = row(i, 0u);
        lambda = direction.w - scratch[slot(i, 1u, SCRATCH)].x * lambda;
        let tension = direction.xyz * lambda;
        let n = node(i + 1u);
        var force = pull - tension;
        if guarded && 0u < k {
            // What pulls a node across a taut strand bears on it where it comes to.
            let taut = max(0.5 * (lambda + after.w), 0.0);
            let stiff = taut * n.w / edge(i).x;
            force -= (after.xyz - direction.xyz) * (taut * stiff / (1.0 + stiff));
        }
        after = vec4(direction.xyz, lambda);
        if touching {
            let support = support_of(i + 1u);
            let off = dot(force, support.xyz);
            let up = 0.0 < off;
            if up && (!presses(i + 1u, support) || TOUCHING < off * n.w) {
                // The strand pulls it off the surface: it is let go.
                set_support(i + 1u, vec3(0.0), 0.0);
            } else {
                let stuck = select(0.0, 1.0, 0.0 < support.w);
                let firm = select(firmness(i + 1u, support), 1.0, up);
                force = fma(support.xyz, vec3(-((firm - stuck) * off)), force * (1.0 - stuck));
            }
        }
        set_node(i + 1u, fma(force, vec3(n.w), n.xyz), n.w);
        pull = tension;
    }
    return true;
}

// Where Newton steps have failed every torn edge gets its length back, root to tip, but before held nodes.
fn clamp_lengths(torn: f32) -> bool {
    var last_held = 0u;
    for (var i = 1u; i <= edges; i++) {
        if is_held(node(i).w) {
            last_held = i;
        }
    }
    var any = false;
    for (var i = last_held; i < edges; i++) {
        let l = edge(i).x;
        let start = node(i).xyz;
        let end = node(i + 1u);
        let d = span(start, end.xyz);
        if d.w < l * (1.0 - torn) || l * (1.0 + torn) < d.w {
            any = true;
            set_node(i + 1u, fma(d.xyz, vec3(l), start), end.w);
        }
    }
    return any;
}

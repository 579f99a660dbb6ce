// Bonds of a strand's joints. Rust twin: src/keratin/bond/model.rs.

// Remembered shape and rate of a joint's bonds of one kind.
fn bond(i: u32, kind: u32) -> vec4<f32> {
    return bonds[slot(i, kind, 4u)];
}

// Ω of a joint, with real part ≥ 0.
fn present_shape(i: u32) -> vec4<f32> {
    var before = root_frame();
    if i > 0u {
        before = frame(i - 1u);
    }
    let omega = product(conjugate(before), frame(i));
    return select(omega, -omega, omega.w < 0.0);
}

// Whether the present shape is in the other hemisphere than the remembered one.
fn is_opposite(shape: vec3<f32>, omega: vec4<f32>) -> bool {
    let away = max(-dot(omega.xyz, shape), 0.0);
    let square = max(1.0 - dot(shape, shape), 0.0);
    return omega.w * omega.w * square < away * away;
}

// Equations 13 and 14: 1 at the root, less where the cuticle is worn.
fn cuticle_factor(distance: f32) -> f32 {
    let cuticle = max(1.0 - record.cuticle_damage * distance, 0.0);
    return 1.0 - record.cuticle_softening * (1.0 - cuticle);
}

// Equation 15 as the direct solver wants it: what closed bonds remember, and their share of the stiffness.
fn shape_joints() {
    var distance = 0.0;
    for (var i = 0u; i < edges; i++) {
        var sum = vec3(0.0);
        var closed = 0.0;
        var total = 0.0;
        for (var kind = 0u; kind < 4u; kind++) {
            let b = bond(i, kind);
            let f = record.influence[kind];
            sum = fma(b.xyz, vec3(f * b.w), sum);
            closed += f * b.w;
            total += f;
        }
        let share = closed / total;
        var v = sum * (1.0 / max(closed, MIN_CLOSED_SHARE * total));
        var w = sqrt(max(1.0 - dot(v, v), 0.0));
        if share < MIN_CLOSED_SHARE {
            let omega = present_shape(i);
            v = omega.xyz;
            w = omega.w;
        }
        rest[slot(i, 0u, 2u)] = vec4(v, w);
        let e = edge(i);
        let factor = cuticle_factor(distance) * (1.0 - e.w);
        rest[slot(i, 1u, 2u)] = vec4(e.x, max(share, MIN_CLOSED_SHARE) * factor, e.z, e.w);
        distance += e.x;
    }
}

// Equation 16: bonds that form remember the present shape, bonds that break forget nothing.
fn changed(b: vec4<f32>, change: f32, omega: vec4<f32>) -> vec4<f32> {
    let to = clamp(b.w + change, 0.0, 1.0);
    let formed = to - b.w;
    if !(0.0 < formed) {
        return vec4(b.xyz, to);
    }
    let present = select(formed, -formed, is_opposite(b.xyz, omega));
    let mean = fma(omega.xyz, vec3(present), b.xyz * b.w) * (1.0 / max(to, 1e-30));
    return vec4(mean, to);
}

fn remember() {
    for (var i = 0u; i < edges; i++) {
        let drying = motion[slot(i, 1u, 2u)].w;
        let rates = vec4(bond(i, 0u).w, bond(i, 1u).w, bond(i, 2u).w, bond(i, 3u).w);
        var asked = fma(rates, -record.share, record.change);
        for (var t = 0u; t < record.treatments; t++) {
            if record.treatment[t].from_joint <= i && i < record.treatment[t].to_joint {
                asked += fma(rates, -record.treatment[t].share, record.treatment[t].change);
            }
        }
        asked.x += drying;
        // Peptide bonds are never cut.
        asked.w = max(asked.w, 0.0);
        // NaN changes nothing.
        if all(asked == vec4(0.0)) || is_broken4(asked) {
            continue;
        }
        let omega = present_shape(i);
        for (var kind = 0u; kind < 4u; kind++) {
            bonds[slot(i, kind, 4u)] = changed(bond(i, kind), asked[kind], omega);
        }
    }
}

// Gravity, drag and wind. Rust twins: src/forces/environment/{systems,wind,blown}.rs.

// Equation 17: wind of a blower on an edge, as an acceleration along its aim (m/s²).
fn wind_of(b: u32, p: vec3<f32>, e: vec3<f32>) -> f32 {
    let aim = record.blower[b].aim;
    let to = p - record.blower[b].nozzle;
    let along = dot(to, aim);
    if along <= 0.0 {
        return 0.0;
    }
    let off = to - aim * along;
    let sine = sqrt(dot(cross(aim, e), cross(aim, e))) / max(sqrt(dot(e, e)), 1e-12);
    return record.blower[b].strength * sine / (sqrt(dot(off, off)) / REFERENCE_DISTANCE + 1.0);
}

// Where the air finds a node: held ones have not moved yet.
fn air_place(i: u32) -> vec3<f32> {
    if 0u < i && is_held(edge(i).z) {
        return start_of(i);
    }
    return node(i).xyz;
}

// What the air does to velocities, and what it asks of hydrogen bonds (equation 19).
fn blow() {
    let fallen = record.gravity * record.dt;
    let taken_along = 1.0 - record.retained;
    for (var i = 0u; i <= edges; i++) {
        let m = moving(i);
        let weight = edge(i).z;
        var v = m.xyz * record.retained + fallen;
        var drying = 0.0;
        if record.blowers > 0u {
            // The tip has no edge of its own: it takes the last one's wind.
            let e = min(i, edges - 1u);
            let along = air_place(e + 1u) - air_place(e);
            let p = air_place(i);
            var acceleration = vec3(0.0);
            for (var b = 0u; b < record.blowers; b++) {
                let wind = wind_of(b, p, along);
                acceleration += record.blower[b].aim * wind;
                drying += record.blower[b].drying * wind;
            }
            v += acceleration * (record.dt / max(weight, 1.0));
        }
        v += record.wind * taken_along;
        if is_held(weight) {
            v = vec3(0.0);
            if 0u < i {
                v = (node(i).xyz - start_of(i)) * (1.0 / record.dt);
            }
        }
        set_moving(i, v, m.w);
        motion[slot(i, 1u, 2u)].w = drying * record.dt;
    }
}

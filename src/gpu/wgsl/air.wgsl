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

// Where the air finds a node: as the head has carried it into this substep; held ones have not moved yet.
fn air_place(i: u32) -> vec3<f32> {
    if 0u < i {
        return pose_in[slot(i, 0u, 2u)].xyz;
    }
    return node(i).xyz;
}

// The share that a jet has of the air at a place.
fn jet_share(b: u32, p: vec3<f32>) -> f32 {
    let to = p - record.blower[b].nozzle;
    let along = dot(to, record.blower[b].aim);
    if along <= 0.0 {
        return 0.0;
    }
    let off = to - record.blower[b].aim * along;
    let core = record.blower[b].core;
    return core / max(along, core) / (sqrt(dot(off, off)) / REFERENCE_DISTANCE + 1.0);
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
        var flow = record.wind;
        if record.blowers > 0u {
            // The tip has no edge of its own: it takes the last one's wind.
            let e = min(i, edges - 1u);
            let along = air_place(e + 1u) - air_place(e);
            let p = air_place(i);
            var acceleration = vec3(0.0);
            var shares = 0.0;
            var carried = vec3(0.0);
            for (var b = 0u; b < record.blowers; b++) {
                let wind = wind_of(b, p, along);
                acceleration += record.blower[b].aim * wind;
                drying += record.blower[b].drying * wind;
                let share = jet_share(b, p);
                let motion = record.blower[b].velocity
                    + cross(record.blower[b].spin, p - record.blower[b].center);
                shares += share;
                carried += motion * share;
            }
            // The jets' share of the air moves as their nozzles do.
            flow += (carried - (record.wind - record.headwind) * shares) / max(shares, 1.0);
            v += acceleration * (record.dt / max(weight, 1.0));
        }
        v += flow * taken_along;
        var push = (v - m.xyz) * (1.0 / record.dt);
        if is_held(weight) || MAX_PUSH * MAX_PUSH < dot(push, push) {
            push = vec3(0.0);
        }
        set_push(i, push);
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

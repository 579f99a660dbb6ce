// Obstacles and nodes. Rust twins: src/solver/rod/obstacle.rs, src/solver/rod/touch.rs.

// Obstacles that this strand may touch in this substep; whether a node moves so fast against one that it
// might pass through; whether a node rests on one.
var<private> near: vec4<u32>;
var<private> sweeps: bool;
var<private> touched: bool;
// Whether a pass has found a node to stick, slide, rest or leave that did not.
var<private> contact_changed: bool;
// Length from the root on that may be in what the root lies in, 0 where it lies in nothing.
var<private> escape_length: f32;
// Of a strand with such a root its length (m).
var<private> whole_length: f32;
// Whether it begins the substep in an obstacle that its length does not let it out of.
var<private> trapped: bool;

fn is_near(o: u32) -> bool {
    return ((near[o >> 5u] >> (o & 31u)) & 1u) != 0u;
}

// The first of them from this one on; beyond all where there is none. Of many obstacles few are near.
fn next_near(start: u32) -> u32 {
    let word = vec4(0u, 1u, 2u, 3u);
    let first = vec4(start >> 5u);
    let from_it = near & select(vec4(0xffffffffu), vec4(0xffffffffu << (start & 31u)), word == first);
    let left = select(from_it, vec4(0u), word < first);
    let at = firstTrailingBit(left) + 32u * word;
    let found = select(at, vec4(MAX_OBSTACLES), left == vec4(0u));
    return min(min(found.x, found.y), min(found.z, found.w));
}

// Where a point of the surface goes during the substep.
fn taken_along(o: u32, p: vec3<f32>) -> vec3<f32> {
    if record.obstacle[o].moves == 0u {
        return p;
    }
    let q = vec4(p, 1.0);
    return vec3(
        dot(record.obstacle[o].moved_x, q),
        dot(record.obstacle[o].moved_y, q),
        dot(record.obstacle[o].moved_z, q),
    );
}

// Direction and length of v; along `other` where it has none.
fn unit_or(v: vec3<f32>, other: vec3<f32>) -> vec4<f32> {
    let length = sqrt(dot(v, v));
    return vec4(select(v * (1.0 / max(length, 1e-12)), other, length < 1e-12), length);
}

fn half_axes(o: u32) -> vec3<f32> {
    return vec3(
        record.obstacle[o].radius,
        record.obstacle[o].half_height,
        record.obstacle[o].inverse,
    );
}

// A vector along the axes of an ellipsoid.
fn vector_in(o: u32, v: vec3<f32>) -> vec3<f32> {
    return vec3(
        dot(v, record.obstacle[o].b),
        dot(v, record.obstacle[o].across),
        dot(v, record.obstacle[o].axis),
    );
}

// Normal of an ellipsoid's surface nearest to p, and the distance from it. Rust twin: src/solver/rod/shape.
fn off_ellipsoid(o: u32, p: vec3<f32>) -> vec4<f32> {
    let half = half_axes(o);
    let size = max(max(half.x, half.y), half.z);
    let r = half / size;
    let least = min(min(r.x, r.y), r.z);
    let own = vector_in(o, p - record.obstacle[o].a);
    // In the middle of the shortest axis there are two nearest points: one is taken.
    let y = max(abs(own) / size, select(vec3(0.0), vec3(1e-6 * least), r == vec3(least)));
    let e = (r - least) * (r + least);
    let a = y * r;
    let poles = a - e;
    var s = max(max(poles.x, poles.y), poles.z);
    let steps = min(7u + u32(ceil(1.0 / least)), 16u);
    for (var k = 0u; k < steps; k++) {
        let inverse = 1.0 / (s + e);
        let share = a * inverse;
        let g = dot(share, share);
        s += (g * sqrt(g) - g) / dot(share * share, inverse);
    }
    let way = y / (s + e);
    let normal = way * (1.0 / sqrt(dot(way, way)));
    let distance = dot(y - way * r * r, normal) * size;
    let facing = select(normal, -normal, own < vec3(0.0));
    let out = record.obstacle[o].b * facing.x
        + record.obstacle[o].across * facing.y
        + record.obstacle[o].axis * facing.z;
    return vec4(out, distance);
}

// Normal of the surface nearest to p, and how deep p is below a layer of skin on it.
fn depth_in(o: u32, p: vec3<f32>) -> vec4<f32> {
    let kind = record.obstacle[o].kind;
    let a = record.obstacle[o].a;
    let b = record.obstacle[o].b;
    if kind == HALF_SPACE {
        return vec4(a, record.skin - dot(p - b, a));
    }
    let rel = p - a;
    if kind == CAPSULE {
        let t = clamp(dot(rel, b * record.obstacle[o].inverse), 0.0, 1.0);
        let off = unit_or(rel - b * t, record.obstacle[o].across);
        return vec4(off.xyz, record.obstacle[o].radius + record.skin - off.w);
    }
    if kind == ELLIPSOID {
        let off = off_ellipsoid(o, p);
        return vec4(off.xyz, record.skin - off.w);
    }
    let along = dot(rel, b);
    let off = unit_or(rel - b * along, record.obstacle[o].across);
    let side = record.obstacle[o].radius + record.skin - off.w;
    let cap = record.obstacle[o].half_height + record.skin - abs(along);
    if cap < side {
        return vec4(select(b, -b, along < 0.0), cap);
    }
    return vec4(off.xyz, side);
}

// Whether p is farther than `distance` outside. Wrongly denies near corners only.
fn is_beyond(o: u32, p: vec3<f32>, distance: f32) -> bool {
    let kind = record.obstacle[o].kind;
    let a = record.obstacle[o].a;
    let b = record.obstacle[o].b;
    if kind == HALF_SPACE {
        return distance < dot(p - b, a);
    }
    let rel = p - a;
    if kind == ELLIPSOID {
        // Scaled to a ball distances do not shrink; also the bounding ball.
        let half = half_axes(o);
        let squeezed = vector_in(o, rel) / half;
        let close = 1.0 + distance / record.obstacle[o].thickness;
        let far = max(max(half.x, half.y), half.z) + distance;
        return close * close < dot(squeezed, squeezed) || far * far < dot(rel, rel);
    }
    let reach = record.obstacle[o].radius + distance;
    if kind == CAPSULE {
        let off = rel - b * clamp(dot(rel, b * record.obstacle[o].inverse), 0.0, 1.0);
        return reach * reach < dot(off, off);
    }
    let along = dot(rel, b);
    let off = rel - b * along;
    let cap = record.obstacle[o].half_height + distance;
    return reach * reach < dot(off, off) || cap * cap < along * along;
}

// Where a node gets to, and whether there was anything in its way, with which normal, how deep it was inside.
struct Met {
    place: vec3<f32>,
    meets: bool,
    normal: vec3<f32>,
    depth: f32,
}

// How deep a node that began the substep at `start`, so far from the root, may be in an obstacle: one that the root
// lies in, or, of a trapped strand, as deep as it was.
fn allowed(o: u32, along: f32, start: vec3<f32>) -> f32 {
    let near_root = allowed_near_root(o, along);
    if !trapped {
        return near_root;
    }
    return max(near_root, depth_in(o, taken_along(o, start)).w);
}

fn allowed_near_root(o: u32, along: f32) -> f32 {
    if !(along < escape_length) {
        return 0.0;
    }
    let root = node(0u).xyz;
    if is_beyond(o, root, record.skin) {
        return 0.0;
    }
    let depth = depth_in(o, root).w;
    // A strand that is too short to get out is not moved by it.
    if whole_length < depth * ESCAPE_RATIO {
        return 3.0e38;
    }
    let deepest = escape_length * (1.0 / ESCAPE_RATIO);
    let share = min(depth * DEPTH_RATIO / deepest, 1.0);
    let way = along * (1.0 / ESCAPE_RATIO);
    return max((deepest - way * way / deepest) * share, 0.0);
}

// Out of the solid the shortest way where it is deeper than `may_be`: `depth` by that.
fn push_out(o: u32, p: vec3<f32>, may_be: f32) -> Met {
    // Most nodes that may touch it in the substep do not in this pass.
    if record.obstacle[o].kind == ELLIPSOID && is_beyond(o, p, record.skin) {
        return Met(p, false, vec3(0.0), 0.0);
    }
    let found = depth_in(o, p);
    let depth = found.w - may_be;
    if !(depth > 0.0) {
        return Met(p, false, vec3(0.0), 0.0);
    }
    return Met(fma(found.xyz, vec3(depth), p), true, found.xyz, depth);
}

// The same; where the node begins the substep on the surface, it stays there at first.
fn rest_on(o: u32, p: vec3<f32>, start: vec3<f32>, may_be: f32) -> Met {
    let found = depth_in(o, start);
    let depth = found.w - may_be;
    if !(-TOUCHING < depth) {
        return push_out(o, p, may_be);
    }
    let other = push_out(o, p, may_be);
    return Met(fma(found.xyz, vec3(max(depth, 0.0)), start), true, found.xyz, other.depth);
}

// The same after a Newton step, of nodes that were free in it; others stay that an obstacle bears with this force.
fn bear_on(o: u32, p: vec3<f32>, rested: bool, bearing: f32, may_be: f32) -> Met {
    let found = depth_in(o, p);
    let depth = found.w - may_be;
    if rested && -TOUCHING < depth {
        if 0.0 < bearing {
            return Met(fma(found.xyz, vec3(max(depth, 0.0)), p), true, found.xyz, bearing);
        }
        if depth < TOUCHING {
            return Met(p, false, vec3(0.0), 0.0);
        }
    }
    return push_out(o, p, may_be);
}

// It rests on nothing.
fn release(i: u32) {
    set_support(i, vec3(0.0), 0.0);
    set_reaction(i, vec3(0.0));
}

// 0 for a node that touches nothing, 1 for one without friction, 2 for one that sticks, 3 for one that slides.
fn contact_of(support: vec4<f32>) -> u32 {
    let rests = select(0u, 1u, dot(support.xyz, support.xyz) > 0.0);
    return rests + select(0u, 1u, 0.0 < support.w) + select(0u, 2u, support.w < 0.0);
}

// Holds a node back that would pass through a thin or fast solid. `fast` says whether it might have.
struct Swept {
    place: vec3<f32>,
    fast: bool,
    normal: vec3<f32>,
    passes: bool,
}

fn continuous_collision(o: u32, start: vec3<f32>, p: vec3<f32>) -> Swept {
    if record.obstacle[o].kind == HALF_SPACE {
        return Swept(p, false, vec3(0.0), false);
    }
    let thickness = record.obstacle[o].thickness;
    let way = p - start;
    if !(0.2 * thickness * thickness < dot(way, way)) {
        return Swept(p, false, vec3(0.0), false);
    }
    let facing = depth_in(o, start);
    let axis = record.obstacle[o].axis;
    let apart = start - record.obstacle[o].a;
    let across_from = fma(axis, vec3(-dot(apart, axis)), apart);
    let along = fma(axis, vec3(-dot(way, axis)), way);
    var nearest = clamp(-dot(across_from, along) / max(dot(along, along), 1e-20), 0.0, 1.0);
    if record.obstacle[o].kind == ELLIPSOID {
        let half = half_axes(o);
        let squeezed_from = vector_in(o, apart) / half;
        let squeezed = vector_in(o, way) / half;
        nearest = clamp(-dot(squeezed_from, squeezed) / max(dot(squeezed, squeezed), 1e-20), 0.0, 1.0);
    }
    let at_nearest = depth_in(o, fma(way, vec3(nearest), start));
    let at_middle = depth_in(o, fma(way, vec3(0.5), start));
    let at_end = depth_in(o, fma(way, vec3(1.0), start));
    let deepest = max(max(at_nearest.w, at_middle.w), at_end.w);
    let passes = 0.0 < deepest
        && dot(at_end.xyz, facing.xyz) < 0.0
        && facing.w < 1e-3 * thickness;
    if !passes {
        return Swept(p, true, vec3(0.0), false);
    }
    let behind = max(-dot(way, facing.xyz) + facing.w, 0.0);
    return Swept(fma(facing.xyz, vec3(behind), p), true, facing.xyz, true);
}

// Chooses the obstacles of this strand. Held nodes must know where they come from.
fn choose_near() {
    near = vec4(0u);
    escape_length = 0.0;
    trapped = false;
    if record.obstacles == 0u {
        return;
    }
    var pull = 0.0;
    var longest = 0.0;
    whole_length = 0.0;
    for (var i = 0u; i <= edges; i++) {
        let n = node(i);
        if is_held(n.w) {
            let pulled = n.xyz - start_of(i);
            pull = max(pull, dot(pulled, pulled));
        }
        let l = select(edge(i).x, 0.0, i == edges);
        longest = max(longest, l);
        whole_length += l;
    }
    let margin = sqrt(pull) + longest + record.skin;
    let ahead = FASTER * record.dt;
    for (var i = 0u; i <= edges; i++) {
        let p = node(i).xyz;
        let v = moving(i).xyz;
        let own = fma(sqrt(dot(v, v)), ahead, margin);
        for (var o = 0u; o < record.obstacles; o++) {
            if is_near(o) {
                continue;
            }
            let moved = taken_along(o, p) - p;
            let reach = own + sqrt(dot(moved, moved));
            if !is_beyond(o, p, reach) {
                near[o >> 5u] |= 1u << (o & 31u);
            }
        }
    }
    let root = node(0u).xyz;
    for (var o = next_near(0u); o < record.obstacles; o = next_near(o + 1u)) {
        if !is_beyond(o, root, record.skin) {
            escape_length = max(escape_length, ESCAPE_RATIO * depth_in(o, root).w);
        }
    }
}

// How far from the root node i + 1 is, from that of node i.
fn farther(along: f32, i: u32) -> f32 {
    return along + select(edge(i).x, 0.0, i == edges);
}

// p* = p + v dt, or on what is in the way.
fn predict_nodes(dt: f32) {
    sweeps = false;
    var next = 0.0;
    for (var i = 0u; i <= edges; i++) {
        let n = node(i);
        let along = next;
        next = farther(along, i);
        if is_held(n.w) {
            continue;
        }
        // What begins inside is set on the surface before the step, which gives it no velocity.
        var start = n.xyz;
        for (var o = next_near(0u); o < record.obstacles; o = next_near(o + 1u)) {
            let taken = taken_along(o, start);
            let out = push_out(o, taken, allowed(o, along, start));
            if out.meets {
                start += out.place - taken;
            }
        }
        set_start(i, start);
        var to = fma(moving(i).xyz, vec3(dt), start);
        for (var o = next_near(0u); o < record.obstacles; o = next_near(o + 1u)) {
            let far = select(fma(push_of(i), vec3(record.dt * dt), to), to, spins());
            let swept = continuous_collision(o, taken_along(o, start), far);
            let stopped = any(swept.normal != vec3(0.0)) && allowed(o, along, start) <= 0.0;
            to = select(to, swept.place, stopped);
            sweeps = sweeps || swept.fast;
        }
        set_node(i, to, n.w);
    }
}

// Moves nodes out of obstacles and records contacts. Friction: `FrictionPass` of src/solver/rod/touch.rs.
fn contacts(friction_pass: u32) {
    touched = false;
    contact_changed = false;
    if all(near == vec4(0u)) {
        return;
    }
    var along = 0.0;
    for (var i = 0u; i <= edges; i++) {
        touch(i, along, friction_pass);
        along = farther(along, i);
    }
}

// The same of one node, so far from the root.
fn touch(i: u32, along: f32, friction_pass: u32) {
    let n = node(i);
    let held = is_held(n.w);
    let start = start_of(i);
    let before = support_of(i);
    let rested = dot(before.xyz, before.xyz) > 0.0;
    var p = n.xyz;
    var rests_on = vec3(0.0);
    var touches = false;
    var sticks = false;
    var drag = 0.0;
    if friction_pass == FRICTION_PASS_BETWEEN && rested {
        rests_on = before.xyz;
        touches = true;
    }
    if friction_pass == FRICTION_PASS_BETWEEN || friction_pass == FRICTION_PASS_SOLVED {
        sticks = 0.0 < before.w;
        drag = max(-before.w, 0.0);
    }
    let reaction = reaction_of(i);
    let bearing = dot(before.xyz, reaction);
    let slid = before.w < 0.0;
    var pull = reaction;
    var deepest = -1.0;
    for (var o = next_near(0u); o < record.obstacles; o = next_near(o + 1u)) {
        let may_be = allowed(o, along, start);
        let taken = taken_along(o, start);
        if sweeps {
            let swept = continuous_collision(o, taken, p);
            if swept.passes && !(may_be > 0.0) {
                p = select(swept.place, p, held);
                rests_on = swept.normal;
                touches = true;
            }
        }
        var out: Met;
        if friction_pass == FRICTION_PASS_ASSUMED {
            out = rest_on(o, p, taken, may_be);
        } else if friction_pass == FRICTION_PASS_JUDGED || friction_pass == FRICTION_PASS_SOLVED {
            out = bear_on(o, p, rested, bearing, may_be);
        } else {
            out = push_out(o, p, may_be);
        }
        if !out.meets {
            continue;
        }
        // Between two solids it rests on the one that bears more.
        let bears = friction_pass == FRICTION_PASS_DEPTH || deepest < out.depth;
        if bears {
            deepest = out.depth;
            rests_on = out.normal;
            set_bearer(i, o);
        }
        touches = true;
        let slip = out.place - taken;
        let tangential = slip - out.normal * dot(slip, out.normal);
        let length = sqrt(dot(tangential, tangential));
        let most = record.obstacle[o].friction * out.depth;
        var stays = 0.0;
        let held_by = reaction - out.normal * dot(reaction, out.normal);
        if friction_pass == FRICTION_PASS_ASSUMED {
            if bears {
                sticks = -TOUCHING < depth_in(o, taken).w - may_be;
            }
        } else if friction_pass == FRICTION_PASS_JUDGED {
            // What would have to pull it back: by what it has been held with, or else by what it has slipped.
            let wanted = select(held_by - tangential, held_by, slid);
            let size = sqrt(max(dot(held_by, held_by), 1e-24));
            let reverses = REVERSING * size < dot(tangential, held_by);
            let holds = select(dot(wanted, wanted) < most * most, reverses, slid);
            // The solid that bears more decides.
            if bears {
                sticks = rested && holds;
                drag = select(drag, most, rested);
                pull = wanted;
            }
        } else if friction_pass == FRICTION_PASS_SOLVED && sticks {
            stays = 1.0;
        } else if friction_pass == FRICTION_PASS_SOLVED && 0.0 < drag {
            stays = select(0.0, 1.0, 0.0 < dot(tangential, held_by));
        } else if friction_pass == FRICTION_PASS_BETWEEN && 0.0 < drag {
            stays = 0.0;
        } else if friction_pass != FRICTION_PASS_NONE {
            stays = min(1.0, most / max(length, 1e-12));
        }
        p = select(fma(tangential, vec3(-stays), out.place), p, held);
    }
    set_node(i, p, n.w);
    touched = touched || touches;
    let support = vec4(rests_on, select(0.0, select(-drag, 1.0, sticks), touches));
    set_support(i, support.xyz, support.w);
    contact_changed = contact_changed || contact_of(before) != contact_of(support);
    if friction_pass == FRICTION_PASS_JUDGED && support.w < 0.0 && !held {
        set_slowed_along(i, pull);
    }
}

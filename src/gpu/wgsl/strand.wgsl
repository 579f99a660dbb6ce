// A strand in memory and what acts on it in a substep. Layout: src/gpu/layout.rs; the record:
// src/gpu/record.rs. Constants of all kernels: src/gpu/constants.rs.

struct Obstacle {
    // Half-space: its normal. Capsule: one end. Cylinder, ellipsoid: its centre.
    a: vec3<f32>,
    kind: u32,
    // Half-space: a point. Capsule: from one end to the other. Cylinder: the axis. Ellipsoid: its first
    // axis; the others are `across` and `axis`, its half axes `radius`, `half_height` and `inverse`.
    b: vec3<f32>,
    radius: f32,
    // Some direction across the axis.
    across: vec3<f32>,
    half_height: f32,
    // The unit axis; zero where there is none.
    axis: vec3<f32>,
    friction: f32,
    // How a point of the surface moves: three rows of an affine map.
    moved_x: vec4<f32>,
    moved_y: vec4<f32>,
    moved_z: vec4<f32>,
    // Inverse square of the axis' length, thickness, 1 if it moves.
    inverse: f32,
    thickness: f32,
    moves: u32,
    unused: u32,
}

struct Blower {
    nozzle: vec3<f32>,
    strength: f32,
    aim: vec3<f32>,
    drying: f32,
    // How it moves (m/s, rad/s); how far its air keeps its speed (m).
    velocity: vec3<f32>,
    core: f32,
    spin: vec3<f32>,
    unused: f32,
    // What it turns about, in metres.
    center: vec3<f32>,
    unused_too: f32,
}

struct Treatment {
    // As those of the whole hair.
    change: vec4<f32>,
    share: vec4<f32>,
    // From this joint on, up to that one.
    from_joint: u32,
    to_joint: u32,
    unused: vec2<u32>,
}

struct Substep {
    // Gravity in the hair's frame (m/s²), length (s).
    gravity: vec3<f32>,
    dt: f32,
    // What the frame's motion does to what rests in the world.
    frame_turn: vec4<f32>,
    frame_move: vec3<f32>,
    flags: u32,
    // The wind of the place (m/s), share of its velocity that hair keeps against the air.
    wind: vec3<f32>,
    retained: f32,
    // What of it is no wind of the place (m/s).
    headwind: vec3<f32>,
    still: f32,
    influence: vec4<f32>,
    // Δb asked of every joint, by kind, and the share of its rate that is taken off it.
    change: vec4<f32>,
    share: vec4<f32>,
    bending_length: f32,
    damping: f32,
    skin: f32,
    limiter_steps: u32,
    cuticle_damage: f32,
    cuticle_softening: f32,
    blowers: u32,
    obstacles: u32,
    blower: array<Blower, MAX_BLOWERS>,
    treatments: u32,
    // Kinematic targets of nodes, and of followers' roots: first and number.
    first_target: u32,
    targets: u32,
    first_root_target: u32,
    root_targets: u32,
    first_follower_block: u32,
    first_follower_slot: u32,
    // G J/(E I).
    torsion: f32,
    // How the hair's frame has moved in the tick, and its length (s).
    follow_turn: vec4<f32>,
    follow_move: vec3<f32>,
    follow_seconds: f32,
    // Time since hand-over (s), what is left after it of a follower's own motion, its time constant (s).
    follow_since: f32,
    follow_decay: f32,
    follow_lasts: f32,
    unused_2: u32,
    // Sleep of the whole hair: sleep.wgsl has what the first four are. The tick; where the report holds whether
    // a strand was not still at the end of this tick, of the one before and of the next.
    sleep: vec4<f32>,
    tick: u32,
    restless: u32,
    restless_before: u32,
    restless_next: u32,
    // Of hair that sweeps solve: k/(1 − k) of a joint in a substep; what makes w_q of lengths, and χ that is
    // given in its place, else 0; the share of their relative spin that neighbouring edges exchange.
    bend: f32,
    spin_weight: f32,
    chi: f32,
    exchange: f32,
    iterations: u32,
    projection: u32,
    unused_3: vec2<u32>,
    treatment: array<Treatment, MOST_TREATMENTS>,
    obstacle: array<Obstacle, MAX_OBSTACLES>,
}

// Of each block of strands: first node slot, nodes of a strand, strands, number of its first strand.
@group(0) @binding(0) var<storage, read> blocks: array<vec4<u32>>;
// Two a node: place and nothing; frame, at the tip the scalp's.
@group(0) @binding(1) var<storage, read> pose_in: array<vec4<f32>>;
// The same; beside the place stands the inverse mass.
@group(0) @binding(2) var<storage, read_write> pose_out: array<vec4<f32>>;
// Two a node: velocity and tension; place at the tick's start and drying. Of hair that sweeps solve there is one
// more behind those of all nodes: the edge's angular velocity.
@group(0) @binding(3) var<storage, read_write> motion: array<vec4<f32>>;
// Two a node: rest shape; length, share of stiffness, weight in dry nodes (0 held), share softened.
@group(0) @binding(4) var<storage, read_write> rest: array<vec4<f32>>;
// Four a node: remembered shape and rate of each kind.
@group(0) @binding(5) var<storage, read_write> bonds: array<vec4<f32>>;
// SCRATCH a node. Before a substep the first two hold a node's kinematic target, and the frame of a root's; of no
// meaning otherwise between substeps.
@group(0) @binding(6) var<storage, read_write> scratch: array<vec4<f32>>;
// Strands put back, rebuilt, of the first of them the number from the end, and whether one with held nodes has to
// give way; from the 16th on whether a strand was not still.
@group(0) @binding(7) var<storage, read_write> report: array<atomic<u32>, 20>;
@group(1) @binding(0) var<uniform> record: Substep;

// The strand of this thread.
var<private> first: u32;
var<private> lane: u32;
var<private> edges: u32;
var<private> number: u32;

fn slot(i: u32, part: u32, parts: u32) -> u32 {
    return ((first + i) * parts + part) * GROUP_SIZE + lane;
}

// Place and inverse mass.
fn node(i: u32) -> vec4<f32> {
    return pose_out[slot(i, 0u, 2u)];
}

fn set_node(i: u32, place: vec3<f32>, w: f32) {
    pose_out[slot(i, 0u, 2u)] = vec4(place, w);
}

fn frame(i: u32) -> vec4<f32> {
    return pose_out[slot(i, 1u, 2u)];
}

fn set_frame(i: u32, q: vec4<f32>) {
    pose_out[slot(i, 1u, 2u)] = q;
}

// The scalp's frame at the end of the substep.
fn root_frame() -> vec4<f32> {
    return frame(edges);
}

// Velocity and tension.
fn moving(i: u32) -> vec4<f32> {
    return motion[slot(i, 0u, 2u)];
}

fn set_moving(i: u32, v: vec3<f32>, tension: f32) {
    motion[slot(i, 0u, 2u)] = vec4(v, tension);
}

fn spins() -> bool {
    return (record.flags & SWEEPS) != 0u;
}

fn spin_slot(i: u32) -> u32 {
    return arrayLength(&motion) / 3u * 2u + slot(i, 0u, 1u);
}

// Angular velocity of an edge, of hair that has them.
fn spin(i: u32) -> vec3<f32> {
    return motion[spin_slot(i)].xyz;
}

fn set_spin(i: u32, omega: vec3<f32>) {
    motion[spin_slot(i)] = vec4(omega, 0.0);
}

// Length, share of stiffness, weight, share softened.
fn edge(i: u32) -> vec4<f32> {
    return rest[slot(i, 1u, 2u)];
}

fn rest_shape(i: u32) -> vec4<f32> {
    return rest[slot(i, 0u, 2u)];
}

fn row(i: u32, part: u32) -> vec4<f32> {
    return scratch[slot(i, part, SCRATCH)];
}

fn set_row(i: u32, part: u32, value: vec4<f32>) {
    scratch[slot(i, part, SCRATCH)] = value;
}

// Where a node began the substep.
fn start_of(i: u32) -> vec3<f32> {
    return scratch[slot(i, 6u, SCRATCH)].xyz;
}

fn set_start(i: u32, place: vec3<f32>) {
    scratch[slot(i, 6u, SCRATCH)] = vec4(place, 0.0);
}

// Normal of the obstacle that it rests on, or zero; 1 where friction holds it at its start there, or minus the
// friction that it slides against, as a displacement of a free node in the substep (m).
fn support_of(i: u32) -> vec4<f32> {
    return scratch[slot(i, 7u, SCRATCH)];
}

fn set_support(i: u32, normal: vec3<f32>, hold: f32) {
    scratch[slot(i, 7u, SCRATCH)] = vec4(normal, hold);
}

// Acceleration by air and gravity in this substep (m/s²).
fn push_of(i: u32) -> vec3<f32> {
    return scratch[slot(i, 8u, SCRATCH)].xyz;
}

fn set_push(i: u32, push: vec3<f32>) {
    scratch[slot(i, 8u, SCRATCH)] = vec4(push, 0.0);
}

// What holds it there, as a displacement of a free node in the substep (m). Where the last row of the edge before it
// was, which a Newton step has used when it writes this, and writes only when it has read it.
fn reaction_of(i: u32) -> vec3<f32> {
    return select(row(max(i, 1u) - 1u, 5u).xyz, vec3(0.0), i == 0u);
}

fn set_reaction(i: u32, reaction: vec3<f32>) {
    if 0u < i {
        set_row(i - 1u, 5u, vec4(reaction, 0.0));
    }
}

// Two directions across a normal.
fn across_of(normal: vec3<f32>) -> mat2x3<f32> {
    let other = select(vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0), 0.7 < abs(normal.x));
    let first = normalize(cross(normal, other));
    return mat2x3(first, cross(normal, first));
}

// Which way friction acts on a node that slides, across the normal of what it rests on: as an angle.
fn slowed_along(i: u32) -> vec3<f32> {
    let angle = scratch[slot(i, 8u, SCRATCH)].w;
    return across_of(support_of(i).xyz) * vec2(cos(angle), sin(angle));
}

fn set_slowed_along(i: u32, way: vec3<f32>) {
    let flat = way * across_of(support_of(i).xyz);
    scratch[slot(i, 8u, SCRATCH)].w = atan2(flat.y, flat.x);
}

// That obstacle: the last eight bits of where the edge after the node has the stretch that was taken off it.
fn bearer_of(i: u32) -> u32 {
    return bitcast<u32>(scratch[slot(i, 6u, SCRATCH)].w) & 255u;
}

fn set_bearer(i: u32, o: u32) {
    let taken = bitcast<u32>(scratch[slot(i, 6u, SCRATCH)].w) & ~255u;
    scratch[slot(i, 6u, SCRATCH)].w = bitcast<f32>(taken | o);
}

// How much of the stretch of an edge's tension the length limiter has taken off (m).
fn taken_of(i: u32) -> f32 {
    return bitcast<f32>(bitcast<u32>(scratch[slot(i, 6u, SCRATCH)].w) & ~255u);
}

fn set_taken(i: u32, stretch: f32) {
    let taken = bitcast<u32>(stretch) & ~255u;
    scratch[slot(i, 6u, SCRATCH)].w = bitcast<f32>(taken | bearer_of(i));
}

fn is_held(w: f32) -> bool {
    return w < 1e-12;
}

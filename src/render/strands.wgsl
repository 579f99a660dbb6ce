// From the packed buffers to points on drawn strands. Rust twin: curve.rs. Keep both alike.
//
// A material of your own may import this and bind the buffers of `HairBuffers` at the same places.
#define_import_path bevy_keratin::strands

// The view that shows guides alone.
const VIEW_GUIDES: u32 = 6u;

struct HairNode {
    position: vec3<f32>,   // in the hair's frame (m)
    rates: u32,            // hydrogen, ionic, disulfide, peptide as unorm8, lowest byte first
    // As f16, low bits first: mean |length / rest - 1| of the edges that meet here, and 0 dry ... 1
    // soaked.
    strain_moisture: u32,
    rest: f32,             // length along the strand from the root at rest (m)
    // As f16: motion since the frame before (m / 1024), and 1, or 0 where the guide has no usable
    // node in this frame.
    motion_xy: u32,
    motion_z_shown: u32,
}

struct DrawnStrand {
    guides: vec3<u32>,     // nearest first
    seed: u32,
    weights: vec3<f32>,    // shares of the guides, sum 1
    length: f32,           // share of the guides' length that is drawn, above phase; above 1 larger
    root: vec3<f32>,       // root's place besides the weighted guides' roots (m)
    phase: f32,            // where on the guides the strand begins, a share of their length
    stray: vec3<f32>,      // by how much the tip leaves the lock (m)
    size: f32,             // length at rest (m)
    // To the middles of its locks, large to small: between the roots (m), and by how much more the
    // middle goes with the second guide; with the third below.
    lock_large: vec4<f32>,
    lock_middle: vec4<f32>,
    lock_small: vec4<f32>,
    lock_third: vec3<f32>,
    // Width as a share of the look's as f16, below 0 for guides themselves; above it where the strand is cut, a
    // share of its length as unorm16.
    width_cut: u32,
}

// Width as a share of the look's.
fn strand_width(strand: DrawnStrand) -> f32 {
    let width = unpack2x16float(strand.width_cut).x;
    return select(width, 1.0, width < 0.0);
}

// Where a strand is cut: a share of its length, 1 for whole ones.
fn strand_cut(strand: DrawnStrand) -> f32 {
    return unpack2x16unorm(strand.width_cut).y;
}

// A layer of bleach and dye, from `begin` to `end` of the length.
struct Dye {
    absorption: vec3<f32>,
    bleach: f32,
    begin: f32,
    end: f32,
    fade: f32,
    in_streaks: u32,       // whether only some strands have it
}

struct Ribbon {
    root_absorption: vec3<f32>,
    variation: f32,
    tip_absorption: vec3<f32>,
    root_shade: f32,
    width: f32,
    taper: f32,
    roughness: f32,
    gloss: f32,
    backlight: f32,
    grey: f32,
    layers: f32,           // of strands, one behind the other
    clump: f32,
    parting: f32,
    wet_clump: f32,
    segments: u32,
    guides: u32,
    strands: u32,
    view: u32,
    frizz: f32,
    locks: vec3<f32>,
    lock_shape: f32,
    root_fade: f32,
    dye_count: u32,
    rank_step: u32,        // strand * rank_step modulo their number is the strand's rank
    order_step: u32,       // and rank * order_step the strand of a rank
    ring_ranks: u32,       // strands that have rings, from the first rank on
    ring_every: u32,       // of how many rings one is drawn
    shadow_density: f32,
    densities: array<vec4<f32>, 2>, // of strands, seen from beside (1/m), along their length
    dyes: array<Dye, 4>,
}

// A ball, capsule or ellipsoid: in its own frame, all within 1 of a segment along Y.
struct DrawnSolid {
    x: vec4<f32>,          // the frame's axes, by which a place's coordinates are found
    y: vec4<f32>,
    z: vec4<f32>,
    half: f32,             // of the segment's length; of a hat HOLDS, HIDES or less than 0
    room: f32,             // how far outside strands stay
    reach: f32,            // of a ball around it, with that room (m)
    rim: f32,              // of a hat: it is above this along Y
}

// What differs from frame to frame besides nodes.
struct DrawnFrame {
    share: f32,            // of the strands, that is drawn
    fade: f32,             // the part of it, from its end, in which they fade
    wider: f32,            // how many times wider they are
    solid_count: u32,
    // The grid in which fibres are counted: its lowest corner and size of a cell (m), and cells along a side, 0
    // for none.
    volume_begin: vec3<f32>,
    volume_side: u32,
    volume_cell: vec3<f32>,
    unused: u32,
    // Lights towards which they are: places in the world and 1, or the way there and 0; the same in the hair's
    // frame.
    lights: array<vec4<f32>, 4>,
    local_lights: array<vec4<f32>, 4>,
    groups: array<vec4<f32>, 24>, // balls around eight solids each
    solids: array<DrawnSolid, 192>,
}

@group(#{MATERIAL_BIND_GROUP}) @binding(0) var<uniform> ribbon: Ribbon;
@group(#{MATERIAL_BIND_GROUP}) @binding(1) var<storage, read> nodes: array<HairNode>;
struct DrawnGuide {
    first: u32,            // node
    count: u32,            // of nodes
    edges: f32,            // before it was cut
    end: f32,              // where it ends, in these
}

@group(#{MATERIAL_BIND_GROUP}) @binding(2) var<storage, read> guides: array<DrawnGuide>;
@group(#{MATERIAL_BIND_GROUP}) @binding(3) var<storage, read> strands: array<DrawnStrand>;
// Of each strand the layers of dye whose streaks it is in, a bit each; one word where none has streaks.
@group(#{MATERIAL_BIND_GROUP}) @binding(4) var<storage, read> streaks: array<u32>;
@group(#{MATERIAL_BIND_GROUP}) @binding(5) var<storage, read> frame: DrawnFrame;

#ifdef MOTION_VECTOR_PREPASS
// 1 computes points as they were in the frame before, 0 as they are.
var<private> past: f32 = 0.0;
#endif

// Of strands around one, at a share of its length (1/m).
fn density_at(share: f32) -> f32 {
    let place = clamp(8.0 * share - 0.5, 0.0, 7.0);
    let piece = min(u32(place), 6u);
    let here = ribbon.densities[piece / 4u][piece % 4u];
    let next = ribbon.densities[(piece + 1u) / 4u][(piece + 1u) % 4u];
    return mix(here, next, place - f32(piece));
}

fn node_place(index: u32) -> vec3<f32> {
#ifdef MOTION_VECTOR_PREPASS
    let n = nodes[index];
    let motion = vec3(unpack2x16float(n.motion_xy), unpack2x16float(n.motion_z_shown).x);
    return n.position - motion * (past / 1024.0);
#else
    return nodes[index].position;
#endif
}

fn node_shown(index: u32) -> f32 {
    return unpack2x16float(nodes[index].motion_z_shown).y;
}

fn node_moisture(index: u32) -> f32 {
    return unpack2x16float(nodes[index].strain_moisture).y;
}

struct CurvePoint {
    position: vec3<f32>,
    slope: vec3<f32>,      // derivative by the share of the length
}

// Where a share (0 root ... 1 tip) of a whole guide falls.
struct GuidePlace {
    below: u32,            // the node below, in the buffer
    on: f32,               // how far on to the next, above 1 beyond the end of one that is cut
    edge: f32,             // length between the two, in edges of the whole guide
}

fn guide_place(guide: DrawnGuide, share: f32) -> GuidePlace {
    let along = saturate(share) * guide.edges;
    let below = min(floor(along), f32(guide.count - 2u));
    var out: GuidePlace;
    out.below = guide.first + u32(below);
    out.edge = select(1.0, guide.end - below, u32(below) + 2u == guide.count);
    out.on = (along - below) / out.edge;
    return out;
}

// Catmull-Rom through the nodes of a guide, straight on from where it is cut.
fn guide_point(guide: DrawnGuide, share: f32) -> CurvePoint {
    let place = guide_place(guide, share);
    let f = min(place.on, 1.0);
    let p1 = node_place(place.below);
    let p2 = node_place(place.below + 1u);
    var p0 = 2.0 * p1 - p2;
    if place.below > guide.first {
        p0 = node_place(place.below - 1u);
    }
    var p3 = 2.0 * p2 - p1;
    if place.below + 2u < guide.first + guide.count {
        p3 = node_place(place.below + 2u);
    }
    let a = 0.5 * (p2 - p0);
    let b = p0 - 2.5 * p1 + 2.0 * p2 - 0.5 * p3;
    let c = 1.5 * (p1 - p2) + 0.5 * (p3 - p0);
    let slope = a + f * (2.0 * b + 3.0 * f * c);
    var point: CurvePoint;
    point.position = p1 + f * (a + f * (b + f * c)) + (place.on - f) * slope;
    point.slope = slope * (guide.edges / place.edge);
    return point;
}

struct StrandPoint {
    position: vec3<f32>,
    slope: vec3<f32>,
    // How much each guide counts here, sum 1; all 0 where nothing is to be drawn.
    weights: vec3<f32>,
    // Where on the guides this is.
    share: f32,
    // From the guide that water draws it to (m).
    outward: vec3<f32>,
}

// A value and its derivative.
struct Rising {
    value: f32,
    rate: f32,
}

// The share of the length over which a strand leaves its root for where its phase puts it.
const EASE: f32 = 0.2;

fn eased_at(t: f32) -> Rising {
    let u = saturate(t / EASE);
    return Rising(u * (2.0 - u), 2.0 * (1.0 - u) / EASE);
}

// What its locks do to a strand, with the derivatives.
struct Locks {
    root: vec3<f32>,
    root_rate: vec3<f32>,
    weights: vec3<f32>,
    rates: vec3<f32>,
}

// Every level draws what the levels before have left.
fn locks_at(strand: DrawnStrand, t: f32) -> Locks {
    let gone = pow(max(t, 1e-4), ribbon.lock_shape);
    let rising = ribbon.lock_shape * gone / max(t, 1e-4);
    let pull = ribbon.locks * gone;
    let pulling = ribbon.locks * rising;
    let left_large = 1.0 - pull.x;
    let left_middle = left_large * (1.0 - pull.y);
    let falling = -pulling.x * (1.0 - pull.y) - left_large * pulling.y;
    let share = vec3(pull.x, pull.y * left_large, pull.z * left_middle);
    let rate = vec3(pulling.x, pulling.y * left_large - pull.y * pulling.x,
        pulling.z * left_middle + pull.z * falling);
    let second = vec3(strand.lock_large.w, strand.lock_middle.w, strand.lock_small.w);
    let weights = vec2(dot(second, share), dot(strand.lock_third, share));
    let rates = vec2(dot(second, rate), dot(strand.lock_third, rate));
    var out: Locks;
    out.root = strand.lock_large.xyz * share.x + strand.lock_middle.xyz * share.y + strand.lock_small.xyz * share.z;
    out.root_rate = strand.lock_large.xyz * rate.x + strand.lock_middle.xyz * rate.y + strand.lock_small.xyz * rate.z;
    out.weights = vec3(-weights.x - weights.y, weights);
    out.rates = vec3(-rates.x - rates.y, rates);
    return out;
}

// Where in the noise a strand goes, for each metre of its length.
const THROUGH: vec3<f32> = vec3(0.6, 0.8, -1.4);
const TAU: f32 = 6.2831855;

// Waves whose sum has no divergence, as curl noise has none: each leans at right angles to the way it
// runs. Those of `length` (m) at `place`, with the derivative by the strand's share.
fn waves(place: vec3<f32>, through: vec3<f32>, length: f32, begin: f32) -> CurvePoint {
    let count = vec4(1.0, 1.31, 0.77, 1.13) / length;
    let at = vec4(dot(vec3(0.8, 0.6, 0.0), place), dot(vec3(0.0, 0.8, 0.6), place),
        dot(vec3(0.6, 0.0, 0.8), place), dot(vec3(0.48, -0.64, 0.6), place));
    let go = vec4(dot(vec3(0.8, 0.6, 0.0), through), dot(vec3(0.0, 0.8, 0.6), through),
        dot(vec3(0.6, 0.0, 0.8), through), dot(vec3(0.48, -0.64, 0.6), through));
    let turn = fract(count * at + vec4(0.0, 0.37, 0.71, 0.13) + begin) * TAU;
    let high = sin(turn);
    let rise = cos(turn) * count * go * TAU;
    var out: CurvePoint;
    out.position = vec3(high.y + 0.8 * high.w, high.z + 0.6 * high.w, high.x);
    out.slope = vec3(rise.y + 0.8 * rise.w, rise.z + 0.6 * rise.w, rise.x);
    return out;
}

// How far frizz puts a strand off its way.
fn frizz_at(strand: DrawnStrand, root: vec3<f32>, t: f32) -> CurvePoint {
    let height = ribbon.frizz * pow(max(t, 1e-4), 1.3);
    let rising = 1.3 * height / max(t, 1e-4);
    let through = THROUGH * strand.size;
    let place = root + through * t;
    // Neighbours wave nearly alike.
    let own = 0.2 * hash(strand.seed + 31u);
    let coarse = waves(place, through, 12e-3, own);
    let fine = waves(place, through, 3e-3, own);
    let position = 0.7 * coarse.position + 0.18 * fine.position;
    var out: CurvePoint;
    out.position = position * height;
    out.slope = (0.7 * coarse.slope + 0.18 * fine.slope) * height + position * rising;
    return out;
}

// The way that a guide has gone from its root at a point, shifted by the phase.
fn way_along(guide: DrawnGuide, root: vec3<f32>, point: CurvePoint, phase: f32, eased: Rising,
    pace: f32) -> CurvePoint {
    var shift = vec3(0.0);
    if phase > 0.0 {
        shift = guide_point(guide, phase).position - root;
    }
    var out: CurvePoint;
    out.position = point.position - root - shift * eased.value;
    out.slope = point.slope * pace - shift * eased.rate;
    return out;
}

// Length from the root over which pushing sets in (m), or half of a strand that is shorter than twice
// that: roots are in the skin.
const ROOT: f32 = 5e-3;

// Solids of a group.
const GROUP: u32 = 8u;
// How many times a point goes through all solids, at most: what one pushes out may come to lie in an
// earlier one.
const SWEEPS: u32 = 3u;
// Of a hat that strands stay under, and of one above whose rim they are not drawn.
const HOLDS: f32 = -1.0;
const HIDES: f32 = -3.0;

// Moves a point of a strand out of a solid if it is inside, and turns its slope along the surface.
fn push_out(solid: DrawnSolid, point: ptr<function, StrandPoint>) -> u32 {
    let place = vec4((*point).position, 1.0);
    var own = vec3(dot(solid.x, place), dot(solid.y, place), dot(solid.z, place));
    let above = own.y - solid.rim;
    let half = max(solid.half, 0.0);
    own.y -= clamp(own.y, -half, half);
    let apart = length(own);
    var out = own / max(apart, 1e-6);
    var missing = 1.0 + solid.room - apart;
    if solid.half < 0.0 && above <= 0.0 {
        return 0u;
    }
    if solid.half == HIDES {
        (*point).weights = vec3(0.0);
        return 0u;
    }
    if solid.half == HOLDS {
        // In or down, whichever is shorter.
        missing = solid.room + apart - 1.0;
        out = -out;
        if above < missing {
            missing = above;
            out = vec3(0.0, -1.0, 0.0);
        }
    }
    if missing <= 0.0 {
        return 0u;
    }
    let x = solid.x.xyz;
    let y = solid.y.xyz;
    let z = solid.z.xyz;
    (*point).position += missing
        * (x * (out.x / dot(x, x)) + y * (out.y / dot(y, y)) + z * (out.z / dot(z, z)));
    let normal = x * out.x + y * out.y + z * out.z;
    (*point).slope -= normal * (dot(normal, (*point).slope) / max(dot(normal, normal), 1e-12));
    return 1u;
}

// The point at `t` of a strand so long (m) out of all solids.
fn push_out_of_all(t: f32, length: f32, point: ptr<function, StrandPoint>) {
    let inside = (*point).position;
    let slope = (*point).slope;
    for (var sweep = 0u; sweep < SWEEPS; sweep++) {
        var pushed = 0u;
        for (var first = 0u; first < frame.solid_count; first += GROUP) {
            let bounds = frame.groups[first / GROUP];
            let off = (*point).position - bounds.xyz;
            if dot(off, off) > bounds.w * bounds.w {
                continue;
            }
            for (var i = first; i < min(first + GROUP, frame.solid_count); i++) {
                pushed += push_out(frame.solids[i], point);
            }
        }
        if pushed < 2u {
            break;
        }
    }
    let grown = saturate(t * length / max(min(ROOT, 0.5 * length), 1e-6));
    (*point).position = mix(inside, (*point).position, grown);
    (*point).slope = mix(slope, (*point).slope, grown);
}

// How much of a strand of so many is drawn in this frame: 1 all, 0 nothing.
fn strand_alpha(index: u32) -> f32 {
    return alpha_of_rank(rank_of(index));
}

// A product modulo the number of strands, in parts of 32 bits.
fn times(number: u32, step: u32) -> u32 {
    let high = (number * (step >> 8u)) % ribbon.strands;
    return (high * 256u + number * (step & 255u)) % ribbon.strands;
}

fn rank_of(index: u32) -> u32 {
    return times(index, ribbon.rank_step);
}

fn strand_of_rank(rank: u32) -> u32 {
    return times(rank, ribbon.order_step);
}

fn alpha_of_rank(rank: u32) -> f32 {
    return saturate((frame.share - f32(rank) / f32(ribbon.strands)) / max(frame.fade, 1e-6));
}

// How much nearer to the root the first rings are than if all were as far apart.
const NEAR_ROOT: f32 = 0.75;

// Where a ring is on a strand. Rings are close together at the root: a strand that lies along the skin
// comes out of it there, and a long straight segment would cut through a round head.
fn ring_share(ring: u32) -> f32 {
    let t = f32(ring) / f32(ribbon.segments);
    let left = 1.0 - t;
    return t - NEAR_ROOT * t * left * left * left;
}

// The point at a share `own` (0 root ... 1 tip) of what is left of a strand.
fn strand_point(strand: DrawnStrand, own: f32) -> StrandPoint {
    let cut = strand_cut(strand);
    var out = whole_point(strand, own * cut);
    out.slope *= cut;
    return out;
}

// The point at `t` of a strand as if it were whole.
fn whole_point(strand: DrawnStrand, t: f32) -> StrandPoint {
    var out: StrandPoint;
    let follows = select(1.0, 0.0, unpack2x16float(strand.width_cut).x < 0.0);
    let reach = min(strand.length, 1.0) - strand.phase;
    // What is longer than its guides is like them, but larger.
    let larger = max(strand.length, 1.0);
    let eased = eased_at(t);
    out.share = strand.phase * eased.value + t * reach;
    let pace = reach + strand.phase * eased.rate;
    let near = guides[strand.guides.x];
    let near_root = node_place(near.first);
    let near_point = guide_point(near, out.share);

    let locks = locks_at(strand, t);
    let own = max(strand.weights + locks.weights, vec3(0.0));
    var weights = vec3(own.x * node_shown(near.first), 0.0, 0.0);
    var root = strand.root + strand.weights.x * near_root;
    let near_way = way_along(near, near_root, near_point, strand.phase, eased, pace);
    var way = weights.x * near_way.position;
    var slope = weights.x * near_way.slope
        + locks.rates.x * node_shown(near.first) * near_way.position;
    for (var i = 1; i < 3; i++) {
        if strand.weights[i] <= 0.0 && own[i] <= 0.0 {
            continue;
        }
        let guide = guides[strand.guides[i]];
        let guide_root = node_place(guide.first);
        let point = guide_point(guide, out.share);
        root += strand.weights[i] * guide_root;
        let guide_way = way_along(guide, guide_root, point, strand.phase, eased, pace);
        // Guides that went apart, or other ways, stop blending: the strand goes with its nearest.
        let apart = distance(point.position, near_point.position)
            / max(distance(guide_root, near_root), 1e-4);
        let together = dot(guide_way.position, near_way.position)
            / max(length(guide_way.position) * length(near_way.position), 1e-12);
        let beyond = out.share * guide.edges - guide.end;
        let goes = node_shown(guide.first)
            * (1.0 - smoothstep(0.0, 1.0, beyond))
            * (1.0 - smoothstep(ribbon.parting, 1.5 * ribbon.parting, apart))
            * select(smoothstep(0.0, 0.6, together), 1.0, t <= 0.0);
        weights[i] = own[i] * goes;
        way += weights[i] * guide_way.position;
        slope += goes * (own[i] * guide_way.slope + locks.rates[i] * guide_way.position);
    }
    let sum = weights.x + weights.y + weights.z;
    if sum <= 1e-6 {
        return out;
    }
    out.weights = weights / sum;
    // Toward the tip locks draw together around their middles, and strays leave them.
    let gather = (near_root - root) * ribbon.clump * follows;
    var frizz: CurvePoint;
    if follows > 0.0 && ribbon.frizz > 0.0 {
        frizz = frizz_at(strand, root, t);
    }
    let loose = root + way * (larger / sum) + locks.root + gather * t + strand.stray * t * t
        + frizz.position;
    let loose_slope = slope * (larger / sum) + locks.root_rate + gather + 2.0 * t * strand.stray
        + frizz.slope;
    // Water draws a lock together around its guide, from the root on.
    let at = guide_place(near, out.share);
    let low = node_moisture(at.below);
    let rise = node_moisture(at.below + 1u) - low;
    let most = ribbon.wet_clump * follows * node_shown(near.first);
    let moisture = low + rise * min(at.on, 1.0);
    let rising = select(rise * near.edges / at.edge, 0.0, at.on > 1.0);
    let tight = most * moisture * t * (2.0 - t);
    let tighter = most * (rising * pace * t * (2.0 - t) + moisture * (2.0 - 2.0 * t));
    let inward = near_point.position - loose;
    out.position = loose + inward * tight;
    out.outward = inward * (tight - 1.0);
    out.slope = mix(loose_slope, near_point.slope * pace, tight) + inward * tighter;
    push_out_of_all(t, strand.size, &out);
    return out;
}

#ifdef MOTION_VECTOR_PREPASS
// Where the point was in the frame before, in the hair's frame.
fn past_strand_position(strand: DrawnStrand, t: f32) -> vec3<f32> {
    past = 1.0;
    let point = strand_point(strand, t);
    past = 0.0;
    return point.position;
}
#endif

struct StrandState {
    rates: vec4<f32>,
    strain: f32,
    moisture: f32,
}

// What the guides carry at a point of a strand.
fn strand_state(strand: DrawnStrand, point: StrandPoint) -> StrandState {
    var state: StrandState;
    for (var i = 0; i < 3; i++) {
        let weight = point.weights[i];
        if weight <= 0.0 {
            continue;
        }
        let guide = guides[strand.guides[i]];
        let at = guide_place(guide, point.share);
        let n = nodes[at.below];
        let m = nodes[at.below + 1u];
        let on = min(at.on, 1.0);
        state.rates += weight * mix(unpack4x8unorm(n.rates), unpack4x8unorm(m.rates), on);
        let own = mix(unpack2x16float(n.strain_moisture), unpack2x16float(m.strain_moisture), on);
        state.strain += weight * own.x;
        state.moisture += weight * own.y;
    }
    return state;
}

// A number in [0, 1) from a seed: the PCG hash.
fn hash(seed: u32) -> f32 {
    let state = seed * 747796405u + 2891336453u;
    let word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return f32(((word >> 22u) ^ word) >> 8u) / 16777216.0;
}

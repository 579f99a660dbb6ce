// From the packed buffers to points on drawn strands. Rust twin: curve.rs. Keep both alike.
//
// A material of your own may import this and bind the buffers of `HairBuffers` at the same places.
#define_import_path bevy_keratin::strands

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
    guide: f32,            // 1 for guides themselves, 0 for followers
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
    density: f32,          // of strands, seen from beside (1/m)
    layers: f32,           // of strands, one behind the other
    clump: f32,
    parting: f32,
    wet_clump: f32,
    segments: u32,
    guides: u32,
    strands: u32,
    view: u32,
}

@group(#{MATERIAL_BIND_GROUP}) @binding(0) var<uniform> ribbon: Ribbon;
@group(#{MATERIAL_BIND_GROUP}) @binding(1) var<storage, read> nodes: array<HairNode>;
// First node and number of nodes of each guide.
@group(#{MATERIAL_BIND_GROUP}) @binding(2) var<storage, read> guides: array<vec2<u32>>;
@group(#{MATERIAL_BIND_GROUP}) @binding(3) var<storage, read> strands: array<DrawnStrand>;

#ifdef MOTION_VECTOR_PREPASS
// 1 computes points as they were in the frame before, 0 as they are.
var<private> past: f32 = 0.0;
#endif

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

// Where `share` (0 root ... 1 tip) falls: node below, and how far on to the next.
fn node_below(guide: vec2<u32>, share: f32) -> vec2<f32> {
    let along = saturate(share) * f32(guide.y - 1u);
    let below = min(floor(along), f32(guide.y - 2u));
    return vec2(below, along - below);
}

// Catmull-Rom through the nodes of a guide.
fn guide_point(guide: vec2<u32>, share: f32) -> CurvePoint {
    let at = node_below(guide, share);
    let i = u32(at.x);
    let f = at.y;
    let p1 = node_place(guide.x + i);
    let p2 = node_place(guide.x + i + 1u);
    var p0 = 2.0 * p1 - p2;
    if i > 0u {
        p0 = node_place(guide.x + i - 1u);
    }
    var p3 = 2.0 * p2 - p1;
    if i + 2u < guide.y {
        p3 = node_place(guide.x + i + 2u);
    }
    let a = 0.5 * (p2 - p0);
    let b = p0 - 2.5 * p1 + 2.0 * p2 - 0.5 * p3;
    let c = 1.5 * (p1 - p2) + 0.5 * (p3 - p0);
    var point: CurvePoint;
    point.position = p1 + f * (a + f * (b + f * c));
    point.slope = (a + f * (2.0 * b + 3.0 * f * c)) * f32(guide.y - 1u);
    return point;
}

struct StrandPoint {
    position: vec3<f32>,
    slope: vec3<f32>,
    // How much each guide counts here, sum 1; all 0 where nothing is to be drawn.
    weights: vec3<f32>,
    // Where on the guides this is.
    share: f32,
}

fn strand_point(strand: DrawnStrand, t: f32) -> StrandPoint {
    var out: StrandPoint;
    let reach = min(strand.length, 1.0) - strand.phase;
    // What is longer than its guides is like them, but larger.
    let larger = max(strand.length, 1.0);
    out.share = strand.phase + t * reach;
    let near = guides[strand.guides.x];
    let near_root = node_place(near.x);
    let near_point = guide_point(near, out.share);

    var weights = vec3(strand.weights.x * node_shown(near.x), 0.0, 0.0);
    var root = strand.root + strand.weights.x * near_root;
    let near_way = near_point.position - guide_point(near, strand.phase).position;
    var way = weights.x * near_way;
    var slope = weights.x * near_point.slope;
    for (var i = 1; i < 3; i++) {
        if strand.weights[i] <= 0.0 {
            continue;
        }
        let guide = guides[strand.guides[i]];
        let guide_root = node_place(guide.x);
        let point = guide_point(guide, out.share);
        root += strand.weights[i] * guide_root;
        let guide_way = point.position - guide_point(guide, strand.phase).position;
        // Guides that went apart, or other ways, stop blending: the strand goes with its nearest.
        let apart = distance(point.position, near_point.position)
            / max(distance(guide_root, near_root), 1e-4);
        let together = dot(guide_way, near_way)
            / max(length(guide_way) * length(near_way), 1e-12);
        let weight = strand.weights[i] * node_shown(guide.x)
            * (1.0 - smoothstep(ribbon.parting, 1.5 * ribbon.parting, apart))
            * select(smoothstep(0.0, 0.6, together), 1.0, out.share <= strand.phase);
        weights[i] = weight;
        way += weight * guide_way;
        slope += weight * point.slope;
    }
    let sum = weights.x + weights.y + weights.z;
    if sum <= 0.0 {
        return out;
    }
    out.weights = weights / sum;
    // Toward the tip locks draw together around their guide, and strays leave them.
    let gather = (near_root - root) * ribbon.clump * (1.0 - strand.guide);
    let loose = root + way * (larger / sum) + gather * t + strand.stray * t * t;
    let loose_slope = slope * (reach * larger / sum) + gather + 2.0 * t * strand.stray;
    // Water draws a lock together around its guide, from the root on.
    let at = node_below(near, out.share);
    let low = node_moisture(near.x + u32(at.x));
    let rise = node_moisture(near.x + u32(at.x) + 1u) - low;
    let most = ribbon.wet_clump * (1.0 - strand.guide) * node_shown(near.x);
    let moisture = low + rise * at.y;
    let tight = most * moisture * t * (2.0 - t);
    let tighter = most * (rise * f32(near.y - 1u) * reach * t * (2.0 - t) + moisture * (2.0 - 2.0 * t));
    let inward = near_point.position - loose;
    out.position = loose + inward * tight;
    out.slope = mix(loose_slope, near_point.slope * reach, tight) + inward * tighter;
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
        let at = node_below(guide, point.share);
        let n = nodes[guide.x + u32(at.x)];
        let m = nodes[guide.x + u32(at.x) + 1u];
        state.rates += weight * mix(unpack4x8unorm(n.rates), unpack4x8unorm(m.rates), at.y);
        let own = mix(unpack2x16float(n.strain_moisture), unpack2x16float(m.strain_moisture), at.y);
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

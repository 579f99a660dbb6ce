// Rings: what all passes need to know of a strand at the places between its straight segments. Computed once a
// frame into a buffer, or by each vertex where the device cannot.
#define_import_path bevy_keratin::rings

#import bevy_keratin::strands::{ribbon, DrawnStrand, StrandState, strand_point, strand_state}

struct Ring {
    position: vec3<f32>,   // in the hair's frame (m)
    tangent: vec3<f32>,    // unit
    // From the middle of the lock that water draws together (m).
    outward: vec3<f32>,
    state: StrandState,
    shown: bool,
}

// 32 bytes.
struct PackedRing {
    position: vec3<f32>,
    tangent: u32,          // octahedral, as snorm16
    // As f16, low bits first: outward and moisture, then strain and 1, or 0 where nothing is to be drawn.
    outward_moisture: vec2<u32>,
    rates: u32,            // unorm8
    strain_shown: u32,
}

// Those that are drawn of each strand; the tip's is the last.
fn rings_of_strand() -> u32 {
    return (ribbon.segments + ribbon.ring_every - 1u) / ribbon.ring_every + 1u;
}

// At a share of a strand's length.
fn ring_of(strand: DrawnStrand, t: f32) -> Ring {
    var out: Ring;
    let point = strand_point(strand, t);
    if all(point.weights == vec3(0.0)) {
        return out;
    }
    let square = dot(point.slope, point.slope);
    out.position = point.position;
    out.tangent = select(vec3(0.0, 1.0, 0.0), point.slope * inverseSqrt(max(square, 1e-30)), square > 1e-20);
    out.outward = point.outward;
    out.state = strand_state(strand, point);
    out.shown = true;
    return out;
}

// Octahedral coordinates of a unit vector (Meyer et al. 2010).
fn folded(v: vec3<f32>) -> vec2<f32> {
    let flat = v.xy / (abs(v.x) + abs(v.y) + abs(v.z));
    let turned = (1.0 - abs(flat.yx)) * select(vec2(-1.0), vec2(1.0), flat >= vec2(0.0));
    return select(turned, flat, v.z >= 0.0);
}

fn unfolded(flat: vec2<f32>) -> vec3<f32> {
    let z = 1.0 - abs(flat.x) - abs(flat.y);
    let below = max(-z, 0.0);
    return normalize(vec3(flat - below * select(vec2(-1.0), vec2(1.0), flat >= vec2(0.0)), z));
}

fn packed(ring: Ring) -> PackedRing {
    var out: PackedRing;
    if !ring.shown {
        return out;
    }
    out.position = ring.position;
    out.tangent = pack2x16snorm(folded(ring.tangent));
    out.outward_moisture = vec2(pack2x16float(ring.outward.xy),
        pack2x16float(vec2(ring.outward.z, ring.state.moisture)));
    out.rates = pack4x8unorm(ring.state.rates);
    out.strain_shown = pack2x16float(vec2(min(ring.state.strain, 65504.0), 1.0));
    return out;
}

fn unpacked(ring: PackedRing) -> Ring {
    var out: Ring;
    let last = unpack2x16float(ring.strain_shown);
    let middle = unpack2x16float(ring.outward_moisture.y);
    out.shown = last.y > 0.0;
    out.position = ring.position;
    out.tangent = unfolded(unpack2x16snorm(ring.tangent));
    out.outward = vec3(unpack2x16float(ring.outward_moisture.x), middle.x);
    out.state.rates = unpack4x8unorm(ring.rates);
    out.state.strain = last.x;
    out.state.moisture = middle.y;
    return out;
}

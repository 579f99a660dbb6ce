// Camera-facing ribbons by vertex pulling: what all passes share. Depth of the prepass and of the
// forward pass must be equal to the last bit, so both do exactly this and mark positions invariant.
#define_import_path bevy_keratin::ribbon

#import bevy_pbr::mesh_functions
#import bevy_pbr::mesh_view_bindings::view
#import bevy_keratin::strands::{
    ribbon, strands, frame, ring_share, strand_alpha, strand_cut, strand_width, StrandState, DrawnStrand,
    VIEW_GUIDES,
}
#ifdef HAIR_EXPANDED
#import bevy_keratin::strands::rank_of
#import bevy_keratin::rings::{PackedRing, Ring, unpacked, rings_of_strand}
#else
#import bevy_keratin::rings::{Ring, ring_of}
#endif
#ifdef MOTION_VECTOR_PREPASS
#import bevy_keratin::strands::past_strand_position
#endif

#ifdef HAIR_EXPANDED
@group(#{MATERIAL_BIND_GROUP}) @binding(6) var<storage, read> rings: array<PackedRing>;

fn ring_at(index: u32, ring: u32) -> Ring {
    let rank = rank_of(index);
    if rank >= ribbon.ring_ranks {
        // The mesh of another level, for the frame until its buffer is here.
        return Ring();
    }
    let in_strand = (ring + ribbon.ring_every - 1u) / ribbon.ring_every;
    return unpacked(rings[rank * rings_of_strand() + in_strand]);
}
#else
fn ring_at(index: u32, ring: u32) -> Ring {
    return ring_of(strands[index], ring_share(ring));
}
#endif

// Up to where cut hair keeps its width.
const BLUNT: f32 = 0.9;

// Places are ways from the eye, along the world's axes: ten kilometres from the origin, places in the world are rounded
// to more than a strand's width.
struct RibbonVertex {
    from_eye: vec3<f32>,
    // The point of the strand beside which this is.
    center: vec3<f32>,
    // And that in the hair's frame.
    local: vec3<f32>,
    tangent: vec3<f32>,
    // From the middle of the lock that water draws together.
    outward: vec3<f32>,
    // Of the hair's frame to the world.
    scale: f32,
    // 0 root ... 1 tip, and of the strand before it was cut.
    along: f32,
    whole: f32,
    seed: u32,
    state: StrandState,
    // How much of what is drawn the strand covers, and how far it has come out of the scalp: 1 is all.
    share: f32,
    grown: f32,
    shown: bool,
}

// The pixel size (m) where clip.w is `w`: right for perspective and orthographic cameras.
fn pixel_size(w: f32) -> f32 {
    return 2.0 * abs(w) / (abs(view.clip_from_view[1][1]) * max(view.viewport.w, 1.0));
}

fn toward_eye(from_eye: vec3<f32>) -> vec3<f32> {
    if view.clip_from_view[3][3] == 1.0 {
        return normalize(view.world_from_view[2].xyz);
    }
    return normalize(-from_eye);
}

fn way_from_eye(world_from_local: mat4x4<f32>, place: vec3<f32>) -> vec3<f32> {
    let m = world_from_local;
    return mat3x3(m[0].xyz, m[1].xyz, m[2].xyz) * place + (m[3].xyz - view.world_position);
}

fn in_clip(from_eye: vec3<f32>) -> vec4<f32> {
    let m = view.view_from_world;
    return view.clip_from_view * vec4(mat3x3(m[0].xyz, m[1].xyz, m[2].xyz) * from_eye, 1.0);
}

fn safe_normalize(v: vec3<f32>, otherwise: vec3<f32>) -> vec3<f32> {
    let square = dot(v, v);
    return select(otherwise, v * inverseSqrt(max(square, 1e-30)), square > 1e-20);
}

// What stands for the surface that many strands make up: across the strand, to the eye.
fn facing_normal(tangent: vec3<f32>, eye: vec3<f32>) -> vec3<f32> {
    return safe_normalize(eye - tangent * dot(eye, tangent), eye);
}

// `corner` counts through all strands: two for each ring of each strand.
fn ribbon_vertex(corner: u32, instance: u32) -> RibbonVertex {
    var out: RibbonVertex;
    let per_strand = 2u * (ribbon.segments + 1u);
    let index = corner / per_strand;
    if index >= ribbon.strands || (ribbon.view == VIEW_GUIDES && index >= ribbon.guides) {
        return out;
    }
    let alpha = strand_alpha(index);
    if alpha <= 0.0 {
        return out;
    }
    let strand = strands[index];
    let in_strand = corner - index * per_strand;
    out.along = ring_share(in_strand / 2u);
    let side = f32(in_strand & 1u) - 0.5;
    let ring = ring_at(index, in_strand / 2u);
    if !ring.shown {
        return out;
    }
    out.shown = true;
    out.seed = strand.seed;
    out.state = ring.state;

    let world = mesh_functions::get_world_from_local(instance);
    let linear = mat3x3(world[0].xyz, world[1].xyz, world[2].xyz);
    let scale = pow(abs(determinant(linear)), 1.0 / 3.0);
    out.scale = scale;
    let center = way_from_eye(world, ring.position);
    out.center = center;
    out.local = ring.position;
    out.tangent = safe_normalize(linear * ring.tangent, vec3(0.0, 1.0, 0.0));
    out.outward = linear * ring.outward;
    let eye = toward_eye(center);

    out.whole = out.along * strand_cut(strand);
    out.grown = out.whole * strand.size / max(ribbon.root_fade, 1e-9);
    let width = scale * ribbon.width * frame.wider * strand_width(strand) * mix(1.0, ribbon.taper, smoothstep(BLUNT, 1.0, out.along));
    // Of a shadow map, a texel.
    let drawn = max(width, pixel_size(in_clip(center).w));
    out.share = alpha * width / max(drawn, 1e-9);
    let across = safe_normalize(cross(out.tangent, eye), normalize(view.world_from_view[0].xyz));
    out.from_eye = center + across * (side * drawn);
    return out;
}

#ifdef MOTION_VECTOR_PREPASS
// Where a vertex was in the frame before, from where the eye is now. The side it faced then is taken for that it faces now.
fn place_before(vertex: RibbonVertex, corner: u32, instance: u32) -> vec3<f32> {
    let strand = strands[corner / (2u * (ribbon.segments + 1u))];
    let point = past_strand_position(strand, vertex.along);
    let world = mesh_functions::get_previous_world_from_local(instance);
    return way_from_eye(world, point) + (vertex.from_eye - vertex.center);
}
#endif

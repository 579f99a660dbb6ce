// Vectors, quaternions (Hamilton's, x y z w) and 3x3 blocks. Rust twins: src/base/lanes/algebra.rs,
// src/solver/rod/direct/{frames,matrix}.rs.

fn normalized(q: vec4<f32>) -> vec4<f32> {
    return q * (1.0 / sqrt(dot(q, q)));
}

// A step toward the unit quaternion, without a root.
fn renormalized(q: vec4<f32>) -> vec4<f32> {
    return q * (2.0 / (1.0 + dot(q, q)));
}

fn conjugate(q: vec4<f32>) -> vec4<f32> {
    return vec4(-q.xyz, q.w);
}

fn product(a: vec4<f32>, b: vec4<f32>) -> vec4<f32> {
    let v = fma(b.xyz, vec3(a.w), fma(a.xyz, vec3(b.w), cross(a.xyz, b.xyz)));
    return vec4(v, fma(a.w, b.w, -dot(a.xyz, b.xyz)));
}

// q (0, v).
fn times_vector(q: vec4<f32>, v: vec3<f32>) -> vec4<f32> {
    return vec4(fma(v, vec3(q.w), cross(q.xyz, v)), -dot(q.xyz, v));
}

// (0, v) q.
fn after_vector(q: vec4<f32>, v: vec3<f32>) -> vec4<f32> {
    return vec4(fma(v, vec3(q.w), cross(v, q.xyz)), -dot(v, q.xyz));
}

// R(q) v.
fn rotated(q: vec4<f32>, v: vec3<f32>) -> vec3<f32> {
    let t = 2.0 * cross(q.xyz, v);
    return v + q.w * t + cross(q.xyz, t);
}

// R(q) e3.
fn tangent(q: vec4<f32>) -> vec3<f32> {
    return vec3(
        2.0 * fma(q.x, q.z, q.w * q.y),
        2.0 * fma(q.y, q.z, -(q.w * q.x)),
        1.0 - 2.0 * fma(q.x, q.x, q.y * q.y),
    );
}

// R(q) e1.
fn first_axis(q: vec4<f32>) -> vec3<f32> {
    return vec3(
        1.0 - 2.0 * fma(q.y, q.y, q.z * q.z),
        2.0 * fma(q.x, q.y, q.w * q.z),
        2.0 * fma(q.x, q.z, -(q.w * q.y)),
    );
}

struct TransportedFrame {
    q: vec4<f32>,
    turn: vec3<f32>,
}

// Turns q the shortest way so that its tangent is along e, of length len; and twice the vector part of
// the turn.
fn parallel_transport(q: vec4<f32>, e: vec3<f32>, len: f32) -> TransportedFrame {
    let d = tangent(q);
    let cosine = len + dot(d, e);
    let scale = 1.0 / sqrt(max(2.0 * len * cosine, 1e-30));
    var turn = vec4(cross(d, e) * scale, cosine * scale);
    if cosine < len * 1e-6 {
        turn = vec4(first_axis(q), 0.0);
    }
    let turned = product(turn, q);
    let length = fma(-0.5, dot(turned, turned), 1.5);
    return TransportedFrame(turned * length, turn.xyz + turn.xyz);
}

// The moment of a joint on the edge behind it: 2K s Im(q (before Q0)‾).
fn moment(before: vec4<f32>, q: vec4<f32>, rest: vec4<f32>, k: f32, torsion: f32) -> vec3<f32> {
    let apart = product(q, conjugate(product(before, rest)));
    let even = apart.xyz * select(2.0 * k, -2.0 * k, apart.w < 0.0);
    if torsion == 1.0 {
        return even;
    }
    let joint = twist_of(before, q, rest);
    let share = sqrt(joint.w / joint.z);
    let nearer = rest * select(1.0, -1.0, apart.w < 0.0);
    let along = fma(vec2(share), joint.xy, -nearer.wz);
    let both = fma(vec4(along.y), turned_by_e3(before), before * along.x);
    return fma(product(both, conjugate(q)).xyz, vec3(2.0 * k * (torsion - 1.0)), even);
}

// Of a joint's rotation w and z, the sum of their squares, and the same of its rest shape.
fn twist_of(before: vec4<f32>, q: vec4<f32>, rest: vec4<f32>) -> vec4<f32> {
    let w = dot(before, q);
    let z = dot(turned_by_e3(before), q);
    return vec4(w, z, max(fma(w, w, z * z), 1e-12), max(fma(rest.w, rest.w, rest.z * rest.z), 1e-12));
}

// Second derivatives of a joint's energy, over K, by the rotations of its edges about their tangents: on the
// diagonal and off it. At rest exact, elsewhere what bounds them.
fn twist_stiffness(before: vec4<f32>, q: vec4<f32>, rest: vec4<f32>, torsion: f32) -> vec2<f32> {
    let joint = twist_of(before, q, rest);
    let twist = sqrt(joint.z * joint.w) * torsion;
    let bend = sqrt(max(1.0 - joint.z, 0.0) * max(1.0 - joint.w, 0.0));
    return vec2(bend + twist, bend - twist);
}

// q e3.
fn turned_by_e3(q: vec4<f32>) -> vec4<f32> {
    return vec4(q.y, -q.x, q.w, -q.z);
}

// A symmetric matrix: xx yy zz, and yx zx zy.
struct Symmetric {
    d: vec3<f32>,
    o: vec3<f32>,
}

// A matrix by its rows.
struct Matrix {
    x: vec3<f32>,
    y: vec3<f32>,
    z: vec3<f32>,
}

const NO_SYMMETRIC = Symmetric(vec3(0.0), vec3(0.0));
const NO_MATRIX = Matrix(vec3(0.0), vec3(0.0), vec3(0.0));

// along v vᵀ + all I.
fn uniaxial(v: vec3<f32>, along: f32, all: f32) -> Symmetric {
    let s = v * along;
    return Symmetric(fma(s, v, vec3(all)), vec3(s.y * v.x, s.z * v.x, s.z * v.y));
}

fn plus_symmetric(a: Symmetric, b: Symmetric) -> Symmetric {
    return Symmetric(a.d + b.d, a.o + b.o);
}

// s − m − mᵀ.
fn minus_both(s: Symmetric, m: Matrix) -> Symmetric {
    return Symmetric(
        vec3(s.d.x - (m.x.x + m.x.x), s.d.y - (m.y.y + m.y.y), s.d.z - (m.z.z + m.z.z)),
        vec3(s.o.x - (m.y.x + m.x.y), s.o.y - (m.z.x + m.x.z), s.o.z - (m.z.y + m.y.z)),
    );
}

// start − a · b.
fn dot_from(start: f32, a: vec3<f32>, b: vec3<f32>) -> f32 {
    return fma(-a.x, b.x, fma(-a.y, b.y, fma(-a.z, b.z, start)));
}

fn row_from(start: vec3<f32>, a: vec3<f32>, b: Matrix) -> vec3<f32> {
    return vec3(dot_from(start.x, a, b.x), dot_from(start.y, a, b.y), dot_from(start.z, a, b.z));
}

// s − a bᵀ, which is symmetric.
fn minus_product(s: Symmetric, a: Matrix, b: Matrix) -> Symmetric {
    return Symmetric(
        vec3(dot_from(s.d.x, a.x, b.x), dot_from(s.d.y, a.y, b.y), dot_from(s.d.z, a.z, b.z)),
        vec3(dot_from(s.o.x, a.y, b.x), dot_from(s.o.y, a.z, b.x), dot_from(s.o.z, a.z, b.y)),
    );
}

// scale (a bᵀ − (a·b) I).
fn coupling_of(a: vec3<f32>, b: vec3<f32>, scalar: f32, scale: f32) -> Matrix {
    let s = a * scale;
    let d = scalar * scale;
    return Matrix(
        vec3(fma(s.x, b.x, -d), s.x * b.y, s.x * b.z),
        vec3(s.y * b.x, fma(s.y, b.y, -d), s.y * b.z),
        vec3(s.z * b.x, s.z * b.y, fma(s.z, b.z, -d)),
    );
}

// m + v×.
fn plus_cross(m: Matrix, v: vec3<f32>) -> Matrix {
    return Matrix(
        vec3(m.x.x, m.x.y - v.z, m.x.z + v.y),
        vec3(m.y.x + v.z, m.y.y, m.y.z - v.x),
        vec3(m.z.x - v.y, m.z.y + v.x, m.z.z),
    );
}

fn plus_matrix(a: Matrix, b: Matrix) -> Matrix {
    return Matrix(a.x + b.x, a.y + b.y, a.z + b.z);
}

fn minus_symmetric(m: Matrix, s: Symmetric) -> Matrix {
    return Matrix(
        vec3(m.x.x - s.d.x, m.x.y - s.o.x, m.x.z - s.o.y),
        vec3(m.y.x - s.o.x, m.y.y - s.d.y, m.y.z - s.o.z),
        vec3(m.z.x - s.o.y, m.z.y - s.o.z, m.z.z - s.d.z),
    );
}

// start − m v.
fn times_from(m: Matrix, v: vec3<f32>, start: vec3<f32>) -> vec3<f32> {
    return vec3(dot_from(start.x, m.x, v), dot_from(start.y, m.y, v), dot_from(start.z, m.z, v));
}

// start − mᵀ v.
fn transposed_from(m: Matrix, v: vec3<f32>, start: vec3<f32>) -> vec3<f32> {
    return fma(m.z, vec3(-v.z), fma(m.y, vec3(-v.y), fma(m.x, vec3(-v.x), start)));
}

// A = L D Lᵀ: yx, zx, zy of L and the inverses of D.
struct Pivot {
    l: vec3<f32>,
    inverse: vec3<f32>,
}

// Pivots are at least `least`; where `held` nothing moves.
fn pivot_of(a: Symmetric, least: f32, held: bool) -> Pivot {
    let x = 1.0 / max(a.d.x, least);
    let yx = a.o.x * x;
    let zx = a.o.y * x;
    let y = 1.0 / max(fma(-yx, a.o.x, a.d.y), least);
    let below = fma(-zx, a.o.x, a.o.z);
    let zy = below * y;
    let z = 1.0 / max(fma(-zy, below, fma(-zx, a.o.y, a.d.z)), least);
    return Pivot(vec3(yx, zx, zy), select(vec3(x, y, z), vec3(0.0), held));
}

// L⁻¹ v.
fn forward(p: Pivot, v: vec3<f32>) -> vec3<f32> {
    let y = fma(-p.l.x, v.x, v.y);
    return vec3(v.x, y, fma(-p.l.z, y, fma(-p.l.y, v.x, v.z)));
}

// m L⁻ᵀ.
fn unscaled(p: Pivot, m: Matrix) -> Matrix {
    return Matrix(forward(p, m.x), forward(p, m.y), forward(p, m.z));
}

// m D⁻¹.
fn scaled(p: Pivot, m: Matrix) -> Matrix {
    return Matrix(m.x * p.inverse, m.y * p.inverse, m.z * p.inverse);
}

// Whether x is no finite number. Comparisons may be folded away, bits are not.
fn is_broken(x: f32) -> bool {
    return (bitcast<u32>(x) & 0x7f800000u) == 0x7f800000u;
}

fn is_broken3(v: vec3<f32>) -> bool {
    return is_broken(v.x) || is_broken(v.y) || is_broken(v.z);
}

fn is_broken4(v: vec4<f32>) -> bool {
    return is_broken3(v.xyz) || is_broken(v.w);
}

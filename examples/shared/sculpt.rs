//! The training head as a distance to its surface: a smooth union of simple solids.
//!
//! It lies on its back: +X to the crown, +Y to the face. Both halves are alike.

use crate::scenes::HEAD_RADIUS;
use bevy::math::Vec3;

/// Where the bust is cut off (m).
pub const BUST_END: f32 = -0.375;

/// Blends two distances over a width of `k`.
pub fn join(a: f32, b: f32, k: f32) -> f32 {
    let h = (k - (a - b).abs()).max(0.0) / k;
    a.min(b) - 0.25 * h * h * k
}

/// Takes `b` away from `a`, with an edge of width `k`.
pub fn carve(a: f32, b: f32, k: f32) -> f32 {
    -join(-a, b, k)
}

fn ball(p: Vec3, centre: Vec3, radius: f32) -> f32 {
    p.distance(centre) - radius
}

pub fn ellipsoid(p: Vec3, centre: Vec3, radii: Vec3) -> f32 {
    let q = p - centre;
    let (near, far) = ((q / radii).length(), (q / (radii * radii)).length());
    near * (near - 1.0) / far.max(1e-6)
}

/// A capsule whose radius goes from `ra` at `a` to `rb` at `b`.
pub fn limb(p: Vec3, a: Vec3, b: Vec3, ra: f32, rb: f32) -> f32 {
    let way = b - a;
    let t = ((p - a).dot(way) / way.length_squared()).clamp(0.0, 1.0);
    p.distance(a + way * t) - (ra + (rb - ra) * t)
}

/// A capsule along the parabola from `a` by `b` to `c`, `b` being its middle.
fn bow(p: Vec3, [a, b, c]: [Vec3; 3], ra: f32, rb: f32, rc: f32) -> f32 {
    const PIECES: usize = 6;
    let at = |t: f32| {
        let lift = 2.0 * b - 0.5 * (a + c);
        a * (1.0 - t) * (1.0 - t) + lift * (2.0 * t * (1.0 - t)) + c * t * t
    };
    let wide =
        |t: f32| if t < 0.5 { ra + (rb - ra) * 2.0 * t } else { rb + (rc - rb) * (2.0 * t - 1.0) };
    (0..PIECES).fold(f32::MAX, |least, i| {
        let (t, u) = (i as f32 / PIECES as f32, (i + 1) as f32 / PIECES as f32);
        least.min(limb(p, at(t), at(u), wide(t), wide(u)))
    })
}

pub fn block(p: Vec3, centre: Vec3, half: Vec3, round: f32) -> f32 {
    let q = (p - centre).abs() - half + round;
    q.max(Vec3::ZERO).length() + q.max_element().min(0.0) - round
}

/// 1 at 0, falling to 0 at `width`.
fn bump(x: f32, width: f32) -> f32 {
    let t = (1.0 - (x / width).powi(2)).max(0.0);
    t * t
}

const fn v(x: f32, y: f32, z: f32) -> Vec3 {
    Vec3::new(x, y, z)
}

/// Distance to the surface of head, neck and shoulders (m), negative inside.
pub fn head(p: Vec3) -> f32 {
    let p = v(p.x, p.y, p.z.abs());
    let mut d = face(p);
    if p.x < 0.02 {
        d = join(d, bust(p), 0.03);
    }
    carve(d, p.x - BUST_END, 0.004)
}

/// The same with a rounded fold in the middle, so that what is wide does not meet itself in an edge.
fn folded(p: Vec3) -> Vec3 {
    v(p.x, p.y, p.z.hypot(0.005))
}

/// Neck, shoulders, chest.
fn bust(p: Vec3) -> f32 {
    let p = folded(p);
    let mut d = limb(p, v(-0.05, -0.016, 0.0), v(-0.2, -0.034, 0.0), 0.046, 0.051);
    // From the shoulders up to the neck, then the shoulders.
    d = join(d, limb(p, v(-0.15, -0.045, 0.03), v(-0.215, -0.045, 0.115), 0.026, 0.036), 0.05);
    d = join(d, limb(p, v(-0.245, -0.037, 0.0), v(-0.262, -0.04, 0.14), 0.05, 0.054), 0.06);
    d = join(d, ellipsoid(p, v(-0.31, -0.022, 0.0), v(0.09, 0.072, 0.15)), 0.05);
    // The muscle from behind the ear to the breastbone, and the hollow between both.
    let muscle = bow(
        p,
        [v(-0.045, -0.022, 0.052), v(-0.125, 0.010, 0.040), v(-0.216, 0.008, 0.012)],
        0.006,
        0.008,
        0.003,
    );
    d = join(d, muscle, 0.026);
    d = carve(d, ball(p, v(-0.211, 0.034, 0.0), 0.010), 0.026);
    // Collar bones.
    let bone = bow(
        p,
        [v(-0.224, 0.019, 0.014), v(-0.219, 0.017, 0.066), v(-0.205, -0.012, 0.132)],
        0.006,
        0.0055,
        0.006,
    );
    join(d, bone, 0.026)
}

/// Distance to the surface of the head without its neck (m), negative inside.
pub fn face(p: Vec3) -> f32 {
    let p = v(p.x, p.y, p.z.abs());
    let skull = ellipsoid(p, v(0.018, 0.0, 0.0), v(0.1, 0.095, 0.077));
    // Flat where the hair's roots are, so that they all sit in the scalp.
    let back = block(p, v(0.0, 0.026 - HEAD_RADIUS, 0.0), v(0.036, 0.026, 0.058), 0.02);
    let mut d = join(skull, back, 0.07);
    let front = ellipsoid(p, v(-0.03, 0.038, 0.0), v(0.07, 0.05, 0.055));
    let jaw = ellipsoid(p, v(-0.066, 0.030, 0.0), v(0.037, 0.050, 0.043));
    d = join(d, join(front, jaw, 0.04), 0.04);
    if p.x < 0.06 && p.y > -0.06 {
        d = features(d, p);
    }
    if p.z > 0.05 && p.x.abs() < 0.08 {
        d = join(d, ear(p), 0.006);
    }
    d
}

fn features(mut d: f32, p: Vec3) -> f32 {
    let wide = folded(p);
    // The jaw's corner and edge, the chin.
    d = join(d, limb(wide, v(-0.058, 0.008, 0.047), v(-0.098, 0.062, 0.013), 0.009, 0.008), 0.034);
    d = join(d, ellipsoid(p, v(-0.097, 0.075, 0.0), v(0.013, 0.0145, 0.016)), 0.026);
    // Cheek bones.
    d = join(d, limb(wide, v(-0.028, 0.067, 0.041), v(-0.014, 0.018, 0.062), 0.011, 0.009), 0.03);
    if p.y < 0.04 {
        return d;
    }
    // Brow, sockets.
    d = join(d, limb(wide, v(0.0145, 0.0870, 0.004), v(0.017, 0.071, 0.047), 0.0060, 0.005), 0.022);
    d = carve(d, ellipsoid(p, v(-0.002, 0.101, 0.031), v(0.0125, 0.0155, 0.019)), 0.022);
    d = carve(d, ball(p, v(0.002, 0.1025, 0.0155), 0.0085), 0.014);
    // The muzzle under the lips.
    d = join(d, ellipsoid(p, v(-0.064, 0.062, 0.0), v(0.024, 0.0325, 0.029)), 0.024);
    d = eye(d, p);
    d = nose(d, p);
    mouth(d, p)
}

/// Where the lids meet: how high (m), `aside` from the middle of the face.
pub fn lash_line(aside: f32) -> f32 {
    let off = aside - 0.031;
    -0.0105 + 26.0 * off * off + 0.06 * off
}

/// The middle of the eyeball, and its radius with the lower lid (m).
pub const EYE: Vec3 = v(-0.0035, 0.0735, 0.031);
pub const LID: f32 = 0.0132;

/// A closed eye: the upper lid lies over the lower one.
fn eye(d: f32, p: Vec3) -> f32 {
    let off = p.distance(EYE);
    if off > 0.03 {
        return d;
    }
    let under = lash_line(p.z) - p.x;
    let lower = off - LID;
    let upper = (off - (LID + 0.0016)).max(under);
    let mut d = join(d, lower, 0.0075);
    // The upper lid ends in its fold.
    let fold = bump(p.x - 0.0035 + 14.0 * (p.z - 0.031).powi(2), 0.0018) * bump(p.z - 0.031, 0.017);
    d = join(d, upper, 0.0012);
    d + 0.0013 * fold
}

fn nose(mut d: f32, p: Vec3) -> f32 {
    if p.z > 0.04 || p.x < -0.075 {
        return d;
    }
    let bridge = bow(
        p,
        [v(0.008, 0.0885, 0.0), v(-0.015, 0.0985, 0.0), v(-0.0365, 0.1095, 0.0)],
        0.0055,
        0.0062,
        0.0068,
    );
    d = join(d, bridge, 0.013);
    let body = limb(p, v(-0.010, 0.087, 0.0), v(-0.0355, 0.0985, 0.0), 0.0062, 0.0095);
    d = join(d, body, 0.014);
    // Tip, wings, what is between the nostrils.
    d = join(d, ball(p, v(-0.0375, 0.1085, 0.0), 0.0078), 0.010);
    d = join(d, ellipsoid(p, v(-0.0405, 0.0985, 0.0112), v(0.0064, 0.0085, 0.0048)), 0.008);
    d = join(d, limb(p, v(-0.0425, 0.1085, 0.0), v(-0.0475, 0.0955, 0.0), 0.0034, 0.0036), 0.005);
    let nostril = ellipsoid(p, v(-0.0474, 0.1010, 0.0064), v(0.0030, 0.0052, 0.0025));
    d = carve(d, nostril, 0.0022);
    // The crease around the wing.
    let crease = limb(p, v(-0.0365, 0.0935, 0.0175), v(-0.0475, 0.0920, 0.0160), 0.0008, 0.0008);
    carve(d, crease, 0.003)
}

fn mouth(mut d: f32, p: Vec3) -> f32 {
    if p.x > -0.04 || p.z > 0.045 {
        return d;
    }
    // The groove between nose and lip.
    d = carve(d, limb(p, v(-0.0505, 0.1050, 0.0), v(-0.0585, 0.1060, 0.0), 0.0021, 0.0024), 0.004);
    let upper = bow(
        p,
        [v(-0.0632, 0.0975, 0.0), v(-0.0634, 0.0945, 0.0110), v(-0.0674, 0.0800, 0.0250)],
        0.0046,
        0.0042,
        0.0010,
    );
    let peak = limb(p, v(-0.0594, 0.0990, 0.0045), v(-0.0635, 0.0925, 0.0160), 0.0019, 0.0012);
    d = join(d, join(upper, peak, 0.004), 0.0042);
    let lower = bow(
        p,
        [v(-0.0724, 0.0955, 0.0), v(-0.0716, 0.0930, 0.0100), v(-0.0678, 0.0790, 0.0245)],
        0.0064,
        0.0054,
        0.0010,
    );
    d = join(d, lower, 0.0046);
    // Where the lips meet; the hollow under them.
    let parting = bow(
        p,
        [v(-0.0677, 0.1022, 0.0), v(-0.0668, 0.0985, 0.0125), v(-0.0676, 0.0860, 0.0240)],
        0.0005,
        0.0005,
        0.0001,
    );
    d = carve(d, parting, 0.0018);
    carve(d, limb(p, v(-0.0835, 0.1070, 0.0), v(-0.0825, 0.1040, 0.010), 0.0060, 0.004), 0.012)
}

/// From the ear's middle: up along it, to the front, and out of the head.
fn at_ear(p: Vec3) -> Vec3 {
    let q = p - v(-0.014, -0.006, 0.0755);
    // Tilted back by 17°, and its rear edge stands off the head.
    let (sin, cos) = (0.292, 0.956);
    let (up, front) = (q.x * cos - q.y * sin, q.x * sin + q.y * cos);
    let (sin, cos) = (0.36, 0.933);
    v(up, front * cos + q.z * sin, q.z * cos - front * sin)
}

fn ear(p: Vec3) -> f32 {
    let q = at_ear(p);
    let mut d = ellipsoid(q, v(0.008, -0.001, -0.001), v(0.0235, 0.0175, 0.0062));
    d = join(d, ellipsoid(q, v(-0.021, 0.0035, -0.001), v(0.0115, 0.0095, 0.0050)), 0.012);
    // Its root on the skull.
    d = join(d, ellipsoid(q, v(0.0, 0.005, -0.009), v(0.021, 0.010, 0.010)), 0.010);
    // The rim runs along the edge, from above the canal over the top down to the lobe; inside it a groove.
    let edge = ellipsoid(v(q.x, q.y, 0.0), v(0.008, -0.001, 0.0), v(0.0235, 0.0175, 1.0));
    let ring = |within: f32, out: f32, radius: f32| (edge + within).hypot(q.z - out) - radius;
    let end = 0.46 * q.y - 0.005 - 0.9 * q.x;
    let rim = ring(0.0018, 0.0036, 0.0026).max(end);
    let groove = ring(0.0060, 0.0072, 0.0022).max(end + 0.009);
    d = carve(d, groove, 0.003);
    let bowl = ellipsoid(q, v(-0.002, 0.004, 0.0075), v(0.0120, 0.0085, 0.0080));
    d = carve(d, bowl, 0.004);
    d = join(d, rim, 0.003);
    let ridge = bow(
        q,
        [v(0.017, 0.002, 0.0035), v(0.003, -0.0072, 0.0040), v(-0.0125, -0.0035, 0.0035)],
        0.0021,
        0.0022,
        0.0018,
    );
    d = join(d, ridge, 0.004);
    let tragus = ellipsoid(q, v(-0.004, 0.0128, 0.0022), v(0.0052, 0.0030, 0.0040));
    join(d, tragus, 0.004)
}

/// The unit direction in which a distance grows, from points `step` (m) around.
pub fn gradient(distance: &impl Fn(Vec3) -> f32, p: Vec3, step: f32) -> Vec3 {
    // The corners of a tetrahedron.
    const WAYS: [Vec3; 4] =
        [v(1.0, -1.0, -1.0), v(-1.0, -1.0, 1.0), v(-1.0, 1.0, -1.0), v(1.0, 1.0, 1.0)];
    let sum = WAYS.iter().fold(Vec3::ZERO, |sum, way| sum + *way * distance(p + *way * step));
    sum.normalize_or(Vec3::Y)
}

/// The unit direction in which a distance grows.
pub fn normal(distance: &impl Fn(Vec3) -> f32, p: Vec3) -> Vec3 {
    gradient(distance, p, 3e-4)
}

/// Resin, with lips and the lids' edges a little darker.
pub fn skin(p: Vec3) -> Vec3 {
    let q = v(p.x, p.y, p.z.abs());
    let mut color = v(0.58, 0.46, 0.375);
    if q.y < 0.06 {
        return color;
    }
    let lip = if q.x > -0.0672 {
        bow(
            q,
            [v(-0.0622, 0.0995, 0.0), v(-0.0635, 0.0960, 0.0120), v(-0.0674, 0.0865, 0.0235)],
            0.0042,
            0.0042,
            0.0012,
        )
    } else {
        bow(
            q,
            [v(-0.0718, 0.0990, 0.0), v(-0.0712, 0.0960, 0.0100), v(-0.0678, 0.0865, 0.0225)],
            0.0062,
            0.0054,
            0.0012,
        )
    };
    let red = (0.5 - lip / 0.0016).clamp(0.0, 1.0);
    color = color.lerp(v(0.50, 0.28, 0.235), 0.75 * red);
    let (aside, up) = (q.z - 0.031, q.x - lash_line(q.z));
    let edge = bump(up, 0.0011) * bump(aside, 0.0165);
    color.lerp(v(0.16, 0.10, 0.08), 0.8 * edge)
}

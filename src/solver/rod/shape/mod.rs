//! Solids in a frame of their own: boxes, ellipsoids, convex hulls and baked distances.

#[cfg(test)]
pub(crate) mod fixture;
mod grid;
mod hull;

pub use {grid::DistanceGrid, hull::ConvexHull};

use crate::base::lanes::{Real, V3, inlined, splat};
use fearless_simd::{Simd, f32x16, mask32x16, prelude::*};
use glam::{Mat3, Vec3};

/// A solid around the origin of its frame, along its axes, in its unit.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// A box with rounded edges.
    Cuboid {
        /// Half its size, edges included.
        half: Vec3,
        /// The radius of its edges: at most the smallest of `half`.
        rounding: f32,
    },
    /// An ellipsoid.
    Ellipsoid {
        /// Half its axes.
        radii: Vec3,
    },
    /// A convex hull.
    Hull(ConvexHull),
    /// Baked distances.
    Grid(DistanceGrid),
    /// A hat: an ellipsoid above a plane across Y.
    Hat {
        /// Half the axes of the ellipsoid.
        radii: Vec3,
        /// Where the plane is.
        rim: f32,
        /// Whether it holds nodes under it: all that is outside of the ellipsoid and above an endless brim is solid. Else
        /// what is inside of the hat is.
        holds: bool,
    },
}

/// How far a hat that holds nodes under it reaches around, in times its size.
const ENDLESS: f32 = 100.0;
/// How steeply the brim of a hat falls: under a level one hair that cannot get below it would be caught outside.
const BRIM: f32 = 0.35;

/// A [`Shape`] in the frame of the nodes.
#[derive(Clone, Debug, PartialEq)]
pub struct Placed {
    /// What it is.
    pub shape: Shape,
    /// Where the origin of its frame is (m).
    pub center: Vec3,
    /// The unit axes of its frame.
    pub axes: Mat3,
    /// Length of the unit of its frame (m).
    pub scale: f32,
}

impl Shape {
    /// Its bounding box: centre and half size.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        match self {
            Self::Cuboid { half, .. } => (Vec3::ZERO, *half),
            Self::Ellipsoid { radii } => (Vec3::ZERO, *radii),
            Self::Hull(hull) => hull.bounds(),
            Self::Grid(grid) => grid.bounds(),
            Self::Hat { radii, holds: true, .. } => {
                (Vec3::ZERO, Vec3::splat(ENDLESS * radii.max_element()))
            }
            Self::Hat { radii, rim, holds: false } => {
                let low = rim.clamp(-radii.y, radii.y);
                (0.5 * Vec3::Y * (radii.y + low), radii.with_y(0.5 * (radii.y - low)))
            }
        }
    }

    /// An upper bound of its extent from the origin of its frame.
    pub fn reach(&self) -> f32 {
        match self {
            Self::Cuboid { half, .. } => half.length(),
            Self::Ellipsoid { radii } | Self::Hat { radii, .. } => radii.max_element(),
            Self::Hull(hull) => hull.reach(),
            Self::Grid(grid) => grid.reach(),
        }
    }

    /// About half of its smallest thickness.
    fn thickness(&self) -> f32 {
        match self {
            Self::Cuboid { half, .. } => half.min_element(),
            Self::Ellipsoid { radii } | Self::Hat { radii, .. } => radii.min_element(),
            Self::Hull(hull) => hull.thickness(),
            Self::Grid(grid) => grid.thickness(),
        }
    }

    /// The difference to another shape, in its unit; infinite between different kinds.
    pub(crate) fn change(&self, other: &Self) -> f32 {
        match (self, other) {
            (Self::Cuboid { half: a, rounding: r }, Self::Cuboid { half: b, rounding: s }) => {
                a.distance(*b) + (r - s).abs()
            }
            (Self::Ellipsoid { radii: a }, Self::Ellipsoid { radii: b }) => a.distance(*b),
            (Self::Hat { radii: a, rim: y, holds }, Self::Hat { radii: b, rim: z, holds: too })
                if holds == too =>
            {
                a.distance(*b) + (y - z).abs()
            }
            (one, other) if one == other => 0.0,
            _ => f32::INFINITY,
        }
    }

    /// The unit normal of the surface nearest to a point, and the signed distance.
    #[inline(always)]
    fn distance<R: Real>(&self, p: V3<R>) -> (V3<R>, R) {
        match self {
            Self::Cuboid { half, rounding } => cuboid(p, *half, *rounding),
            Self::Ellipsoid { radii } => ellipsoid(p, *radii),
            Self::Hull(hull) => hull.distance(p),
            Self::Grid(grid) => grid.sample(p),
            Self::Hat { radii, rim, holds: true } => around_hat(p, *radii, *rim),
            Self::Hat { radii, rim, holds: false } => hat(p, *radii, *rim),
        }
    }

    /// The parameter along a path at which it is deepest inside, or nearest; approximate where it
    /// misses.
    #[inline(always)]
    fn deepest<R: Real>(&self, start: V3<R>, way: V3<R>) -> R {
        let lit = |value: f32| start.x.lit(value.into());
        let (zero, one) = (lit(0.0), lit(1.0));
        match self {
            Self::Cuboid { half, .. } => {
                let sides = [
                    (Vec3::X, half.x),
                    (Vec3::NEG_X, half.x),
                    (Vec3::Y, half.y),
                    (Vec3::NEG_Y, half.y),
                    (Vec3::Z, half.z),
                    (Vec3::NEG_Z, half.z),
                ];
                middle_within(start, way, sides.into_iter())
            }
            Self::Hull(hull) => middle_within(start, way, hull.planes()),
            Self::Ellipsoid { radii } | Self::Hat { radii, holds: false, .. } => {
                let squeezed = inlined(
                    #[inline(always)]
                    |v: V3<R>| {
                        let inverse = radii.recip();
                        V3::new(v.x * lit(inverse.x), v.y * lit(inverse.y), v.z * lit(inverse.z))
                    },
                );
                let (from, along) = (squeezed(start), squeezed(way));
                let t = -from.dot(along) / along.dot(along).max(lit(1e-20));
                t.max(zero).min(one)
            }
            Self::Grid(grid) => {
                // Sphere tracing.
                let whole = way.dot(way).sqrt().max(lit(1e-12));
                let mut share = zero;
                for _ in 0..MARCH {
                    let free = grid.free(way.scale_add(share, start));
                    share = (share + free.max(lit(0.25 * grid.cell())) / whole).min(one);
                }
                share
            }
            // Of a way from below.
            Self::Hat { .. } => one,
        }
    }
}

/// Steps of sphere tracing through a grid.
const MARCH: usize = 6;

/// The parameter in the middle of the part of a path that is behind all planes.
#[inline(always)]
fn middle_within<R: Real>(
    start: V3<R>,
    way: V3<R>,
    planes: impl Iterator<Item = (Vec3, f32)>,
) -> R {
    let lit = |value: f32| start.x.lit(value.into());
    let (mut enter, mut exit) = (lit(0.0), lit(1.0));
    for (normal, offset) in planes {
        let normal = splat(start.x, normal);
        let (before, speed) = (start.dot(normal) - lit(offset), way.dot(normal));
        let tiny = lit(1e-12);
        let when = -before / R::select(speed.lt(lit(0.0)), speed.min(-tiny), speed.max(tiny));
        let enters = speed.lt(lit(0.0));
        enter = enter.max(R::select(enters, when, lit(0.0)));
        exit = exit.min(R::select(enters, lit(1.0), when));
    }
    (lit(0.5) * (enter + exit)).max(lit(0.0)).min(lit(1.0))
}

#[inline(always)]
fn abs<R: Real>(x: R) -> R {
    R::select(x.lt(x.lit(0.0)), -x, x)
}

/// 1 with the sign of another number.
#[inline(always)]
fn sign<R: Real>(x: R) -> R {
    R::select(x.lt(x.lit(0.0)), x.lit(-1.0), x.lit(1.0))
}

#[inline(always)]
fn signed<R: Real>(v: V3<R>, like: V3<R>) -> V3<R> {
    V3::new(v.x * sign(like.x), v.y * sign(like.y), v.z * sign(like.z))
}

/// Exact in and out of a box with rounded edges.
#[inline(always)]
fn cuboid<R: Real>(p: V3<R>, half: Vec3, rounding: f32) -> (V3<R>, R) {
    let lit = |value: f32| p.x.lit(value.into());
    let (zero, one) = (lit(0.0), lit(1.0));
    let inner = splat(p.x, (half - rounding).max(Vec3::ZERO));
    let q = V3::new(abs(p.x), abs(p.y), abs(p.z)) - inner;
    let out = V3::new(q.x.max(zero), q.y.max(zero), q.z.max(zero));
    let length = out.dot(out).sqrt();
    let tiny = lit(1e-12);
    // Within the inner box the nearest face decides; X before Y before Z.
    let (nx, ny, nz) =
        (V3::new(one, zero, zero), V3::new(zero, one, zero), V3::new(zero, zero, one));
    let face = V3::select(q.x.lt(q.y), ny, nx);
    let most = q.x.max(q.y);
    let face = V3::select(most.lt(q.z), nz, face);
    let most = most.max(q.z);
    let around = out.scale(one / length.max(tiny));
    let normal = V3::select(length.lt(tiny), face, around);
    (signed(normal, p), length + most.min(zero) - lit(rounding))
}

/// Newton steps to the nearest point of an ellipsoid whose axes differ so many times: measured to reach
/// a millionth of its size, for points on the evolute too, where they converge the slowest. A fixed
/// number, so that a lane's result does not depend on the others.
fn newton_steps(ratio: f32) -> u32 {
    7 + ratio.ceil().min(9.0) as u32
}

/// The nearest point of an ellipsoid's surface, by a root search.
///
/// The nearest point of p is `r²p/(r² + t)`, where t makes `G(t) = Σ (r p/(r² + t))²` one. `1/√G` is
/// concave, so that Newton's steps from below never go beyond the root. s is t relative to the
/// first pole, which is accurate deep inside.
#[inline(always)]
fn ellipsoid<R: Real>(p: V3<R>, radii: Vec3) -> (V3<R>, R) {
    let lit = |value: f32| p.x.lit(value.into());
    let size = radii.max_element();
    let r = radii / size;
    let least = r.min_element();
    // In the middle of the shortest axis there are two nearest points: one is taken.
    let floor = |axis: f32| if axis == least { 1e-6 * least } else { 0.0 };
    let unit = lit(1.0 / size);
    let y = V3::new(
        (abs(p.x) * unit).max(lit(floor(r.x))),
        (abs(p.y) * unit).max(lit(floor(r.y))),
        (abs(p.z) * unit).max(lit(floor(r.z))),
    );
    let above = (r - least) * (r + least);
    let e = splat(p.x, above);
    let a = V3::new(y.x * lit(r.x), y.y * lit(r.y), y.z * lit(r.z));
    let mut s = (a.x - e.x).max(a.y - e.y).max(a.z - e.z);
    for _ in 0..newton_steps(1.0 / least) {
        let over = inlined(
            #[inline(always)]
            |a: R, e: R| {
                let inverse = a.lit(1.0) / (s + e);
                let share = a * inverse;
                (share * share, share * share * inverse)
            },
        );
        let [x, y, z] = [over(a.x, e.x), over(a.y, e.y), over(a.z, e.z)];
        let (g, slope) = (x.0 + y.0 + z.0, x.1 + y.1 + z.1);
        s = s + (g * g.sqrt() - g) / slope;
    }
    let way = V3::new(y.x / (s + e.x), y.y / (s + e.y), y.z / (s + e.z));
    let normal = way.scale(lit(1.0) / way.dot(way).sqrt());
    let r2 = r * r;
    let off = V3::new(y.x - way.x * lit(r2.x), y.y - way.y * lit(r2.y), y.z - way.z * lit(r2.z));
    (signed(normal, p), off.dot(normal) * lit(size))
}

/// An ellipsoid above a plane: what comes in from below is not pushed back.
#[inline(always)]
fn hat<R: Real>(p: V3<R>, radii: Vec3, rim: f32) -> (V3<R>, R) {
    let below = p.x.lit(rim.into()) - p.y;
    let (outward, off) = ellipsoid(p, radii);
    (outward, R::select(p.x.lit(0.0).lt(below), off.max(below), off))
}

/// How far a point is above the brim of a hat, to first order, the normal there, upward, and the brim's breadth from the
/// rim to the nearest point of it: below 0 where the rim is nearer.
#[inline(always)]
fn above_brim<R: Real>(p: V3<R>, radii: Vec3, rim: f32) -> (V3<R>, R, R) {
    let lit = |value: f32| p.x.lit(value.into());
    let zero = lit(0.0);
    let breadth = 0.5 * (radii.x + radii.z);
    // Across, as a share of the ellipsoid's breadth.
    let (x, z) = (p.x * lit(1.0 / radii.x), p.z * lit(1.0 / radii.z));
    let across = (x * x + z * z).sqrt();
    let at_rim = (1.0 - (rim / radii.y).powi(2)).max(0.0).sqrt();
    let beyond = ((across - lit(at_rim)) * lit(breadth)).max(zero);
    let outward = lit(breadth) / across.max(lit(1e-6));
    let off =
        V3::new(x * outward * lit(BRIM / radii.x), lit(1.0), z * outward * lit(BRIM / radii.z));
    let unit = lit(1.0 / (1.0 + BRIM * BRIM).sqrt());
    let above = (p.y - lit(rim) + beyond * lit(BRIM)) * unit;
    let normal = off.scale(lit(1.0) / off.dot(off).sqrt());
    (normal, above, beyond - above * lit(BRIM) * unit)
}

/// All that is outside of an ellipsoid and above a brim: the way out is in or under that, whichever is shorter.
#[inline(always)]
fn around_hat<R: Real>(p: V3<R>, radii: Vec3, rim: f32) -> (V3<R>, R) {
    let (outward, off) = ellipsoid(p, radii);
    let (up, above, breadth) = above_brim(p, radii, rim);
    let above = R::select(breadth.lt(p.x.lit(0.0)), off, above);
    (V3::select(above.lt(off), -up, -outward), -above.min(off))
}

impl Placed {
    /// A point in the frame of the shape.
    #[inline(always)]
    fn point_in<R: Real>(&self, p: V3<R>) -> V3<R> {
        self.vector_in(p - splat(p.x, self.center))
    }

    #[inline(always)]
    fn vector_in<R: Real>(&self, v: V3<R>) -> V3<R> {
        let inverse = v.x.lit((1.0 / self.scale).into());
        let along = |axis: Vec3| v.dot(splat(v.x, axis)) * inverse;
        V3::new(along(self.axes.x_axis), along(self.axes.y_axis), along(self.axes.z_axis))
    }

    #[inline(always)]
    fn direction_out<R: Real>(&self, v: V3<R>) -> V3<R> {
        let z = splat(v.x, self.axes.z_axis).scale(v.z);
        let zy = splat(v.x, self.axes.y_axis).scale_add(v.y, z);
        splat(v.x, self.axes.x_axis).scale_add(v.x, zy)
    }

    /// As [`Solid::depth`](super::obstacle::Solid::depth).
    #[inline(always)]
    pub(super) fn depth<R: Real>(&self, p: V3<R>, clearance: f32) -> (V3<R>, R) {
        p.x.apart(
            #[inline(always)]
            || {
                let (normal, distance) = self.shape.distance(self.point_in(p));
                let scale = p.x.lit(self.scale.into());
                (self.direction_out(normal), p.x.lit(clearance.into()) - distance * scale)
            },
        )
    }

    /// Whether it is worth a test by [`is_beyond`](Self::is_beyond) first to know that a point is outside.
    pub(super) fn is_costly(&self) -> bool {
        matches!(self.shape, Shape::Ellipsoid { .. } | Shape::Hat { .. })
    }

    /// As [`Solid::is_beyond`](super::obstacle::Solid::is_beyond).
    #[inline(always)]
    pub(super) fn is_beyond<S: Simd>(&self, p: V3<f32x16<S>>, distance: f32x16<S>) -> mask32x16<S> {
        p.x.apart(
            #[inline(always)]
            || {
                let lit = |value: f32| f32x16::splat(p.x.simd, value);
                let (p, distance) = (self.point_in(p), distance * lit(1.0 / self.scale));
                match &self.shape {
                    Shape::Cuboid { half, rounding } => {
                        let inner = (*half - *rounding).max(Vec3::ZERO);
                        let reach = distance + lit(*rounding);
                        Real::lt(reach * reach, outside(p, Vec3::ZERO, inner))
                    }
                    Shape::Ellipsoid { radii } => {
                        // Scaled to a ball distances do not shrink; also the bounding ball.
                        let inverse = radii.recip();
                        let (x, y, z) =
                            (p.x * lit(inverse.x), p.y * lit(inverse.y), p.z * lit(inverse.z));
                        let squeezed = V3::new(x, y, z);
                        let near = lit(1.0) + distance * lit(1.0 / radii.min_element());
                        let far = lit(radii.max_element()) + distance;
                        Real::lt(near * near, squeezed.dot(squeezed))
                            | Real::lt(far * far, p.dot(p))
                    }
                    Shape::Hat { radii, rim, holds } => {
                        let inverse = radii.recip();
                        let (x, y, z) =
                            (p.x * lit(inverse.x), p.y * lit(inverse.y), p.z * lit(inverse.z));
                        let squeezed = V3::new(x, y, z).dot(V3::new(x, y, z));
                        // Scaled to a ball distances do not shrink.
                        let room = distance * lit(1.0 / radii.min_element());
                        if *holds {
                            let near = Real::max(lit(1.0) - room, lit(0.0));
                            let (_, above, _) = above_brim(p, *radii, *rim);
                            Real::lt(squeezed, near * near) | Real::lt(distance, -above)
                        } else {
                            let near = lit(1.0) + room;
                            Real::lt(near * near, squeezed) | Real::lt(distance, lit(*rim) - p.y)
                        }
                    }
                    Shape::Hull(hull) => Real::lt(distance, hull.distance(p).1),
                    Shape::Grid(grid) => {
                        let (middle, half) = grid.bounds();
                        let far = Real::lt(distance * distance, outside(p, middle, half));
                        if far.all_true() {
                            return far;
                        }
                        // Interpolated distances have a gradient of at most √3.
                        let free = grid.free(p);
                        far | Real::lt(distance * lit(1.733), free)
                    }
                }
            },
        )
    }

    /// For continuous collision: the parameter along a path at which it is deepest inside.
    #[inline(always)]
    pub(super) fn deepest<R: Real>(&self, start: V3<R>, way: V3<R>) -> R {
        start.x.apart(
            #[inline(always)]
            || self.shape.deepest(self.point_in(start), self.vector_in(way)),
        )
    }

    /// Half of its thickness (m).
    pub(super) fn thickness(&self) -> f32 {
        self.shape.thickness() * self.scale
    }

    /// A bounding ball (m).
    pub(super) fn ball(&self) -> (Vec3, f32) {
        let (middle, half) = self.shape.bounds();
        (self.center + self.axes * middle * self.scale, half.length() * self.scale)
    }

    /// The bounding box along the axes of the nodes: centre and half size (m).
    pub(super) fn bounds(&self) -> (Vec3, Vec3) {
        let (middle, half) = self.shape.bounds();
        let Mat3 { x_axis, y_axis, z_axis } = self.axes;
        let around = x_axis.abs() * half.x + y_axis.abs() * half.y + z_axis.abs() * half.z;
        (self.center + self.axes * middle * self.scale, around * self.scale)
    }
}

/// Squared distance of points from a box.
#[inline(always)]
fn outside<R: Real>(p: V3<R>, middle: Vec3, half: Vec3) -> R {
    let (q, zero) = (p - splat(p.x, middle), p.x.lit(0.0));
    let half = splat(p.x, half);
    let out = V3::new(
        (abs(q.x) - half.x).max(zero),
        (abs(q.y) - half.y).max(zero),
        (abs(q.z) - half.z).max(zero),
    );
    out.dot(out)
}

#[cfg(test)]
mod tests {
    use super::{
        fixture::{CELL, all_shapes, pear, pear_balls, pear_distance},
        *,
    };
    use crate::base::lanes::{Lane, load, load3};
    use crate::solver::rod::obstacle::{Obstacle, Solid, continuous_collision, push_out};
    use fearless_simd::{Level, dispatch};
    use glam::{Quat, UVec3};
    use proptest::prelude::*;

    fn vector(size: f32) -> impl Strategy<Value = Vec3> {
        [-size..size, -size..size, -size..size].prop_map(Vec3::from)
    }

    fn distance(shape: &Shape, p: Vec3) -> (Vec3, f32) {
        let (normal, distance) = shape.distance(V3::new(p.x, p.y, p.z));
        (Vec3::new(normal.x, normal.y, normal.z), distance)
    }

    /// How fast a distance may change with the place.
    fn steepest(shape: &Shape) -> f32 {
        if matches!(shape, Shape::Grid(_)) { 3f32.sqrt() } else { 1.0 }
    }

    /// From outside the way under a hat that holds is in or down; one that does not keeps what is inside out.
    #[test]
    fn a_hat_holds_what_is_its_own_and_keeps_out_what_is_not() {
        let hat = |holds| Shape::Hat { radii: Vec3::splat(0.1), rim: 0.01, holds };
        let at = |off: f32| Vec3::new(0.0, 0.6, 0.8) * (0.1 + off);
        for off in [-0.03, 0.0, 0.02, 0.05] {
            let (normal, free) = distance(&hat(true), at(off));
            assert!((free + off).abs() < 1e-6, "{free} for {off}");
            assert!(normal.distance(-at(off).normalize()) < 1e-5);
            let (normal, free) = distance(&hat(false), at(off));
            assert!((free - off).abs() < 1e-6 && normal.y > 0.0, "{free} for {off}");
        }
        // A brim's breadth outside of the rim, over it and under it.
        let up = Vec3::new(BRIM, 1.0, 0.0).normalize();
        let on = Vec3::new(0.0099_f32.sqrt() + 0.2, 0.01 - 0.2 * BRIM, 0.0);
        for over in [-0.02, 0.0, 0.02] {
            let (normal, free) = distance(&hat(true), on + up * over);
            assert!((free + over).abs() < 1e-6, "{free} for {over}");
            assert!(normal.distance(-up) < 1e-5, "{normal}");
        }
        let (_, free) = distance(&hat(false), Vec3::new(0.1, 0.0, 0.0));
        assert!((free - 0.01).abs() < 1e-6, "{free}");
    }

    /// Where depths come from one face and then from another they do not jump: nodes would.
    #[test]
    fn depths_around_a_hat_are_continuous() {
        let hat = Shape::Hat { radii: Vec3::new(0.1, 0.12, 0.1), rim: 0.02, holds: true };
        let at = |i: i32, k: i32| distance(&hat, 1e-3 * Vec3::new(i as f32, k as f32, 0.3)).1;
        for (i, k) in (-200..200).flat_map(|i| (-200..200).map(move |k| (i, k))) {
            let apart = (at(i + 1, k) - at(i, k)).abs().max((at(i, k + 1) - at(i, k)).abs());
            assert!(apart < 1.5e-3, "{i}, {k}: {apart}");
        }
    }

    proptest! {
        /// What is so far off a face, an edge or a corner of the inner box.
        #[test]
        fn a_box_is_exact(
            half in [0.02f32..1.0, 0.02f32..1.0, 0.02f32..1.0],
            rounding in 0.0f32..0.02,
            on in [-1.0f32..1.0, -1.0f32..1.0, -1.0f32..1.0],
            clamped in [0..3, 0..3, 0..3],
            way in [0.01f32..1.0, 0.01f32..1.0, 0.01f32..1.0],
            off in -0.02f32..1.0,
        ) {
            let half = Vec3::from(half);
            let inner = (half - rounding).max(Vec3::ZERO);
            // On each axis at the low end, at the high end, or between.
            let (mut place, mut out) = (Vec3::ZERO, Vec3::ZERO);
            for k in 0..3 {
                (place[k], out[k]) = match clamped[k] {
                    0 => (-inner[k], -way[k]),
                    1 => (inner[k], way[k]),
                    _ => (0.9 * inner[k] * on[k], 0.0),
                };
            }
            prop_assume!(out != Vec3::ZERO);
            let out = out.normalize();
            let off = off.max(-rounding);
            let p = place + out * (rounding + off);
            let (normal, found) = distance(&Shape::Cuboid { half, rounding }, p);
            prop_assert!((found - off).abs() < 1e-6, "{found} is {off}");
            prop_assert!(off + rounding < 1e-4 || normal.distance(out) < 1e-2, "{normal} is {out}");
        }

        /// What is so far off a point of the surface along its normal, inward up to where it curves most.
        #[test]
        fn an_ellipsoid_is_exact_to_a_millionth(
            radii in [0.01f32..1.0, 0.01f32..1.0, 0.01f32..1.0],
            way in vector(1.0),
            off in -0.95f32..3.0,
            inward in proptest::bool::ANY,
        ) {
            let radii = Vec3::from(radii);
            let (least, most) = (radii.min_element(), radii.max_element());
            let way = way.normalize_or(Vec3::X);
            let (q, out) = (way * radii, (way / radii).normalize());
            let off = if inward { off.min(0.0) * least * least / most } else { off.abs() * most };
            let (normal, found) = distance(&Shape::Ellipsoid { radii }, q + out * off);
            prop_assert!((found - off).abs() < 2e-6 * most, "{found} is {off}, {radii}");
            prop_assert!(normal.distance(out) < 2e-3, "{normal} is {out}, {radii}, {off}");
        }

        #[test]
        fn distances_change_no_faster_than_places(
            which in 0usize..4, p in vector(0.2), step in vector(0.03),
        ) {
            let shape = &all_shapes()[which];
            let ((normal, here), (_, there)) = (distance(shape, p), distance(shape, p + step));
            prop_assert!((normal.length() - 1.0).abs() < 1e-4);
            let most = steepest(shape) * step.length() + 1e-6;
            prop_assert!((here - there).abs() <= most, "{here} to {there} over {}", step.length());
        }

        /// However it is placed, lanes and numbers agree, and what was inside is outside.
        #[test]
        fn nodes_are_pushed_out(
            which in 0usize..4,
            center in vector(1.0),
            turn in vector(2.0),
            scale in 0.1f32..10.0,
            p in vector(0.12),
        ) {
            let shape = all_shapes()[which].clone();
            // Deep inside a grid is coarse: a node gets out of there in more than one step.
            prop_assume!(which != 3 || distance(&shape, p).1 > -CELL);
            let turn = Quat::from_scaled_axis(turn);
            let axes = glam::Mat3::from_quat(turn);
            let own = shape.clone();
            let solid = Solid::Placed(Placed { shape, center, axes, scale });
            let at = center + turn * (p * scale);
            let scalar = solid.depth(V3::new(at.x, at.y, at.z), 0.0);
            prop_assert!((scalar.1 + scale * distance(&own, p).1).abs() < 4e-6 * (1.0 + scale));
            let obstacle = Obstacle { solid: solid.clone(), motion: None, friction: 0.0 };
            let (out, beyond) = dispatch!(Level::new(), simd => {
                let p = crate::base::lanes::splat3(simd, at);
                let lit = |value: f32| f32x16::splat(simd, value);
                let out = push_out(&obstacle, p, 0.0, lit(0.0)).map(|push| {
                    let lane = |x: f32x16<_>| x[5];
                    Vec3::new(lane(push.to.x), lane(push.to.y), lane(push.to.z))
                });
                // As far as it is, less a little, it is not beyond; far away it is.
                let depth = solid.depth(p, 0.0).1;
                let far = crate::base::lanes::splat3(simd, at + 10.0 * scale);
                (out, (
                    solid.is_beyond(p, lit(1e-5 * scale) - depth).any_true(),
                    solid.is_beyond(far, lit(scale)).all_true(),
                ))
            });
            prop_assert_eq!(out.is_some(), scalar.1 > 0.0);
            prop_assert!(!beyond.0 || scalar.1 > 0.0);
            prop_assert!(beyond.1);
            if let Some(out) = out {
                let left = solid.depth(V3::new(out.x, out.y, out.z), 0.0).1;
                // Within a cell of a crease a grid's gradient turns: a step from a cell deep leaves up to
                // 0.41 of a cell (of 10⁶ places), elsewhere 0.08. The next pass takes the rest.
                let most = match (which, pear_balls(p)) {
                    (3, (low, high)) if (low - high).abs() < 2.0 * CELL => 0.45 * CELL * scale,
                    (3, _) => 0.1 * CELL * scale,
                    _ => 4e-6 * (1.0 + scale),
                };
                prop_assert!(left < most, "{left} m left of {}", scalar.1);
            }
            prop_assert!(solid.may_reach(at, at, 0.0) || scalar.1 <= 0.0);
        }

        /// A step through the middle of what is thin ends before it.
        #[test]
        fn what_would_go_through_is_held_back(which in 0usize..4, way in vector(1.0), turn in vector(2.0)) {
            let shape = all_shapes()[which].clone();
            let own = shape.clone();
            let turn = Quat::from_scaled_axis(turn);
            let (center, scale) = (Vec3::new(0.3, -0.2, 0.1), 2.0);
            let axes = glam::Mat3::from_quat(turn);
            let solid = Solid::Placed(Placed { shape, center, axes, scale });
            let obstacle = Obstacle { solid, motion: None, friction: 0.0 };
            let way = way.normalize_or(Vec3::X) * 0.3;
            let [from, to] = [way, -way].map(|p| center + turn * (p * scale));
            let held = dispatch!(Level::new(), simd => {
                let [from, to] = [from, to].map(|p| crate::base::lanes::splat3(simd, p));
                continuous_collision(&obstacle, from, to, 0.0).map(|(held, _)| {
                    Vec3::new(held.x[3], held.y[3], held.z[3])
                })
            });
            let held = turn.inverse() * (held.unwrap() - center) / scale;
            let (facing, before) = distance(&own, way);
            let behind = facing.dot(way - held) - before;
            prop_assert!(behind < 1e-4, "{behind} behind the surface that it came to");
        }
    }

    /// Whether lanes find that points are farther than `off` outside.
    fn is_beyond(placed: &Placed, p: Vec3, off: f32) -> bool {
        dispatch!(Level::new(), simd => {
            let all = placed.is_beyond(crate::base::lanes::splat3(simd, p), f32x16::splat(simd, off));
            assert_eq!(all.any_true(), all.all_true());
            all.all_true()
        })
    }

    /// What is well outside is found to be: otherwise every node would look at every solid.
    #[test]
    fn what_is_far_out_is_beyond() {
        let axes = Mat3::from_quat(Quat::from_scaled_axis(Vec3::new(0.3, -1.1, 0.7)));
        let (center, scale) = (Vec3::new(0.4, -0.2, 1.0), 2.0);
        let place = |shape: Shape| Placed { shape, center, axes, scale };
        // In the shape's unit: a point, and how far out of the shape it is at most found to be.
        let cases = |shape: Shape, cases: &[(Vec3, f32)]| {
            let placed = place(shape);
            for (p, off) in cases {
                let at = center + axes * (*p * scale);
                assert!(is_beyond(&placed, at, 0.99 * off * scale), "{p} of {:?}", placed.shape);
                assert!(!is_beyond(&placed, at, 1.01 * off * scale), "{p} of {:?}", placed.shape);
            }
        };
        let (half, rounding) = (Vec3::new(0.05, 0.1, 0.02), 0.01);
        let corner = half - rounding + Vec3::splat(0.05);
        let off = 3f32.sqrt() * 0.05 - rounding;
        let sharp = [(Vec3::X * 0.08, 0.03), (Vec3::NEG_Z * 0.1, 0.08), (corner, off)];
        cases(Shape::Cuboid { half, rounding }, &sharp);
        // Over the flat side by the shorter axis, over the narrow end by the ball around.
        let radii = Vec3::new(0.1, 0.02, 0.1);
        let flat = [(Vec3::Y * 0.05, 0.03), (Vec3::X * 0.2, 0.1), (Vec3::NEG_Z * 0.13, 0.03)];
        cases(Shape::Ellipsoid { radii }, &flat);
        let [.., hull, grid] = all_shapes();
        let slope = Vec3::ONE.normalize() * 0.07;
        cases(hull, &[(Vec3::X * 0.09, 0.04), (slope, 0.04)]);
        // Off the box around the grid's solid, which is from −0.07 to 0.07 and 0.12 above.
        let off_box = Vec3::new(0.2, 0.05, 0.0);
        cases(grid.clone(), &[(off_box, 0.13), (Vec3::new(0.0, 0.05, 0.3), 0.23)]);
        // Other lanes may be within the box, 0.027 beside the pear's upper ball.
        let placed = place(grid);
        let beyond = |beside: f32| {
            let lane = |k: usize| match k % 2 {
                0 => (off_box, 0.12),
                _ => (Vec3::new(0.06, 0.11, 0.0), beside),
            };
            let at = |k: usize| center + axes * (lane(k).0 * scale);
            let p: [Lane; 3] = core::array::from_fn(|axis| core::array::from_fn(|k| at(k)[axis]));
            let off: Lane = core::array::from_fn(|k| lane(k).1 * scale);
            dispatch!(Level::new(), simd => {
                placed.is_beyond(load3(simd, &p), load(simd, &off)).to_bitmask()
            })
        };
        assert_eq!([beyond(0.014), beyond(0.03)], [0xffff, 0x5555]);
    }

    proptest! {
        /// Bounding boxes touch what they enclose, wherever it is, however it is placed.
        #[test]
        fn boxes_around_are_tight(
            points in proptest::collection::vec(vector(0.1), 6..20),
            off in vector(0.5),
            turn in vector(2.0),
            scale in 0.1f32..10.0,
        ) {
            let points: Vec<Vec3> = points.into_iter().map(|p| p + off).collect();
            let Ok(hull) = ConvexHull::new(&points) else { return Ok(()) };
            let sides = |points: &[Vec3]| {
                let low = points.iter().copied().fold(Vec3::INFINITY, Vec3::min);
                let high = points.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
                (0.5 * (low + high), 0.5 * (high - low))
            };
            let near = |(a, b): (Vec3, Vec3), (c, d): (Vec3, Vec3), most: f32| {
                a.distance(c) < most && b.distance(d) < most
            };
            let shape = Shape::Hull(hull);
            prop_assert!(near(shape.bounds(), sides(&points), 1e-5), "{:?}", shape.bounds());
            let reach = points.iter().map(|p| p.length()).fold(0.0, f32::max);
            prop_assert!(shape.reach() >= reach && shape.reach() < reach * 3f32.sqrt() + 1e-5);
            // Placed: the box around the turned box.
            let (center, axes) = (Vec3::new(0.3, 1.0, -2.0), Mat3::from_quat(Quat::from_scaled_axis(turn)));
            let (middle, half) = shape.bounds();
            let corners: Vec<Vec3> = (0..8)
                .map(|k| Vec3::new([-1.0, 1.0][k & 1], [-1.0, 1.0][k >> 1 & 1], [-1.0, 1.0][k >> 2]))
                .map(|side| center + scale * (axes * (middle + half * side)))
                .collect();
            let placed = Placed { shape, center, axes, scale };
            prop_assert!(near(placed.bounds(), sides(&corners), 1e-5 * (1.0 + scale)), "{:?}", placed.bounds());
        }
    }

    #[test]
    fn a_baked_octahedron_knows_where_it_is() {
        let (center, size) = (Vec3::new(0.2, -0.1, 0.05), Vec3::new(0.12, 0.2, 0.09));
        let tip =
            |k: usize| Vec3::AXES[k / 2] * size * if k.is_multiple_of(2) { 1.0 } else { -1.0 };
        let tips: Vec<Vec3> = (0..6).map(|k| center + tip(k)).collect();
        let faces: Vec<[u32; 3]> = (0..8u32)
            .map(|k| {
                let [x, y, z] = [k & 1, 2 + (k >> 1 & 1), 4 + (k >> 2)];
                if k.count_ones() % 2 == 0 { [x, y, z] } else { [x, z, y] }
            })
            .collect();
        let grid = DistanceGrid::bake(&tips, &faces, CELL).unwrap();
        let (middle, half) = Shape::Grid(grid).bounds();
        assert!(middle.distance(center) < CELL, "{middle}");
        let wider = half - size;
        assert!(wider.min_element() > -CELL && wider.max_element() < 2.0 * CELL, "{wider}");
    }

    /// Whether they share their data or not.
    #[test]
    fn shapes_are_compared_by_what_they_hold() {
        for ((a, b), other) in all_shapes().into_iter().zip(all_shapes()).zip([1, 2, 3, 0]) {
            assert!(a == b && a == a.clone() && a != all_shapes()[other], "{a:?}");
            assert_eq!((a.change(&b), a.change(&all_shapes()[other])), (0.0, f32::INFINITY));
        }
        let origin = Vec3::splat(-0.105);
        let bounds = (Vec3::splat(-0.07), Vec3::splat(0.07));
        let of = |distance: f32| {
            DistanceGrid::of_samples(origin, CELL, UVec3::splat(2), vec![distance; 8], bounds)
        };
        assert!(of(0.1) == of(0.1) && of(0.1) != of(0.2));
    }

    /// As far as the middle is from the surface; of a grid at most four cells.
    #[test]
    fn thickness_is_that_of_the_thinnest_part() {
        let place = |shape| Placed { shape, center: Vec3::X, axes: Mat3::IDENTITY, scale: 3.0 };
        let found = all_shapes().map(|shape| place(shape).thickness());
        let expected = [0.02, 0.03, 0.03, 4.0 * CELL].map(|half| 3.0 * half);
        for (found, expected) in found.into_iter().zip(expected) {
            assert!((found - expected).abs() < 1e-6, "{found}, expected {expected}");
        }
    }

    /// What begins inside has no side that it came from: it is left to the push-out.
    #[test]
    fn what_begins_inside_is_not_held_back() {
        for (shape, inside) in all_shapes().into_iter().zip([
            Vec3::X * 0.04,
            Vec3::X * 0.09,
            Vec3::X * 0.04,
            Vec3::X * 0.055,
        ]) {
            let depth = -distance(&shape, inside).1;
            assert!(depth > 3e-3 && depth < 0.018, "{shape:?}: {depth}");
            let (center, axes, scale) = (Vec3::ZERO, Mat3::IDENTITY, 1.0);
            let solid = Solid::Placed(Placed { shape, center, axes, scale });
            let obstacle = Obstacle { solid, motion: None, friction: 0.0 };
            for (from, is_held) in [(inside, false), (Vec3::X * 0.15, true)] {
                let held = dispatch!(Level::new(), simd => {
                    let [from, to] =
                        [from, Vec3::X * -0.3].map(|p| crate::base::lanes::splat3(simd, p));
                    continuous_collision(&obstacle, from, to, 0.0).map(|(held, _)| held.x[3])
                });
                assert_eq!(held.is_some_and(|x| x > -0.29), is_held, "{held:?} from {from}");
            }
        }
    }

    #[test]
    fn boxes_enclose_what_is_inside() {
        for shape in all_shapes() {
            let (middle, half) = shape.bounds();
            let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
            for k in 0..200_000 {
                let share =
                    |n: usize| (k as f64 * [0.754_877_67, 0.569_840_29, 0.346_1][n]).fract() as f32;
                let p = Vec3::new(share(0), share(1), share(2)) * 0.26 - Vec3::splat(0.125);
                if distance(&shape, p).1 < 0.0 {
                    (low, high) = (low.min(p), high.max(p));
                }
            }
            let least = (low - (middle - half)).min(middle + half - high).min_element();
            let most = (low - (middle - half)).max(middle + half - high).max_element();
            // A grid's edges are rounded off by part of a cell.
            let loose = if matches!(shape, Shape::Grid(_)) { CELL } else { 5e-3 };
            assert!(least > -1e-6 && most < loose, "{shape:?}: {least} to {most}");
        }
    }

    #[test]
    fn the_middle_of_each_has_a_way_out() {
        for shape in all_shapes() {
            for p in [Vec3::ZERO, Vec3::X * 1e-9, Vec3::Y * 1e-5, Vec3::splat(-0.0)] {
                let (normal, found) = distance(&shape, p);
                assert!(
                    (normal.length() - 1.0).abs() < 1e-4 && found < -0.015,
                    "{shape:?}: {found}"
                );
            }
            let far = distance(&shape, Vec3::splat(1e4));
            assert!((far.1 - 1e4 * 3f32.sqrt()).abs() < 1.0, "{far:?}");
            assert!(far.0.is_finite());
        }
        let round = Shape::Ellipsoid { radii: Vec3::ONE };
        assert!((distance(&round, Vec3::ZERO).1 + 1.0).abs() < 1e-5);
        let flat = Shape::Ellipsoid { radii: Vec3::new(1.0, 1e-3, 0.5) };
        assert!((distance(&flat, Vec3::new(0.0, 2e-3, 0.0)).1 - 1e-3).abs() < 1e-6);
        assert!((distance(&flat, Vec3::ZERO).1 + 1e-3).abs() < 1e-6);
    }

    /// Whether stretched shapes are those of stretched surfaces.
    #[test]
    fn stretched_shapes_have_stretched_surfaces() {
        let by = Vec3::new(2.0, 0.4, 1.25);
        let points: Vec<Vec3> = (0..40)
            .map(|k| {
                let share = |n: usize| (k as f32 * [0.754_877, 0.569_84, 0.346_1][n]).fract();
                Vec3::new(share(0), share(1), share(2)) * 0.2 - 0.07
            })
            .collect();
        let stretched: Vec<Vec3> = points.iter().map(|p| *p * by).collect();
        let [a, b] = [points, stretched].map(|points| ConvexHull::new(&points).unwrap());
        let (a, b) = (Shape::Hull(a.stretched(by)), Shape::Hull(b));
        let grid = pear().stretched(by);
        let (middle, half) = Shape::Grid(pear()).bounds();
        assert_eq!(Shape::Grid(grid.clone()).bounds(), (middle * by, half * by));
        assert!(grid != pear() && grid == pear().stretched(by));
        let mut deepest = 0.0_f32;
        for k in 0..2000 {
            let share = |n: usize| (k as f32 * [0.754_877, 0.569_84, 0.346_1][n]).fract();
            let p = Vec3::new(share(0), share(1), share(2)) * 0.3 - 0.15;
            assert!((distance(&a, p * by).1 - distance(&b, p * by).1).abs() < 1e-5, "{p}");
            // From up to a cell or two within, a few passes lead onto the surface, as a grid of the first
            // order knows it.
            let mut at = p * by;
            let free = grid.free(V3::new(at.x, at.y, at.z));
            assert!(free <= distance(&Shape::Grid(grid.clone()), at).1.max(0.0) + 1e-6);
            if pear_distance(p) > 0.0 || pear_distance(p) < -2.0 * CELL {
                continue;
            }
            for _ in 0..4 {
                let (normal, off) = distance(&Shape::Grid(grid.clone()), at);
                assert!((normal.length() - 1.0).abs() < 1e-4);
                at -= normal * off.min(0.0);
            }
            deepest = deepest.min(pear_distance(at / by));
        }
        assert!(deepest > -0.6 * CELL, "{} cells", deepest / CELL);
    }

    /// Beside its points a grid knows distances to a fifth of its cell.
    #[test]
    fn a_grid_interpolates() {
        let mut worst = 0.0_f32;
        for k in 0..4000 {
            let share = |n: usize| (k as f32 * [0.754_877, 0.569_84, 0.346_1][n]).fract();
            let p = Vec3::new(share(0), share(1), share(2)) * 0.3 - Vec3::new(0.15, 0.13, 0.15);
            let (off, found) = (pear_distance(p), pear().distance(p));
            if off.abs() < 0.02 {
                worst = worst.max((off - found).abs());
            }
        }
        println!("off by {} cells", worst / CELL);
        assert!(worst < 0.2 * CELL, "{worst}");
    }
}

//! Obstacles of rods in lanes: half-spaces, capsules, cylinders and placed shapes.

use super::shape::Placed;
use crate::base::lanes::{LANES, Lane, Real, V3, inlined, load, load3, splat};
use fearless_simd::{Simd, f32x16, mask32x16, prelude::*};
use glam::{Affine3A, BVec3, Vec3};

/// The solid part of space that an [`Obstacle`] fills, in the frame of the nodes.
#[derive(Clone, Debug, PartialEq)]
pub enum Solid {
    /// Everything on the far side of a plane.
    HalfSpace {
        /// Unit normal, pointing out of the solid.
        normal: Vec3,
        /// A point of the plane (m).
        point: Vec3,
    },
    /// All points within `radius` of a segment; of a point for spheres.
    Capsule {
        /// One end of the segment (m).
        a: Vec3,
        /// The other end (m).
        b: Vec3,
        /// Radius (m).
        radius: f32,
    },
    /// A solid cylinder with flat ends.
    Cylinder {
        /// The centre (m).
        center: Vec3,
        /// Unit direction of the axis.
        axis: Vec3,
        /// Radius (m).
        radius: f32,
        /// Half the length along the axis (m).
        half_height: f32,
    },
    /// Any other shape.
    Placed(Placed),
}

/// A solid that nodes cannot enter.
#[derive(Clone, Debug)]
pub struct Obstacle {
    /// The solid at the end of the substep.
    pub solid: Solid,
    /// How its surface moves during the substep: a point of it goes from x to `motion · x`.
    pub motion: Option<Affine3A>,
    /// Coulomb coefficient.
    pub friction: f32,
}

/// A subset of a block's obstacles as bits. With more than 128, several obstacles share a bit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct NearObstacles(u128);

impl NearObstacles {
    pub(crate) const NONE: Self = Self(0);
    pub(crate) const ALL: Self = Self(u128::MAX);
    const BITS: usize = u128::BITS as usize;

    /// Adds the obstacle of this index.
    #[inline(always)]
    pub(crate) fn add(&mut self, index: usize) {
        self.0 |= 1 << (index % Self::BITS);
    }

    /// Those of `obstacles` that are chosen, in their order.
    #[inline(always)]
    pub(crate) fn of(self, obstacles: &[Obstacle]) -> impl Iterator<Item = &Obstacle> {
        let (mut first, mut bits) = (0, self.0);
        core::iter::from_fn(move || {
            while self.0 != 0 && first < obstacles.len() {
                if bits != 0 {
                    let index = first + bits.trailing_zeros() as usize;
                    bits &= bits - 1;
                    if let Some(obstacle) = obstacles.get(index) {
                        return Some(obstacle);
                    }
                }
                if bits == 0 {
                    (first, bits) = (first + Self::BITS, self.0);
                }
            }
            None
        })
    }
}

/// The obstacles that a node can touch while it is near a place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CloseObstacles {
    pub(super) obstacles: NearObstacles,
    /// The place (m), and the square of the distance from it (m²): below 0 where nothing is known.
    pub(super) place: [Lane; 3],
    pub(super) within: Lane,
}

impl CloseObstacles {
    pub(super) const UNKNOWN: Self =
        Self { obstacles: NearObstacles::ALL, place: [[0.0; LANES]; 3], within: [-1.0; LANES] };

    /// Those that a node at `p` can touch, of `near`.
    #[inline(always)]
    pub(super) fn at<S: Simd>(&self, p: V3<f32x16<S>>, near: NearObstacles) -> NearObstacles {
        let off = p - load3(p.x.simd, &self.place);
        let is_close = Real::lt(off.dot(off), load(p.x.simd, &self.within)).all_true();
        if is_close { self.obstacles } else { near }
    }
}

impl Obstacle {
    /// A point after it has moved with the surface for the substep.
    #[inline(always)]
    pub(crate) fn moved_with<R: Real>(&self, p: V3<R>) -> V3<R> {
        let Some(m) = &self.motion else { return p };
        let moved = splat(p.x, m.translation.into());
        let moved = splat(p.x, m.matrix3.z_axis.into()).scale_add(p.z, moved);
        let moved = splat(p.x, m.matrix3.y_axis.into()).scale_add(p.y, moved);
        splat(p.x, m.matrix3.x_axis.into()).scale_add(p.x, moved)
    }

    /// Whether any point of the box `low…high`, grown by `margin`, may lie inside during the
    /// substep. Conservative: true where in doubt.
    pub fn may_touch(&self, low: Vec3, high: Vec3, margin: f32) -> bool {
        let motion = self.motion.map_or(0.0, |motion| {
            // An affine displacement is largest at a corner.
            let corners = (0..8).map(|i| {
                let upper = BVec3::new(i & 1 != 0, i & 2 != 0, i & 4 != 0);
                Vec3::select(upper, high, low)
            });
            corners.map(|x| motion.transform_point3(x).distance(x)).fold(0.0, f32::max)
        });
        self.solid.may_reach(low, high, margin + motion)
    }
}

impl Solid {
    /// A bounding ball: endless for half-spaces.
    pub(super) fn ball(&self) -> (Vec3, f32) {
        match *self {
            Solid::HalfSpace { point, .. } => (point, f32::INFINITY),
            Solid::Capsule { a, b, radius } => (0.5 * (a + b), radius + 0.5 * a.distance(b)),
            Solid::Cylinder { center, radius, half_height, .. } => {
                (center, radius.hypot(half_height))
            }
            Solid::Placed(ref placed) => placed.ball(),
        }
    }

    /// Whether any point of the box `low…high`, grown by `margin`, may lie inside. Conservative:
    /// true where in doubt.
    pub fn may_reach(&self, low: Vec3, high: Vec3, margin: f32) -> bool {
        let center = 0.5 * (low + high);
        let half = 0.5 * (high - low) + margin;
        let overlaps =
            |low: Vec3, high: Vec3| (low.cmple(center + half) & high.cmpge(center - half)).all();
        match *self {
            Solid::HalfSpace { normal, point } => {
                (center - point).dot(normal) <= normal.abs().dot(half)
            }
            Solid::Capsule { a, b, radius } => overlaps(a.min(b) - radius, a.max(b) + radius),
            Solid::Cylinder { center: c, axis, radius, half_height } => {
                let across = (Vec3::ONE - axis * axis).max(Vec3::ZERO);
                let reach = axis.abs() * half_height
                    + radius * Vec3::new(across.x.sqrt(), across.y.sqrt(), across.z.sqrt());
                overlaps(c - reach, c + reach)
            }
            Solid::Placed(ref placed) => {
                let (c, reach) = placed.bounds();
                overlaps(c - reach, c + reach)
            }
        }
    }
}

/// The direction and length of `v`. For a point on a collider's axis, where the shortest way out is
/// not unique, the direction is `or`.
#[inline(always)]
fn unit_or<R: Real>(v: V3<R>, or: Vec3) -> (V3<R>, R) {
    let tiny = v.x.lit(1e-12);
    let length = v.dot(v).sqrt();
    let degenerate = length.lt(tiny);
    let inverse = v.x.lit(1.0) / length.max(tiny);
    (V3::select(degenerate, splat(v.x, or), v.scale(inverse)), length)
}

impl Solid {
    /// The unit normal of the surface nearest to `p`, and how deep `p` is below a layer of `clearance`
    /// (m) on it: negative outside.
    #[inline(always)]
    pub(crate) fn depth<R: Real>(&self, p: V3<R>, clearance: f32) -> (V3<R>, R) {
        let one = p.x;
        let lit = |value: f32| one.lit(value.into());
        match *self {
            Solid::HalfSpace { normal, point } => {
                let n = splat(one, normal);
                (n, lit(clearance) - (p - splat(one, point)).dot(n))
            }
            Solid::Capsule { a, b, radius } => {
                let axis = b - a;
                let inverse = 1.0 / axis.length_squared().max(1e-20);
                let rel = p - splat(one, a);
                let t = rel.dot(splat(one, axis * inverse));
                let t = t.max(lit(0.0)).min(lit(1.0));
                let off = rel - splat(one, axis).scale(t);
                let (n, distance) = unit_or(off, across(axis));
                (n, lit(radius + clearance) - distance)
            }
            Solid::Cylinder { center, axis, radius, half_height } => {
                let u = splat(one, axis);
                let rel = p - splat(one, center);
                let along = rel.dot(u);
                let off = rel - u.scale(along);
                let (radial, distance) = unit_or(off, across(axis));
                let side = lit(radius + clearance) - distance;
                let below = along.lt(lit(0.0));
                let cap = lit(half_height + clearance) - R::select(below, -along, along);
                let cap_normal = V3::select(below, -u, u);
                let nearer_cap = cap.lt(side);
                // Outside where either is negative: the smaller of the two decides.
                (V3::select(nearer_cap, cap_normal, radial), cap.min(side))
            }
            Solid::Placed(ref placed) => placed.depth(p, clearance),
        }
    }
}

impl Solid {
    /// Whether `p` is outside of a layer of `clearance` (m) on it in all lanes, where that is cheaper to know
    /// than the [`depth`](Self::depth). With room for rounding, so that no lane's result depends on the others.
    #[inline(always)]
    pub(super) fn is_clear<S: Simd>(&self, p: V3<f32x16<S>>, clearance: f32) -> bool {
        let thickness = match *self {
            Solid::Capsule { radius, .. } => radius,
            Solid::Cylinder { radius, half_height, .. } => radius.min(half_height),
            Solid::Placed(ref placed) if placed.is_costly() => placed.thickness(),
            _ => return false,
        };
        self.is_beyond(p, f32x16::splat(p.x.simd, clearance + 1e-3 * thickness)).all_true()
    }

    /// Whether `p` is farther than `distance` (m) outside. Conservative: false near corners and for NaN;
    /// cheaper than [`depth`](Self::depth), which computes the normal as well.
    #[inline(always)]
    pub(super) fn is_beyond<S: Simd>(&self, p: V3<f32x16<S>>, distance: f32x16<S>) -> mask32x16<S> {
        let lit = |value: f32| f32x16::splat(p.x.simd, value);
        match *self {
            Solid::HalfSpace { normal, point } => {
                Real::lt(distance, (p - splat(p.x, point)).dot(splat(p.x, normal)))
            }
            Solid::Capsule { a, b, radius } => {
                let mut off = p - splat(p.x, a);
                if a != b {
                    let axis = b - a;
                    let inverse = 1.0 / axis.length_squared().max(1e-20);
                    let t = off.dot(splat(p.x, axis * inverse));
                    let t = Real::min(Real::max(t, lit(0.0)), lit(1.0));
                    off = splat(p.x, axis).scale_add(-t, off);
                }
                let reach = lit(radius) + distance;
                Real::lt(reach * reach, off.dot(off))
            }
            Solid::Cylinder { center, axis, radius, half_height } => {
                let rel = p - splat(p.x, center);
                let along = rel.dot(splat(p.x, axis));
                let off = splat(p.x, axis).scale_add(-along, rel);
                let (side, cap) = (lit(radius) + distance, lit(half_height) + distance);
                Real::lt(side * side, off.dot(off)) | Real::lt(cap * cap, along * along)
            }
            Solid::Placed(ref placed) => placed.is_beyond(p, distance),
        }
    }
}

/// How a node is moved out of a solid.
pub(super) struct Push<S: Simd> {
    /// Where it gets to.
    pub(super) to: V3<f32x16<S>>,
    /// The solid's normal there, or zero in lanes that are not inside.
    pub(super) normal: V3<f32x16<S>>,
    /// How deep it was (m), at least 0.
    pub(super) depth: f32x16<S>,
}

impl<S: Simd> Push<S> {
    /// How far it goes along the surface from `start`, a place that moves with it, and the length of that (m).
    #[inline(always)]
    pub(super) fn slip(&self, start: V3<f32x16<S>>) -> (V3<f32x16<S>>, f32x16<S>) {
        let slip = self.to - start;
        let along = slip - self.normal.scale(slip.dot(self.normal));
        (along, Real::sqrt(along.dot(along)))
    }
}

/// The shortest way out of the solid for `p` where it is deeper inside than `allowed` (m); `None` where no lane is.
#[inline(always)]
pub(super) fn push_out<S: Simd>(
    obstacle: &Obstacle,
    p: V3<f32x16<S>>,
    clearance: f32,
    allowed: f32x16<S>,
) -> Option<Push<S>> {
    let zero = f32x16::splat(p.x.simd, 0.0);
    // Most nodes that may touch it in the substep do not in this pass.
    if obstacle.solid.is_clear(p, clearance) {
        return None;
    }
    let (normal, depth) = obstacle.solid.depth(p, clearance);
    let depth = depth - allowed;
    let inside = Real::lt(zero, depth);
    if inside.to_bitmask() == 0 {
        return None;
    }
    let depth = Real::max(depth, zero);
    let to = V3::select(inside, normal.scale_add(depth, p), p);
    Some(Push { to, normal: V3::select(inside, normal, V3::new(zero, zero, zero)), depth })
}

/// Continuous collision: stops a node that would pass through a thin or fast solid within the
/// substep. A node that was on one side of it (`start`, moved with the solid) and would be on the
/// other is kept in front of the tangent plane at the surface point nearest to `start`. Returns as
/// [`push_out`] does; `None` where no lane moves fast enough against the solid to pass.
///
/// The path is sampled where it comes nearest to the solid's axis, in its middle and at its end: a
/// node that moves by less than half the solid's thickness cannot pass.
#[inline(always)]
pub(super) fn continuous_collision<S: Simd>(
    obstacle: &Obstacle,
    start: V3<f32x16<S>>,
    p: V3<f32x16<S>>,
    clearance: f32,
) -> Option<(V3<f32x16<S>>, V3<f32x16<S>>)> {
    let simd = p.x.simd;
    let lit = |value: f32| f32x16::splat(simd, value);
    let (thickness, center, axis) = match obstacle.solid {
        Solid::HalfSpace { .. } => return None,
        Solid::Capsule { a, b, radius } => (radius, a, (b - a).normalize_or_zero()),
        Solid::Cylinder { center, axis, radius, half_height } => {
            (radius.min(half_height), center, axis)
        }
        Solid::Placed(ref placed) => (placed.thickness(), placed.center, Vec3::Y),
    };
    let way = p - start;
    // Slower ones stay on their side, where the nearest way out is correct.
    let way_squared = way.dot(way);
    let fast = Real::lt(lit(0.2 * thickness * thickness), way_squared);
    if fast.to_bitmask() == 0 {
        return None;
    }
    // A node that stays on its side of a ball's centre has not passed it.
    if let Solid::Capsule { a, b, .. } = obstacle.solid
        && a == b
    {
        let center = splat(p.x, a);
        if Real::lt(lit(0.0), (p - center).dot(start - center)).all_true() {
            return None;
        }
    }
    // Nor do those that begin farther from it than they go.
    let reach = Real::sqrt(way_squared) + lit(clearance + 1e-3 * thickness);
    if obstacle.solid.is_beyond(start, reach).all_true() {
        return None;
    }
    let (facing, depth) = obstacle.solid.depth(start, clearance);
    let mut deepest = lit(f32::NEG_INFINITY);
    let mut leaving = facing;
    let across = inlined(
        #[inline(always)]
        |v: V3<f32x16<S>>| {
            let u = splat(v.x, axis);
            u.scale_add(-v.dot(u), v)
        },
    );
    let (from, along) = (across(start - splat(p.x, center)), across(way));
    let nearest = -from.dot(along) / Real::max(along.dot(along), lit(1e-20));
    let nearest = match &obstacle.solid {
        Solid::Placed(placed) => placed.deepest(start, way),
        _ => Real::min(Real::max(nearest, lit(0.0)), lit(1.0)),
    };
    for share in [nearest, lit(0.5), lit(1.0)] {
        let (normal, depth) = obstacle.solid.depth(way.scale_add(share, start), clearance);
        deepest = Real::max(deepest, depth);
        leaving = normal;
    }
    let passes = fast
        & Real::lt(lit(0.0), deepest)
        & Real::lt(leaving.dot(facing), lit(0.0))
        & Real::lt(depth, lit(1e-3 * thickness));
    // How far behind the plane: `start` is −depth before it.
    let behind = Real::max(-(way.dot(facing)) + depth, lit(0.0));
    let none = V3::new(lit(0.0), lit(0.0), lit(0.0));
    let held = V3::select(passes, facing.scale_add(behind, p), p);
    Some((held, V3::select(passes, facing, none)))
}

/// A direction perpendicular to an axis; up for an axis without length.
fn across(axis: Vec3) -> Vec3 {
    axis.try_normalize().map_or(Vec3::Y, |u| u.any_orthonormal_vector())
}

const _: () = assert!(LANES == 16, "f32x16 is the lane type");

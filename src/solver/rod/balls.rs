//! Bounding balls of obstacles, sixteen side by side.

use super::obstacle::Obstacle;
use crate::base::lanes::{LANES, Lane, Real, V3, load, load3, put3};
use fearless_simd::{Simd, f32x16, prelude::*};
use glam::{Mat3A, Vec3};

/// The bits of all lanes.
const ALL: u64 = (1 << LANES) - 1;

/// Safety factor on distances of balls, for rounding.
const ROUNDING_MARGIN: f32 = 1.0001;

/// Bounding balls of sixteen obstacles, grown by how far a node of the block may move with each.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ObstacleBalls {
    center: [Lane; 3],
    radius: Lane,
    /// Their places among all obstacles; beyond these where there are fewer than sixteen.
    pub(super) index: [usize; LANES],
}

impl ObstacleBalls {
    /// Balls around `obstacles` for nodes in the ball around `center`.
    pub(super) fn collect<'a>(
        all: &mut Vec<Self>,
        obstacles: impl Iterator<Item = (usize, &'a Obstacle)>,
        (center, radius): (Vec3, f32),
    ) {
        all.clear();
        for (lane, (index, o)) in (0..LANES).cycle().zip(obstacles) {
            if lane == 0 {
                all.push(Self { index: [usize::MAX; LANES], ..Self::default() });
            }
            let (at, reach) = o.solid.ball();
            // An affine displacement grows at most by its matrix' norm from the center on.
            let moved = o.motion.map_or(0.0, |motion| {
                let [x, y, z] = (motion.matrix3 - Mat3A::IDENTITY).to_cols_array_2d();
                let norm = [x, y, z].as_flattened().iter().map(|m| m * m).sum::<f32>().sqrt();
                motion.transform_point3(center).distance(center) + norm * radius
            });
            let Some(balls) = all.last_mut() else { break };
            put3(&mut balls.center, lane, at);
            (balls.radius[lane], balls.index[lane]) = (reach + moved, index);
        }
    }

    /// Bits of those that may be within `reach` of `center`: all in doubt.
    #[inline(always)]
    pub(super) fn near<S: Simd>(&self, center: V3<f32x16<S>>, reach: f32x16<S>) -> u64 {
        let off = load3(reach.simd, &self.center) - center;
        let limit =
            (load(reach.simd, &self.radius) + reach) * f32x16::splat(reach.simd, ROUNDING_MARGIN);
        !Real::lt(limit * limit, off.dot(off)).to_bitmask() & ALL
    }
}

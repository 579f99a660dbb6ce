//! Solids that drawn strands are pushed out of: guides stay out of a head, followers between them may
//! not.

use crate::{
    base::grid::compact_groups,
    forces::contact::{ColliderShape, HairCollider, Obstacles},
};
use bevy::{math::Affine3A, prelude::*};

/// How many solids a hair's drawn strands are pushed out of at most.
pub(super) const MAX_SOLIDS: usize = 192;
/// How many solids share a bounding ball, by which points that are outside of it skip all of them.
pub(super) const GROUP: usize = 8;
/// How many, the largest, block light.
const BLOCKERS: usize = 16;
/// How many times a point goes through all solids, at most: what one pushes out may come to lie in an
/// earlier one.
const SWEEPS: usize = 3;
/// How far around a hat holds strands, in times its size.
const UNDER_HAT: f32 = 4.0;
/// How far outside strands are drawn (m): between two rings they cut through what is round.
const CLEARANCE: f32 = 0.8e-3;
/// Length from the root over which pushing sets in (m), or half of a strand that is shorter than twice
/// that: roots are in the skin.
const ROOT: f32 = 5e-3;

/// A ball, a capsule or an ellipsoid in a hair's frame, as the shader reads it: in its own frame all
/// points within 1 of a segment along Y.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct DrawnSolid {
    /// The axes, by which a point's coordinates are found, and where they begin.
    axes: [Vec4; 3],
    /// Half the segment's length; of a hat [`HOLDS`], [`KEEPS_OUT`] or [`HIDES`].
    half: f32,
    /// The clearance.
    room: f32,
    /// Radius of a ball around the middle that holds the solid with its clearance (m).
    reach: f32,
    /// Of a hat: it is above this along Y.
    rim: f32,
}

/// [`DrawnSolid::half`] of a hat that strands stay under, of one that they stay outside of, and of one above whose rim
/// they are not drawn.
const HOLDS: f32 = -1.0;
const KEEPS_OUT: f32 = -2.0;
const HIDES: f32 = -3.0;

impl DrawnSolid {
    /// What `shape` fills at this place in the hair's frame; of a hat whether it `holds` the hair. `None` if that is no
    /// finite solid of these kinds.
    pub fn new(shape: &ColliderShape, place: &Affine3A, holds: bool) -> Option<Self> {
        let (radii, half_length) = size(shape)?;
        if radii.min_element() <= 0.0 {
            return None;
        }
        let from = place.inverse();
        let rows = from.matrix3.transpose();
        let row = |of: Vec3, begin: f32, radius: f32| of.extend(begin) / radius;
        let begin = Vec3::from(from.translation);
        let axes = [
            row(rows.x_axis.into(), begin.x, radii.x),
            row(rows.y_axis.into(), begin.y, radii.y),
            row(rows.z_axis.into(), begin.z, radii.z),
        ];
        let scale = place.matrix3.determinant().abs().cbrt();
        let (mut half, room) = (half_length / radii.y, CLEARANCE / (radii.min_element() * scale));
        let mut rim = 0.0;
        if let ColliderShape::Hat { rim: height, hides, .. } = shape {
            half = match (holds, hides) {
                (false, _) => KEEPS_OUT,
                (true, false) => HOLDS,
                (true, true) => HIDES,
            };
            rim = height / radii.y;
        }
        let m = place.matrix3;
        let longest = [m.x_axis, m.y_axis, m.z_axis].map(|axis| axis.length()).into_iter();
        let longest = longest.fold(0.0, f32::max);
        // The clearance is a share of the radii.
        let around = if holds && half < 0.0 { UNDER_HAT } else { 1.0 + room.max(0.0) };
        let reach = (radii.max_element() + half_length) * longest * around;
        let is_usable = axes.iter().all(|row| row.is_finite() && row.truncate() != Vec3::ZERO)
            && [half, room, reach, rim].into_iter().all(f32::is_finite);
        is_usable.then_some(Self { axes, half, room, reach, rim })
    }

    /// A ball (m), for tests and tools.
    pub fn ball(center: Vec3, radius: f32) -> Option<Self> {
        let ball = ColliderShape::Sphere(Sphere { radius });
        Self::new(&ball, &Affine3A::from_translation(center), false)
    }

    /// Its middle, in the hair's frame.
    fn center(&self) -> Vec3 {
        let begin = Vec3::from(self.axes.map(|row| row.w));
        Mat3::from_cols_array_2d(&self.axes.map(|row| row.truncate().to_array()))
            .transpose()
            .inverse()
            .mul_vec3(-begin)
    }

    /// Moves a point of a strand out if it is inside, and turns its slope along the surface.
    fn push(&self, position: &mut Vec3, slope: &mut Vec3) -> bool {
        let own = Vec3::from(self.axes.map(|row| row.truncate().dot(*position) + row.w));
        let above = own.y - self.rim;
        let half = self.half.max(0.0);
        let own = own - Vec3::Y * own.y.clamp(-half, half);
        let apart = own.length();
        let mut out = own / apart.max(1e-6);
        let mut missing = 1.0 + self.room - apart;
        if self.half < 0.0 && (above <= 0.0 || self.half == HIDES) {
            return false;
        }
        if self.half == HOLDS {
            // In or down, whichever is shorter.
            missing = self.room + apart - 1.0;
            out = -out;
            if above < missing {
                (missing, out) = (above, Vec3::NEG_Y);
            }
        }
        if missing <= 0.0 {
            return false;
        }
        let rows = self.axes.map(Vec4::truncate);
        let way = |row: Vec3| row / row.length_squared();
        *position += (way(rows[0]) * out.x + way(rows[1]) * out.y + way(rows[2]) * out.z) * missing;
        let normal = (rows[0] * out.x + rows[1] * out.y + rows[2] * out.z).normalize_or_zero();
        *slope -= normal * normal.dot(*slope);
        true
    }
}

/// Moves the point at `t` (0 root, 1 tip) of a strand so long (m) out of all solids, and turns its slope
/// along the surfaces.
pub(super) fn push_out(
    solids: &[DrawnSolid],
    t: f32,
    length: f32,
    position: &mut Vec3,
    slope: &mut Vec3,
) {
    let (mut outside, mut along) = (*position, *slope);
    for _ in 0..SWEEPS {
        let pushed = solids.iter().filter(|solid| solid.push(&mut outside, &mut along)).count();
        if pushed < 2 {
            break;
        }
    }
    let grown = (t * length / ROOT.min(0.5 * length).max(1e-6)).clamp(0.0, 1.0);
    *position = position.lerp(outside, grown);
    *slope = slope.lerp(along, grown);
}

/// Orders solids, of which the largest come first, as the shader goes through them: those that block
/// light, then such that are near each other in groups. As many as it takes.
pub fn arrange(solids: &mut Vec<DrawnSolid>) {
    solids.truncate(MAX_SOLIDS);
    let small = solids.split_off(solids.len().min(BLOCKERS));
    let centers: Vec<Vec3> = small.iter().map(DrawnSolid::center).collect();
    solids.extend(compact_groups(&centers, GROUP).into_iter().map(|i| small[i as usize]));
}

/// Adds the solids that may touch what is in a box, of middle and half its size, in the frame of a hair at `place`.
pub(super) fn gather(
    solids: &mut Vec<DrawnSolid>,
    balls: &[Ball],
    inside: (Vec3, Vec3),
    place: &GlobalTransform,
    colliders: &Query<(Entity, &HairCollider, &GlobalTransform)>,
    obstacles: Option<&Obstacles>,
) {
    let (hair, from_world) = (place.affine(), place.affine().inverse());
    let near = balls.iter().filter(|ball| ball.is_near(inside, &hair));
    solids.extend(near.filter_map(|ball| {
        let (_, of, at) = colliders.get(ball.collider).ok()?;
        let holds = obstacles.is_some_and(|obstacles| obstacles.is_held_by(ball.collider));
        DrawnSolid::new(&of.shape, &(from_world * at.affine()), holds)
    }));
}

/// A ball around some solids: its middle and radius.
pub(super) fn bounds(solids: &[DrawnSolid]) -> Vec4 {
    let centers = || solids.iter().map(DrawnSolid::center);
    let low = centers().fold(Vec3::MAX, Vec3::min);
    let high = centers().fold(Vec3::MIN, Vec3::max);
    let center = low.midpoint(high);
    let reaches = solids.iter().map(|solid| solid.center().distance(center) + solid.reach);
    center.extend(reaches.fold(0.0, f32::max))
}

/// Radii and half the length of a solid that the shader knows.
fn size(shape: &ColliderShape) -> Option<(Vec3, f32)> {
    match shape {
        ColliderShape::Sphere(s) => Some((Vec3::splat(s.radius), 0.0)),
        ColliderShape::Capsule(c) => Some((Vec3::splat(c.radius), c.half_length)),
        ColliderShape::Ellipsoid { radii } | ColliderShape::Hat { radii, .. } => {
            Some((*radii, 0.0))
        }
        _ => None,
    }
}

/// A ball around a collider in the world.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ball {
    center: Vec3,
    pub(super) radius: f32,
    pub(super) collider: Entity,
}

impl Ball {
    /// `None` for shapes that the shader does not know.
    pub(super) fn around(
        entity: Entity,
        of: &HairCollider,
        place: &GlobalTransform,
    ) -> Option<Self> {
        let (radii, half_length) = size(&of.shape)?;
        let m = place.affine().matrix3;
        let longest = m.x_axis.length().max(m.y_axis.length()).max(m.z_axis.length());
        let radius = (radii.max_element() + half_length) * longest;
        Some(Self { center: place.translation(), radius, collider: entity })
    }

    /// Whether it may touch what is in a box in a hair's frame.
    pub(super) fn is_near(&self, (center, half): (Vec3, Vec3), hair: &Affine3A) -> bool {
        let scale = hair.matrix3.determinant().abs().cbrt();
        let center = hair.transform_point3(center);
        center.distance(self.center) <= half.length() * scale + self.radius
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pushed(solid: &DrawnSolid, length: f32, mut p: Vec3) -> Vec3 {
        let mut slope = Vec3::X;
        push_out(&[*solid], 1.0, length, &mut p, &mut slope);
        p
    }

    #[test]
    fn points_inside_come_out_by_the_clearance_and_others_stay() {
        let ball = DrawnSolid::ball(Vec3::X, 0.1).unwrap();
        let out = pushed(&ball, 0.1, Vec3::new(1.0, 0.06, 0.0));
        assert!(out.distance(Vec3::new(1.0, 0.1 + CLEARANCE, 0.0)) < 1e-6, "{out}");
        let free = Vec3::new(1.0, 0.2, 0.0);
        assert_eq!(pushed(&ball, 0.1, free), free);
        let root = Vec3::new(1.0, 0.0995, 0.0);
        assert_eq!(pushed(&ball, 0.0, root), root, "roots are in the skin");
        let stub = pushed(&ball, 2e-3, root);
        assert!(
            stub.distance(Vec3::new(1.0, 0.1 + CLEARANCE, 0.0)) < 1e-6,
            "short hair shows: {stub}"
        );
    }

    #[test]
    fn a_capsule_that_is_turned_and_scaled_pushes_across_its_axis() {
        let capsule = ColliderShape::Capsule(Capsule3d::new(0.1, 0.4));
        let turn = Quat::from_rotation_z(core::f32::consts::FRAC_PI_2);
        let place = Affine3A::from_scale_rotation_translation(Vec3::splat(2.0), turn, Vec3::Z);
        let capsule = DrawnSolid::new(&capsule, &place, false).unwrap();
        let out = pushed(&capsule, 0.1, Vec3::new(0.3, 0.1, 1.0));
        assert!(out.distance(Vec3::new(0.3, 0.2 + CLEARANCE, 1.0)) < 1e-5, "{out}");
        let end = pushed(&capsule, 0.1, Vec3::new(-0.45, 0.0, 1.0));
        assert!(end.distance(Vec3::new(-0.6 - CLEARANCE, 0.0, 1.0)) < 1e-5, "{end}");
    }

    #[test]
    fn what_is_no_finite_solid_is_left_out() {
        let at = Affine3A::from_translation;
        let ball = |radius| ColliderShape::Sphere(Sphere { radius });
        assert_eq!(DrawnSolid::new(&ball(0.1), &at(Vec3::NAN), false), None);
        assert_eq!(DrawnSolid::new(&ball(0.0), &at(Vec3::ZERO), false), None);
        assert_eq!(DrawnSolid::new(&ball(0.1), &Affine3A::from_scale(Vec3::ZERO), false), None);
        let plane = ColliderShape::Plane(InfinitePlane3d::new(Vec3::Y));
        assert_eq!(DrawnSolid::new(&plane, &at(Vec3::ZERO), false), None);
        let inside = pushed(&DrawnSolid::ball(Vec3::ZERO, 0.1).unwrap(), 0.1, Vec3::ZERO);
        assert!(inside.is_finite());
    }
}

//! Where things are within a tick, and what the motion of the hair's own frame does to the hair.
//!
//! Transforms change once a tick or a frame; a substep wants them in between. [`TickPose`] takes
//! hair, colliders, rods and blowers from where they were to where they are in equal parts.
//!
//! Strands live in the frame of their `Hair`, where roots do not move. In a frame that moves, things
//! at rest in the world seem to move the other way: each substep the nodes are carried by the inverse
//! of the frame's motion, which is exactly inertia.

use bevy::{
    math::{Affine3A, Isometry3d},
    prelude::*,
};

/// Where an entity is within the tick, spread over its substeps. Written by `Roots` from the
/// entity's global transform.
#[derive(Component, Reflect, Clone, Debug, Default)]
#[reflect(Component, Default, Clone)]
pub struct TickPose {
    from: Option<Pose>,
    to: Pose,
    now: Pose,
    before: Pose,
    was_invalid: bool,
}

/// A rigid pose with a scale.
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Place in the world (m).
    pub translation: Vec3,
    /// Orientation in the world.
    pub rotation: Quat,
    /// World units per unit of the hair.
    pub scale: f32,
}

impl Default for Pose {
    fn default() -> Self {
        Self { translation: Vec3::ZERO, rotation: Quat::IDENTITY, scale: 1.0 }
    }
}

impl Pose {
    /// The pose of a global transform: of an uneven scale the mean. `None` when it is not finite or
    /// flattens space.
    pub fn of(transform: &GlobalTransform) -> Option<Self> {
        let (scale, rotation, translation) = transform.to_scale_rotation_translation();
        let scale = scale.element_product().abs().cbrt();
        let valid = translation.is_finite()
            && rotation.is_finite()
            && rotation.length_squared() > 0.5
            && scale.is_finite()
            && scale > 1e-9;
        valid.then(|| Self { translation, rotation: rotation.normalize(), scale })
    }

    /// From `self` (0) to `to` (1).
    pub(crate) fn toward(&self, to: &Self, t: f32) -> Self {
        if t >= 1.0 {
            return *to;
        }
        Self {
            translation: self.translation.lerp(to.translation, t),
            rotation: self.rotation.slerp(to.rotation, t),
            scale: self.scale + (to.scale - self.scale) * t,
        }
    }

    /// A direction of the world, seen from the hair.
    pub fn direction_in(&self, direction: Vec3) -> Vec3 {
        self.rotation.inverse() * direction
    }

    /// A point of the world, in the hair's units.
    pub fn point_in(&self, point: Vec3) -> Vec3 {
        self.rotation.inverse() * (point - self.translation) / self.scale
    }

    /// A point of the hair, in the world.
    pub fn point_out(&self, point: Vec3) -> Vec3 {
        self.rotation * (point * self.scale) + self.translation
    }

    /// The pose as a transform from its own space to the world.
    pub fn affine(&self) -> Affine3A {
        Affine3A::from_scale_rotation_translation(
            Vec3::splat(self.scale),
            self.rotation,
            self.translation,
        )
    }
}

impl TickPose {
    /// The pose at the end of this substep.
    pub fn now(&self) -> &Pose {
        &self.now
    }

    /// The pose at the end of the substep before.
    pub fn before(&self) -> &Pose {
        &self.before
    }

    /// How this pose goes from before to now as seen in `hair`: what carries a point of its surface
    /// along; `None` if it rests. Nodes have been carried into the hair's frame as it is now, so what
    /// rests in the world rests in it, whatever the frame did.
    pub fn motion_in(&self, hair: &Pose) -> Option<Affine3A> {
        (self.now != self.before).then(|| {
            let hair = hair.affine();
            hair.inverse() * self.now.affine() * self.before.affine().inverse() * hair
        })
    }

    /// Begins a tick: the frame is to go to `to`, from where it was; from `to` itself the first time.
    /// Says whether an invalid pose should be reported.
    pub(super) fn aim(&mut self, to: Option<Pose>) -> bool {
        let report = to.is_none() && !self.was_invalid;
        self.was_invalid = to.is_none();
        let from = if self.from.is_some() { Some(self.to) } else { to };
        self.to = to.unwrap_or(self.to);
        if self.from.is_none() {
            self.now = self.to;
        }
        self.from = from;
        report
    }

    /// Goes to the share `t` of the tick's motion.
    pub(super) fn advance(&mut self, t: f32) {
        self.before = self.now;
        self.now = self.from.unwrap_or(self.to).toward(&self.to, t);
    }

    /// How a point at rest in the world moves in this frame during the substep; `None` if the frame
    /// did not move.
    pub fn carry(&self) -> Option<Isometry3d> {
        (self.before != self.now).then(|| {
            let rotation = (self.now.rotation.inverse() * self.before.rotation).normalize();
            let translation = self.now.rotation.inverse()
                * (self.before.translation - self.now.translation)
                / self.now.scale;
            Isometry3d::new(translation, rotation)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_rests_in_the_world_is_carried_so_that_it_still_does() {
        let a = Pose {
            translation: Vec3::new(1.0, 2.0, 3.0),
            rotation: Quat::from_rotation_y(0.3),
            scale: 2.0,
        };
        let b = Pose {
            translation: Vec3::new(1.5, 1.0, 3.0),
            rotation: Quat::from_rotation_x(1.0),
            scale: 2.0,
        };
        let mut frame = TickPose::default();
        assert!(!frame.aim(Some(a)));
        frame.advance(1.0);
        assert!(frame.carry().is_none(), "the first tick begins where the frame is");
        frame.aim(Some(b));
        let world = Vec3::new(0.2, 0.4, -0.3);
        let mut local = a.point_in(world);
        for i in 1..=6 {
            frame.advance(i as f32 / 6.0);
            local = frame.carry().unwrap() * local;
        }
        assert!(b.point_out(local).distance(world) < 1e-5);
        assert!(frame.aim(None) && !frame.aim(None), "reported once");
        frame.advance(1.0);
        assert_eq!(*frame.now(), b);
    }
}

//! Poses of entities within a tick, and inertia from the motion of the hair's frame.
//!
//! Transforms change once a tick or a frame; substeps need poses in between. [`TickPose`]
//! interpolates hair, colliders, rods and blowers from their previous to their present pose.
//!
//! Strands live in the frame of their `Hair`, where roots do not move. Seen from a moving frame,
//! points at rest in the world move the opposite way: each substep the nodes are moved by the
//! inverse of the frame's motion, which is exactly inertia.

use crate::base::setting::setting;
use bevy::{
    math::{Affine3A, Isometry3d},
    prelude::*,
};

/// The pose of an entity within the tick, interpolated over its substeps. Written by `Roots` from
/// the entity's global transform.
#[derive(Component, Reflect, Clone, Debug)]
#[component(clone_behavior = Ignore)]
#[reflect(Component, Default, Clone)]
pub struct TickPose {
    from: Option<Pose>,
    to: Pose,
    now: Pose,
    /// The pose at the start of the present substep; for a hair that merges several, of the first
    /// of those.
    before: Pose,
    /// The shares of the tick at `before` and at `now`.
    shares: [f32; 2],
    /// The shares of the frame's translation and rotation that act on its hair as inertia.
    inertia: Vec2,
    jumps: bool,
    /// Whether this tick is one of a teleport.
    jumped: bool,
    was_invalid: bool,
    frames: FramePoses,
}

/// The poses of an entity in the last frames. Frames and ticks are not synchronous: a head that
/// turns evenly from frame to frame would turn by two frames' worth in one tick and by three in the
/// next, and its hair would stutter. So ticks use the pose one frame ago by their own clock,
/// interpolated between the last two frames. An entity that was moved within a tick is used where
/// it is.
#[derive(Reflect, Clone, Debug, Default)]
#[reflect(Default, Clone)]
struct FramePoses {
    /// The last two frames' poses with their times (s), the newer one second.
    last: [Option<(f64, Pose)>; 2],
    /// The pose used by the last tick.
    seen: Option<Pose>,
    /// Whether the last change came from within the ticks.
    moved_by_ticks: bool,
}

impl FramePoses {
    fn are_valid(&self) -> bool {
        let last = self.last.iter().flatten();
        last.clone().all(|(seconds, _)| seconds.is_finite())
            && last.map(|(_, pose)| pose).chain(&self.seen).all(Pose::is_rigid)
    }

    fn record(&mut self, seconds: f64, pose: Pose) {
        if self.seen.is_some_and(|seen| seen != pose) {
            self.moved_by_ticks = false;
        }
        self.seen = Some(pose);
        self.last = [self.last[1], Some((seconds, pose))];
    }

    fn at(&mut self, seconds: f64, present: Pose) -> Pose {
        self.moved_by_ticks |= self.seen.is_some_and(|seen| seen != present);
        self.seen = Some(present);
        match self.last {
            // At rest the pose has to stay the same to the last bit.
            [Some((t0, before)), Some((t1, after))]
                if t0 < t1 && before != after && !self.moved_by_ticks =>
            {
                before.toward(&after, ((seconds - t0) / (t1 - t0)).clamp(0.0, 1.0) as f32)
            }
            _ => present,
        }
    }
}

impl Default for TickPose {
    fn default() -> Self {
        let pose = Pose::default();
        Self {
            from: None,
            to: pose,
            now: pose,
            before: pose,
            shares: [0.0; 2],
            inertia: Vec2::ONE,
            jumps: false,
            jumped: false,
            was_invalid: false,
            frames: FramePoses::default(),
        }
    }
}

setting! {
    /// How much the motion of the head acts on its hair. Component of a [`Hair`](crate::Hair), may change at
    /// any time; where absent, [`HairDefault<HairInertia>`](crate::HairDefault) holds.
    ///
    /// Game characters accelerate and turn faster than any person; with less inertia their hair
    /// trails behind them by less.
    ///
    /// ```
    /// # use bevy_keratin::prelude::*; use bevy::prelude::*;
    /// # let mut world = World::new();
    /// // a fast cartoon character
    /// world.spawn((Hair, HairInertia { moving: 0.3, turning: 0.5, ..default() }));
    /// ```
    #[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Component, Default, Clone, PartialEq)]
    pub struct HairInertia {
        /// Share of the head's translation that acts on the hair as inertia: 1 as in nature, 0 for hair
        /// that moves with the head as if it rested. Headwind and drag are scaled by the same share.
        pub moving: f32 = 1.0, in MOVING: 0.0..=1.0, "1 is as in nature";
        /// The same for the head's rotation.
        pub turning: f32 = 1.0, in TURNING: 0.0..=1.0, "1 is as in nature";
        /// A head that moves farther than this within one tick, and farther than
        /// [`teleport_lengths`](Self::teleport_lengths), counts as teleported: its hair moves with it
        /// in its present shape, at rest. In the hair's own scale; 0.5 is 30 m/s at 60 Hz.
        pub teleport_distance: f32 = 0.5, "m" in TELEPORT_DISTANCE: 0.0..=f32::INFINITY,
            safe 0.1..=f32::INFINITY, "0.5 suits games";
        /// The same in lengths of its longest strand: long hair can follow motion that short hair
        /// cannot. Colliders, rods and blowers that move like some hair teleport when that does.
        pub teleport_lengths: f32 = 3.0, in TELEPORT_LENGTHS: 0.0..=f32::INFINITY,
            safe 1.0..=10.0, "3 is a fast whip of the head";
        /// The same for a head that turns by more than this. 1.6 is more than 5000° a second at
        /// 60 Hz; π and above never happen.
        pub teleport_angle: f32 = 1.6, "rad" in TELEPORT_ANGLE: 0.0..=f32::INFINITY,
            "1.6 suits games";
    }
}

impl HairInertia {
    /// Whether a change from one pose to another within a tick counts as a teleport.
    fn is_jump(&self, from: &Pose, to: &Pose, longest: impl FnOnce() -> f32) -> bool {
        let distance = to.translation.distance(from.translation) / to.size().max(from.size());
        to.scale * from.scale < 0.0
            || distance > self.teleport_distance && distance > self.teleport_lengths * longest()
            || to.rotation.angle_between(from.rotation) > self.teleport_angle
    }
}

/// A rigid pose with a scale. A mirror image is a point reflection: its scale is negative.
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Position in the world (m).
    pub translation: Vec3,
    /// Orientation in the world.
    pub rotation: Quat,
    /// World units per unit of the hair; negative where the hair is mirrored.
    pub scale: f32,
}

/// About X.
const HALF_TURN: Quat = Quat::from_xyzw(1.0, 0.0, 0.0, 0.0);

impl Default for Pose {
    fn default() -> Self {
        Self { translation: Vec3::ZERO, rotation: Quat::IDENTITY, scale: 1.0 }
    }
}

impl Pose {
    /// The pose of a global transform, with the mean of a non-uniform scale, which is negative for a
    /// transform that mirrors. `None` when it is not finite or not invertible.
    pub fn of(transform: &GlobalTransform) -> Option<Self> {
        let (scale, rotation, translation) = transform.to_scale_rotation_translation();
        // The decomposition mirrors along X: that is a point reflection and half a turn about X.
        let (rotation, scale) = match scale.element_product().cbrt() {
            mirrored if mirrored < 0.0 => (rotation * HALF_TURN, mirrored),
            scale => (rotation, scale),
        };
        let pose = Self { translation, rotation, scale };
        pose.is_valid().then(|| Self { rotation: rotation.normalize(), ..pose })
    }

    fn is_valid(&self) -> bool {
        let Self { translation, rotation, scale } = self;
        translation.is_finite()
            && rotation.is_finite()
            && rotation.length_squared() > 0.5
            && scale.is_finite()
            && scale.abs() > 1e-9
    }

    /// Whether it is valid, with a rotation of unit length, as the tick keeps them.
    fn is_rigid(&self) -> bool {
        self.is_valid() && self.rotation.is_normalized()
    }

    /// From `self` (0) to `to` (1).
    pub(crate) fn toward(&self, to: &Self, t: f32) -> Self {
        // At rest the pose has to stay the same to the last bit: far from the origin an ulp is a visible jump.
        if t >= 1.0 || self == to {
            return *to;
        }
        Self {
            translation: self.translation.lerp(to.translation, t),
            rotation: self.rotation.slerp(to.rotation, t),
            scale: self.scale + (to.scale - self.scale) * t,
        }
    }

    /// World units per unit of the hair, mirrored or not.
    pub fn size(&self) -> f32 {
        self.scale.abs()
    }

    /// A direction of the world, seen from the hair.
    pub fn direction_in(&self, direction: Vec3) -> Vec3 {
        self.rotation.inverse() * direction * self.scale.signum()
    }

    /// A direction of the hair, in the world.
    pub fn direction_out(&self, direction: Vec3) -> Vec3 {
        self.rotation * direction * self.scale.signum()
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

    /// The pose at the end of the previous substep; for a hair that merges several, before the
    /// first of those.
    pub fn before(&self) -> &Pose {
        &self.before
    }

    /// How this pose moves during the substep of `hair`, in the hair's frame: the motion of a point
    /// fixed to it; `None` if it rests. Nodes are already in the present frame of the hair, so with
    /// full inertia an entity at rest in the world has no motion here, whatever the frame does.
    #[doc(hidden)]
    pub fn motion_in(&self, hair: &TickPose) -> Option<Affine3A> {
        let began = self.at(hair.shares[0]);
        if hair.inertia == Vec2::ONE {
            return (self.now != began).then(|| {
                let hair = hair.now.affine();
                hair.inverse() * self.now.affine() * began.affine().inverse() * hair
            });
        }
        let seen = |own: &Pose, hair: &Pose| hair.affine().inverse() * own.affine();
        let (before, now) = (seen(&began, &hair.before), seen(&self.now, &hair.now));
        let followed = hair.frame_delta().map_or(before, |delta| Affine3A::from(delta) * before);
        (now != followed).then(|| now * followed.inverse())
    }

    /// Ends its motion: it rests where it is until the next tick.
    pub(crate) fn hold(&mut self) {
        self.before = self.now;
        self.shares[0] = self.shares[1];
    }

    /// Treats the next tick's change of pose as a teleport, not as motion.
    pub fn jump(&mut self) {
        self.jumps = true;
    }

    /// Begins a tick in which the frame moves from its previous pose to `to`; it starts at `to` the
    /// first time and on a teleport, which depends on the `longest` strand (m). Returns whether it
    /// was a teleport, and whether an invalid pose should be reported.
    pub(super) fn aim(
        &mut self,
        to: Option<Pose>,
        seconds: f64,
        inertia: &HairInertia,
        longest: impl FnOnce() -> f32,
    ) -> (bool, bool) {
        let report = to.is_none() && !self.was_invalid;
        self.was_invalid = to.is_none();
        // Written from outside, for instance by an inspector: start over.
        let known = [self.to, self.now, self.before, self.from.unwrap_or_default()];
        if !known.iter().all(Pose::is_rigid) || !self.frames.are_valid() {
            *self = Self { jumps: self.jumps, was_invalid: self.was_invalid, ..default() };
        }
        self.inertia = Vec2::new(inertia.moving, inertia.turning);
        let first = self.from.is_none();
        let requested = core::mem::take(&mut self.jumps);
        let put =
            !first && to.is_some_and(|to| requested || inertia.is_jump(&self.to, &to, longest));
        let to = to.map(|present| {
            if put {
                self.frames = FramePoses::default();
            }
            self.frames.at(seconds, present)
        });
        let from = if first || put { to } else { Some(self.to) };
        self.to = to.unwrap_or(self.to);
        if first || put {
            self.now = self.to;
        }
        self.from = from;
        self.shares[1] = 0.0;
        self.jumped = put;
        (put, report)
    }

    /// Whether it was teleported at the beginning of this tick.
    #[cfg(feature = "gpu")]
    pub(crate) fn has_jumped(&self) -> bool {
        self.jumped
    }

    /// The displacement of the entity in this tick (m).
    pub(super) fn displacement_to(&self, to: &Pose) -> Vec3 {
        to.translation - self.to.translation
    }

    /// Records the entity's pose at the start of a frame; `seconds` is the time of the previous
    /// frame.
    pub(super) fn record(&mut self, seconds: f64, pose: Option<Pose>) {
        if let Some(pose) = pose {
            self.frames.record(seconds, pose);
        }
    }

    /// Advances to the share `t` of the tick's motion; the substep continues while a hair `waits`
    /// to merge several.
    pub(super) fn advance(&mut self, t: f32, waits: bool) {
        if !waits {
            self.before = self.now;
            self.shares[0] = self.shares[1];
        }
        self.now = self.at(t);
        self.shares[1] = t;
    }

    fn at(&self, t: f32) -> Pose {
        let from = self.from.unwrap_or(self.to);
        if t > 0.0 { from.toward(&self.to, t) } else { from }
    }

    /// How a point at rest in the world moves in this frame during the substep; `None` if the frame
    /// did not move. With less than full [`HairInertia`] it is only that share of the motion.
    #[doc(hidden)]
    pub fn frame_delta(&self) -> Option<Isometry3d> {
        (self.before != self.now).then(|| {
            let rotation = (self.now.rotation.inverse() * self.before.rotation).normalize();
            let translation = self.now.rotation.inverse()
                * (self.before.translation - self.now.translation)
                / self.now.scale;
            match self.inertia {
                Vec2::ONE => Isometry3d::new(translation, rotation),
                Vec2 { x: moving, y: turning } => {
                    Isometry3d::new(translation * moving, Quat::IDENTITY.slerp(rotation, turning))
                }
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_interpolate_frames_and_take_their_own_writes_as_they_are() {
        let at = |x: f32| Pose { translation: Vec3::X * x, ..default() };
        let mut frames = FramePoses::default();
        assert_eq!(frames.at(0.0, at(1.0)), at(1.0), "nothing is known yet");
        frames.record(1.0, at(1.0));
        frames.record(2.0, at(2.0));
        assert_eq!(frames.at(1.25, at(2.0)), at(1.25));
        assert_eq!(frames.at(9.0, at(2.0)), at(2.0), "no extrapolation");
        // A tick moves it: it is where the tick put it, also after it stopped there.
        assert_eq!(frames.at(2.5, at(2.5)), at(2.5));
        frames.record(3.0, at(2.5));
        assert_eq!(frames.at(2.5, at(2.5)), at(2.5));
        // A frame moves it again.
        frames.record(4.0, at(4.0));
        assert_eq!(frames.at(3.5, at(4.0)), at(3.25));
        let turned = Pose { rotation: Quat::from_rotation_y(0.3), ..at(4.0) };
        frames.record(5.0, turned);
        frames.record(6.0, turned);
        assert_eq!(frames.at(5.3, turned), turned, "bit for bit");
    }

    #[test]
    fn what_rests_in_the_world_keeps_resting_in_a_moving_frame() {
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
        let inertia = HairInertia { teleport_distance: 10.0, ..default() };
        assert_eq!(frame.aim(Some(a), 0.0, &inertia, || 0.0), (false, false));
        frame.advance(1.0, false);
        assert!(frame.frame_delta().is_none(), "the first tick begins where the frame is");
        frame.aim(Some(b), 0.0, &inertia, || 0.0);
        let world = Vec3::new(0.2, 0.4, -0.3);
        let mut local = a.point_in(world);
        for i in 1..=6 {
            frame.advance(i as f32 / 6.0, false);
            local = frame.frame_delta().unwrap() * local;
        }
        assert!(b.point_out(local).distance(world) < 1e-5);
        // Back again, two substeps as one; what moves along is seen to move as far.
        let mut beside = frame.clone();
        frame.aim(Some(a), 0.0, &inertia, || 0.0);
        beside.aim(
            Some(Pose { translation: b.translation + Vec3::X * 0.6, ..b }),
            0.0,
            &inertia,
            || 0.0,
        );
        for i in 1..=6 {
            frame.advance(i as f32 / 6.0, i % 2 == 0);
            beside.advance(i as f32 / 6.0, false);
            if i % 2 == 0 {
                local = frame.frame_delta().unwrap() * local;
                let moved = beside.motion_in(&frame).unwrap();
                let point = frame.now().point_in(Vec3::Y);
                let moved = frame.now().point_out(moved.transform_point3(point));
                assert!(moved.distance(Vec3::new(0.2, 1.0, 0.0)) < 1e-5, "{moved}");
            }
        }
        assert!(a.point_out(local).distance(world) < 1e-5);
        frame.aim(Some(b), 0.0, &inertia, || 0.0);
        frame.advance(1.0, false);
        let mut reports = || frame.aim(None, 0.0, &inertia, || 0.0).1;
        assert!(reports() && !reports(), "reported once");
        frame.advance(1.0, false);
        assert_eq!(*frame.now(), b);
    }

    #[test]
    fn values_written_into_a_pose_are_replaced_in_the_next_tick() {
        let a = Pose { translation: Vec3::X, ..default() };
        let broken = Pose { scale: 0.0, ..a };
        let spoils: [fn(&mut TickPose, Pose); 6] = [
            |pose, _| pose.to.rotation.x = 1e6,
            |pose, broken| pose.to = broken,
            |pose, broken| pose.now = broken,
            |pose, _| pose.before.rotation = Quat::from_array([0.0; 4]),
            |pose, broken| pose.from = Some(Pose { translation: Vec3::NAN, ..broken }),
            |pose, broken| pose.frames.last = [Some((f64::NAN, broken)), Some((1.0, broken))],
        ];
        for spoil in spoils {
            let mut pose = TickPose::default();
            pose.aim(Some(a), 0.0, &HairInertia::default(), || 0.0);
            pose.advance(1.0, false);
            spoil(&mut pose, broken);
            pose.aim(Some(a), 0.0, &HairInertia::default(), || 0.0);
            pose.advance(1.0, false);
            assert_eq!((pose.now, pose.before), (a, a));
        }
    }

    #[test]
    fn a_pose_at_rest_far_from_the_origin_stays_the_same_to_the_last_bit() {
        for far in [1234.567, 98_765.43, 1e30] {
            let rotation = Quat::from_rotation_y(0.7);
            let at = Pose { translation: Vec3::new(far, -far, 0.3 * far), rotation, scale: 1.1 };
            let mut pose = TickPose::default();
            for _ in 0..3 {
                pose.aim(Some(at), 0.0, &HairInertia::default(), || 0.0);
                for i in 1..=7 {
                    pose.advance(i as f32 / 7.0, false);
                    assert!(pose.frame_delta().is_none(), "{far}");
                }
            }
        }
    }
}

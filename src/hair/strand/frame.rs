//! Poses of entities within a tick, and inertia from the motion of the hair's frame.
//!
//! Transforms change once a tick or a frame; substeps need poses in between. [`TickPose`]
//! interpolates hair, colliders, rods and blowers from their previous to their present pose.
//!
//! Strands live in the frame of their `Hair`, where roots do not move. Seen from a moving frame,
//! points at rest in the world move the opposite way: each substep the nodes are moved by the
//! inverse of the frame's motion, which is exactly inertia.

use crate::base::{motion::TickMoment, setting::setting, tape::Tape};
use bevy::{
    math::{Affine3A, Isometry3d, Mat3A},
    prelude::*,
};

/// The pose of an entity within the tick, interpolated over its substeps. Written by `Roots` from
/// where the entity is at the end of the tick.
#[derive(Component, Reflect, Clone, Debug)]
#[component(clone_behavior = Ignore)]
#[reflect(Default, Clone)]
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
    was_invalid: bool,
    /// How long the tick is (s).
    seconds: f32,
    /// Its motion in the last tick, jumps left out, and as the transforms had it.
    motion: [PoseMotion; 2],
    /// The last tick that it was in.
    tick: u64,
    /// The frame in which it jumped last.
    jump_frame: u64,
    /// Whether its strands rest on the head in this tick, whatever they did before.
    settles: bool,
    /// Whether its motion is known only in the next tick: it has just come back.
    came_back: bool,
    /// Whether its hair waits: it is scaled down to be hidden.
    waits: bool,
    /// Its largest size so far.
    full_size: f32,
    /// How its transform is squashed and sheared beside the pose.
    stretch: Mat3,
}

/// How a pose moves: velocity (m/s) and spin (rad/s), in the world and along its own axes.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Default, Clone, PartialEq)]
struct PoseMotion {
    velocity: [Vec3; 2],
    spin: [Vec3; 2],
}

impl PoseMotion {
    fn between(from: &Pose, to: &Pose, seconds: f32) -> Self {
        if from == to || seconds <= 0.0 {
            return Self::default();
        }
        let turn = to.rotation * from.rotation.inverse();
        let turn = if turn.w < 0.0 { -turn } else { turn };
        let velocity = (to.translation - from.translation) / seconds;
        let spin = turn.to_scaled_axis() / seconds;
        let own = to.rotation.inverse();
        Self { velocity: [velocity, own * velocity], spin: [spin, own * spin] }
    }

    /// Whether this motion explains another: it goes on in the world, or turned with the pose.
    fn explains(&self, other: &Self, size: f32, limits: &HairInertia) -> bool {
        let near = |a: &[Vec3; 2], b: &[Vec3; 2], most: f32| {
            a.iter().zip(b).any(|(a, b)| a.distance(*b) <= most)
        };
        near(&self.velocity, &other.velocity, limits.teleport_speed * size)
            && near(&self.spin, &other.spin, limits.teleport_spin)
    }

    /// Where a pose that moves like this, along its own axes, was some seconds ago.
    fn carried_back(&self, to: &Pose, seconds: f32) -> Pose {
        let [velocity, spin] = [self.velocity[1], self.spin[1]].map(|own| to.rotation * own);
        Pose {
            translation: to.translation - velocity * seconds,
            rotation: (Quat::from_scaled_axis(-spin * seconds) * to.rotation).normalize(),
            scale: to.scale,
        }
    }

    fn is_finite(&self) -> bool {
        self.velocity.iter().chain(&self.spin).all(|v| v.is_finite())
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
            was_invalid: false,
            seconds: 0.0,
            motion: [PoseMotion::default(); 2],
            tick: 0,
            jump_frame: 0,
            settles: false,
            came_back: false,
            waits: false,
            full_size: 0.0,
            stretch: Mat3::IDENTITY,
        }
    }
}

/// Where a pose is in a tick.
pub(super) struct Aim<'a> {
    pub(super) tick: TickMoment,
    /// Where it is at the end of the tick; `None` where its transform is not valid.
    pub(super) end: Option<Pose>,
    /// Whether it was moved while time stood still.
    pub(super) was_put: bool,
    pub(super) limits: HairInertia,
    /// Whether what moves like it jumps.
    pub(super) along: Option<bool>,
    /// Where it was at the tick's beginning, by its motion in the frame.
    pub(super) begin: &'a mut dyn FnMut() -> Option<Pose>,
    /// It has jumped: where it is at the tick's beginning and end without what nothing explains, if known.
    pub(super) jump: &'a mut dyn FnMut() -> Option<[Pose; 2]>,
}

/// What a tick's motion means for the hair of a pose.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Aimed {
    /// Whether an invalid pose should be reported.
    pub(super) report: bool,
    /// Whether it jumps.
    pub(super) jumps: bool,
    /// Its strands come to rest on the head.
    pub(super) settles: bool,
    /// What is added to the velocities of its strands, so that they stay what they are seen from the
    /// head: a velocity and a spin in the hair's frame.
    pub(super) change: Option<[Vec3; 2]>,
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
        /// A head whose velocity changes by more than this within a tick, or a frame that moves it, has
        /// jumped: a portal, a respawn. Its hair keeps its shape and its motion as seen from the head.
        /// In the hair's own scale, at any tick rate.
        pub teleport_speed: f32 = 25.0, "m/s" in TELEPORT_SPEED: 0.0..=f32::INFINITY,
            safe 5.0..=f32::INFINITY, "25 is more than a character turns about by at a run";
        /// The same for its angular velocity.
        pub teleport_spin: f32 = 40.0, "rad/s" in TELEPORT_SPIN: 0.0..=f32::INFINITY,
            safe 10.0..=f32::INFINITY, "40 is a pirouette that turns about";
        /// A head that is scaled to less than this share of its largest scale is hidden, as games hide it
        /// in first person: its hair waits unsolved, and comes back at rest in the shape it had. 0
        /// never waits.
        pub hidden_scale: f32 = 0.15, in HIDDEN_SCALE: 0.0..=1.0, "0.15 hides heads of a tenth";
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

/// The size of what is scaled to nothing.
const VANISHED: f32 = 1e-6;

/// About X.
const HALF_TURN: Quat = Quat::from_xyzw(1.0, 0.0, 0.0, 0.0);

impl Default for Pose {
    fn default() -> Self {
        Self { translation: Vec3::ZERO, rotation: Quat::IDENTITY, scale: 1.0 }
    }
}

/// Axes count as alike and perpendicular up to this.
pub(super) const ALIKE: f32 = 1e-4;

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

/// The motion of air or water that something carries, in a hair's frame.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Carried {
    velocity: Vec3,
    spin: Vec3,
    center: Vec3,
}

impl Carried {
    /// Without a turn (m/s).
    #[cfg(test)]
    pub(crate) fn along(velocity: Vec3) -> Self {
        Self { velocity, ..Self::default() }
    }

    /// Its velocity at a place (m/s). Hair that turns along rests in it at any scale: from the hair's
    /// origin on the turn counts in the hair's measure, up to there in metres.
    pub(crate) fn at(&self, place: Vec3) -> Vec3 {
        self.velocity + self.spin.cross(place - self.center)
    }

    /// For records: velocity, spin and centre.
    #[cfg(feature = "gpu")]
    pub(crate) fn parts(&self) -> [Vec3; 3] {
        [self.velocity, self.spin, self.center]
    }
}

impl Pose {
    pub(crate) fn record(&mut self, tape: &mut Tape<'_>) {
        tape.value(&mut self.translation);
        tape.value(&mut self.rotation);
        tape.value(&mut self.scale);
    }
}

impl TickPose {
    /// Its state; of ticks and frames whether they are the present ones.
    pub(crate) fn record(&mut self, tape: &mut Tape<'_>, now: TickMoment) {
        tape.option(&mut self.from, |tape, pose| pose.record(tape));
        for pose in [&mut self.to, &mut self.now, &mut self.before] {
            pose.record(tape);
        }
        for motion in &mut self.motion {
            tape.value(&mut motion.velocity);
            tape.value(&mut motion.spin);
        }
        tape.value(&mut self.shares);
        tape.value(&mut self.inertia);
        tape.value(&mut self.stretch);
        tape.values([&mut self.seconds, &mut self.full_size]);
        tape.flags([&mut self.jumps, &mut self.was_invalid, &mut self.settles]);
        tape.flags([&mut self.came_back, &mut self.waits]);
        for (at, now) in [(&mut self.tick, now.number), (&mut self.jump_frame, now.frame)] {
            let mut is_past = *at != now;
            tape.flags([&mut is_past]);
            if let Tape::Read(_) = tape {
                *at = now.wrapping_sub(u64::from(is_past));
            }
        }
    }

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

    /// Begins a tick: from where it was to where it is at its end, with what it carries along.
    pub(super) fn aim(&mut self, aim: Aim<'_>) -> Aimed {
        let Aim { tick, end, was_put, limits, along, begin, jump } = aim;
        let report = end.is_none() && !self.was_invalid;
        self.was_invalid = end.is_none();
        // Written from outside, for instance by an inspector: start over.
        let known = [self.to, self.now, self.before, self.from.unwrap_or_default()];
        let is_valid = known.iter().all(Pose::is_rigid)
            && self.motion.iter().all(PoseMotion::is_finite)
            && self.stretch.inverse().is_finite()
            && self.full_size.is_finite();
        if !is_valid {
            *self = Self { jumps: self.jumps, was_invalid: self.was_invalid, ..default() };
        }
        self.inertia = Vec2::new(limits.moving, limits.turning);
        (self.seconds, self.shares, self.settles) = (tick.seconds, [0.0; 2], false);
        let was_away = core::mem::replace(&mut self.tick, tick.number).wrapping_add(1)
            != tick.number
            || core::mem::take(&mut self.waits);
        let requested = core::mem::take(&mut self.jumps);
        let Some(mut to) = end else {
            self.from = self.from.map(|_| self.to);
            return Aimed { report, ..default() };
        };
        self.full_size = self.full_size.max(to.size());
        self.waits = to.size() <= VANISHED || to.size() < limits.hidden_scale * self.full_size;
        if self.from.is_none() || self.waits {
            (self.from, self.to, self.now, self.before) = (Some(to), to, to, to);
            return Aimed { report, ..default() };
        }
        let (mut from, [kept, seen]) = (self.to, self.motion);
        if was_away || was_put || !tick.continues {
            from = Pose { scale: to.scale, ..begin().unwrap_or(to) };
        }
        let mut motion = PoseMotion::between(&from, &to, tick.seconds);
        let size = to.size().max(from.size());
        let is_explained = kept.explains(&motion, size, &limits);
        // As from a gun: it has moved like this in the tick before.
        let is_launched = !is_explained && seen.explains(&motion, size, &limits);
        // In the frame of a jump what frames have moved is seen without it.
        if self.jump_frame != tick.frame || tick.frame == 0 {
            self.motion[1] = motion;
        }
        let jumps = !was_away
            && (requested
                || to.scale * from.scale < 0.0
                || along.unwrap_or(!is_explained && !is_launched));
        if jumps {
            // It moves on as before, to where it is now.
            self.jump_frame = tick.frame;
            (from, to) = match jump() {
                Some([begin, end]) => (Pose { scale: end.scale, ..begin }, end),
                None => (kept.carried_back(&to, tick.seconds), to),
            };
            motion = PoseMotion::between(&from, &to, tick.seconds);
        }
        let came_back = core::mem::take(&mut self.came_back);
        // What has come back is not seen to move before the next tick.
        self.came_back = was_away && motion == PoseMotion::default();
        self.settles = was_away;
        // The tick itself turns velocities from its beginning to its end.
        let own = |v: Vec3| from.rotation.inverse() * v;
        let velocities = if came_back || was_away || !jumps && (was_put || is_launched) {
            let before = if was_away { PoseMotion::default() } else { kept };
            Some([
                (own(motion.velocity[0]), before.velocity[1]),
                (own(motion.spin[0]), before.spin[1]),
            ])
        } else {
            // Time is missing in which the head has turned: it is felt to speed up, not to turn.
            (!tick.continues && !jumps).then(|| {
                let turned = |[world, before]: [Vec3; 2]| (own(world), before);
                [turned(kept.velocity), turned(kept.spin)]
            })
        };
        let change = velocities.map(|[(velocity, before), (spin, spun)]| {
            [(velocity - before) * self.inertia.x / to.scale, (spin - spun) * self.inertia.y]
        });
        let change = change.filter(|change| *change != [Vec3::ZERO; 2]);
        (self.from, self.to, self.motion[0]) = (Some(from), to, motion);
        self.now = from;
        Aimed { report, jumps, settles: was_away, change }
    }

    /// Takes up how `place` is squashed and sheared beside its pose; what moves a point that is fixed to
    /// it, if that has changed.
    pub(super) fn stretch_to(&mut self, place: &GlobalTransform, pose: &Pose) -> Option<Mat3> {
        let own = pose.affine().matrix3.inverse() * place.affine().matrix3;
        let is_even = own.abs_diff_eq(Mat3A::IDENTITY, ALIKE) || !own.inverse().is_finite();
        let own = if is_even { Mat3::IDENTITY } else { Mat3::from(own) };
        let before = core::mem::replace(&mut self.stretch, own);
        let change = own * before.inverse();
        (own != before && change.is_finite()).then_some(change)
    }

    /// Its pose where it is scaled to nothing, which leaves no direction: that which it had. `None` where
    /// it has another fault.
    pub(super) fn vanished(&self, place: &GlobalTransform) -> Option<Pose> {
        let axes = place.affine().matrix3;
        let has_vanished =
            [axes.x_axis, axes.y_axis, axes.z_axis].iter().all(|a| a.length() < 1e-9);
        let scale = VANISHED.copysign(self.to.scale);
        let pose = Pose { translation: place.translation(), rotation: self.to.rotation, scale };
        (has_vanished && pose.is_valid()).then_some(pose)
    }

    /// Whether its hair waits for it to be shown again.
    pub(crate) fn waits(&self) -> bool {
        self.waits
    }

    /// Whether its strands were put to rest at the beginning of this tick.
    #[cfg(feature = "gpu")]
    pub(crate) fn settles(&self) -> bool {
        self.settles
    }

    /// Undoes the motion of the frame on free nodes that it has been applied to.
    pub(crate) fn back(&self) -> Option<Isometry3d> {
        self.frame_delta().map(|delta| delta.inverse())
    }

    /// The displacement of the entity in this tick (m).
    pub(super) fn displacement_to(&self, to: &Pose) -> Vec3 {
        to.translation - self.to.translation
    }

    /// Shifts it with the world.
    pub(crate) fn shift(&mut self, by: Vec3) {
        let poses = [&mut self.to, &mut self.now, &mut self.before];
        for pose in poses.into_iter().chain(&mut self.from) {
            pose.translation += by;
        }
    }

    fn motion(&self) -> PoseMotion {
        PoseMotion::between(&self.from.unwrap_or(self.to), &self.to, self.seconds)
    }

    /// Its velocity in this tick, in the world (m/s); jumps left out.
    pub fn velocity(&self) -> Vec3 {
        self.motion().velocity[0]
    }

    /// How a point that is fixed to it moves in this tick, in the frame and units of its hair, as far as motion acts on that.
    #[cfg(feature = "groom")]
    pub(crate) fn motion_at(&self, place: Vec3) -> Vec3 {
        let PoseMotion { velocity, spin } = self.motion();
        let own = |v: Vec3| self.now.rotation.inverse() * v;
        own(velocity[0]) * self.inertia.x / self.now.scale
            + (own(spin[0]) * self.inertia.y).cross(place)
    }

    /// Its angular velocity in this tick, in the world (rad/s); jumps left out.
    pub fn spin(&self) -> Vec3 {
        self.motion().spin[0]
    }

    /// How air or water moves here that another pose carries, by the shares of motion that act on
    /// hair.
    pub(crate) fn carried_by(&self, other: &Self) -> Carried {
        let PoseMotion { velocity, spin } = other.motion();
        let center = self.now.point_in(other.now.translation);
        Carried {
            velocity: self.now.direction_in(velocity[0] * self.inertia.x),
            spin: self.now.rotation.inverse() * spin[0] * self.inertia.y,
            center: center * self.now.size(),
        }
    }

    /// What is added here to the velocity of air and water, so that a headwind counts in metres a second
    /// at any scale of the hair, as wind and currents do; zero at scale 1.
    pub(crate) fn headwind(&self) -> Vec3 {
        let motion = self.now.direction_in(self.velocity() * self.inertia.x);
        motion * (self.now.size().recip() - 1.0)
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

    /// Aims at a pose in the next tick, of 1/60 s, as something that ticks move.
    fn aim(frame: &mut TickPose, end: Option<Pose>, limits: HairInertia) -> Aimed {
        let tick =
            TickMoment { number: frame.tick + 1, seconds: 1.0 / 60.0, ..TickMoment::default() };
        frame.aim(Aim {
            tick,
            end,
            was_put: false,
            limits,
            along: None,
            begin: &mut || end,
            jump: &mut || None,
        })
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
        let inertia = HairInertia {
            teleport_speed: f32::INFINITY,
            teleport_spin: f32::INFINITY,
            ..default()
        };
        assert_eq!(aim(&mut frame, Some(a), inertia), Aimed::default());
        frame.advance(1.0, false);
        assert!(frame.frame_delta().is_none(), "the first tick begins where the frame is");
        aim(&mut frame, Some(b), inertia);
        let world = Vec3::new(0.2, 0.4, -0.3);
        let mut local = a.point_in(world);
        for i in 1..=6 {
            frame.advance(i as f32 / 6.0, false);
            local = frame.frame_delta().unwrap() * local;
        }
        assert!(b.point_out(local).distance(world) < 1e-5);
        // Back again, two substeps as one; what moves along is seen to move as far.
        let mut beside = frame.clone();
        aim(&mut frame, Some(a), inertia);
        let pushed = Pose { translation: b.translation + Vec3::X * 0.6, ..b };
        aim(&mut beside, Some(pushed), inertia);
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
        aim(&mut frame, Some(b), inertia);
        frame.advance(1.0, false);
        let mut reports = || aim(&mut frame, None, inertia).report;
        assert!(reports() && !reports(), "reported once");
        frame.advance(1.0, false);
        assert_eq!(*frame.now(), b);
    }

    #[test]
    fn a_change_of_speed_that_nothing_explains_is_a_jump_at_any_rate_of_ticks() {
        let at = |x: f32| Some(Pose { translation: Vec3::X * x, ..default() });
        let limits = HairInertia::default();
        for hertz in [10.0, 60.0, 240.0] {
            // Starts at `speed`, keeps it, and is put 64 m away on the way.
            for (speed, starts_with_a_jump) in [(20.0, false), (30.0, true)] {
                let mut frame = TickPose::default();
                let (mut x, mut jumps) = (0.0, Vec::new());
                for tick in 0..6 {
                    x += if tick > 0 { speed / hertz } else { 0.0 };
                    x += if tick == 4 { 64.0 } else { 0.0 };
                    let moment = TickMoment {
                        number: frame.tick + 1,
                        seconds: 1.0 / hertz,
                        ..TickMoment::default()
                    };
                    let aimed = frame.aim(Aim {
                        tick: moment,
                        end: at(x),
                        was_put: false,
                        limits,
                        along: None,
                        begin: &mut || at(x),
                        jump: &mut || None,
                    });
                    jumps.push(aimed.jumps);
                    frame.advance(1.0, false);
                }
                let expected = [false, starts_with_a_jump, false, false, true, false];
                assert_eq!(jumps, expected, "{hertz} Hz, {speed} m/s");
                let moved = frame.frame_delta().unwrap().translation.x * hertz;
                assert!((moved + speed).abs() < 0.05, "{hertz} Hz: goes on at {moved} m/s");
            }
        }
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
            |pose, _| pose.motion[0].velocity[1].x = f32::NAN,
        ];
        for spoil in spoils {
            let mut pose = TickPose::default();
            aim(&mut pose, Some(a), HairInertia::default());
            pose.advance(1.0, false);
            spoil(&mut pose, broken);
            aim(&mut pose, Some(a), HairInertia::default());
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
                aim(&mut pose, Some(at), HairInertia::default());
                for i in 1..=7 {
                    pose.advance(i as f32 / 7.0, false);
                    assert!(pose.frame_delta().is_none(), "{far}");
                }
            }
        }
    }
}

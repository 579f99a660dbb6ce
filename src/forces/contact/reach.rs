//! Which colliders a hair may touch within a tick, by bounding balls sorted along an axis.

use super::{ColliderShape, HairCollider};
use crate::{
    base::tape::Tape,
    hair::strand::{Pose, TickPose},
};
use bevy::prelude::*;

/// A bounding ball of a hair in any pose, in its own frame.
#[derive(Component, Clone, Copy, Debug)]
#[component(clone_behavior = Ignore)]
pub(crate) struct HairReach {
    center: Vec3,
    radius: f32,
    /// Ticks since it was computed.
    pub(super) age: u32,
}

impl Default for HairReach {
    fn default() -> Self {
        Self { center: Vec3::ZERO, radius: f32::INFINITY, age: LOOK_AGAIN }
    }
}

/// Safety factor on the reach, for motion within a substep and stretched strands.
const REACH_MARGIN: f32 = 1.25;

impl HairReach {
    pub(crate) fn record(&mut self, tape: &mut Tape<'_>) {
        tape.value(&mut self.center);
        tape.value(&mut self.radius);
        tape.value(&mut self.age);
    }

    /// Around strands with these roots and lengths (m).
    pub(super) fn around(strands: impl Iterator<Item = (Vec3, f32)>) -> Self {
        let (mut low, mut high, mut longest) = (Vec3::INFINITY, Vec3::NEG_INFINITY, 0.0f32);
        for (root, length) in strands {
            (low, high, longest) = (low.min(root), high.max(root), longest.max(length));
        }
        let (center, radius) = (0.5 * (low + high), 0.5 * low.distance(high) + longest);
        Self { center, radius, age: 0 }
    }

    /// The ball around the hair in the world, of its lengths as they are drawn (m); none without strands.
    pub(crate) fn ball(&self, pose: &Pose) -> Option<(Vec3, f32)> {
        let center = pose.point_out(self.center);
        center.is_finite().then_some((center, self.radius * pose.size()))
    }

    /// Roots have moved.
    #[cfg(feature = "gpu")]
    pub(crate) fn look_again(&mut self) {
        self.age = LOOK_AGAIN;
    }

    /// Whether it may come to a ball in the world, a center and a radius (m), in a substep.
    pub(crate) fn is_near(&self, frame: &TickPose, (center, radius): (Vec3, f32)) -> bool {
        let ball = Ball { center, radius, travel: 0.0 };
        ball.is_near(frame.now().point_out(self.center), self.room(frame, 1), 1)
    }

    /// How far from its center it may be within a tick (m, in the world).
    pub(crate) fn room(&self, frame: &TickPose, substeps: u32) -> f32 {
        let (before, now) = (frame.before(), frame.now());
        let travel = before.translation.distance(now.translation);
        REACH_MARGIN * self.radius * now.size() + travel * substeps as f32
    }
}

/// Ticks between checks of strands without outside writes: roots move little on a head.
pub(super) const LOOK_AGAIN: u32 = 16;

/// A ball around a collider in the world, and how far it moves in a substep (m).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ball {
    center: Vec3,
    radius: f32,
    travel: f32,
}

impl Ball {
    pub(crate) fn around(collider: &HairCollider, pose: &TickPose) -> Self {
        let (before, now) = (pose.before(), pose.now());
        let radius = match &collider.shape {
            ColliderShape::Sphere(s) => s.radius,
            ColliderShape::Capsule(c) => c.radius + c.half_length,
            ColliderShape::Cylinder(c) => c.radius.hypot(c.half_height),
            ColliderShape::Plane(_) => f32::INFINITY,
            ColliderShape::Cuboid { cuboid, .. } => cuboid.half_size.length(),
            ColliderShape::Ellipsoid { radii } | ColliderShape::Hat { radii, .. } => {
                radii.max_element()
            }
            ColliderShape::Hull(hull) => hull.reach(),
            ColliderShape::Grid(grid) => grid.reach(),
        };
        let travel = before.translation.distance(now.translation);
        let radius = radius * now.size().max(before.size());
        Self { center: now.translation, radius, travel }
    }

    /// How far from its center it may be within a tick (m).
    fn room(&self, substeps: u32) -> f32 {
        self.radius + self.travel * substeps as f32
    }

    /// Whether its content may come within `room` (m) of a point within a tick of `substeps`.
    fn is_near(&self, center: Vec3, room: f32, substeps: u32) -> bool {
        let apart = room + self.room(substeps);
        let squared = self.center.distance_squared(center);
        // NaN counts as near, so that it is reported where it is used.
        squared <= apart * apart || squared.is_nan() || apart.is_nan()
    }
}

/// Lookups that cost less without an order than one sort.
const FEW_LOOKUPS: usize = 16;

/// All colliders in a tick of so many substeps, or all droplets in a substep, found by place: in a crowd a hair
/// is near few of them.
#[derive(Resource)]
pub(crate) struct Colliders<T> {
    substeps: u32,
    all: Vec<(Ball, T)>,
    /// Where the balls' centers are along x, in this order, with their indices.
    along_x: Vec<(f32, u32)>,
    /// The room of the largest of these (m).
    largest: f32,
    /// The indices of the others, which have no end or are not finite.
    anywhere: Vec<u32>,
}

impl<T> Default for Colliders<T> {
    fn default() -> Self {
        Self::new(1, Vec::new())
    }
}

impl<T> Colliders<T> {
    /// From balls that do not move for a substep, each a center in the world and a radius (m), to be looked up so
    /// many times. For a few times they are looked through: sorting costs more.
    pub(crate) fn of_balls(lookups: usize, balls: impl Iterator<Item = ((Vec3, f32), T)>) -> Self {
        let still = |((center, radius), item)| (Ball { center, radius, travel: 0.0 }, item);
        let all: Vec<(Ball, T)> = balls.map(still).collect();
        if lookups > FEW_LOOKUPS {
            return Self::new(1, all);
        }
        let anywhere = (0..all.len() as u32).collect();
        Self { substeps: 1, all, along_x: Vec::new(), largest: 0.0, anywhere }
    }

    /// From balls that move for so many substeps.
    pub(crate) fn new(substeps: u32, all: Vec<(Ball, T)>) -> Self {
        let (mut along_x, mut anywhere, mut largest) = (Vec::new(), Vec::new(), 0.0f32);
        for ((ball, _), i) in all.iter().zip(0..) {
            let room = ball.room(substeps);
            if room.is_finite() && ball.center.is_finite() {
                along_x.push((ball.center.x, i));
                largest = largest.max(room);
            } else {
                anywhere.push(i);
            }
        }
        along_x.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        Self { substeps, all, along_x, largest, anywhere }
    }

    /// Those that hair in `frame` may touch within the tick, in the order they were given; all for a hair of
    /// unknown reach. `found` holds their indices afterwards.
    pub(crate) fn near<'a>(
        &'a self,
        frame: &TickPose,
        reach: Option<&HairReach>,
        found: &'a mut Vec<u32>,
    ) -> impl Iterator<Item = &'a T> {
        let center = reach.map_or(Vec3::ZERO, |reach| frame.now().point_out(reach.center));
        let room = reach.map_or(f32::INFINITY, |reach| reach.room(frame, self.substeps));
        self.around(center, room, found)
    }

    /// Those with these indices.
    pub(super) fn iter_many<'a>(&'a self, found: &'a [u32]) -> impl Iterator<Item = &'a T> {
        found.iter().filter_map(|i| Some(&self.all.get(*i as usize)?.1))
    }

    /// Those that may come within `room` (m) of a point within the tick, in the order they were given.
    /// `found` holds their indices afterwards.
    pub(crate) fn around<'a>(
        &'a self,
        center: Vec3,
        room: f32,
        found: &'a mut Vec<u32>,
    ) -> impl Iterator<Item = &'a T> {
        found.clear();
        // A little more, for rounding. Without an end, or NaN, it holds all.
        let far = 1.0001 * (room + self.largest);
        let beyond = |at: f32| at - center.x > far;
        let short = |at: f32| center.x - at > far;
        let first = self.along_x.partition_point(|(at, _)| short(*at));
        let rest = self.along_x[first..].iter().take_while(|(at, _)| !beyond(*at));
        let candidates = rest.map(|(_, i)| i).chain(&self.anywhere);
        let is_near = |i: &&u32| self.all[**i as usize].0.is_near(center, room, self.substeps);
        found.extend(candidates.filter(is_near));
        found.sort_unstable();
        self.iter_many(found)
    }

    /// All of them.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &T> {
        self.all.iter().map(|(_, item)| item)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hair::strand::Pose;
    use bevy::reflect::GetPath;
    use proptest::prelude::*;

    fn moving(now: Pose, by: Vec3) -> TickPose {
        let mut frame = TickPose::default();
        *frame.path_mut("now").unwrap() = now;
        *frame.path_mut("before").unwrap() = Pose { translation: now.translation + by, ..now };
        frame
    }

    #[test]
    fn a_hair_is_near_what_it_can_reach_in_a_tick() {
        // On a frame of twice the size that moves 5 mm a substep, beside a ball that moves 10 mm.
        let reach = HairReach { radius: 0.1, ..default() };
        let frame = moving(Pose { scale: 2.0, ..default() }, Vec3::Y * 5e-3);
        let is_near = |distance: f32| {
            let ball = Ball { center: Vec3::X * distance, radius: 0.05, travel: 0.01 };
            let all = Colliders::new(6, vec![(ball, ())]);
            let found = all.near(&frame, Some(&reach), &mut Vec::new()).count() == 1;
            let center = frame.now().point_out(reach.center);
            assert_eq!(found, ball.is_near(center, reach.room(&frame, 6), 6));
            found
        };
        let touches = REACH_MARGIN * 0.1 * 2.0 + 0.05 + (5e-3 + 0.01) * 6.0;
        assert!(is_near(touches - 1e-3) && !is_near(touches + 1e-3));
        assert!(is_near(f32::NAN), "NaN is reported where it is used");
    }

    #[test]
    fn few_lookups_find_what_many_find() {
        let ball = |i: u16| {
            let [x, y] = [13, 7].map(|k| f32::from(i * k % 101) * 0.01);
            ((Vec3::new(x, y, if i == 40 { f32::NAN } else { 0.3 }), 0.002 * f32::from(i % 9)), i)
        };
        let [few, many] = [1, usize::MAX].map(|n| Colliders::of_balls(n, (0..200).map(ball)));
        let mut counts = Vec::new();
        for room in [0.0, 0.05, 0.4, f32::INFINITY] {
            let [a, b] = [&few, &many].map(|all| {
                all.around(Vec3::new(0.4, 0.5, 0.3), room, &mut Vec::new())
                    .copied()
                    .collect::<Vec<_>>()
            });
            assert_eq!(a, b, "within {room}");
            counts.push(a.len());
        }
        assert!(counts.is_sorted() && counts[1] < counts[2] && counts[3] == 200, "{counts:?}");
    }

    #[test]
    fn a_ball_encloses_its_shape_and_no_more() {
        // The farthest of the shape's points along many rays from its center, which lies in all of them.
        let farthest = |inside: fn(Vec3) -> bool| {
            let along = |i: u16| {
                let (up, turn) = (1.0 - (f32::from(i) + 0.5) / 2500.0, f32::from(i) * 2.399_963);
                let way = Vec3::new(turn.cos(), 0.0, turn.sin()) * (1.0 - up * up).sqrt();
                let way = way + up * Vec3::Y;
                (0..1000).map(|k| 1e-3 * k as f32).take_while(|r| inside(*r * way)).last()
            };
            (0..5000).filter_map(along).fold(0.0, f32::max)
        };
        let scaled = moving(Pose { scale: 2.0, ..default() }, Vec3::X * 0.01);
        let shapes: [(_, fn(Vec3) -> bool); 5] = [
            (HairCollider::sphere(0.1), |p| p.length() <= 0.1),
            (HairCollider::capsule(0.1, 0.3), |p| {
                p.distance(Vec3::Y * p.y.clamp(-0.15, 0.15)) <= 0.1
            }),
            (HairCollider::cylinder(0.3, 0.8), |p| p.x.hypot(p.z) <= 0.3 && p.y.abs() <= 0.4),
            (HairCollider::cuboid(Vec3::new(0.2, 0.4, 0.8)), |p| {
                p.abs().cmple(Vec3::new(0.1, 0.2, 0.4)).all()
            }),
            (HairCollider::ellipsoid(Vec3::new(0.1, 0.4, 0.2)), |p| {
                (p / Vec3::new(0.1, 0.4, 0.2)).length() <= 1.0
            }),
        ];
        for (collider, inside) in shapes {
            let ball = Ball::around(&collider.unwrap(), &scaled);
            let farthest = 2.0 * farthest(inside);
            let most = 1.03 * farthest + 2e-3;
            assert!((farthest..most).contains(&ball.radius), "{farthest} m: {ball:?}");
            assert!((ball.travel - 0.01).abs() < 1e-6 && ball.center == Vec3::ZERO);
        }
        let floor = Ball::around(&HairCollider::plane(Dir3::Y), &TickPose::default());
        assert_eq!(floor.radius, f32::INFINITY);
    }

    proptest! {
        #[test]
        fn sorted_balls_find_what_a_test_of_each_finds(
            balls in prop::collection::vec(
                (prop::array::uniform3(-2.0f32..2.0), prop_oneof![
                    8 => 0.0f32..0.4, 1 => Just(f32::INFINITY), 1 => Just(f32::NAN),
                ], 0.0f32..0.05),
                0..60,
            ),
            at in prop::array::uniform3(-2.0f32..2.0),
            radius in prop_oneof![8 => 0.0f32..0.8, 1 => Just(f32::INFINITY), 1 => Just(f32::NAN)],
            substeps in 1u32..8,
        ) {
            let balls: Vec<_> = (balls.into_iter().zip(0..))
                .map(|((center, radius, travel), i)| {
                    (Ball { center: center.into(), radius, travel }, i)
                })
                .collect();
            let reach = HairReach { radius, center: Vec3::X * 0.1, ..default() };
            let frame = moving(Pose { translation: at.into(), ..default() }, Vec3::Z * 0.01);
            let center = frame.now().point_out(reach.center);
            let one_by_one: Vec<i32> = balls.iter()
                .filter(|(ball, _)| ball.is_near(center, reach.room(&frame, substeps), substeps))
                .map(|(_, i)| *i)
                .collect();
            let all = Colliders::new(substeps, balls);
            let mut scratch = Vec::new();
            let found: Vec<i32> = all.near(&frame, Some(&reach), &mut scratch).copied().collect();
            prop_assert_eq!(found, one_by_one);
            prop_assert_eq!(all.near(&frame, None, &mut scratch).count(), all.all.len());
        }
    }
}

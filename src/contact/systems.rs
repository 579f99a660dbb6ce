//! `Interaction`: contact between strands, and colliders in each hair's frame.

use super::{
    Bake, BakeError, ColliderShape, ConvexHull, DistanceGrid, HairCollider, HullError, LockContact,
    LockNeighbours, Obstacles, Openings, coarse, neighbours::Lookup,
};
use crate::{
    fault::{FaultKind, HairFault},
    parallel::prefetch,
    rod::{
        obstacle::{Obstacle, Solid},
        shape::{Placed, Shape},
    },
    schedule::{EffectiveSubsteps, HairSettle, HairStep, HairSystems, HairTick, first_substep},
    setting::{self, Ranged, Settings},
    strand::{
        Hair, OnGpu, SleepPose, Sleepers, Strand, StrandOf, StrandSleep, Strands, TickPose,
        keep_required,
    },
};
use bevy::{ecs::entity::EntityHashSet, prelude::*};

/// Strands do not touch each other where more than so many are followers for each one that is not: the
/// guides of background hair are centimetres apart.
const SPARSE: usize = 8;

/// How many strands are prefetched at once.
const TOGETHER: usize = 16;

/// Colliders and contact between strands.
pub struct ContactPlugin;

impl Plugin for ContactPlugin {
    fn build(&self, app: &mut App) {
        setting::plugin::<LockContact>(app);
        #[cfg(feature = "avian")]
        super::avian::plugin(app);
        setting::component::<HairCollider>(app);
        keep_required::<HairCollider, TickPose>(app);
        keep_required::<Hair, Obstacles>(app);
        keep_required::<Hair, LockNeighbours>(app);
        keep_required::<Hair, HairReach>(app);
        app.register_type::<ColliderShape>()
            .register_type::<ConvexHull>()
            .register_type::<DistanceGrid>()
            .register_type::<HullError>()
            .register_type::<BakeError>()
            .register_type::<Bake>()
            .register_type::<Openings>()
            .register_type::<Obstacles>()
            .register_type::<LockNeighbours>()
            .register_required_components::<Hair, Obstacles>()
            .register_required_components::<Hair, LockNeighbours>()
            .register_required_components::<Hair, HairReach>()
            .add_systems(
                HairTick,
                (
                    (
                        (find_reach, choose_colliders).chain().run_if(first_substep),
                        gather_obstacles,
                    )
                        .chain()
                        .in_set(HairSystems::Obstacles),
                    push_strands_apart.in_set(HairSystems::StrandContact),
                ),
            )
            .add_systems(
                HairSettle,
                (
                    gather_obstacles.in_set(HairSystems::Obstacles),
                    push_strands_apart.in_set(HairSystems::StrandContact),
                ),
            );
    }
}

/// A collider in a hair's frame, with the motion of its surface during the substep.
pub(crate) fn seen_from(hair: &TickPose, collider: &HairCollider, pose: &TickPose) -> Obstacle {
    let (now, own) = (hair.now(), pose.now());
    let scale = own.scale / now.scale;
    let at = now.point_in(own.translation);
    let turned = |d: Vec3| now.direction_in(own.rotation * d);
    let placed = |shape: Shape| {
        Solid::Placed(Placed {
            shape,
            center: at,
            axes: Mat3::from_cols(turned(Vec3::X), turned(Vec3::Y), turned(Vec3::Z)),
            scale,
        })
    };
    let solid = match &collider.shape {
        ColliderShape::Sphere(s) => Solid::Capsule { a: at, b: at, radius: s.radius * scale },
        ColliderShape::Capsule(c) => {
            let half = turned(Vec3::Y) * (c.half_length * scale);
            Solid::Capsule { a: at - half, b: at + half, radius: c.radius * scale }
        }
        ColliderShape::Plane(p) => Solid::HalfSpace { normal: turned(*p.normal), point: at },
        ColliderShape::Cylinder(c) => Solid::Cylinder {
            center: at,
            axis: turned(Vec3::Y),
            radius: c.radius * scale,
            half_height: c.half_height * scale,
        },
        ColliderShape::Cuboid { cuboid, rounding } => {
            placed(Shape::Cuboid { half: cuboid.half_size, rounding: *rounding })
        }
        ColliderShape::Ellipsoid { radii } => placed(Shape::Ellipsoid { radii: *radii }),
        ColliderShape::Hull(hull) => placed(Shape::Hull(hull.clone())),
        ColliderShape::Grid(grid) => placed(Shape::Grid(grid.clone())),
    };
    let motion = pose.motion_in(hair);
    Obstacle { solid, motion, friction: collider.friction }
}

/// A bounding ball of a hair in any pose, in its own frame.
#[derive(Component, Clone, Copy, Debug)]
pub(crate) struct HairReach {
    center: Vec3,
    radius: f32,
    /// Number of strands when it was computed, and ticks since.
    members: usize,
    age: u32,
}

impl Default for HairReach {
    fn default() -> Self {
        Self { center: Vec3::ZERO, radius: f32::INFINITY, members: 0, age: 0 }
    }
}

impl HairReach {
    /// Around strands with these roots and lengths (m).
    fn around(strands: impl Iterator<Item = (Vec3, f32)>) -> Self {
        let (mut low, mut high, mut longest) = (Vec3::INFINITY, Vec3::NEG_INFINITY, 0.0f32);
        for (root, length) in strands {
            (low, high, longest) = (low.min(root), high.max(root), longest.max(length));
        }
        let (center, radius) = (0.5 * (low + high), 0.5 * low.distance(high) + longest);
        Self { center, radius, ..default() }
    }

    /// Roots have moved.
    #[cfg(feature = "gpu")]
    pub(crate) fn look_again(&mut self) {
        self.members = UNKNOWN;
    }

    /// Whether hair in `frame` may touch the content of `ball` within a tick of `substeps`.
    pub(crate) fn is_near(&self, frame: &TickPose, ball: &Ball, substeps: u32) -> bool {
        let (before, now) = (frame.before(), frame.now());
        let travel = before.translation.distance(now.translation) + ball.travel;
        let apart = ROOM * self.radius * now.scale + ball.radius + travel * substeps as f32;
        let squared = ball.center.distance_squared(now.point_out(self.center));
        // NaN counts as near, so that it is reported where it is used.
        squared <= apart * apart || squared.is_nan() || apart.is_nan()
    }
}

/// A number of strands that no hair has.
const UNKNOWN: usize = usize::MAX;

/// Ticks between checks of strands without outside writes: roots move little on a head.
const LOOK_AGAIN: u32 = 16;

fn find_reach(
    mut hairs: Query<(Entity, &Strands, &mut HairReach, Has<OnGpu>), With<Hair>>,
    touched: Query<&StrandOf, (Changed<Strand>, Without<OnGpu>)>,
    strands: Query<&Strand>,
) {
    let touched: EntityHashSet = touched.iter().map(|of| of.0).collect();
    for (hair, members, mut reach, on_gpu) in &mut hairs {
        let reach = reach.bypass_change_detection();
        // On the GPU roots stay, or somebody says that they have moved.
        if on_gpu && reach.members != UNKNOWN {
            continue;
        }
        reach.age += 1;
        if reach.members == members.len() && reach.age < LOOK_AGAIN && !touched.contains(&hair) {
            continue;
        }
        let of_strand = |strand: &Strand| {
            (strand.positions().first().copied().unwrap_or_default(), strand.length())
        };
        let found = HairReach::around(strands.iter_many(members.collection()).map(of_strand));
        *reach = HairReach { members: members.len(), ..found };
    }
}

/// Safety factor on the reach, for motion within a substep and stretched strands.
const ROOM: f32 = 1.25;

/// A ball around a collider in the world, and how far it moves in a substep (m).
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
            ColliderShape::Ellipsoid { radii } => radii.max_element(),
            ColliderShape::Hull(hull) => hull.reach(),
            ColliderShape::Grid(grid) => grid.reach(),
        };
        let travel = before.translation.distance(now.translation);
        let radius = radius * now.scale.max(before.scale);
        Self { center: now.translation, radius, travel }
    }
}

/// All colliders, clamped to valid values, with their bounding balls.
pub(crate) fn with_balls<'a>(
    colliders: &'a Query<(&HairCollider, &TickPose)>,
) -> Vec<(Ball, HairCollider, &'a TickPose)> {
    let with_ball = |(collider, pose): (&HairCollider, &'a TickPose)| {
        let collider = collider.clamped();
        (Ball::around(&collider, pose), collider, pose)
    };
    colliders.iter().map(with_ball).collect()
}

/// At the start of a tick: which colliders a hair may touch in it; none for a hair without simulated
/// strands.
fn choose_colliders(
    step: Res<HairStep>,
    colliders: Query<(Entity, &HairCollider, &TickPose)>,
    mut hairs: Query<(&TickPose, &HairReach, Option<&Sleepers>, &mut Obstacles), With<Hair>>,
) {
    let balls: Vec<(Ball, Entity)> = colliders
        .iter()
        .map(|(entity, collider, pose)| (Ball::around(&collider.clamped(), pose), entity))
        .collect();
    for (pose, reach, sleepers, mut obstacles) in &mut hairs {
        obstacles.near.clear();
        if sleepers.is_none_or(|sleepers| sleepers.awake > 0) {
            let near = balls.iter().filter(|(ball, _)| reach.is_near(pose, ball, step.count));
            obstacles.near.extend(near.map(|(_, entity)| *entity));
        }
    }
}

fn gather_obstacles(
    steps: EffectiveSubsteps,
    colliders: Query<(&HairCollider, &TickPose)>,
    mut hairs: Query<(Entity, &TickPose, &mut Obstacles), With<Hair>>,
) {
    for (hair, pose, mut obstacles) in &mut hairs {
        let Obstacles { solids, near } = &mut *obstacles;
        solids.clear();
        if steps.of(hair).is_some() {
            let near = colliders.iter_many(near);
            solids.extend(near.map(|(collider, at)| seen_from(pose, &collider.clamped(), at)));
        }
    }
}

fn too_fine(strand: &Strand, radius: f32, stride: usize) -> HairFault {
    let segment = 1e3 * strand.length() / strand.edges() as f32;
    let message = format!(
        "segments of a strand are {segment:.3} mm long, expected at least its lock's radius of {} mm: \
         contact samples every {stride}th of its {} nodes; use fewer nodes",
        1e3 * radius,
        strand.nodes(),
    );
    HairFault::new(FaultKind::Strand, message)
}

pub(crate) fn push_strands_apart(
    steps: EffectiveSubsteps,
    contact: Settings<LockContact>,
    mut hairs: Query<
        (Entity, &Strands, &mut LockNeighbours, Option<&Sleepers>),
        (With<Hair>, Without<OnGpu>),
    >,
    mut strands: Query<(&mut Strand, &mut StrandSleep, &mut SleepPose), With<StrandOf>>,
    mut faults: MessageWriter<HairFault>,
) {
    for (hair, members, mut neighbours, sleepers) in &mut hairs {
        let LockContact { radius, strength } = contact.of(hair);
        let LockNeighbours { lists: list, members: (present, had_followers), is_reported } =
            neighbours.bypass_change_detection();
        // Followers take no part in contact, but in bridges of water.
        let with_followers = list.has_extra_margin();
        let all_rest = sleepers.is_some_and(|s| s.awake == 0 && (s.asleep > 0 || !with_followers));
        // Of so few strands none is near another. Bridges of water are between all.
        let simulated = sleepers.map_or(members.len(), |s| s.awake + s.asleep);
        let is_sparse = !with_followers && simulated * SPARSE < members.len();
        if radius <= 0.0 || strength <= 0.0 || all_rest || is_sparse {
            continue;
        }
        let Some(step) = steps.of(hair) else { continue };
        let reach = 2.0 * radius;
        list.clear();
        if step.is_first || with_followers != *had_followers {
            let takes_part = |id: &&Entity| {
                strands.get(**id).is_ok_and(|(_, sleep, _)| with_followers || !sleep.is_follower())
            };
            present.clear();
            present.extend(members.collection().iter().filter(takes_part));
            *had_followers = with_followers;
        }
        // Bridges of water need complete lists. Dry strands are searched once a tick at most, at their
        // expected positions in the middle of the time until the next search: most move with their
        // neighbours.
        let lookup = if step.is_first || with_followers { Lookup::Now } else { Lookup::Later };
        let until = list.lookups() as f32 * step.tick - step.dt;
        let ahead = (step.is_first && !with_followers).then_some(0.5 * until);
        for some in present.chunks(TOGETHER) {
            strands.iter_many(some).for_each(|(strand, ..)| prefetch(strand.positions()));
            for (strand, ..) in strands.iter_many(some) {
                let stride = coarse::stride(strand.rest_lengths(), reach);
                list.add(strand.positions(), stride);
                if let Some(seconds) = ahead {
                    let moving = strand.positions().iter().zip(strand.velocities());
                    list.expect(moving.map(|(p, v)| *p + *v * seconds));
                }
                if stride > 1 && !core::mem::replace(is_reported, true) {
                    faults.write(too_fine(strand, radius, stride).of(hair));
                }
            }
        }
        let mut pushes = list.pushes(radius, strength, lookup);
        for some in present.chunks(TOGETHER) {
            strands.iter_many(some).for_each(|(strand, ..)| prefetch(strand.velocities()));
            let mut some = strands.iter_many_mut(some);
            while let Some((mut strand, mut sleep, mut still)) = some.fetch_next() {
                if sleep.is_asleep() {
                    let pushes = pushes.by_ref().take(strand.nodes());
                    if still
                        .bypass_change_detection()
                        .has_new_contact(pushes, strength / (2.0 * radius))
                    {
                        sleep.bypass_change_detection().wake();
                    }
                    continue;
                }
                let (_, velocities, ..) = strand.bypass_change_detection().parts_mut();
                velocities.iter_mut().zip(&mut pushes).for_each(|(v, push)| *v += push * step.dt);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::strand::Pose;
    use bevy::reflect::GetPath;

    #[test]
    fn a_hair_is_near_what_it_can_reach_in_a_tick() {
        // On a frame of twice the size that moves 5 mm a substep, beside a ball that moves 10 mm.
        let reach = HairReach { radius: 0.1, ..default() };
        let mut frame = TickPose::default();
        let now = Pose { scale: 2.0, ..default() };
        *frame.path_mut("now").unwrap() = now;
        *frame.path_mut("before").unwrap() = Pose { translation: Vec3::Y * 5e-3, ..now };
        let is_near = |distance: f32| {
            let ball = Ball { center: Vec3::X * distance, radius: 0.05, travel: 0.01 };
            reach.is_near(&frame, &ball, 6)
        };
        let touches = ROOM * 0.1 * 2.0 + 0.05 + (5e-3 + 0.01) * 6.0;
        assert!(is_near(touches - 1e-3) && !is_near(touches + 1e-3));
        assert!(is_near(f32::NAN), "what is no number is seen where it is used");
    }
}

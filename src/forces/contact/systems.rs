//! `Interaction`: contact between strands, and colliders in each hair's frame.

use super::{
    Bake, BakeError, ColliderShape, ContactMethod, ConvexHull, DistanceGrid, HairCollider,
    HullError, LockNeighbours, Obstacles, Openings, StrandContact, coarse,
    hat::WornHat,
    lanes::Penalty,
    neighbours::Lookup,
    pairs::{self, InContact, keep_strands_apart},
    reach::{Ball, Colliders, HairReach, LOOK_AGAIN},
};
use crate::{
    base::{
        fault::{FaultKind, HairFault},
        parallel::{Nanos, for_each, prefetch},
        schedule::{
            EffectiveSubstep, EffectiveSubsteps, HairStep, HairSystems, HairTick, SettleTick,
            first_substep,
        },
        setting::{self, Settings},
        stretch::{self, Stretch},
    },
    hair::{
        strand::{
            Hair, HairHere, MotionOwner, Regroomed, SleepCounts, SleepPose, Strand, StrandOf,
            StrandSleep, Strands, TickPose, keep_required, lacks_strands,
        },
        worn,
    },
    solver::rod::{
        obstacle::{Obstacle, Solid},
        shape::{Placed, Shape},
    },
};
use bevy::prelude::*;

/// Strands do not touch each other where more than so many are followers for each one that is not: the
/// guides of background hair are centimetres apart.
const SPARSE: usize = 8;

/// Approximate time of contact per node (ns).
const CONTACT: usize = 100;

/// How many strands are prefetched at once.
const TOGETHER: usize = 16;

/// Colliders and contact between strands.
pub struct ContactPlugin;

impl Plugin for ContactPlugin {
    fn build(&self, app: &mut App) {
        if lacks_strands::<Self>(app) {
            return;
        }
        worn::setting::<StrandContact>(app);
        #[cfg(feature = "avian")]
        super::avian::plugin(app);
        setting::component::<HairCollider>(app);
        keep_required::<HairCollider, TickPose>(app);
        keep_required::<HairCollider, Stretch<HairCollider>>(app);
        stretch::plugin::<HairCollider>(app);
        keep_required::<Hair, Obstacles>(app);
        keep_required::<Hair, LockNeighbours>(app);
        keep_required::<Hair, HairReach>(app);
        app.register_type::<ColliderShape>()
            .register_type::<ContactMethod>()
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
            .init_resource::<TickColliders>()
            .add_systems(
                HairTick,
                (
                    (gather_colliders, find_hats)
                        .chain()
                        .after(HairSystems::Poses)
                        .before(HairSystems::LevelOfDetail)
                        .run_if(first_substep),
                    (
                        (find_reach, choose_colliders).chain().run_if(first_substep),
                        gather_obstacles,
                    )
                        .chain()
                        .in_set(HairSystems::Obstacles),
                    push_strands_apart.in_set(HairSystems::StrandContact),
                    keep_strands_apart.in_set(HairSystems::StrandCores),
                ),
            )
            .add_systems(
                SettleTick,
                (
                    gather_obstacles.in_set(HairSystems::Obstacles),
                    push_strands_apart.in_set(HairSystems::StrandContact),
                    keep_strands_apart.in_set(HairSystems::StrandCores),
                ),
            );
    }
}

/// A collider at the start of the tick.
pub(crate) struct TickCollider {
    pub(crate) id: Entity,
    /// With valid values, as it acts where its pose has the mean scale.
    pub(crate) collider: HairCollider,
    pub(crate) pose: TickPose,
}

/// All colliders of the tick, gathered once.
pub(crate) type TickColliders = Colliders<TickCollider>;

fn gather_colliders(
    step: Res<HairStep>,
    colliders: Query<(Entity, &HairCollider, &Stretch<HairCollider>, &TickPose)>,
    mut all: ResMut<TickColliders>,
) {
    let placed = colliders.iter().map(|(id, collider, stretch, pose)| {
        let collider = stretch.of(collider);
        (Ball::around(&collider, pose), TickCollider { id, collider, pose: pose.clone() })
    });
    let mut placed: Vec<_> = placed.collect();
    // Not of their rows, which change with what else lives in the world.
    placed.sort_by_key(|(_, collider)| collider.id.index_u32());
    *all = Colliders::new(step.count, placed);
}

/// At the start of a tick: a hat holds hair that has a root under it, whatever either hangs on.
fn find_hats(
    colliders: Res<TickColliders>,
    mut hairs: Query<(&TickPose, &HairReach, Option<&Strands>, &mut Obstacles), With<Hair>>,
    strands: Query<&Strand>,
) {
    let is_hat = |of: &&TickCollider| matches!(of.collider.shape, ColliderShape::Hat { .. });
    let hats: Vec<&TickCollider> = colliders.iter().filter(is_hat).collect();
    for (pose, reach, members, mut obstacles) in &mut hairs {
        let worn = &mut obstacles.bypass_change_detection().hats;
        if hats.is_empty() {
            worn.clear();
            continue;
        }
        let before = core::mem::take(worn);
        let holds = |hat: &&&TickCollider| {
            let is_worn = before.iter().any(|worn| worn.is(hat.id));
            let covers = |strand: &Strand| {
                let root = strand.positions().first().map(|root| pose.now().point_out(*root));
                root.is_some_and(|root| {
                    WornHat::covers(is_worn, &hat.collider.shape, hat.pose.now().point_in(root))
                })
            };
            let mut members = strands.iter_many(members.into_iter().flat_map(Strands::iter));
            reach.is_near(pose, (hat.pose.now().translation, 0.0)) && members.any(covers)
        };
        let ids: Vec<Entity> = hats.iter().filter(holds).map(|hat| hat.id).collect();
        *worn = WornHat::held_by(ids, before);
    }
}

/// A collider in a hair's frame, with the motion of its surface during the substep. A hat keeps things out.
pub(crate) fn seen_from(hair: &TickPose, collider: &HairCollider, pose: &TickPose) -> Obstacle {
    let (now, own) = (hair.now(), pose.now());
    let scale = own.size() / now.size();
    let at = now.point_in(own.translation);
    let turned = |d: Vec3| now.direction_in(own.direction_out(d));
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
        ColliderShape::Hat { radii, rim, .. } => {
            placed(Shape::Hat { radii: *radii, rim: *rim, holds: false })
        }
        ColliderShape::Hull(hull) => placed(Shape::Hull(hull.clone())),
        ColliderShape::Grid(grid) => placed(Shape::Grid(grid.clone())),
    };
    let motion = pose.motion_in(hair);
    Obstacle { solid, motion, friction: collider.friction }
}

fn find_reach(
    mut hairs: Query<(&Strands, &mut HairReach, Ref<Regroomed>, &MotionOwner), With<Hair>>,
    strands: Query<&Strand>,
) {
    for (members, mut reach, regroomed, owner) in &mut hairs {
        let reach = reach.bypass_change_detection();
        // On the GPU roots stay, or the GPU reports that they have moved.
        reach.age += u32::from(!owner.is_on_gpu());
        if reach.age < LOOK_AGAIN && (owner.is_on_gpu() || !regroomed.is_changed()) {
            continue;
        }
        let of_strand = |strand: &Strand| {
            (strand.positions().first().copied().unwrap_or_default(), strand.length())
        };
        *reach = HairReach::around(strands.iter_many(members.collection()).map(of_strand));
    }
}

/// At the start of a tick: which colliders a hair may touch in it; none for a hair without simulated
/// strands.
fn choose_colliders(
    colliders: Res<TickColliders>,
    mut hairs: Query<(&TickPose, &HairReach, &MotionOwner, &mut Obstacles), With<Hair>>,
) {
    for (pose, reach, owner, mut obstacles) in &mut hairs {
        obstacles.near.clear();
        if owner.moves() {
            drop(colliders.near(pose, Some(reach), &mut obstacles.near));
        }
    }
}

fn gather_obstacles(
    steps: EffectiveSubsteps,
    all: Res<TickColliders>,
    poses: Query<&TickPose, With<HairCollider>>,
    mut hairs: Query<(Entity, &TickPose, &mut Obstacles), With<Hair>>,
) {
    for (hair, pose, mut obstacles) in &mut hairs {
        // Hair that takes no substep now keeps them: it may be asked what is near.
        if let Some(step) = steps.of(hair) {
            let Obstacles { solids, near, hats } = &mut *obstacles;
            let near = all.iter_many(near).filter_map(|of| Some((of, poses.get(of.id).ok()?)));
            solids.clear();
            solids.extend(near.map(|(of, now)| {
                let mut seen = seen_from(pose, &of.collider, now);
                if let Some(hat) = hats.iter_mut().find(|hat| hat.id == of.id) {
                    hat.come_down(&mut seen, step.dt);
                }
                seen
            }));
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

fn too_crowded(radius: f32) -> HairFault {
    let message = format!(
        "too many segments lie around a node, expected fewer within a few times the lock's radius of {} mm: \
         the nearest push it; use fewer strands, or a smaller StrandContact::radius",
        1e3 * radius,
    );
    HairFault::new(FaultKind::Strand, message)
}

/// A hair whose strands may touch in this substep.
struct Touching<'a> {
    hair: Entity,
    pose: &'a TickPose,
    members: &'a Strands,
    neighbours: Mut<'a, LockNeighbours>,
    contact: StrandContact,
    step: EffectiveSubstep,
    /// The first strand that has too many nodes for contact, or that there are too many in one place.
    fault: Option<HairFault>,
}

impl Touching<'_> {
    /// Looks up neighbours and their pushes.
    fn find<'s, 'w: 's>(&mut self, strands: &'s Query<'w, '_, InContact, With<StrandOf>>) {
        let Self { hair, pose, members, neighbours, contact, step, fault } = self;
        let radius = contact.radius;
        let LockNeighbours { lists: list, pairs, members: (present, had_followers), reported } =
            neighbours.bypass_change_detection();
        // Followers take no part in contact, but in bridges of water.
        let with_followers = list.has_extra_margin();
        let reach = 2.0 * radius;
        list.clear();
        if step.is_first || with_followers != *had_followers {
            let takes_part = |id: &&Entity| {
                strands.get(**id).is_ok_and(|of| with_followers || !of.sleep.is_follower())
            };
            present.clear();
            present.extend(members.collection().iter().filter(takes_part));
            *had_followers = with_followers;
        }
        let is_paired = contact.method == ContactMethod::Pairs;
        if is_paired {
            pairs::find(pairs, strands.iter_many(&*present), contact, pose, step.dt);
            if pairs.is_crowded() && !core::mem::replace(&mut reported.1, true) {
                *fault = Some(too_crowded(radius).of(*hair));
            }
            if !with_followers {
                return;
            }
        }
        // Strands are searched once a tick at most, at their expected positions in the middle of the time until
        // the next search: most move with their neighbours.
        let lookup = if step.is_first { Lookup::Now } else { Lookup::Later };
        let until = list.lookups() as f32 * step.tick - step.dt;
        let ahead = step.is_first.then_some(0.5 * until);
        for some in present.chunks(TOGETHER) {
            strands.iter_many(some).for_each(|of| prefetch(of.strand.positions()));
            for strand in strands.iter_many(some).map(|of| of.strand) {
                let stride = coarse::stride(strand.rest_lengths(), reach);
                list.add(strand.positions(), stride);
                if let Some(seconds) = ahead {
                    let moving = strand.positions().iter().zip(strand.velocities());
                    list.expect(moving.map(|(p, v)| *p + *v * seconds));
                }
                if stride > 1 && !core::mem::replace(&mut reported.0, true) {
                    *fault = Some(too_fine(strand, radius, stride).of(*hair));
                }
            }
        }
        // What only bridges of water need is not pushed a second time.
        let strength = if is_paired { 0.0 } else { contact.strength };
        let mutual = contact.method == ContactMethod::Mutual;
        list.find_pushes(Penalty { reach, strength, mutual, dt: step.dt }, lookup);
        if fault.is_none() && list.is_crowded() && !core::mem::replace(&mut reported.1, true) {
            *fault = Some(too_crowded(radius).of(*hair));
        }
    }
}

/// The pushes of either method.
enum Either<P, L> {
    Pairs(P),
    Lists(L),
}

impl<P: Iterator<Item = Vec3>, L: Iterator<Item = Vec3>> Iterator for Either<P, L> {
    type Item = Vec3;

    fn next(&mut self) -> Option<Vec3> {
        match self {
            Self::Pairs(pushes) => pushes.next(),
            Self::Lists(pushes) => pushes.next(),
        }
    }
}

pub(crate) fn push_strands_apart(
    steps: EffectiveSubsteps,
    contact: Settings<StrandContact>,
    mut hairs: Query<
        (Entity, &TickPose, &Strands, &mut LockNeighbours, Option<&SleepCounts>),
        HairHere,
    >,
    mut strands: ParamSet<(
        Query<InContact, With<StrandOf>>,
        Query<(&mut Strand, &mut StrandSleep, &mut SleepPose), With<StrandOf>>,
    )>,
    mut faults: MessageWriter<HairFault>,
) {
    let touching =
        hairs.iter_mut().filter_map(|(hair, pose, members, mut neighbours, sleepers)| {
            neighbours.bypass_change_detection().pairs.rest();
            let contact = contact.of(hair);
            let with_followers = neighbours.lists.has_extra_margin();
            let all_rest =
                sleepers.is_some_and(|s| s.awake == 0 && (s.asleep > 0 || !with_followers));
            // Of so few strands none is near another. Bridges of water are between all.
            let simulated = sleepers.map_or(members.len(), |s| s.awake + s.asleep);
            let is_sparse = !with_followers && simulated * SPARSE < members.len();
            if contact.radius <= 0.0 || contact.strength <= 0.0 || all_rest || is_sparse {
                return None;
            }
            let step = steps.of(hair)?;
            Some(Touching { hair, pose, members, neighbours, contact, step, fault: None })
        });
    let mut touching: Vec<Touching> = touching.collect();
    let nodes: usize = touching.iter().map(|hair| hair.neighbours.nodes()).sum();
    let each = Nanos(CONTACT * nodes / touching.len().max(1));
    let present = strands.p0();
    for_each(&mut touching, each, |hair| hair.find(&present));
    let mut strands = strands.p1();
    for Touching { mut neighbours, contact, step, fault, .. } in touching {
        faults.write_batch(fault);
        let StrandContact { radius, strength, method, .. } = contact;
        let LockNeighbours { lists, pairs, members: (present, _), .. } =
            neighbours.bypass_change_detection();
        let is_paired = method == ContactMethod::Pairs;
        let mut pushes = match is_paired {
            true => Either::Pairs(pairs.pushes(step.dt)),
            false => Either::Lists(lists.pushes()),
        };
        for some in present.chunks(TOGETHER) {
            strands.iter_many(some).for_each(|(strand, ..)| prefetch(strand.velocities()));
            let mut some = strands.iter_many_mut(some);
            while let Some((mut strand, mut sleep, mut still)) = some.fetch_next() {
                if is_paired && sleep.is_follower() {
                    continue;
                }
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

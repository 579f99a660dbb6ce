//! `Interaction` and `BondUpdate`: droplets fall, slide, merge and follow their strands.

use super::{
    Droplet, DropletRules, HairWetting, StrandPoint, WaterLedger,
    exchange::{detached_drop, on_strand},
    model::{clinging, fall, hanging, slide},
    volume::{LocalVolumes, Volumes},
};
use crate::{
    base::lanes::V3,
    base::{
        fault::HairFault,
        parallel::{Nanos, for_each_block},
        schedule::{EffectiveSubsteps, HairProcessTime, HairStep},
        setting::{Ranged, Settings, Violations, report},
    },
    forces::{
        contact::{Ball, Colliders, HairCollider, HairReach, TickColliders, seen_from},
        environment::{
            Gravity, Winds,
            vapour::{DryingAir, WATER, transfer},
        },
    },
    hair::strand::{Hair, Pose, Strand, StrandOf, TickPose},
    solver::rod::{
        obstacle::{Obstacle, Solid},
        shape::Shape,
    },
};
use bevy::prelude::*;

/// The state of a droplet in this substep.
struct Moving<'a> {
    entity: Entity,
    drop: Mut<'a, Droplet>,
    violations: Violations,
    /// Water not counted by the ledger (m³); negative for water removed from outside.
    new: f64,
    evaporated: f64,
    is_removed: bool,
}

type HairParts = (&'static TickPose, Option<&'static HairReach>);

pub(super) fn move_droplets(
    mut commands: Commands,
    (step, steps): (Res<HairStep>, EffectiveSubsteps),
    (air, process, gravity, rules): (
        Res<DryingAir>,
        Res<HairProcessTime>,
        Gravity,
        Res<DropletRules>,
    ),
    wetting: Settings<HairWetting>,
    (colliders, poses): (Res<TickColliders>, Query<&TickPose, With<HairCollider>>),
    winds: Winds,
    volumes: Volumes,
    hairs: Query<HairParts, With<Hair>>,
    strands: Query<(&StrandOf, &Strand)>,
    mut droplets: Query<(Entity, &mut Droplet)>,
    mut ledger: ResMut<WaterLedger>,
    mut faults: MessageWriter<HairFault>,
    mut bounds: Local<Vec<HairBounds>>,
) {
    if droplets.is_empty() {
        bounds.clear();
        return;
    }
    let Some(shared) = steps.shared() else { return };
    let rules = rules.clamped();
    let gravity = gravity.clamped().0;
    let down = gravity.normalize_or_zero();
    if shared.is_first || bounds.is_empty() {
        *bounds = HairBounds::of(&hairs, down, step.count);
    }
    let bounds = &*bounds;
    let process = process.clamped().0;
    let world = TickPose::default();
    let solids = colliders.iter().filter_map(|placed| {
        let (collider, pose) = (&placed.collider, poses.get(placed.id).ok()?);
        Some((Ball::around(collider, pose), seen_from(&world, collider, pose)))
    });
    let solids = Colliders::new(step.count, solids.collect());
    let tick = step.dt * step.count as f32;
    let winds = winds.seen_from(&world);
    let volumes = volumes.seen_from(&world);
    let mut items: Vec<Moving<'_>> = droplets
        .iter_mut()
        .map(|(entity, drop)| Moving {
            entity,
            drop,
            violations: Violations::new(),
            new: 0.0,
            evaporated: 0.0,
            is_removed: false,
        })
        .collect();
    for_each_block(
        &mut items,
        Nanos(200),
        || (Vec::new(), 0),
        |(found, last), Moving { drop, violations, new, evaporated, is_removed, .. }| {
            // Its own values are valid.
            let is_changed = drop.is_changed();
            let drop = drop.bypass_change_detection();
            if is_changed {
                drop.repair(violations);
            }
            *new = drop.volume - drop.counted.0;
            drop.before = drop.position;
            drop.lag += shared.dt;

            let blown = winds.around(drop.position);
            let (wind, warmth) = (blown.velocity, blown.warmth(air.celsius));
            let radius = drop.radius();
            // A drop that meets nothing within the tick moves once, at its end.
            let way = (drop.velocity.length().max(wind.length()) + gravity.length() * tick) * tick;
            if !shared.is_last && falls_freely(drop, way + radius, bounds, &solids, &volumes, found)
            {
                drop.counted.0 = drop.volume;
                return;
            }
            let dt = core::mem::take(&mut drop.lag).max(0.0);
            let speed = air.draught + (wind - drop.velocity).length();
            let area = 4.0 * core::f32::consts::PI * radius * radius;
            let flux = transfer(speed, 2.0 * radius.max(1e-6)) * air.drive(warmth);
            *evaporated = (f64::from(flux * area * process * dt) / WATER).min(drop.volume);
            drop.volume -= *evaporated;
            drop.counted.0 = drop.volume;

            let carrier = drop.ride.and_then(|ride| {
                let (of, strand) = strands.get(ride.strand).ok()?;
                let (pose, _) = hairs.get(of.0).ok()?;
                (strand.nodes() >= 2).then_some((ride, strand, pose.now(), of.0))
            });
            match carrier {
                Some((ride, strand, pose, hair)) => {
                    let wetting = wetting.of(hair);
                    let (at, holds) = slide_along(ride, strand, pose, drop, &wetting, gravity, dt);
                    drop.ride = holds.then_some(StrandPoint { at, ..ride });
                    if !holds {
                        let free = detached_drop(pose, strand, at, drop.volume, &wetting, gravity);
                        (drop.position, drop.velocity) = (free.position, free.velocity);
                        drop.before = drop.position;
                    }
                }
                None => {
                    drop.ride = None;
                    drop.touch_count = 1;
                    // By the mean velocity a step of any length falls as far.
                    let before = drop.velocity;
                    drop.velocity = fall(before, gravity, wind, radius, dt);
                    drop.position += before.midpoint(drop.velocity) * dt;
                    let lies = rest_on_solids(&solids, drop, radius, found);
                    drop.lying = if lies { drop.lying + dt } else { 0.0 };
                }
            }
            let inside = (drop.position.cmpge(rules.min) & drop.position.cmple(rules.max)).all();
            let inside =
                inside && (drop.ride.is_some() || near_any(bounds, last, drop, down, &rules));
            let inside = inside && Droplet::POSITION.check(drop.position).is_ok();
            drop.keep_in_range();
            *is_removed = !inside
                || volumes.contain(drop.position)
                || drop.lying > rules.resting_time
                || drop.volume < 1e-15;
        },
    );
    for Moving { entity, violations, new, evaporated, is_removed, .. } in items {
        ledger.record(new);
        ledger.record(-evaporated);
        report(Some(entity), violations, &mut faults);
        if is_removed {
            // Its remaining water is counted when it is despawned.
            commands.entity(entity).despawn();
        }
    }
}

/// Whether nothing that a falling drop acts on or that acts on it is within a `way` (m).
fn falls_freely(
    drop: &Droplet,
    way: f32,
    bounds: &[HairBounds],
    solids: &Colliders<Obstacle>,
    volumes: &LocalVolumes,
    found: &mut Vec<u32>,
) -> bool {
    let place = drop.position;
    let [x, y, z] = place.to_array();
    let is_near = |solid: &Obstacle| {
        let depth = solid.solid.depth(V3::new(x, y, z), way + SHORT_PUSH).1;
        depth > 0.0 || depth.is_nan()
    };
    drop.ride.is_none()
        && drop.lying == 0.0
        && !bounds.iter().any(|hair| hair.may_touch(place, way + drop.r_max.max(drop.r_min)))
        && volumes.depth(place).is_none_or(|depth| depth < -way)
        && !solids.around(place, way + SHORT_PUSH, found).any(is_near)
}

/// A ball around a hair in the world (m).
#[derive(Clone, Copy)]
pub(super) struct HairBounds {
    center: Vec3,
    radius: f32,
    /// How far from the center its strands may come within the tick.
    room: f32,
    /// How far down it reaches.
    lowest: f32,
}

impl HairBounds {
    /// Of all hair with nodes; of a point at the origin that reaches down without end while there is none.
    fn of(hairs: &Query<HairParts, With<Hair>>, down: Vec3, substeps: u32) -> Vec<Self> {
        let of = |(pose, reach): (&TickPose, Option<&HairReach>)| {
            let reach = reach.copied().unwrap_or_default();
            let (center, radius) = reach.ball(pose.now())?;
            let room = reach.room(pose, substeps);
            Some(Self { center, radius, room, lowest: center.dot(down) + radius })
        };
        let mut all: Vec<Self> = hairs.iter().filter_map(of).collect();
        if all.is_empty() {
            all.push(Self { center: Vec3::ZERO, radius: 0.0, room: -1.0, lowest: f32::INFINITY });
        }
        all
    }

    /// Whether a strand may come within a distance (m) of a place within the tick; not of hair that there is not.
    fn may_touch(&self, place: Vec3, within: f32) -> bool {
        let apart = self.room + within;
        let squared = self.center.distance_squared(place);
        self.room >= 0.0 && (squared <= apart * apart || squared.is_nan())
    }

    fn is_near(&self, place: Vec3, down: Vec3, rules: &DropletRules) -> bool {
        let apart = self.center.distance(place) - self.radius;
        apart <= rules.removal_distance && place.dot(down) <= self.lowest + rules.removal_depth
    }
}

/// Whether a falling drop may still come to any hair. `last` is the hair that one was near to: drops that
/// are near each other mostly are near the same.
fn near_any(
    bounds: &[HairBounds],
    last: &mut usize,
    drop: &Droplet,
    down: Vec3,
    rules: &DropletRules,
) -> bool {
    let is_near = |of: &HairBounds| of.is_near(drop.position, down, rules);
    if bounds.get(*last).is_some_and(is_near) {
        return true;
    }
    let found = bounds.iter().position(is_near);
    *last = found.unwrap_or(*last);
    found.is_some()
}

/// Where on its strand a droplet has slid to, and whether it stays attached: at the tip it hangs,
/// elsewhere it clings; it may be heavier the more strands touch it. Pinned drops always stay.
fn slide_along(
    ride: StrandPoint,
    strand: &Strand,
    pose: &Pose,
    drop: &Droplet,
    wetting: &HairWetting,
    gravity: Vec3,
    dt: f32,
) -> (f32, bool) {
    let edges = strand.edges();
    let edge = (ride.at as usize).min(edges - 1);
    let (p, lengths) = (strand.positions(), strand.rest_lengths());
    let direction = (p[edge + 1] - p[edge]).normalize_or_zero();
    let along = direction.dot(pose.direction_in(gravity));
    let speed = slide(along, drop.radius(), wetting.sliding);
    let at = (ride.at + speed * dt / (lengths[edge] * pose.scale)).clamp(0.0, edges as f32);
    let bundle = wetting.bundle(drop.touch_count as f32);
    let most = if at == edges as f32 {
        hanging(bundle, gravity.length())
    } else {
        // Along a hanging strand a drop only slides; from a horizontal one it detaches.
        let across = (gravity.length_squared() - along * along).max(0.0).sqrt();
        clinging(bundle, across)
    };
    (at, wetting.sliding == 0.0 || drop.volume <= most)
}

/// How deep in a hat a drop is under it, in times its size.
const UNDER_HAT: f32 = 0.1;

/// How far solids push a drop in a substep while only those near it are looked at (m).
const SHORT_PUSH: f32 = 0.05;

/// The same of all solids: a drop may lie between two. `found` is scratch space.
fn rest_on_solids(
    solids: &Colliders<Obstacle>,
    drop: &mut Droplet,
    radius: f32,
    found: &mut Vec<u32>,
) -> bool {
    let (position, velocity) = (drop.position, drop.velocity);
    let (mut lies, mut is_near) = (false, true);
    for solid in solids.around(position, radius + SHORT_PUSH, found) {
        lies |= rest_on(solid, drop, radius);
        is_near &= drop.position.distance(position) <= SHORT_PUSH;
    }
    if is_near {
        return lies;
    }
    // Pushed that far it may have come to others.
    (drop.position, drop.velocity) = (position, velocity);
    solids.iter().fold(false, |lies, solid| rest_on(solid, drop, radius) | lies)
}

/// Moves a drop out of a solid onto its surface and removes the velocity into it. Returns whether it was
/// inside.
fn rest_on(obstacle: &Obstacle, drop: &mut Droplet, radius: f32) -> bool {
    let at = |place: Vec3| obstacle.solid.depth(V3::new(place.x, place.y, place.z), radius);
    let (normal, depth) = at(drop.position);
    if depth.is_nan() || depth <= 0.0 {
        return false;
    }
    // What drips under a hat stays there.
    if let Solid::Placed(placed) = &obstacle.solid
        && let Shape::Hat { radii, .. } = &placed.shape
        && at(drop.before).1 > UNDER_HAT * radii.min_element() * placed.scale
    {
        return false;
    }
    let normal = Vec3::new(normal.x, normal.y, normal.z);
    drop.position += normal * depth;
    drop.velocity -= normal * drop.velocity.dot(normal).min(0.0);
    true
}

/// After the strands have moved: droplets on strands move with them.
pub(super) fn follow_strands(
    hairs: Query<&TickPose, With<Hair>>,
    strands: Query<(&StrandOf, &Strand)>,
    mut droplets: Query<&mut Droplet>,
) {
    for mut drop in &mut droplets {
        let Some(ride) = drop.ride else { continue };
        if let Ok((of, strand)) = strands.get(ride.strand)
            && let Ok(pose) = hairs.get(of.0)
            && strand.nodes() >= 2
        {
            let (place, velocity) = on_strand(strand, ride.at);
            let drop = drop.bypass_change_detection();
            drop.position = pose.now().point_out(place);
            drop.velocity = pose.now().direction_out(velocity);
            drop.keep_in_range();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::rod::obstacle::Solid;
    use proptest::prelude::*;

    #[test]
    fn drops_are_kept_near_any_hair_above_its_own_depth() {
        let at =
            |center: Vec3| HairBounds { center, radius: 1.0, room: 1.0, lowest: 1.0 - center.y };
        let bounds = [at(Vec3::ZERO), at(Vec3::new(5000.0, 800.0, 0.0))];
        let (rules, mut last) = (DropletRules::default(), 0);
        let mut is_kept = |place| {
            let drop = Droplet::ball(place, 1e-3);
            near_any(&bounds, &mut last, &drop, Vec3::NEG_Y, &rules)
        };
        for (place, kept) in [
            (Vec3::Y * -5.9, true),
            (Vec3::Y * -6.1, false),
            (Vec3::new(5000.0, 800.0, 100.9), true),
            (Vec3::new(5000.0, 800.0, 101.1), false),
            // Far below the hair on the mountain, though above that in the valley.
            (Vec3::new(5000.0, 793.9, 0.0), false),
            (Vec3::new(2500.0, 10.0, 0.0), false),
            (Vec3::Y * 100.0, true),
            (Vec3::NAN, false),
        ] {
            assert_eq!(is_kept(place), kept, "{place}");
        }
    }

    proptest! {
        /// Solids far from a drop are left out, also where one pushes it far.
        #[test]
        fn a_drop_rests_on_solids_near_it_as_on_all(
            balls in prop::collection::vec(
                (prop::array::uniform3(-0.3f32..0.3), 0.01f32..0.2), 1..30,
            ),
            v in prop::array::uniform3(-1.0f32..1.0),
        ) {
            let poses: Vec<_> = balls.iter().map(|(at, radius)| (Vec3::from(*at), *radius)).collect();
            let solid = |(at, radius): (Vec3, f32)| Obstacle {
                solid: Solid::Capsule { a: at, b: at, radius },
                motion: None,
                friction: 0.0,
            };
            let solids = poses.iter().map(|ball| (*ball, solid(*ball)));
            let solids = Colliders::of_balls(usize::MAX, solids);
            let drop = Droplet::ball(Vec3::ZERO, 2e-3);
            let [mut near, mut all] = [0; 2].map(|_| Droplet { velocity: v.into(), ..drop.clone() });
            let lies = rest_on_solids(&solids, &mut near, 2e-3, &mut Vec::new());
            let expected = solids.iter().fold(false, |lies, o| rest_on(o, &mut all, 2e-3) | lies);
            prop_assert_eq!((near, lies), (all, expected));
        }
    }
}

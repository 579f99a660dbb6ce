//! `Interaction` and `BondUpdate`: droplets fall, slide, merge and follow their strands.

use super::{
    Droplet, DropletRules, Ride, WaterLedger, Wetting,
    exchange::{let_go, on_strand},
    model::{clinging, fall, hanging, slide},
};
use crate::{
    HairCollider,
    contact::seen_from,
    environment::{
        HairGravity, Winds,
        vapour::{DryingAir, WATER, transfer},
    },
    fault::HairFault,
    lanes::V3,
    parallel::{Nanos, for_each},
    rod::obstacle::Obstacle,
    schedule::{HairStep, ProcessTime},
    setting::{Ranged, Settings, Violations, report},
    strand::{Hair, Pose, Strand, StrandOf, TickPose},
};
use bevy::prelude::*;

/// What becomes of a droplet in this substep.
struct Moving<'a> {
    entity: Entity,
    drop: Mut<'a, Droplet>,
    violations: Violations,
    /// Water that the ledger did not know (m³); negative for water that somebody took.
    new: f64,
    evaporated: f64,
    ends: bool,
}

pub(super) fn move_droplets(
    mut commands: Commands,
    step: Res<HairStep>,
    (air, process, gravity, rules): (
        Res<DryingAir>,
        Res<ProcessTime>,
        Res<HairGravity>,
        Res<DropletRules>,
    ),
    wetting: Settings<Wetting>,
    colliders: Query<(&HairCollider, &TickPose)>,
    winds: Winds,
    hairs: Query<&TickPose, With<Hair>>,
    strands: Query<(&StrandOf, &Strand)>,
    mut droplets: Query<(Entity, &mut Droplet)>,
    mut ledger: ResMut<WaterLedger>,
    mut faults: MessageWriter<HairFault>,
) {
    if droplets.is_empty() {
        return;
    }
    let (dt, rules) = (step.dt, rules.clamped());
    let gravity = gravity.clamped().0;
    let process = process.clamped().0;
    let world = TickPose::default();
    let obstacles: Vec<Obstacle> =
        colliders.iter().map(|(c, pose)| seen_from(&world, &c.clamped(), pose)).collect();
    let winds = winds.seen_from(world.now());
    let mut items: Vec<Moving<'_>> = droplets
        .iter_mut()
        .map(|(entity, drop)| Moving {
            entity,
            drop,
            violations: Violations::new(),
            new: 0.0,
            evaporated: 0.0,
            ends: false,
        })
        .collect();
    for_each(
        &mut items,
        Nanos(500),
        |Moving { drop, violations, new, evaporated, ends, .. }| {
            let drop = drop.bypass_change_detection();
            drop.repair(violations);
            *new = drop.volume - drop.counted.0;
            drop.before = drop.position;

            let blown = winds.around(drop.position);
            let (wind, warmth) = (blown.velocity, blown.warmth(air.celsius));
            let radius = drop.radius();
            let speed = air.draught + (wind - drop.velocity).length();
            let area = 4.0 * core::f32::consts::PI * radius * radius;
            let flux = transfer(speed, 2.0 * radius.max(1e-6)) * air.drive(warmth);
            *evaporated = (f64::from(flux * area * process * dt) / WATER).min(drop.volume);
            drop.volume -= *evaporated;
            drop.counted.0 = drop.volume;

            let carrier = drop.ride.and_then(|ride| {
                let (of, strand) = strands.get(ride.strand).ok()?;
                (strand.nodes() >= 2).then_some((ride, strand, hairs.get(of.0).ok()?.now(), of.0))
            });
            match carrier {
                Some((ride, strand, pose, hair)) => {
                    let wetting = wetting.of(hair);
                    let (at, holds) = slid(ride, strand, pose, drop, &wetting, gravity, dt);
                    drop.ride = holds.then_some(Ride { at, ..ride });
                    if !holds {
                        let free = let_go(pose, strand, at, drop.volume, &wetting, gravity);
                        (drop.position, drop.velocity) = (free.position, free.velocity);
                        drop.before = drop.position;
                    }
                }
                None => {
                    drop.ride = None;
                    drop.company = 1;
                    drop.velocity = fall(drop.velocity, gravity, wind, radius, dt);
                    drop.position += drop.velocity * dt;
                    // All of them: a drop may lie where two meet.
                    let lies =
                        obstacles.iter().fold(false, |lies, o| rest_on(o, drop, radius) | lies);
                    drop.lying = if lies { drop.lying + dt } else { 0.0 };
                }
            }
            let inside = (drop.position.cmpge(rules.min) & drop.position.cmple(rules.max)).all();
            let inside = inside && Droplet::POSITION.check(drop.position).is_ok();
            drop.keep_in_range();
            *ends = !inside || drop.lying > rules.lying || drop.volume < 1e-15;
        },
    );
    for Moving { entity, violations, new, evaporated, ends, .. } in items {
        ledger.book(new);
        ledger.book(-evaporated);
        report(Some(entity), violations, &mut faults);
        if ends {
            // What is left is counted when it goes.
            commands.entity(entity).despawn();
        }
    }
}

/// Where on its strand a droplet has slid to, and whether it holds on there: at the tip it hangs,
/// elsewhere it clings, the more strands are at it the heavier it may be. Pinned drops hold always.
fn slid(
    ride: Ride,
    strand: &Strand,
    pose: &Pose,
    drop: &Droplet,
    wetting: &Wetting,
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
    let bundle = wetting.bundle(drop.company as f32);
    let most = if at == edges as f32 {
        hanging(bundle, gravity.length())
    } else {
        // Along a strand that hangs a drop only slides; it has to let go of one that lies.
        let across = (gravity.length_squared() - along * along).max(0.0).sqrt();
        clinging(bundle, across)
    };
    (at, wetting.sliding == 0.0 || drop.volume <= most)
}

/// Sets a drop that is inside a solid on its surface; its velocity into it is gone. Says whether.
fn rest_on(obstacle: &Obstacle, drop: &mut Droplet, radius: f32) -> bool {
    let [x, y, z] = drop.position.to_array();
    let (normal, depth) = obstacle.solid.depth(V3::new(x, y, z), radius);
    if depth.is_nan() || depth <= 0.0 {
        return false;
    }
    let normal = Vec3::new(normal.x, normal.y, normal.z);
    drop.position += normal * depth;
    drop.velocity -= normal * drop.velocity.dot(normal).min(0.0);
    true
}

/// After the strands have moved: riding droplets are where their strands went.
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
            drop.velocity = pose.now().rotation * velocity;
            drop.keep_in_range();
        }
    }
}

//! `Interaction` and `BondUpdate`: droplets fall, slide, merge and follow their strands.

use super::{
    Droplet, DropletRules, Ride, WaterLedger, Wetting,
    exchange::{let_go, on_strand},
    model::{ball_radius, clinging, fall, hanging, slide},
};
use crate::{
    Blower, HairCollider,
    contact::seen_from,
    environment::{
        Blown, HairGravity, local_blowers,
        vapour::{DryingAir, WATER, transfer},
    },
    fault::HairFault,
    grid::UniformGrid,
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
    drop: &'a mut Droplet,
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
    blowers: Query<(&Blower, &TickPose)>,
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
    let blowers = local_blowers(world.now(), &blowers);
    let mut items: Vec<Moving<'_>> = droplets
        .iter_mut()
        .map(|(entity, drop)| Moving {
            entity,
            drop: drop.into_inner(),
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
            drop.repair(violations);
            *new = drop.volume - drop.counted;
            drop.before = drop.position;

            let blown = Blown::at(&blowers, 1.0, drop.position, Vec3::ZERO);
            let (wind, warmth) = (blown.velocity, blown.warmth(air.celsius));
            let radius = drop.radius();
            let speed = air.draught + (wind - drop.velocity).length();
            let area = 4.0 * core::f32::consts::PI * radius * radius;
            let flux = transfer(speed, 2.0 * radius.max(1e-6)) * air.drive(warmth);
            *evaporated = (f64::from(flux * area * process * dt) / WATER).min(drop.volume);
            drop.volume -= *evaporated;
            drop.counted = drop.volume;

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

/// Once a tick: droplets that touch become one, where the larger was.
pub(super) fn merge_droplets(
    mut commands: Commands,
    step: Res<HairStep>,
    rules: Res<DropletRules>,
    mut droplets: Query<(Entity, &mut Droplet)>,
) {
    if step.index != 0 || !rules.merging || droplets.iter().len() < 2 {
        return;
    }
    let mut drops: Vec<(Entity, Mut<'_, Droplet>)> = droplets.iter_mut().collect();
    let places: Vec<(Vec3, f32)> = drops.iter().map(|(_, d)| (d.position, d.radius())).collect();
    let largest = places.iter().map(|p| p.1).fold(0.0, f32::max);
    let mut grid = UniformGrid::default();
    grid.build(2.0 * largest, places.iter().zip(0..).map(|(p, i)| (p.0, i)));
    for i in 0..drops.len() {
        let (place, radius) = places[i];
        let mut touching: Vec<usize> = Vec::new();
        grid.for_each_near(place, |j| {
            let (other, size) = places[j as usize];
            let near = radius + size;
            if j as usize > i && other.distance_squared(place) < near * near {
                touching.push(j as usize);
            }
        });
        // Cells come in the order of their keys; entities' order is the same everywhere.
        touching.sort_unstable();
        for j in touching {
            let [(_, a), (_, b)] = drops.get_disjoint_mut([i, j]).expect("i is before j");
            if a.volume > 0.0 && b.volume > 0.0 {
                let (a, b) = (a.bypass_change_detection(), b.bypass_change_detection());
                if a.volume >= b.volume { a.merge(b) } else { b.merge(a) }
            }
        }
    }
    for (entity, drop) in drops.iter().filter(|(_, d)| d.volume == 0.0) {
        debug_assert_eq!(drop.counted, 0.0);
        commands.entity(*entity).despawn();
    }
}

impl Droplet {
    /// Takes another drop in, with its momentum.
    fn merge(&mut self, other: &mut Droplet) {
        let volume = self.volume + other.volume;
        let share = (other.volume / volume) as f32;
        if self.ride.is_none() {
            self.position = self.position.lerp(other.position, share);
        }
        self.velocity = self.velocity.lerp(other.velocity, share);
        (self.volume, self.counted) = (volume, self.counted + other.counted);
        (other.volume, other.counted) = (0.0, 0.0);
        self.r_min = self.r_min.max(other.r_min).max(ball_radius(volume));
        self.r_max = self.r_max.max(other.r_max).max(1.5 * self.r_min);
    }
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
        }
    }
}

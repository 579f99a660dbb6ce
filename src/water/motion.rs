//! `Interaction` and `BondUpdate`: droplets fall, slide, merge, meet strands and follow them.

use super::{
    Climate, Droplet, DropletRules, Moisture, ProcessTime, Ride, WaterLedger, Wetting,
    adhesion::{Encounters, Landing, Met, MetBy, Touch},
    exchange::{blown_air, let_go, on_strand},
    field::{Field, SeenDrop},
    model::{ball_radius, clinging, fall, hanging, slide},
    moisture::node_lengths,
    systems::tell,
    vapour::{DryingAir, WATER, transfer},
};
use crate::{
    Blower, HairCollider,
    air::{HairGravity, local_blowers},
    contact::{WetRow, seen_from},
    fault::HairFault,
    grid::UniformGrid,
    parallel::{for_each, for_each_block},
    rod::{algebra::V3, obstacle::Obstacle},
    setting::{Notes, Settings},
    strand::{Burden, Hair, PerHair, Pose, Strand, StrandOf, TickPose},
    tick::HairStep,
};
use bevy::prelude::*;
use fearless_simd::Level;

/// The fewest strands that meet droplets as one piece of work.
const PIECE: usize = 16;

/// The most sums over pieces that are kept, for all droplets together.
const SUMS: usize = 1 << 18;

/// How many strands meet droplets as one piece of work: the same on any number of threads, so that
/// what droplets get is always summed in the same order. Every piece sums for all droplets, so of
/// many droplets there are few pieces.
fn piece(strands: usize, drops: usize) -> usize {
    let pieces = (SUMS / drops.max(1)).clamp(4, 64);
    strands.div_ceil(pieces).max(PIECE)
}

/// Room for the work of a substep, kept from one to the next.
#[derive(Resource, Default)]
pub(super) struct WaterField {
    field: Field,
    merging: UniformGrid,
    pieces: Vec<Encounters>,
    /// Strands that carry a droplet's weight.
    loaded: Vec<Entity>,
    /// What nodes bring to bridges of water.
    pub(super) rows: Vec<WetRow>,
}

/// What becomes of a droplet in this substep.
struct Moving<'a> {
    entity: Entity,
    drop: &'a mut Droplet,
    notes: Notes,
    /// Water that the ledger did not know (m³); negative for water that somebody took.
    new: f64,
    evaporated: f64,
    ends: bool,
}

pub(super) fn move_droplets(
    mut commands: Commands,
    step: Res<HairStep>,
    (climate, process, gravity, rules): (
        Res<Climate>,
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
    let dt = step.dt;
    let gravity = if gravity.is_finite() { gravity.0 } else { Vec3::ZERO };
    let climate = climate.mended(&Notes::default());
    let air = DryingAir::new(climate.celsius, climate.humidity, climate.draught);
    let process = process.mended(&Notes::default());
    let world = TickPose::default();
    let obstacles: Vec<Obstacle> =
        colliders.iter().map(|(c, pose)| seen_from(&world, &c.valid(), pose)).collect();
    let blowers = local_blowers(world.now(), &blowers);
    let mut items: Vec<Moving<'_>> = droplets
        .iter_mut()
        .map(|(entity, drop)| Moving {
            entity,
            drop: drop.into_inner(),
            notes: Notes::default(),
            new: 0.0,
            evaporated: 0.0,
            ends: false,
        })
        .collect();
    for_each(&mut items, |Moving { drop, notes, new, evaporated, ends, .. }| {
        drop.mend(notes);
        *new = drop.volume - drop.counted;
        drop.before = drop.position;

        let (wind, warmth) = blown_air(&blowers, 1.0, air.celsius, drop.position);
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
                let lies = obstacles.iter().fold(false, |lies, o| rest_on(o, drop, radius) | lies);
                drop.lying = if lies { drop.lying + dt } else { 0.0 };
            }
        }
        let inside = (drop.position.cmpge(rules.min) & drop.position.cmple(rules.max)).all();
        *ends = !inside || drop.lying > rules.lying || drop.volume < 1e-15;
    });
    for Moving { entity, notes, new, evaporated, ends, .. } in items {
        ledger.book(new);
        ledger.book(-evaporated);
        tell(entity, notes, &mut faults);
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
    mut scratch: ResMut<WaterField>,
    mut droplets: Query<(Entity, &mut Droplet)>,
) {
    if step.index != 0 || !rules.merging || droplets.iter().len() < 2 {
        return;
    }
    let mut drops: Vec<(Entity, Mut<'_, Droplet>)> = droplets.iter_mut().collect();
    let places: Vec<(Vec3, f32)> = drops.iter().map(|(_, d)| (d.position, d.radius())).collect();
    let largest = places.iter().map(|p| p.1).fold(0.0, f32::max);
    let grid = &mut scratch.merging;
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
                if a.volume >= b.volume { a.take_in(b) } else { b.take_in(a) }
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
    fn take_in(&mut self, other: &mut Droplet) {
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

/// A hair and its strands among droplets.
struct Head<'a> {
    pose: Pose,
    wetting: Wetting,
    strands: Vec<Strandful<'a>>,
}

struct Strandful<'a> {
    entity: Entity,
    strand: Mut<'a, Strand>,
    burden: &'a Burden,
    moisture: &'a Moisture,
}

/// What a substep did to one droplet.
#[derive(Clone, Copy, Debug, Default)]
struct Outcome {
    /// What strands gave it (kg m/s, in the world).
    impulse: Vec3,
    /// How many strands are at it.
    company: u32,
    landing: Option<Landing>,
    /// The most that strands would drink (m³).
    wanted: f64,
}

pub(super) fn wet_strands(
    step: Res<HairStep>,
    gravity: Res<HairGravity>,
    process: Res<ProcessTime>,
    wetting: Settings<Wetting>,
    mut scratch: ResMut<WaterField>,
    hairs: Query<&TickPose, With<Hair>>,
    mut strands: Query<(Entity, &StrandOf, &mut Strand, &mut Burden, &mut Moisture)>,
    mut droplets: Query<&mut Droplet>,
    mut ledger: ResMut<WaterLedger>,
) {
    let WaterField { field, pieces, loaded, .. } = scratch.bypass_change_detection();
    // Water's own weight is written anew by its exchange; to dry hair only droplets are a burden.
    for strand in loaded.drain(..) {
        if let Ok((.., mut burden, moisture)) = strands.get_mut(strand)
            && moisture.is_untouched()
        {
            *burden.bypass_change_detection() = default();
        }
    }
    let mut drops: Vec<&mut Droplet> = droplets.iter_mut().map(Mut::into_inner).collect();
    if drops.is_empty() {
        return;
    }
    // Who carries a drop is heavy for all that pulls.
    for drop in &drops {
        if let Some(ride) = drop.ride
            && let Ok((_, of, strand, mut burden, _)) = strands.get_mut(ride.strand)
            && strand.nodes() >= 2
        {
            let burden = burden.bypass_change_detection();
            weigh(&strand, burden, &wetting.of(of.0), ride.at, mass_of(drop));
            loaded.push(ride.strand);
        }
    }
    let process = process.mended(&Notes::default());
    let mut outcomes = vec![Outcome::default(); drops.len()];
    let mut drunk: Vec<Touch> = Vec::new();
    for Head { pose, wetting, mut strands } in heads(&hairs, &wetting, &mut strands) {
        field.see(&drops, &pose);
        let longest = strands.iter().flat_map(|s| s.strand.rest_lengths()).copied();
        field.sort(1.1 * longest.fold(0.0, f32::max), wetting.lock_radius());
        let met = MetBy {
            wetting: &wetting,
            dt: step.dt,
            uptake: 1.0 - bevy::math::ops::exp(-wetting.uptake * process * step.dt),
            most_film: clinging(wetting.bundle(1.0), gravity.length()),
        };
        meet_all(&mut strands, field, &met, pieces);
        for (k, outcome) in outcomes.iter_mut().enumerate() {
            let sum: Vec4 = pieces.iter().map(|out| out.impulses[k]).sum();
            outcome.impulse += pose.rotation * sum.xyz();
        }
        for out in pieces.iter() {
            sum_up(out, &mut outcomes);
            drunk.extend_from_slice(&out.touches);
        }
    }
    for (drop, outcome) in drops.iter_mut().zip(&outcomes) {
        drop.company = outcome.company.max(1);
        let lands = drop.ride.is_none() && outcome.landing.is_some();
        if let Some(landing) = outcome.landing.filter(|_| lands) {
            drop.ride = Some(Ride { strand: landing.strand, at: landing.at });
            drop.lying = 0.0;
        }
        if let Some(ride) = drop.ride
            && let Ok((_, of, mut strand, mut burden, _)) = strands.get_mut(ride.strand)
            && let Ok(pose) = hairs.get(of.0)
        {
            let (pose, wetting) = (pose.now(), wetting.of(of.0));
            let (strand, burden) =
                (strand.bypass_change_detection(), burden.bypass_change_detection());
            let mut impulse = pose.direction_in(outcome.impulse);
            if lands {
                weigh(strand, burden, &wetting, ride.at, mass_of(drop));
                loaded.push(ride.strand);
                let lands_at = pose.rotation * on_strand(strand, ride.at).1;
                impulse += pose.direction_in(drop.velocity - lands_at) * mass_of(drop);
            }
            push(strand, burden, &wetting, ride.at, impulse);
        }
    }
    for touch in drunk {
        let (drop, outcome) = (&mut drops[touch.drop as usize], &outcomes[touch.drop as usize]);
        // What all want together may be more than there is.
        let share = (drop.counted / outcome.wanted).min(1.0);
        let takes = (touch.wants * share).min(drop.volume);
        if let Ok((_, _, strand, _, mut moisture)) = strands.get_mut(touch.strand) {
            let moisture = moisture.bypass_change_detection();
            ledger.water_out += moisture.fit(strand.nodes());
            moisture.add_film(touch.node, takes);
            drop.volume -= takes;
        }
    }
    drops.iter_mut().for_each(|drop| drop.counted = drop.volume);
}

/// All strands by their hair, in the order in which the world has them.
fn heads<'a>(
    hairs: &Query<&TickPose, With<Hair>>,
    wetting: &Settings<Wetting>,
    strands: &'a mut Query<(Entity, &StrandOf, &mut Strand, &mut Burden, &mut Moisture)>,
) -> Vec<Head<'a>> {
    let mut heads: PerHair<Head<'a>> = default();
    for (entity, of, strand, burden, moisture) in strands {
        let index = heads.index(of.0, || {
            let pose = *hairs.get(of.0).ok()?.now();
            Some(Head { pose, wetting: wetting.of(of.0), strands: Vec::new() })
        });
        if let Some(index) = index
            && strand.nodes() >= 2
        {
            let (burden, moisture) = (&*burden.into_inner(), &*moisture.into_inner());
            heads.values[index].strands.push(Strandful { entity, strand, burden, moisture });
        }
    }
    heads.values
}

impl Field {
    /// The droplets in a hair's frame.
    fn see(&mut self, drops: &[&mut Droplet], pose: &Pose) {
        let scale = pose.scale.recip();
        self.drops.clear();
        self.drops.extend(drops.iter().map(|d| SeenDrop {
            at: pose.point_in(d.position),
            before: pose.point_in(d.before),
            velocity: pose.rotation.inverse() * d.velocity,
            radius: d.radius() * scale,
            r_min: d.r_min * scale,
            r_max: d.r_max * scale,
            strength: d.strength(),
            mass: mass_of(d),
            company: d.company as f32,
            ride: d.ride.map(|r| r.strand),
        }));
    }
}

fn meet_all(
    strands: &mut [Strandful<'_>],
    field: &Field,
    met: &MetBy<'_>,
    pieces: &mut Vec<Encounters>,
) {
    let piece = piece(strands.len(), field.drops.len());
    pieces.resize_with(strands.len().div_ceil(piece), default);
    let level = Level::new();
    let mut work: Vec<_> = strands.chunks_mut(piece).zip(&mut *pieces).collect();
    for_each_block(
        &mut work,
        || (),
        |(), (strands, out)| {
            out.clear(field.drops.len());
            for Strandful { entity, strand, burden, moisture } in strands.iter_mut() {
                let strand = strand.bypass_change_detection();
                let (positions, velocities, lengths) = strand.motion_parts();
                let mut met = Met {
                    strand: *entity,
                    positions,
                    velocities,
                    lengths,
                    load: &burden.mass,
                    film: moisture.film(),
                    by: met,
                };
                met.meet(level, field, out);
            }
        },
    );
}

/// Adds up whom a piece of the strands met, in their order.
fn sum_up(out: &Encounters, outcomes: &mut [Outcome]) {
    for &drop in &out.company {
        outcomes[drop as usize].company += 1;
    }
    for touch in &out.touches {
        outcomes[touch.drop as usize].wanted += touch.wants;
    }
    for landing in &out.landings {
        let first = &mut outcomes[landing.drop as usize].landing;
        if first.is_none_or(|other| landing.when < other.when) {
            *first = Some(*landing);
        }
    }
}

fn mass_of(drop: &Droplet) -> f32 {
    (drop.volume * WATER) as f32
}

/// The edge that a point `at` segments from the root is on, and its ends' shares in it.
fn shares(strand: &Strand, at: f32) -> (usize, [f32; 2]) {
    let edge = (at as usize).min(strand.edges() - 1);
    let t = (at - edge as f32).clamp(0.0, 1.0);
    (edge, [1.0 - t, t])
}

/// Lets a strand bear `mass` (kg) at a point: its nodes get heavier.
fn weigh(strand: &Strand, burden: &mut Burden, wetting: &Wetting, at: f32, mass: f32) {
    burden.mass.resize(strand.nodes(), 0.0);
    let (edge, share) = shares(strand, at);
    for (i, length) in node_lengths(strand.rest_lengths()).enumerate().skip(edge).take(2) {
        burden.mass[i] += share[i - edge] * mass / (wetting.dry_mass() * length);
    }
}

/// Gives a strand an impulse (kg m/s) at a point, which moves as one with what it bears.
fn push(strand: &mut Strand, burden: &Burden, wetting: &Wetting, at: f32, impulse: Vec3) {
    let (edge, share) = shares(strand, at);
    let mut mobility = [0.0; 2];
    for (i, length) in node_lengths(strand.rest_lengths()).enumerate().skip(edge).take(2) {
        let load = burden.mass.get(i).copied().unwrap_or(0.0);
        // The root is the scalp's.
        mobility[i - edge] =
            if i == 0 { 0.0 } else { 1.0 / (wetting.dry_mass() * length * (1.0 + load)) };
    }
    let (_, velocities, _) = strand.motion_parts();
    for end in 0..2 {
        velocities[edge + end] += impulse * (share[end] * mobility[end]);
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

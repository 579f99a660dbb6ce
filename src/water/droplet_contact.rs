//! `Interaction`: contact of strands with droplets.

use super::{
    Droplet, HairWetting, Moisture, StrandPoint, WaterLedger,
    adhesion::{ContactParams, DropletContacts, Landing},
    exchange::{bear_water, on_strand},
    field::{Field, LocalDrop},
    model::clinging,
    moisture::node_lengths,
    strand_block::{StrandBlocks, StrandLane},
};
use crate::{
    base::{
        lanes::{LANES, simd_level},
        parallel::{Nanos, TASK, emptied, for_each_block, prefetch},
        schedule::{EffectiveSubsteps, HairProcessTime, HairStep},
        setting::{Ranged, Settings},
        tape::Tape,
    },
    forces::{
        contact::{Colliders, HairReach, WetRow},
        environment::{Gravity, vapour::WATER},
    },
    hair::strand::{
        AddedMass, Hair, Here, KinematicStrand, MotionOwner, PerHair, Pose, Strand, StrandOf,
        StrandRank, StrandSleep, TickPose,
    },
};
use bevy::{ecs::entity::EntityHashMap, prelude::*};
use core::slice::from_ref;

/// Largest number of sums of a hair, over all work chunks and droplets around it.
const MAX_SUMS: usize = 1 << 18;

/// Droplets per task of the summation.
const DROPS_PER_TASK: usize = 64;

/// Strands per work chunk, a multiple of a block: the same on any number of threads and whatever other hair there
/// is, so that effects on droplets are summed in the same order. Every chunk needs sums for all droplets around its
/// hair, so with many droplets there are few chunks.
fn chunk_size(strands: usize, drops: usize) -> usize {
    let chunks = (MAX_SUMS / drops.max(1)).clamp(4, 64);
    // There may be no strands: those without edges are left out.
    strands.div_ceil(chunks).max(1).next_multiple_of(LANES)
}

/// Buffers of a substep, reused in the next.
#[derive(Resource, Default)]
pub(crate) struct WaterField {
    /// The droplets around each hair, and the results of its work chunks.
    fields: Vec<(Field, Vec<DropletContacts>)>,
    /// Strands that carry a droplet's weight.
    loaded: Vec<Entity>,
    /// The nodes' input to bridges of water.
    pub(super) rows: Vec<WetRow>,
    outcomes: Vec<Outcome>,
    /// Those of the droplets around one hair.
    local: Vec<Outcome>,
    buffers: Vec<Buffers>,
}

impl WaterField {
    /// What a substep finds of the one before.
    pub(crate) fn record(&mut self, tape: &mut Tape<'_>) {
        let count = tape.count(self.loaded.len(), size_of::<u64>());
        self.loaded.resize(count, Entity::PLACEHOLDER);
        self.loaded.iter_mut().for_each(|strand| tape.entity(strand));
    }
}

/// Buffers for a hair's strands, unsorted and sorted.
type Buffers = (Vec<Option<WetStrand<'static>>>, Vec<WetStrand<'static>>);

/// A hair and its strands among droplets.
struct WetHair<'a> {
    pose: Pose,
    owner: MotionOwner,
    wetting: HairWetting,
    /// The droplets that may reach it in this substep, by their numbers.
    drops: Vec<u32>,
    strands: Vec<WetStrand<'a>>,
}

struct WetStrand<'a> {
    entity: Entity,
    rank: StrandRank,
    strand: Mut<'a, Strand>,
    is_free: bool,
    added_mass: &'a AddedMass,
    moisture: Mut<'a, Moisture>,
}

/// Total effect of a substep on one droplet.
#[derive(Clone, Copy, Debug, Default)]
struct Outcome {
    /// Impulse from strands (kg m/s, in the world).
    impulse: Vec3,
    /// Number of strands that touch it.
    touch_count: u32,
    landing: Option<Landing>,
    /// Volume that strands would absorb (m³).
    wanted: f64,
}

/// What droplets act on, as a query reads it.
type AmongDroplets = (
    (Entity, &'static StrandRank, Has<KinematicStrand>),
    &'static StrandOf,
    &'static mut Strand,
    &'static mut AddedMass,
    &'static mut Moisture,
    &'static mut StrandSleep,
);

/// Hair among droplets, as a query reads it.
type RainedOn = (
    (Entity, &'static MotionOwner),
    &'static TickPose,
    &'static mut StrandBlocks,
    Option<&'static HairReach>,
);

pub(super) fn wet_strands(
    (step, steps): (Res<HairStep>, EffectiveSubsteps),
    gravity: Gravity,
    process: Res<HairProcessTime>,
    wetting: Settings<HairWetting>,
    mut scratch: ResMut<WaterField>,
    mut hairs: Query<RainedOn, With<Hair>>,
    mut strands: Query<AmongDroplets, Here>,
    mut droplets: Query<&mut Droplet>,
    mut ledger: ResMut<WaterLedger>,
) {
    let WaterField { fields, loaded, outcomes, local, buffers, .. } =
        scratch.bypass_change_detection();
    let substep = step.dt;
    let Some(step) = steps.shared() else { return };
    if step.is_first {
        hairs.iter_mut().for_each(|(_, _, mut blocks, _)| {
            blocks.bypass_change_detection().forget();
        });
    }
    // Droplets have added to the mass of the strands that carried them.
    for strand in loaded.drain(..) {
        if let Ok((_, of, strand, mut added_mass, moisture, _)) = strands.get_mut(strand) {
            let added_mass = added_mass.bypass_change_detection();
            if moisture.is_untouched() {
                *added_mass = default();
            } else {
                bear_water(added_mass, &moisture, strand.rest_lengths(), &wetting.of(of.0));
            }
        }
    }
    // Those that have yet to move are far from all hair.
    let mut drops: Vec<Mut<'_, Droplet>> =
        droplets.iter_mut().filter(|drop| drop.lag <= 0.0).collect();
    if drops.is_empty() {
        return;
    }
    drops.sort_by_cached_key(|drop| drop.order());
    let gravity = gravity.clamped().0;
    // A drop adds its mass to the strand that carries it.
    for drop in &drops {
        if let Some(ride) = drop.ride
            && let Ok((_, of, strand, mut added_mass, _, mut sleep)) = strands.get_mut(ride.strand)
            && strand.nodes() >= 2
        {
            let added_mass = added_mass.bypass_change_detection();
            weigh(&strand, added_mass, &wetting.of(of.0), ride.at, mass_of(drop));
            sleep.bypass_change_detection().wake();
            loaded.push(ride.strand);
        }
    }
    let process = process.clamped().0;
    outcomes.clear();
    outcomes.resize(drops.len(), Outcome::default());
    let mut wet_hairs = wet_hairs(&mut hairs, &wetting, &mut strands, &drops, buffers);
    fields.resize_with(fields.len().max(wet_hairs.len()), default);
    for (WetHair { pose, wetting, drops: near, strands, .. }, (field, chunks)) in
        wet_hairs.iter_mut().zip(&mut *fields)
    {
        field.set_drops(near.iter().map(|k| &*drops[*k as usize]), pose);
        field.sort(wetting.lock_radius());
        let params = ContactParams {
            wetting,
            field,
            dt: step.dt,
            steepest: 1.0 / (substep * substep),
            uptake: 1.0 - bevy::math::ops::exp(-wetting.uptake * process * step.dt),
            film_capacity: clinging(wetting.bundle(1.0), gravity.length()),
            gravity: pose.direction_in(gravity),
        };
        let chunk = chunk_size(strands.len(), near.len());
        chunks.resize_with(strands.len().div_ceil(chunk), default);
        contact_all(strands.chunks_mut(chunk).zip(&mut *chunks).collect(), &params);
        local.clear();
        local.extend(near.iter().map(|k| outcomes[*k as usize]));
        sum_up(chunks, pose, local);
        near.iter().zip(&*local).for_each(|(k, sum)| outcomes[*k as usize] = *sum);
    }
    // Together the strands may request more than the droplet holds.
    let share = |k: usize| (drops[k].counted.0 / outcomes[k].wanted).min(1.0);
    let shares: Vec<f64> = (0..drops.len()).map(share).collect();
    for (WetHair { drops: near, strands, .. }, (_, chunks)) in
        wet_hairs.iter_mut().zip(&mut *fields)
    {
        let chunk = chunk_size(strands.len(), near.len());
        let shares: Vec<f64> = near.iter().map(|k| shares[*k as usize]).collect();
        absorb_all(strands.chunks_mut(chunk).zip(&mut *chunks).collect(), &shares);
        ledger.water_out += chunks.iter().map(|out| out.removed).sum::<f64>();
    }
    for (wet_hair, buffer) in wet_hairs.into_iter().zip(buffers) {
        buffer.1 = emptied(wet_hair.strands);
    }
    for ((drop, outcome), share) in drops.iter_mut().zip(&*outcomes).zip(shares) {
        let drop = drop.bypass_change_detection();
        // Negative only by rounding.
        drop.volume = (drop.volume - share * outcome.wanted).max(0.0);
        drop.counted.0 = drop.volume;
        drop.touch_count = outcome.touch_count.max(1);
        let lands = drop.ride.is_none() && outcome.landing.is_some();
        if let Some(landing) = outcome.landing.filter(|_| lands) {
            drop.ride = Some(StrandPoint { strand: landing.strand, at: landing.at });
            drop.lying = 0.0;
        }
        if let Some(ride) = drop.ride
            && let Ok(((_, _, is_kinematic), of, mut strand, mut added_mass, ..)) =
                strands.get_mut(ride.strand)
            && let Ok(((_, owner), pose, ..)) = hairs.get(of.0)
        {
            drop.hair = Some(of.0);
            let (pose, wetting) = (pose.now(), wetting.of(of.0));
            let (strand, added_mass) =
                (strand.bypass_change_detection(), added_mass.bypass_change_detection());
            let mut impulse =
                without_lift(pose.direction_in(outcome.impulse), pose.direction_in(gravity));
            if lands {
                weigh(strand, added_mass, &wetting, ride.at, mass_of(drop));
                loaded.push(ride.strand);
                let lands_at = pose.direction_out(on_strand(strand, ride.at).1);
                impulse += pose.direction_in(drop.velocity - lands_at) * mass_of(drop);
            }
            if is_free(*owner, is_kinematic) {
                push(strand, added_mass, &wetting, ride.at, impulse);
            }
        }
    }
}

/// Whether a strand keeps the velocity that droplets give it, and a step takes it on.
fn is_free(owner: MotionOwner, is_kinematic: bool) -> bool {
    !is_kinematic && !matches!(owner, MotionOwner::Frozen | MotionOwner::Played)
}

/// A ball (m) around all that a droplet acts on in a substep, of locks of a radius of up to `clearance`.
fn ball_of(drop: &Droplet, clearance: f32) -> (Vec3, f32) {
    let reach = drop.r_max.max(drop.radius().max(drop.r_min) + clearance);
    let path = drop.position - drop.before;
    (drop.position - 0.5 * path, 0.5 * path.length() + reach)
}

/// The strands that droplets may reach, grouped by hair, neighbouring roots next to each other.
fn wet_hairs<'a>(
    hairs: &mut Query<RainedOn, With<Hair>>,
    wetting: &Settings<HairWetting>,
    strands: &'a mut Query<AmongDroplets, Here>,
    drops: &[Mut<'_, Droplet>],
    buffers: &mut Vec<Buffers>,
) -> Vec<WetHair<'a>> {
    let mut wet_hairs: PerHair<(Entity, WetHair<'a>, Vec<Option<WetStrand<'a>>>)> = default();
    let mut unused = core::mem::take(buffers).into_iter();
    let locks = hairs
        .iter()
        .map(|((hair, _), frame, ..)| wetting.of(hair).lock_radius() * frame.now().scale);
    let widest = locks.fold(0.0, f32::max);
    let balls = (0..).zip(drops).map(|(k, drop)| (ball_of(drop, widest), k));
    let balls = Colliders::of_balls(hairs.iter().count(), balls);
    let mut scratch = Vec::new();
    let mut near = EntityHashMap::<Vec<u32>>::default();
    for ((hair, _), frame, _, reach) in hairs.iter() {
        // None of those that only wider locks of other hair would meet.
        let clearance = wetting.of(hair).lock_radius() * frame.now().scale;
        let ball = |k: u32| ball_of(&drops[k as usize], clearance);
        let is_near = |k: &u32| reach.is_none_or(|reach| reach.is_near(frame, ball(*k)));
        let drops = balls.near(frame, reach, &mut scratch).copied();
        let drops: Vec<u32> = drops.filter(is_near).collect();
        if !drops.is_empty() {
            near.insert(hair, drops);
        }
    }
    if near.is_empty() {
        *buffers = unused.collect();
        return Vec::new();
    }
    for ((entity, rank, is_kinematic), of, strand, added_mass, moisture, _) in strands {
        let index = wet_hairs.index(of.0, || {
            let ((_, owner), frame, ..) = hairs.get(of.0).ok()?;
            let drops = near.remove(&of.0)?;
            let (pose, wetting) = (*frame.now(), wetting.of(of.0));
            let (unsorted, sorted) = unused.next().unwrap_or_default();
            let (owner, strands) = (*owner, emptied(sorted));
            let wet_hair = WetHair { pose, owner, wetting, drops, strands };
            Some((of.0, wet_hair, emptied(unsorted)))
        });
        if let Some(index) = index
            && strand.nodes() >= 2
        {
            let added_mass = &*added_mass.into_inner();
            let (_, WetHair { owner, .. }, unsorted) = &mut wet_hairs.values[index];
            unsorted.push(Some(WetStrand {
                entity,
                rank: *rank,
                strand,
                is_free: is_free(*owner, is_kinematic),
                added_mass,
                moisture,
            }));
        }
    }
    wet_hairs.values.sort_by_key(|(hair, ..)| hair.index_u32());
    let sorted = wet_hairs.values.into_iter().map(|(hair, mut wet_hair, mut unsorted)| {
        if let Ok((_, _, mut blocks, _)) = hairs.get_mut(hair) {
            let roots = unsorted.iter().flatten().map(|s| (s.strand.positions()[0], s.rank));
            let order = blocks.bypass_change_detection().order(unsorted.len(), roots);
            for (i, k) in order.iter().enumerate() {
                // The order is not sequential in memory.
                let later = order.get(i + 16).and_then(|k| unsorted.get(*k as usize));
                prefetch(later.map_or(&[], from_ref));
                wet_hair.strands.extend(unsorted.get_mut(*k as usize).and_then(Option::take));
            }
        }
        buffers.push((emptied(unsorted), Vec::new()));
        wet_hair
    });
    sorted.collect()
}

impl Field {
    /// Transforms the droplets into a hair's frame.
    fn set_drops<'a>(&mut self, drops: impl Iterator<Item = &'a Droplet>, pose: &Pose) {
        let scale = pose.scale.recip();
        self.drops.clear();
        self.drops.extend(drops.map(|d| LocalDrop {
            at: pose.point_in(d.position),
            before: pose.point_in(d.before),
            velocity: pose.direction_in(d.velocity),
            radius: d.radius() * scale,
            r_min: d.r_min * scale,
            r_max: d.r_max * scale,
            strength: d.strength(),
            mass: mass_of(d),
            touch_count: d.touch_count as f32,
            ride: d.ride.map(|r| r.strand),
        }));
    }
}

/// The strands and results of each work chunk.
type Work<'w, 'a> = Vec<(&'w mut [WetStrand<'a>], &'w mut DropletContacts)>;

fn contact_all(mut work: Work<'_, '_>, params: &ContactParams<'_>) {
    let level = simd_level();
    for_each_block(
        &mut work,
        TASK,
        || (),
        |(), (strands, out)| {
            out.clear(params.field.drops.len());
            let (mut rest, mut first) = (&mut **strands, 0);
            rest.iter().take(2 * LANES).for_each(|one| prefetch(from_ref(&*one.strand)));
            rest.iter().take(LANES).for_each(WetStrand::prefetch);
            while !rest.is_empty() {
                let (strand_block, after) = rest.split_at_mut(LANES.min(rest.len()));
                let later = after.get(LANES..).unwrap_or_default();
                later.iter().take(LANES).for_each(|one| prefetch(from_ref(&*one.strand)));
                after.iter().take(LANES).for_each(WetStrand::prefetch);
                let mut strand_lanes: Vec<StrandLane<'_>> =
                    strand_block.iter_mut().map(WetStrand::strand_lane).collect();
                params.contact(level, &mut strand_lanes, first, out);
                (rest, first) = (after, first + LANES);
            }
        },
    );
}

/// Adds to every node its share of the volume that it requested.
fn absorb_all(mut work: Work<'_, '_>, shares: &[f64]) {
    for_each_block(
        &mut work,
        TASK,
        || (),
        |(), (strands, out)| {
            for touch in &out.touches {
                let WetStrand { strand, moisture, .. } = &mut strands[touch.strand as usize];
                let moisture = moisture.bypass_change_detection();
                out.removed += moisture.fit(strand.nodes());
                let takes = touch.wants * shares[touch.drop as usize];
                moisture.add_film(touch.node as usize, takes);
            }
        },
    );
}

impl WetStrand<'_> {
    fn prefetch(&self) {
        let (positions, velocities, ..) = self.strand.parts();
        prefetch(positions);
        prefetch(velocities);
        prefetch(self.strand.rest_lengths());
    }

    fn strand_lane(&mut self) -> StrandLane<'_> {
        let (positions, velocities, lengths) = self.strand.bypass_change_detection().motion_parts();
        StrandLane {
            strand: self.entity,
            positions,
            velocities,
            is_free: self.is_free,
            lengths,
            load: &self.added_mass.mass,
            film: self.moisture.film(),
        }
    }
}

/// Sums the effects on droplets and finds where they land first, over all chunks in the strands'
/// order.
fn sum_up(chunks: &[DropletContacts], pose: &Pose, outcomes: &mut [Outcome]) {
    // Blocked over droplets: data written by other threads are slow to read.
    let mut parts: Vec<_> =
        (0..).step_by(DROPS_PER_TASK).zip(outcomes.chunks_mut(DROPS_PER_TASK)).collect();
    for_each_block(
        &mut parts,
        Nanos(10_000),
        || (),
        |(), (first, outcomes)| {
            for chunk in chunks {
                for (outcome, sum) in outcomes.iter_mut().zip(&chunk.sums[*first..]) {
                    // Most chunks are near few droplets.
                    if sum.impulse != Vec3::ZERO {
                        outcome.impulse += pose.direction_out(sum.impulse);
                    }
                    outcome.touch_count += sum.touch_count;
                    outcome.wanted += sum.wanted;
                }
            }
        },
    );
    for landing in chunks.iter().flat_map(|chunk| &chunk.landings) {
        let first = &mut outcomes[landing.drop as usize].landing;
        if first.is_none_or(|other| landing.when < other.when) {
            *first = Some(*landing);
        }
    }
}

fn mass_of(drop: &Droplet) -> f32 {
    (drop.volume * WATER) as f32
}

/// The edge of the point `at` segments from the root, and the weights of the edge's ends.
fn shares(strand: &Strand, at: f32) -> (usize, [f32; 2]) {
    let edge = (at as usize).min(strand.edges() - 1);
    let t = (at - edge as f32).clamp(0.0, 1.0);
    (edge, [1.0 - t, t])
}

/// Adds `mass` (kg) at a point of a strand to its nodes.
fn weigh(strand: &Strand, added_mass: &mut AddedMass, wetting: &HairWetting, at: f32, mass: f32) {
    added_mass.mass.resize(strand.nodes(), 0.0);
    let (edge, share) = shares(strand, at);
    for (i, length) in node_lengths(strand.rest_lengths()).enumerate().skip(edge).take(2) {
        let added = share[i - edge] * mass / (wetting.dry_mass() * length);
        // A short strand may carry more drops than the limit allows.
        added_mass.mass[i] = (added_mass.mass[i] + added).min(AddedMass::MOST);
    }
}

/// An impulse (kg m/s) without its upward part: the strands that a droplet attracts cannot support
/// it against gravity.
fn without_lift(impulse: Vec3, gravity: Vec3) -> Vec3 {
    let up = -gravity.normalize_or_zero();
    impulse - up * impulse.dot(up).max(0.0)
}

/// Applies an impulse (kg m/s) at a point of a strand, including its added mass.
fn push(
    strand: &mut Strand,
    added_mass: &AddedMass,
    wetting: &HairWetting,
    at: f32,
    impulse: Vec3,
) {
    let (edge, share) = shares(strand, at);
    let mut mobility = [0.0; 2];
    for (i, length) in node_lengths(strand.rest_lengths()).enumerate().skip(edge).take(2) {
        let load = added_mass.mass.get(i).copied().unwrap_or(0.0);
        // The root is fixed to the scalp.
        mobility[i - edge] =
            if i == 0 { 0.0 } else { 1.0 / (wetting.dry_mass() * length * (1.0 + load)) };
    }
    let (_, velocities, _) = strand.motion_parts();
    for end in 0..2 {
        velocities[edge + end] += impulse * (share[end] * mobility[end]);
    }
}

#[cfg(test)]
mod tests {
    use super::{super::adhesion::DropletSum, *};
    use crate::HairPlugins;
    use bevy::time::TimeUpdateStrategy;
    use core::f32::consts::FRAC_PI_2;

    #[test]
    fn sums_are_rotated_to_the_world_and_the_first_landing_counts() {
        let strand = |i| Entity::from_raw_u32(i).unwrap();
        let landing = |i, when| Landing { drop: 0, strand: strand(i), at: 1.0, when };
        let chunk = |landings: Vec<Landing>| {
            let mut chunk = DropletContacts::default();
            chunk.sums = vec![DropletSum { impulse: Vec3::X, touch_count: 2, wanted: 3e-9 }];
            chunk.landings = landings;
            chunk
        };
        let chunks = [
            chunk(vec![landing(7, 0.5), landing(8, 0.2)]),
            chunk(vec![landing(9, 0.3), landing(10, 0.2)]),
        ];
        let mut outcomes = [Outcome::default()];
        let pose = Pose { rotation: Quat::from_rotation_z(FRAC_PI_2), ..default() };
        sum_up(&chunks, &pose, &mut outcomes);
        let Outcome { impulse, touch_count, landing, wanted } = outcomes[0];
        assert!(impulse.distance(Vec3::Y * 2.0) < 1e-6, "{impulse}");
        assert_eq!((touch_count, wanted), (4, 6e-9));
        // Of those at the same time the strands' order decides.
        assert_eq!(landing.map(|first| first.strand), Some(strand(8)));
    }

    #[test]
    fn a_droplet_costs_only_the_hair_that_it_may_reach() {
        let mut app = App::new();
        app.add_plugins((MinimalPlugins, HairPlugins::default()))
            .insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
        app.finish();
        app.cleanup();
        let points: Vec<Vec3> = (0..5).map(|i| Vec3::NEG_Y * (0.02 * i as f32)).collect();
        for x in 0..30 {
            let hair = app.world_mut().spawn((Hair, Transform::from_xyz(x as f32, 0.0, 0.0))).id();
            app.world_mut().spawn((StrandOf(hair), Strand::from_polyline(&points).unwrap()));
        }
        // One falls past a strand, one far from all.
        for place in [Vec3::new(7.05, 0.0, 0.0), Vec3::new(7.5, 0.0, 0.0)] {
            app.world_mut().spawn(Droplet::new(place, 4e-9).unwrap());
        }
        (0..3).for_each(|_| app.update());
        let mut drops = app.world_mut().query::<&Droplet>();
        assert_eq!(drops.iter(app.world()).count(), 2);
        let fields = &app.world().resource::<WaterField>().fields;
        assert_eq!(fields.iter().map(|(field, _)| field.drops.len()).collect::<Vec<_>>(), [1]);
    }

    #[test]
    fn a_ball_holds_all_that_a_droplet_touches_on_its_way() {
        let mut drop = Droplet::new(Vec3::Y, 4e-9).unwrap().with_influence(1e-3, 2e-3).unwrap();
        drop.before = Vec3::Y * 1.5;
        let (center, radius) = ball_of(&drop, 5e-3);
        assert_eq!(center, Vec3::Y * 1.25);
        assert!((radius - (0.25 + 6e-3)).abs() < 1e-6, "{radius}");
        assert!((ball_of(&drop, 0.0).1 - (0.25 + 2e-3)).abs() < 1e-6);
    }

    #[test]
    fn a_drop_adds_its_mass_and_moves_with_the_strand() {
        let points: Vec<Vec3> = (0..5).map(|i| Vec3::X * (0.03 * i as f32)).collect();
        let mut strand = Strand::from_polyline(&points).unwrap();
        let (mut added, wetting) = (AddedMass::default(), HairWetting::default());
        weigh(&strand, &mut added, &wetting, 2.25, 4e-6);
        let dry: Vec<f32> =
            node_lengths(strand.rest_lengths()).map(|l| l * wetting.dry_mass()).collect();
        let borne: Vec<f32> = added.mass.iter().zip(&dry).map(|(load, dry)| load * dry).collect();
        let near = |a: f32, b: f32| (a - b).abs() < 1e-11;
        assert!(near(borne[2], 3e-6) && near(borne[3], 1e-6), "{borne:?}");
        assert_eq!((borne[0], borne[1], borne[4]), (0.0, 0.0, 0.0));
        push(&mut strand, &added, &wetting, 2.25, Vec3::Z * 1e-6);
        let got: f32 = (strand.velocities().iter().zip(&dry).zip(&borne))
            .map(|((v, dry), borne)| v.z * (dry + borne))
            .sum();
        assert!((got / 1e-6 - 1.0).abs() < 1e-5, "all of the impulse: {got}");
    }
}

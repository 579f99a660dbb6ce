//! `ExternalForces`: showers spawn drops, hair soaks and dries, and hydrogen bonds follow the water.

use super::{
    Counted, Droplet, HairWetting, Moisture, Shower, SoakHair, WaterLedger,
    model::{ball_radius, clinging},
    moisture::{AFTER_DRIP, Exposure, WaterConditions, WaterLoss, node_lengths},
};
use crate::{
    base::{
        fault::{FaultKind, HairFault},
        parallel::{AHEAD, Nanos, for_each_part, in_turn, prefetch, tables},
        schedule::{EffectiveSubsteps, HairProcessTime, HairStep},
        setting::{Ranged, Settings, report},
        tape::Tape,
    },
    forces::environment::{
        Blown, BlownAir, Gravity, LocalWinds, Winds,
        vapour::{DryingAir, WATER},
    },
    hair::{
        strand::{
            AddedMass, Hair, Here, InWater, MissedOnGpu, OnGpu, PerHair, Pose, Strand, StrandOf,
            StrandSleep, Strands, TickPose,
        },
        worn::HairsOf,
    },
    keratin::bond::{BondChanges, BondKind, Bonds},
};
use bevy::{ecs::entity_disabling::Disabled, prelude::*};

/// Approximate cost of a strand (ns), averaged over wet and dry ones.
const EXCHANGE: Nanos = Nanos(500);

/// How often bound water goes toward the air's equilibrium, which takes an hour (s of
/// [`HairProcessTime`]); at most once a tick.
const PERIOD: f32 = 1.0;

/// Drying by moving air (1/s) below which bound water is in no hurry.
const HARDLY_DRIES: f32 = 1e-6;

/// What the exchange of this tick found in any hair.
#[derive(Resource, Clone, Copy, Debug, Default)]
pub(crate) struct FoundWater {
    /// Whether there is water.
    pub(super) any: bool,
    /// Whether some of it changes in every tick, such as a film.
    pub(super) busy: bool,
    /// Process time since bound water last moved (s).
    waited: f32,
    /// For how many more substeps hair may emerge from a volume of water that is gone.
    pub(super) emerging: u32,
    /// Whether hair was put back as it was, and its water with it.
    pub(crate) is_restored: bool,
}

impl FoundWater {
    pub(crate) fn record(&mut self, tape: &mut Tape<'_>) {
        tape.flags([&mut self.any, &mut self.busy]);
        tape.value(&mut self.waited);
        tape.value(&mut self.emerging);
    }
}

/// Repairs moisture of new strands and moisture written from outside, for instance by an inspector. Our
/// own writes bypass change detection.
pub(super) fn repair_moistures(
    mut moistures: Query<(Entity, &mut Moisture), (Changed<Moisture>, Here, Allow<Disabled>)>,
    mut ledger: ResMut<WaterLedger>,
    mut found: ResMut<FoundWater>,
    mut faults: MessageWriter<HairFault>,
) {
    for (entity, mut moisture) in &mut moistures {
        let moisture = moisture.bypass_change_detection();
        if let Some(found) = moisture.repair() {
            faults.write(HairFault::new(FaultKind::Setting, found).of(entity));
        }
        ledger.record(moisture.recount());
        found.any |= !moisture.is_untouched();
        found.busy |= moisture.is_busy();
    }
}

pub(super) fn run_showers(
    mut commands: Commands,
    steps: EffectiveSubsteps,
    mut showers: Query<(Entity, &mut Shower, &TickPose)>,
    mut faults: MessageWriter<HairFault>,
) {
    let Some(step) = steps.shared() else { return };
    for (entity, mut shower, pose) in &mut showers {
        let shower = shower.bypass_change_detection();
        let mut valid = shower.clamped();
        let pose = pose.now();
        let mut drops: Vec<Droplet> = (valid.make(step.dt))
            .map(|drop| {
                let position = pose.point_out(drop.position);
                let velocity = pose.direction_out(drop.velocity);
                Droplet { position, velocity, before: position, ..drop }
            })
            .collect();
        // One after the other within the substep, not all at its beginning.
        let each = step.dt / drops.len().max(1) as f32;
        for (drop, i) in drops.iter_mut().zip(0u16..) {
            drop.lag = -each * (f32::from(i) + 0.5);
        }
        if valid.is_limited && !shower.is_limited {
            let message = format!(
                "the shower's rate of {} drops/s makes more than {} in a substep of {} s: the rest is left \
                 out; lower `Shower::rate` or take a shorter fixed timestep",
                valid.rate,
                Shower::MAX_DROPS,
                step.dt
            );
            faults.write(HairFault::new(FaultKind::Setting, message).of(entity));
        }
        (shower.emitted, shower.due, shower.is_limited) =
            (valid.emitted, valid.due, valid.is_limited);
        if !drops.is_empty() {
            commands.spawn_batch(drops);
        }
    }
}

/// The conditions for water in the frame of one hair in a tick.
struct LocalWater<'a> {
    hair: Entity,
    wetting: HairWetting,
    pose: Pose,
    winds: LocalWinds,
    /// Of the tick, and of the time since bound water last moved.
    steps: [Passing<'a>; 2],
    /// Share of the difference by which bonds would approach it until bound water moves again.
    to_come: f32,
}

/// What happens to water in some time.
struct Passing<'a> {
    conditions: WaterConditions<'a>,
    /// Share of the difference by which hydrogen bonds approach the water's target.
    bonds_follow: f32,
}

struct Wet<'a> {
    strand: &'a Strand,
    bonds: &'a Bonds,
    /// The air at each node; empty where the tick has not looked: in still air, and while it sleeps.
    blown: &'a [Blown],
    moisture: &'a mut Moisture,
    added_mass: &'a mut AddedMass,
    changes: &'a mut BondChanges,
    sleep: &'a mut StrandSleep,
    /// Whether it changes in every tick.
    is_busy: bool,
    loss: WaterLoss,
    /// Water of removed nodes (m³).
    removed: f64,
}

impl Wet<'_> {
    fn prefetch(&self) {
        prefetch(self.strand.positions());
        prefetch(self.strand.rest_lengths());
        prefetch(&self.bonds.joints);
        self.moisture.prefetch();
        prefetch(&self.added_mass.mass);
        prefetch(&self.added_mass.softening);
        self.changes.prefetch();
    }
}

/// Once a tick: the film, which hardly moves within one, and bound water.
pub(super) fn exchange_water(
    mut commands: Commands,
    step: Res<HairStep>,
    (air, process, gravity): (Res<DryingAir>, Res<HairProcessTime>, Gravity),
    wetting: Settings<HairWetting>,
    (hairs, of_wearer): (Query<(&TickPose, Option<&Strands>), With<Hair>>, HairsOf),
    winds: Winds,
    mut strands: Query<
        (
            &StrandOf,
            &Strand,
            &Bonds,
            &BlownAir,
            &mut Moisture,
            &mut AddedMass,
            &mut BondChanges,
            &mut StrandSleep,
        ),
        Here,
    >,
    on_gpu: Query<(), With<OnGpu>>,
    mut soaks: MessageReader<SoakHair>,
    mut missed: ResMut<MissedOnGpu<SoakHair>>,
    (mut ledger, mut found): (ResMut<WaterLedger>, ResMut<FoundWater>),
    mut faults: MessageWriter<HairFault>,
) {
    let process = process.clamped().0;
    let tick = step.dt * step.count as f32;
    found.waited += process * tick;
    let is_due = found.waited >= PERIOD;
    let waited = if is_due { core::mem::take(&mut found.waited) } else { 0.0 };
    let damp = air.equilibrium > 0.0;
    let held = |hair: Entity| clinging(wetting.of(hair).bundle(1.0), gravity.clamped().0.length());
    for soak in soaks.read() {
        // It is soaked when it is back.
        if on_gpu.contains(soak.target) {
            missed.0.push(*soak);
            continue;
        }
        let is_known = |target: &&Entity| hairs.contains(**target) || strands.contains(**target);
        let targets = of_wearer.of(&soak.target);
        if let Some(unknown) = targets.iter().find(|target| !is_known(target)) {
            faults.write(of_wearer.no_target("SoakHair", *unknown));
            continue;
        }
        let members = targets.iter().flat_map(|target| match hairs.get(*target) {
            Ok((_, own)) => own.map(|own| own.collection().to_vec()).unwrap_or_default(),
            Err(_) => vec![*target],
        });
        let members: Vec<Entity> = members.collect();
        report(Some(soak.target), soak.violations(), &mut faults);
        let share = soak.clamped().wetness;
        for member in members {
            if let Ok((of, strand, _, _, mut moisture, ..)) = strands.get_mut(member) {
                let capacity = wetting.of(of.0).capacity();
                let lengths = node_lengths(strand.rest_lengths());
                let moisture = moisture.bypass_change_detection();
                ledger.water_out += moisture.fit(strand.nodes());
                let capacities = lengths.map(|l| capacity * f64::from(l));
                let film = f64::from((share - 1.0).max(0.0)) * AFTER_DRIP * held(of.0);
                ledger.record(moisture.soak(share.min(1.0), film, capacities));
            }
        }
    }
    let is_still = winds.are_still();
    let gravity = gravity.clamped().0;
    let water_of = |hair: Entity| {
        let frame = hairs.get(hair).ok()?.0;
        let pose = *frame.now();
        let (wetting, winds) = (wetting.of(hair), winds.seen_from(frame));
        let steps = [(tick, process), (1.0, waited)].map(|(dt, process)| {
            let gravity = pose.direction_in(gravity);
            let conditions = WaterConditions::new(wetting, gravity, &air, dt, process);
            Passing { conditions, bonds_follow: wetting.bonds_follow(process * dt) }
        });
        Some(LocalWater {
            hair,
            wetting,
            pose,
            winds,
            steps,
            to_come: wetting.bonds_follow(PERIOD),
        })
    };
    let done = for_each_part(EXCHANGE, tables(&mut strands), Vec::new, |items, rows| {
        let (mut waters, mut done) = (PerHair::default(), Done::default());
        for (of, strand, bonds, air, moisture, added_mass, changes, sleep) in rows {
            let is_under = !added_mass.in_water.is_empty();
            let has_water = is_under || !moisture.is_untouched();
            let is_busy = is_under || moisture.is_busy();
            done.any |= has_water;
            done.busy |= is_busy;
            // What the air was around it when it fell asleep no longer counts.
            let blown = if is_still || sleep.is_asleep() { &[][..] } else { &air.nodes };
            let is_dried = || blown.iter().any(|air| air.drying > HARDLY_DRIES);
            let is_busy = is_busy || has_water && is_dried();
            if (is_busy || is_due && (damp || has_water))
                && let Some(hair) = waters.index(of.0, || water_of(of.0))
                && strand.nodes() >= 2
                && bonds.joints.len() == strand.edges()
            {
                let wet = Wet {
                    strand,
                    bonds,
                    blown,
                    moisture,
                    added_mass,
                    changes,
                    sleep,
                    is_busy,
                    loss: WaterLoss::default(),
                    removed: 0.0,
                };
                items.push((hair, wet));
            }
        }
        let ahead = |(_, wet): &(usize, Wet<'_>)| wet.prefetch();
        in_turn(items, AHEAD, ahead, |(hair, wet)| {
            exchange(wet, &waters.values[*hair], &air, damp, tick);
        });
        for (hair, wet) in items.drain(..) {
            done.evaporated += wet.loss.evaporated;
            done.merged += wet.loss.merged;
            done.removed += wet.removed;
            let LocalWater { hair, pose, wetting, .. } = &waters.values[hair];
            done.drips.extend(wet.loss.drips.iter().map(|&(node, volume)| {
                let drop = detached_drop(pose, wet.strand, node as f32, volume, wetting, gravity);
                Droplet { hair: Some(*hair), ..drop }
            }));
        }
        done
    });
    (found.any, found.busy) = (false, false);
    for Done { any, busy, evaporated, merged, removed, drips } in done {
        found.any |= any;
        found.busy |= busy;
        ledger.record(-evaporated);
        ledger.record(-merged);
        ledger.water_out += removed;
        if !drips.is_empty() {
            commands.spawn_batch(drips);
        }
    }
}

/// Water balance of some strands.
#[derive(Default)]
struct Done {
    /// Whether any of them has water, and whether one is busy.
    any: bool,
    busy: bool,
    /// Evaporated water (m³); negative where hair absorbed vapour.
    evaporated: f64,
    /// Water given to the surrounding water (m³); negative where hair absorbed it.
    merged: f64,
    /// Water of removed nodes (m³).
    removed: f64,
    drips: Vec<Droplet>,
}

/// One strand's water in one step, with its effects on bonds and weight.
fn exchange(wet: &mut Wet<'_>, water: &LocalWater<'_>, air: &DryingAir, damp: bool, dt: f32) {
    let LocalWater { wetting, winds, steps, to_come, .. } = water;
    let Wet { strand, bonds, blown, moisture, added_mass, changes, sleep, is_busy, .. } = wet;
    let Passing { conditions, bonds_follow } = &steps[usize::from(!*is_busy)];
    wet.removed += moisture.fit(strand.nodes());
    let (positions, lengths, edges) = (strand.positions(), strand.rest_lengths(), strand.edges());
    let (velocities, sleeps) = (strand.velocities(), sleep.is_asleep());
    let exposure = |i: usize| {
        if added_mass.in_water.get(i).is_some_and(InWater::is_under) {
            return Some(Exposure { submerged: true, ..default() });
        }
        let e = i.min(edges - 1);
        let edge = positions[e + 1] - positions[e];
        let blown = match blown.get(i) {
            Some(blown) => *blown,
            // Air too slow to wake it may be warm.
            None if sleeps && winds.are_still() => return None,
            None if sleeps => winds.around_edge(positions[i], edge),
            None => Blown::passing(winds.headwind - velocities[i]),
        };
        let along = edge.normalize_or_zero();
        let exposed = Exposure {
            speed: blown.velocity.cross(along).length(),
            warmth: blown.warmth(air.celsius),
            blown: blown.drying * dt,
            submerged: false,
        };
        // A strand may have become non-finite.
        exposed.is_finite().then_some(exposed)
    };
    let moved = if *is_busy {
        moisture.exchange(positions, lengths, conditions, exposure, &mut wet.loss);
        0.0
    } else {
        moisture.equilibrate(lengths, conditions, exposure, &mut wet.loss)
    };
    // All lost water is in `loss`.
    moisture.recount();
    let behind = open_bonds(bonds, moisture.wetness(), *bonds_follow, changes);
    let capacity = wetting.capacity() * f64::from(strand.length());
    if !damp
        && added_mass.in_water.is_empty()
        && moisture.volume() < 1e-4 * capacity
        && bonds.rates(BondKind::Hydrogen).all(|rate| rate > 0.999)
    {
        wet.removed += moisture.clear();
        **added_mass = default();
        return;
    }
    let weighs = bear_water(added_mass, moisture, lengths, wetting);
    if moisture.note_change(moved.max(behind * bonds_follow).max(weighs), behind * to_come) {
        sleep.wake();
    }
}

/// Sets the added mass and the softening of a strand to those of its water. Returns the largest change of a
/// node's mass, as a share of it.
pub(super) fn bear_water(
    added_mass: &mut AddedMass,
    moisture: &Moisture,
    lengths: &[f32],
    wetting: &HairWetting,
) -> f32 {
    let dry = f64::from(wetting.dry_mass());
    let water = moisture.film().iter().zip(moisture.bound()).map(|(film, bound)| film + bound);
    added_mass.mass.resize(moisture.film().len(), 0.0);
    let mut change = 0.0_f32;
    for ((mass, length), volume) in added_mass.mass.iter_mut().zip(node_lengths(lengths)).zip(water)
    {
        let now = ((WATER * volume / (dry * f64::from(length))) as f32).min(AddedMass::MOST);
        change = change.max((now - *mass).abs() / (1.0 + now));
        *mass = now;
    }
    added_mass.moves_bonds = true;
    added_mass.softening.clear();
    let wetness = moisture.wetness().iter().take(lengths.len());
    added_mass.softening.extend(wetness.map(|w| w * wetting.softening));
    change
}

/// Moves hydrogen bonds by a `share` of the difference toward 1 − wetness; those that close keep
/// the present shape by equation 16. Returns the largest difference.
fn open_bonds(bonds: &Bonds, wetness: &[f32], share: f32, changes: &mut BondChanges) -> f32 {
    let joints = bonds.rates(BondKind::Hydrogen).zip(wetness).enumerate();
    joints.fold(0.0, |most, (i, (b, wet))| {
        let behind = 1.0 - wet - b;
        changes.request_quietly(i, BondKind::Hydrogen, behind * share);
        most.max(behind.abs())
    })
}

/// A drop that detaches from a strand `at` segments from the root: just below it, with its
/// velocity.
pub(super) fn detached_drop(
    pose: &Pose,
    strand: &Strand,
    at: f32,
    volume: f64,
    wetting: &HairWetting,
    gravity: Vec3,
) -> Droplet {
    let (place, velocity) = on_strand(strand, at);
    let radius = ball_radius(volume);
    let below = gravity.normalize_or_zero() * (1.01 * (radius + wetting.lock_radius()) + 1e-5);
    let mut drop = Droplet::ball(pose.point_out(place) + below, radius);
    drop.velocity = pose.direction_out(velocity);
    drop.drip = true;
    // The ledger has counted this water already.
    (drop.volume, drop.counted) = (volume, Counted(volume));
    drop
}

/// Place and velocity of the point `at` segments from the root, in the hair's frame.
pub(super) fn on_strand(strand: &Strand, at: f32) -> (Vec3, Vec3) {
    let edge = (at as usize).min(strand.edges() - 1);
    let t = (at - edge as f32).clamp(0.0, 1.0);
    let mix = |v: &[Vec3]| v[edge].lerp(v[edge + 1], t);
    (mix(strand.positions()), mix(strand.velocities()))
}

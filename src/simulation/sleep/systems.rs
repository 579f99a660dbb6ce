//! At the start of a tick, in `Roots`: which strands sleep in it.

use super::{
    SleepSettings,
    model::{displacement, held_nodes, keeps_turn, lever, stays, turn, within},
};
use crate::{
    base::{
        parallel::{Nanos, for_each},
        schedule::{HairStep, HairSystems, HairTick, first_substep, lacks},
        setting::Settings,
    },
    forces::{
        contact::{
            ColliderShape, HairReach, Obstacles, StrandContact, TickCollider, TickColliders,
            seen_from,
        },
        environment::{AirDrag, Gravity, LocalWinds, Winds},
    },
    hair::{
        strand::{
            AddedMass, Hair, HairHere, HeldNodes, PlayedHair, Pose, Regroomed, SimulatedHere,
            SleepCounts, SleepPose, Strand, StrandModel, StrandOf, StrandSleep, TickPose,
            lacks_strands,
        },
        worn,
    },
    keratin::{
        bond::{BondChanges, BondInfluence, BondPlugin, Bonds, Cuticle},
        treatment::Treatments,
    },
    solver::{
        mass_spring::Springs,
        rod::{
            HairSolver, HairStiffness, StrandMaterial, Sweeps,
            obstacle::{Obstacle, Solid},
            shape::Shape,
        },
    },
    water::Moisture,
};
use bevy::{
    ecs::{entity::EntityHashMap, system::SystemParam},
    math::Affine3A,
    prelude::*,
};

/// Acceleration by wind above which no strand sleeps (m/s²): it bends hair by a thousandth of what
/// gravity does, and dries it.
const BREEZE: f32 = 0.01;

/// Extra distance to a moving collider, beyond the contact radius, within which strands wake (m).
const CLEARANCE: f32 = 1e-3;

/// Strands at rest fall asleep, and wake when something disturbs them.
pub struct SleepPlugin;

impl Plugin for SleepPlugin {
    fn build(&self, app: &mut App) {
        if lacks_strands::<Self>(app) {
            return;
        }
        lacks::<BondPlugin, Self>(app);
        worn::setting::<SleepSettings>(app);
        app.register_type::<SleepSnapshot>()
            .register_required_components::<Hair, SleepSnapshot>()
            .register_required_components::<Hair, SleepCounts>()
            .init_resource::<TickColliders>()
            .add_observer(wake_softer)
            .add_systems(HairTick, update_sleep.in_set(HairSystems::Sleep).run_if(first_substep));
    }
}

/// A strand is as stiff as its hair again.
fn wake_softer(lost: On<Remove, StrandMaterial>, mut strands: Query<&mut StrandSleep>) {
    if let Ok(mut sleep) = strands.get_mut(lost.entity) {
        sleep.bypass_change_detection().wake();
    }
}

/// All settings on which the equilibrium of hair depends.
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
pub(crate) struct Conditions {
    gravity: Vec3,
    sleep: SleepSettings,
    stiffness: HairStiffness,
    solver: HairSolver,
    sweeps: Sweeps,
    influence: BondInfluence,
    cuticle: Cuticle,
    contact: StrandContact,
    drag: AirDrag,
    model: StrandModel,
    springs: Springs,
}

#[derive(SystemParam)]
pub(crate) struct RestSettings<'w, 's> {
    gravity: Gravity<'w>,
    sleep: Settings<'w, 's, SleepSettings>,
    stiffness: Settings<'w, 's, HairStiffness>,
    solver: Settings<'w, 's, HairSolver>,
    sweeps: Settings<'w, 's, Sweeps>,
    influence: Settings<'w, 's, BondInfluence>,
    cuticle: Settings<'w, 's, Cuticle>,
    contact: Settings<'w, 's, StrandContact>,
    drag: Settings<'w, 's, AirDrag>,
    model: Settings<'w, 's, StrandModel>,
    springs: Settings<'w, 's, Springs>,
}

impl RestSettings<'_, '_> {
    pub(crate) fn of(&self, hair: Entity) -> Conditions {
        Conditions {
            gravity: self.gravity.clamped().0,
            sleep: self.sleep.of(hair),
            stiffness: self.stiffness.of(hair),
            solver: self.solver.of(hair),
            sweeps: self.sweeps.of(hair),
            influence: self.influence.of(hair),
            cuticle: self.cuticle.of(hair),
            contact: self.contact.of(hair),
            drag: self.drag.of(hair),
            model: self.model.of(hair),
            springs: self.springs.of(hair),
        }
    }
}

/// The conditions of a hair when they last changed.
#[derive(Component, Reflect, Clone, Debug, Default)]
#[component(clone_behavior = Ignore)]
#[reflect(Default, Clone)]
pub(crate) struct SleepSnapshot {
    pub(super) conditions: Option<Conditions>,
    pub(super) pose: Pose,
    /// The colliders in its frame.
    #[reflect(ignore)]
    pub(super) solids: Vec<SeenCollider>,
}

/// Changes of a hair as a whole since the previous tick.
pub(super) struct WakeEvents {
    pub(super) sleep: SleepSettings,
    /// Whether all its strands wake.
    pub(super) all_wake: bool,
    /// Colliders that appeared, disappeared or moved: strands within reach of these wake (m).
    pub(super) solids: Vec<(Solid, f32)>,
    winds: LocalWinds,
    /// The hats that hide what is above their rims: from the hair's frame to theirs, and the height of the rim (m).
    hats: Vec<(Affine3A, f32)>,
}

impl WakeEvents {
    /// Changes of hair that has none yet.
    fn new(sleep: SleepSettings, all_wake: bool, solids: Vec<(Solid, f32)>) -> Self {
        Self { sleep, all_wake, solids, winds: LocalWinds::default(), hats: Vec::new() }
    }

    /// Whether no part of a strand is to be seen.
    fn are_hiding(&self, strand: &Strand) -> bool {
        let hides = |(to_hat, rim): &(Affine3A, f32)| {
            strand.positions().iter().all(|p| to_hat.transform_point3(*p).y > *rim)
        };
        self.hats.iter().any(hides)
    }
}

impl SleepSnapshot {
    /// Stores the present conditions and returns which strands the changes wake.
    pub(super) fn wake_events(
        &mut self,
        conditions: Conditions,
        pose: &Pose,
        is_regroomed: bool,
        seen: Vec<SeenCollider>,
        substeps: u32,
    ) -> WakeEvents {
        let distance = conditions.sleep.distance();
        let apart = pose.translation.distance(self.pose.translation) / pose.size();
        // Rotation counts as the displacement of the tip of a long strand.
        let turned = turn(self.pose.rotation, pose.rotation) * LONG_STRAND;
        let scaled = (pose.scale / self.pose.scale - 1.0).abs() * LONG_STRAND;
        let rests = apart <= distance && turned <= distance && scaled <= distance;
        let same = self.conditions == Some(conditions) && !is_regroomed;
        if !rests {
            self.pose = *pose;
        }
        self.conditions = Some(conditions);
        let clearance = conditions.contact.radius + CLEARANCE;
        let solids = self.compare_solids(seen, distance, clearance, substeps);
        WakeEvents::new(conditions.sleep, !(rests && same), solids)
    }

    /// The solids that have changed, before and after, with the distance within which they may act in
    /// this tick.
    fn compare_solids(
        &mut self,
        now: Vec<SeenCollider>,
        distance: f32,
        clearance: f32,
        substeps: u32,
    ) -> Vec<(Solid, f32)> {
        let mut changed = Vec::new();
        if now.len() == self.solids.len() {
            for (known, now) in self.solids.iter_mut().zip(now) {
                let moved = known.moved(&now);
                // NaN counts as moved.
                if !within(moved, distance) {
                    // It keeps moving for the rest of the tick.
                    let reach = clearance + moved * substeps as f32;
                    let before = core::mem::replace(known, now);
                    changed.extend([(before.solid, reach), (known.solid.clone(), reach)]);
                }
            }
            return changed;
        }
        let unknown = |one: &&SeenCollider, others: &[SeenCollider]| {
            others.iter().all(|other| !within(other.moved(one), distance))
        };
        let with_clearance = |s: &SeenCollider| (s.solid.clone(), clearance);
        changed.extend(now.iter().filter(|s| unknown(s, &self.solids)).map(with_clearance));
        changed.extend(self.solids.iter().filter(|s| unknown(s, &now)).map(with_clearance));
        self.solids = now;
        changed
    }
}

/// A collider in the frame of a hair.
#[derive(Clone, Debug)]
pub(super) struct SeenCollider {
    pub(super) solid: Solid,
    pub(super) friction: f32,
    pub(super) rotation: Quat,
}

impl SeenCollider {
    pub(super) fn of(
        frame: &TickPose,
        obstacles: Option<&Obstacles>,
        TickCollider { id, collider, pose }: &TickCollider,
    ) -> Self {
        let Obstacle { mut solid, friction, .. } = seen_from(frame, collider, pose);
        if let Solid::Placed(placed) = &mut solid
            && let Shape::Hat { holds, .. } = &mut placed.shape
        {
            *holds = obstacles.is_some_and(|of| of.is_held_by(*id));
        }
        let rotation = frame.now().rotation.inverse() * pose.now().rotation;
        Self { solid, friction, rotation }
    }

    /// How far its surface has moved (m): a rotating ball drags hair, too.
    fn moved(&self, now: &Self) -> f32 {
        let friction = if self.friction == now.friction { 0.0 } else { f32::INFINITY };
        let turned = turn(self.rotation, now.rotation) * lever(&now.solid);
        displacement(&self.solid, &now.solid) + turned + friction
    }
}

/// Length of a long strand (m), the lever for rotations of the head.
const LONG_STRAND: f32 = 0.3;

struct SleepCandidate<'a> {
    hair: usize,
    strand: Mut<'a, Strand>,
    sleep: Mut<'a, StrandSleep>,
    still: Mut<'a, SleepPose>,
    held: Option<&'a HeldNodes>,
    /// Whether its bonds or its water are changing, or it was written to from outside the tick.
    restless: bool,
}

fn update_sleep(
    step: Res<HairStep>,
    settings: RestSettings,
    colliders: Res<TickColliders>,
    winds: Winds,
    mut hairs: Query<
        (
            Entity,
            &TickPose,
            &mut SleepSnapshot,
            &mut SleepCounts,
            (&Regroomed, Has<PlayedHair>),
            (Option<&HairReach>, Option<&Obstacles>),
        ),
        HairHere,
    >,
    mut strands: Query<
        (
            &StrandOf,
            &mut Strand,
            &mut StrandSleep,
            &mut SleepPose,
            (Ref<Bonds>, &BondChanges, &AddedMass, Option<Ref<StrandMaterial>>),
            (Option<&Treatments>, Option<&Moisture>, Option<&HeldNodes>),
        ),
        // Followers sleep when their guides do.
        SimulatedHere,
    >,
) {
    let mut wake_events: Vec<WakeEvents> = Vec::new();
    let mut index_of = EntityHashMap::<usize>::default();
    let mut scratch = Vec::new();
    for (hair, frame, mut snapshot, sleepers, (regroomed, is_played), (reach, obstacles)) in
        &mut hairs
    {
        index_of.insert(hair, wake_events.len());
        let snapshot = snapshot.bypass_change_detection();
        // Hair without simulated strands has none to wake; the first that it gets are awake.
        if *sleepers == SleepCounts::default() {
            snapshot.conditions = None;
            wake_events.push(WakeEvents::new(settings.sleep.of(hair), true, Vec::new()));
            continue;
        }
        // A collider that comes within reach counts as new while it is still far from any strand.
        let near: Vec<&TickCollider> = colliders.near(frame, reach, &mut scratch).collect();
        let seen = near.iter().map(|placed| SeenCollider::of(frame, obstacles, placed)).collect();
        let is_regroomed = regroomed.members;
        let mut new =
            snapshot.wake_events(settings.of(hair), frame.now(), is_regroomed, seen, step.count);
        new.all_wake |= is_played;
        new.winds = winds.seen_from(frame);
        let hiding = near.iter().filter(|of| obstacles.is_some_and(|all| all.are_under(of.id)));
        new.hats.extend(hiding.filter_map(|of| {
            let ColliderShape::Hat { rim, hides: true, .. } = of.collider.shape else {
                return None;
            };
            Some((of.pose.now().affine().inverse() * frame.now().affine(), rim))
        }));
        wake_events.push(new);
    }
    // Strands are mostly grouped by hair.
    let mut last = None;
    let mut hair_of = |hair: Entity| match last {
        Some((known, index)) if known == hair => index,
        _ => {
            let index = index_of.get(&hair).copied();
            last = Some((hair, index));
            index
        }
    };
    let mut items: Vec<SleepCandidate<'_>> = Vec::with_capacity(strands.iter().len());
    for (of, strand, mut sleep, still, (bonds, changes, added_mass, own), others) in &mut strands {
        let Some(hair) = hair_of(of.0) else { continue };
        let (treatments, water, held) = others;
        let restless = strand.is_changed()
            || bonds.is_changed()
            || own.is_some_and(|own| own.is_changed())
            || sleep.bypass_change_detection().take_disturbed()
            || !changes.is_empty()
            || !added_mass.in_water.is_empty()
            || !added_mass.mass.is_empty() && water.is_none_or(Moisture::is_untouched)
            || treatments.is_some_and(|t| !t.acting().is_empty());
        items.push(SleepCandidate { hair, strand, sleep, still, held, restless });
    }
    let seconds = step.dt * step.count as f32;
    for_each(&mut items, Nanos(500), |item| decide(item, &wake_events[item.hair], seconds));
    let mut counts = vec![SleepCounts::default(); wake_events.len()];
    for item in &items {
        let count = &mut counts[item.hair];
        *(if item.sleep.is_asleep() { &mut count.asleep } else { &mut count.awake }) += 1;
    }
    drop(items);
    for (hair, _, _, mut sleepers, ..) in &mut hairs {
        sleepers.set_if_neq(counts[index_of[&hair]]);
    }
}

/// Whether one strand sleeps from now on.
fn decide(item: &mut SleepCandidate<'_>, wake_events: &WakeEvents, seconds: f32) {
    let SleepCandidate { strand, sleep, still, held, restless, .. } = item;
    let strand = strand.bypass_change_detection();
    let (distance, angle) = (wake_events.sleep.distance(), wake_events.sleep.angle());
    let targets = held.map_or(&[][..], |held| &held.targets);
    let restless = *restless || wake_events.all_wake || strand.nodes() < 2;
    if sleep.is_asleep() {
        if restless
            || was_pushed(strand)
            || has_moved_root(strand, still, distance, angle)
            || pulls(strand, still, targets, distance)
            || comes_near(still, &wake_events.solids)
            || is_blown(strand, &wake_events.winds)
        {
            sleep.bypass_change_detection().wake_up();
            still.bypass_change_detection().begin(
                strand.positions(),
                strand.orientations(),
                strand.root_frame(),
                held_nodes(targets),
            );
        }
        return;
    }
    let (sleep, still) = (sleep.bypass_change_detection(), still.bypass_change_detection());
    if wake_events.sleep.seconds == f32::INFINITY {
        sleep.wake_up();
        return;
    }
    // What a hat hides may tremble unseen between it and the head.
    let is_still = stays(&still.positions, strand.positions(), distance)
        && keeps_turn(&still.orientations, strand.orientations(), angle);
    if restless
        || !is_still && !wake_events.are_hiding(strand)
        || has_moved_root(strand, still, distance, angle)
        || pulls(strand, still, targets, distance)
        || is_blown(strand, &wake_events.winds)
    {
        sleep.wake_up();
        still.begin(
            strand.positions(),
            strand.orientations(),
            strand.root_frame(),
            held_nodes(targets),
        );
        return;
    }
    sleep.add_still_time(seconds);
    if sleep.still_for() >= wake_events.sleep.seconds {
        still.distance = distance;
        (still.low, still.high) = (strand.positions()[0], strand.positions()[0]);
        for p in strand.positions() {
            (still.low, still.high) = (still.low.min(*p), still.high.max(*p));
        }
        // Not while a collider arrives in this tick.
        if !comes_near(still, &wake_events.solids) {
            sleep.fall_asleep();
            strand.rest();
        }
    }
}

/// A sleeping strand's velocities are zero unless written from outside.
fn was_pushed(strand: &Strand) -> bool {
    strand.velocities().iter().any(|v| *v != Vec3::ZERO)
}

fn has_moved_root(strand: &Strand, still: &SleepPose, distance: f32, angle: f32) -> bool {
    let stays = still.positions.first().zip(strand.positions().first());
    !stays.is_some_and(|(a, b)| a.distance(*b) <= distance)
        || !within(turn(still.root_frame, strand.root_frame()), angle)
}

/// Whether other nodes are held than before, or the same ones at other targets.
fn pulls(strand: &Strand, still: &SleepPose, targets: &[Option<Vec3>], distance: f32) -> bool {
    if targets.is_empty() && still.held == 0 {
        return false;
    }
    let held = targets.iter().zip(strand.positions());
    held_nodes(targets) != still.held
        || held.filter_map(|(t, p)| Some(t.as_ref()?.distance(*p))).any(|d| !within(d, distance))
}

fn comes_near(still: &SleepPose, solids: &[(Solid, f32)]) -> bool {
    solids
        .iter()
        .any(|(solid, reach)| !reach.is_finite() || solid.may_reach(still.low, still.high, *reach))
}

/// Whether moving air reaches the strand's root, middle or tip.
pub(crate) fn is_blown(strand: &Strand, winds: &LocalWinds) -> bool {
    let (p, last) = (strand.positions(), strand.edges().saturating_sub(1));
    [0, last / 2, last].into_iter().any(|i| {
        let air = winds.around_edge(p[i], p[i + 1] - p[i]);
        !within(air.acceleration.length(), BREEZE) || winds.flows() && !air.is_calm()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_root_moves_by_its_place_or_by_its_frame_alone() {
        let strand = Strand::from_polyline(&[Vec3::ZERO, Vec3::X * 0.01, Vec3::X * 0.02]).unwrap();
        let moved = |by: Vec3, turn: Quat| {
            let mut still = SleepPose::default();
            let positions = strand.positions().iter().map(|p| *p + by).collect::<Vec<_>>();
            still.begin(&positions, strand.orientations(), turn * strand.root_frame(), 0);
            has_moved_root(&strand, &still, 1e-4, 1e-3)
        };
        assert!(!moved(Vec3::ZERO, Quat::IDENTITY));
        assert!(moved(Vec3::ZERO, Quat::from_rotation_z(2e-3)));
        assert!(moved(Vec3::Y * 2e-4, Quat::IDENTITY));
    }
}

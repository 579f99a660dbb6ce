//! Pairs in the tick: strands are collected and pushed before the solver's step, and kept apart after it.

use super::{
    geometry::Row,
    kick::Contact,
    state::{PairNode, Pairs},
};
use crate::{
    base::{lanes::V3, schedule::EffectiveSubsteps, setting::Settings},
    forces::contact::{ContactMethod, LockNeighbours, Obstacles, StrandContact, coarse},
    hair::strand::{
        AddedMass, HairHere, HeldNodes, SimulatedHere, Strand, StrandOf, StrandSleep, TickPose,
    },
    solver::rod::obstacle::Obstacle,
};
use bevy::{ecs::query::QueryData, prelude::*};

/// A strand, as contact sees it.
#[derive(QueryData)]
pub(crate) struct InContact {
    pub strand: &'static Strand,
    pub sleep: &'static StrandSleep,
    added: &'static AddedMass,
    held: Option<&'static HeldNodes>,
}

impl InContactItem<'_, '_> {
    /// Which nodes are held.
    fn is_held(&self, node: usize) -> bool {
        let target = |held: &HeldNodes| held.targets.get(node).copied().flatten();
        node == 0 || self.held.is_some_and(|held| target(held).is_some())
    }

    /// The mass of a node, as metres of a dry strand; 0 where it is held.
    fn mass(&self, node: usize) -> f32 {
        if self.is_held(node) {
            return 0.0;
        }
        let lengths = self.strand.rest_lengths();
        let before = lengths.get(node.wrapping_sub(1)).copied().unwrap_or(0.0);
        let cell = 0.5 * (before + lengths.get(node).copied().unwrap_or(0.0));
        let added = self.added.mass.get(node).copied().unwrap_or(0.0);
        let inertia = self.added.in_water.get(node).map_or(1.0, |water| water.inertia);
        cell * (1.0 + added) * inertia
    }
}

/// Evaluates the pairs of a hair's strands for a substep of `dt` (s).
pub(crate) fn find<'s>(
    pairs: &mut Pairs,
    strands: impl Iterator<Item = InContactItem<'s, 's>>,
    contact: &StrandContact,
    pose: &TickPose,
    dt: f32,
) {
    let reach = 2.0 * contact.radius;
    // Relative to the frame: what turns with it does not slide.
    let frame = pose.carried_by(pose);
    pairs.clear();
    for of in strands.filter(|of| !of.sleep.is_follower()) {
        let stride = coarse::stride(of.strand.rest_lengths(), reach);
        let (places, velocities) = (of.strand.positions(), of.strand.velocities());
        let velocities = of.strand.forced().map_or(velocities, |(before, _)| before);
        let sleeps = of.sleep.is_asleep();
        let node = |i: usize| {
            let place = places[i];
            let velocity = if sleeps { Vec3::ZERO } else { velocities[i] - frame.at(place) };
            PairNode { place, velocity, mass: of.mass(i) * stride as f32 }
        };
        pairs.add(places, stride, (0..places.len()).map(node));
    }
    pairs.find(numbers_of(contact, dt));
}

/// What contact is like in a substep of `dt` (s).
fn numbers_of(contact: &StrandContact, dt: f32) -> Contact<f32> {
    let reach = 2.0 * contact.radius;
    let StrandContact { strength, friction, cohesion, .. } = *contact;
    Contact { reach, core: reach * contact.core, strength, friction, cohesion, dt }
}

/// A hair of which cores are to stay apart.
struct Apart<'a> {
    present: &'a [Entity],
    pairs: &'a mut Pairs,
    obstacles: &'a [Obstacle],
    contact: StrandContact,
    dt: f32,
}

pub(crate) fn keep_strands_apart(
    steps: EffectiveSubsteps,
    contact: Settings<StrandContact>,
    mut hairs: Query<(Entity, &mut LockNeighbours, Option<&Obstacles>), HairHere>,
    mut strands: ParamSet<(
        Query<InContact, With<StrandOf>>,
        Query<&mut Strand, (With<StrandOf>, SimulatedHere)>,
    )>,
    (mut ends, mut lengths, mut moved): (
        Local<Vec<Row>>,
        Local<Vec<f32>>,
        Local<Vec<(Entity, usize)>>,
    ),
) {
    for (hair, mut neighbours, obstacles) in &mut hairs {
        let neighbours = neighbours.bypass_change_detection();
        let (contact, step) = (contact.of(hair), steps.of(hair));
        let Some(step) = step.filter(|_| neighbours.pairs.is_found()) else { continue };
        if contact.method != ContactMethod::Pairs || contact.core <= 0.0 {
            continue;
        }
        let LockNeighbours { pairs, members: (present, _), .. } = neighbours;
        let obstacles = obstacles.map_or(&[][..], |all| &all.solids);
        let apart = Apart { present, pairs, obstacles, contact, dt: step.dt };
        moved.clear();
        apart.find(&strands.p0(), &mut ends, &mut lengths, &mut moved);
        let mut strands = strands.p1();
        for (id, first) in &*moved {
            if let Ok(mut strand) = strands.get_mut(*id) {
                put(strand.bypass_change_detection(), &ends[*first..], step.dt);
            }
        }
    }
}

impl Apart<'_> {
    /// Collects the strands that have to be moved, with their first node among `ends`.
    fn find(
        self,
        strands: &Query<InContact, With<StrandOf>>,
        ends: &mut Vec<Row>,
        lengths: &mut Vec<f32>,
        moved: &mut Vec<(Entity, usize)>,
    ) {
        let Self { present, pairs, obstacles, contact, dt } = self;
        let reach = 2.0 * contact.radius;
        ends.clear();
        lengths.clear();
        let (mut starts, mut ids) = (Vec::new(), Vec::new());
        for (id, of) in present.iter().filter_map(|id| Some((*id, strands.get(*id).ok()?))) {
            if of.sleep.is_follower() {
                continue;
            }
            let own = ends.len();
            ids.push((id, own));
            let (places, all) = (of.strand.positions(), of.strand.rest_lengths());
            // Those of which not all nodes are sampled stay where they are.
            let is_fine = coarse::stride(all, reach) > 1;
            let stays = is_fine || of.sleep.is_asleep();
            for i in pairs.sampled(ids.len() - 1, places.len()) {
                let mass = if stays { 0.0 } else { of.mass(i) };
                let w = if mass > 0.0 { 1.0 / mass } else { 0.0 };
                ends.push(places.get(i).copied().unwrap_or_default().extend(w).to_array());
                lengths.push(all.get(i).copied().unwrap_or(0.0));
            }
            starts.extend(ends[own..].iter().map(|row| Vec3::new(row[0], row[1], row[2])));
        }
        let clearance = contact.radius;
        let push_out = |node: usize, place: Vec3| leave(obstacles, starts[node], place, clearance);
        let touched = pairs.keep_apart(ends, lengths, &numbers_of(&contact, dt), push_out);
        moved.extend(ids.iter().zip(touched).filter(|(_, touched)| **touched).map(|(id, _)| *id));
    }
}

/// Where a node is to be that was at `start`: in no solid deeper than there.
fn leave(obstacles: &[Obstacle], start: Vec3, place: Vec3, clearance: f32) -> Vec3 {
    let mut place = place;
    for obstacle in obstacles {
        if !obstacle.may_touch(place, place, clearance) {
            continue;
        }
        let depth = |p: Vec3| obstacle.solid.depth(V3::new(p.x, p.y, p.z), clearance);
        let (normal, deep) = depth(place);
        let more = deep - depth(start).1.max(0.0);
        if more > 0.0 {
            place += more * Vec3::new(normal.x, normal.y, normal.z);
        }
    }
    place
}

/// Moves a strand's nodes, and its edges with them.
fn put(strand: &mut Strand, ends: &[Row], dt: f32) {
    let (places, velocities, orientations, _) = strand.parts_mut();
    let mut before = places.first().copied().unwrap_or_default();
    let mut start = before;
    for (i, ((place, v), end)) in places.iter_mut().zip(velocities).zip(ends).enumerate() {
        let (was, end) = (*place, Vec3::new(end[0], end[1], end[2]));
        *v += (end - was) / dt;
        *place = end;
        if let Some(q) = i.checked_sub(1).and_then(|edge| orientations.get_mut(edge)) {
            let [from, to] = [was - before, end - start].map(Vec3::normalize_or_zero);
            if from != Vec3::ZERO && to != Vec3::ZERO && from != to {
                *q = (Quat::from_rotation_arc(from, to) * *q).normalize();
            }
        }
        (before, start) = (was, end);
    }
}

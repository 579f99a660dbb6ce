//! Held nodes, and how far from the root they can be held.

use super::Strand;
use crate::base::{
    fault::{FaultKind, HairFault},
    tape::Tape,
};
use bevy::{math::Isometry3d, prelude::*};

/// Nodes held by something else: a rod they are wound on, a hand, a clip. Held nodes have inverse
/// mass 0 and move to their targets as far as the strand reaches by the way that colliders leave free: where an edge
/// would be stretched or crushed by more than 4 % (with [`Sweeps`](crate::SolverMethod::Sweeps) 5 %, of springs 50 %) they
/// give way. A target out of reach is reported once as a fault of kind [`FaultKind::Strand`]. Add it to a strand entity.
/// Hair on the graphics card that has to give way goes on on the processor.
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq)]
#[require(HeldNodesState)]
pub struct HeldNodes {
    /// For each node from the root its target at the end of the next substep (m, in the hair's
    /// frame), or `None` for a free node. May be shorter than the strand.
    pub targets: Vec<Option<Vec3>>,
    /// For each node from the root the orientation of the edge before it at the end of the next substep (in the
    /// hair's frame; its third axis points along the edge, and is turned to do so), or `None` for an edge that is
    /// free to twist. Counts where both ends of the edge are held; the root's is
    /// [`Strand::root_frame`]. Together with the two targets it clamps the strand there, as a tie or a braid's
    /// end does. Empty by default; [`SolverMethod::Sweeps`](crate::SolverMethod::Sweeps) ignores it.
    pub frames: Vec<Option<Quat>>,
}

/// How held nodes come to their targets. Kept by the tick.
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct HeldNodesState {
    /// A target is out of reach, which has been reported.
    pub out_of_reach: bool,
    /// How far a node moves toward its target in a substep at most (m), since the strand could not follow; `None`
    /// while it can, 0 where none is held for one substep.
    pub(crate) pace: Option<f32>,
    /// How often it could not since it was last at its targets, and how often in a row.
    pub(crate) refused: u16,
    in_a_row: u8,
    /// Whether it is held by what leads strands itself, by many ways at a time: those of them that give way meanwhile are
    /// no news.
    pub(crate) is_led: bool,
}

impl HeldNodesState {
    /// Whether it could not follow its targets lately.
    #[cfg(feature = "gpu")]
    pub(crate) fn gives_way(&self) -> bool {
        self.pace.is_some()
    }

    pub(crate) fn record(&mut self, tape: &mut Tape<'_>) {
        tape.flags([&mut self.out_of_reach, &mut self.is_led]);
        tape.option(&mut self.pace, Tape::value);
        tape.value(&mut self.refused);
        tape.value(&mut self.in_a_row);
    }
}

/// Pace of a strand that could not follow, as a share of the way that was refused; how much faster it may go after
/// each substep in which it could; and the least (m), that of a strand which has been let go for a substep.
const SLOWER: f32 = 0.25;
const FASTER: f32 = 1.5;
const SLOWEST: f32 = 1e-5;

/// Refused substeps in a row at the slowest pace after which a strand is let go.
const STUCK: u8 = 4;

/// Refused substeps after which a target counts as out of reach.
const REFUSALS: u16 = 16;

/// Maximum extension of hair between two held nodes, as a share of its length. Fully straight
/// hair has more length constraints than degrees of freedom, and its tensions are undetermined.
const TAUT: f32 = 0.99;

/// Distance at which the ends of free hair of a `length` are held whose targets are `distance`
/// apart (m). Nearly straight hair is held as it is; targets beyond reach are brought nearer the
/// farther they are, down to [`TAUT`].
pub(crate) fn drawn_out(distance: f32, length: f32) -> f32 {
    let excess = (distance - length).clamp(0.0, (1.0 - TAUT) * length.max(0.0));
    distance.min(length) - excess
}

/// Tolerance for the rounding of lengths.
const SLACK: f32 = 1e-3;

impl HeldNodes {
    /// Index and position of each held node. A target out of reach of the previous held node, or of
    /// the root, is moved within reach, and adjacent held nodes follow at the length of their edges; a
    /// target that is not finite leaves the node free. With a `pace` nodes go together, none by more than that (m).
    /// With a pace of 0 none is held.
    pub(crate) fn within_reach<'a>(
        &'a self,
        strand: &'a Strand,
        pace: Option<f32>,
    ) -> impl Iterator<Item = (usize, Vec3)> + 'a {
        let root = strand.positions.first().copied().unwrap_or_default();
        let share = pace.map(|pace| (pace / self.farthest(strand)).min(1.0));
        let is_held = pace.is_none_or(|pace| pace > 0.0);
        let held = self.partly_within_reach(root, strand, share.filter(|share| *share < 1.0));
        held.filter(move |_| is_held)
    }

    /// The same for a strand whose root is here.
    #[cfg(feature = "gpu")]
    pub(crate) fn within_reach_of<'a>(
        &'a self,
        root: Vec3,
        strand: &'a Strand,
    ) -> impl Iterator<Item = (usize, Vec3)> + 'a {
        self.partly_within_reach(root, strand, None)
    }

    /// The largest distance of a held node from its target (m).
    fn farthest(&self, strand: &Strand) -> f32 {
        let held = self.targets.iter().zip(&strand.positions).skip(1);
        held.filter_map(|(target, p)| Some(target.filter(|t| t.is_finite())?.distance(*p)))
            .fold(0.0, f32::max)
    }

    /// The last held node that a target leads; 0 if there is none.
    fn last(&self, strand: &Strand) -> usize {
        let mut held = self.targets.iter().take(strand.nodes());
        held.rposition(|target| target.is_some_and(|t| t.is_finite())).unwrap_or(0)
    }

    fn partly_within_reach<'a>(
        &'a self,
        root: Vec3,
        strand: &'a Strand,
        share: Option<f32>,
    ) -> impl Iterator<Item = (usize, Vec3)> + 'a {
        let targets = self.targets.iter().take(strand.nodes()).enumerate();
        let (mut last, mut length) = (root, 0.0);
        let (mut is_drawn, mut is_displaced) = (false, false);
        targets.filter_map(move |(node, target)| {
            let edge = node.checked_sub(1);
            length += edge.map_or(0.0, |edge| strand.rest_lengths[edge]);
            let Some(target) = target.filter(|target| target.is_finite()) else {
                is_drawn |= node > 0;
                return None;
            };
            let Some(edge) = edge else {
                last = target;
                return Some((node, last));
            };
            let target = share.map_or(target, |share| strand.positions[node].lerp(target, share));
            // Squares of user values may overflow f32.
            let direction = (target - last).as_dvec3();
            let distance = direction.length() as f32;
            let apart = if is_drawn {
                drawn_out(distance, length)
            } else if is_displaced || share.is_some() {
                length
            } else {
                distance.min(length)
            };
            is_displaced &= !is_drawn;
            is_displaced |= distance > length * (1.0 + SLACK);
            let now = (strand.positions[edge + 1] - strand.positions[edge]).as_dvec3();
            let direction = direction.normalize_or(now.normalize_or_zero()).as_vec3();
            last = if apart == distance { target } else { last + direction * apart };
            (length, is_drawn) = (0.0, false);
            Some((node, last))
        })
    }

    /// The first node whose target is out of reach, and by how much (m).
    fn out_of_reach(&self, strand: &Strand) -> Option<(usize, f32)> {
        let unknown = self.targets.iter().position(|t| t.is_some_and(|t| !t.is_finite()));
        let unknown = unknown.map(|node| (node, f32::INFINITY));
        let most = SLACK * strand.length();
        unknown.or_else(|| {
            self.within_reach(strand, None)
                .map(|(node, place)| (node, self.targets[node].map_or(0.0, |t| t.distance(place))))
                .find(|(_, short)| *short > most)
        })
    }
}

/// The held nodes of a strand that is stepped.
pub(crate) struct Held<'a> {
    pub(crate) nodes: &'a HeldNodes,
    pub(crate) state: &'a mut HeldNodesState,
}

impl<'a> Held<'a> {
    /// `None` of strands of which no node is held.
    pub(crate) fn of(
        nodes: Option<&'a HeldNodes>,
        state: Option<&'a mut HeldNodesState>,
    ) -> Option<Self> {
        let (nodes, state) = nodes.zip(state)?;
        (!nodes.targets.is_empty()).then_some(Self { nodes, state })
    }

    /// Index and position of each held node in this substep, root first.
    pub(crate) fn places<'b>(
        &'b self,
        strand: &'b Strand,
    ) -> impl Iterator<Item = (usize, Vec3)> + 'b {
        self.nodes.within_reach(strand, self.state.pace)
    }

    /// Whether the strand is free in this substep, for it could not be held.
    pub(crate) fn is_let_go(&self) -> bool {
        self.state.pace == Some(0.0)
    }

    /// Takes a substep that brings nodes to a `place` and strains no edge by more than `most_strain`, not those beyond the
    /// last held node either, which colliders may keep from following. Else the strand is to
    /// [give way](Strand::give_way), with the nodes up to that of the error at rest. Sets the pace of the next one.
    pub(crate) fn accepts(
        &mut self,
        strand: &Strand,
        most_strain: f32,
        place: impl Fn(usize) -> Vec3,
    ) -> Result<(), usize> {
        let mut before = place(0);
        let is_strained = |(l, node): &(&f32, usize)| {
            let p = place(*node);
            let off = (core::mem::replace(&mut before, p).distance(p) - *l).abs();
            off.is_nan() || off > most_strain * *l
        };
        let is_let_go = self.is_let_go();
        let state = &mut *self.state;
        if is_let_go {
            (state.pace, state.in_a_row) = (Some(SLOWEST), 0);
            return Ok(());
        }
        let Some((_, strained)) = strand.rest_lengths.iter().zip(1..).find(is_strained) else {
            state.in_a_row = 0;
            state.pace = state.pace.filter(|pace| *pace < self.nodes.farthest(strand));
            match &mut state.pace {
                Some(pace) => *pace *= FASTER,
                None => state.refused = 0,
            }
            return Ok(());
        };
        let tried = state.pace.unwrap_or(f32::INFINITY).min(self.nodes.farthest(strand));
        state.in_a_row = if tried > SLOWEST { 0 } else { state.in_a_row + 1 };
        let is_stuck = state.in_a_row >= STUCK;
        state.pace = Some(if is_stuck { 0.0 } else { (tried * SLOWER).max(SLOWEST) });
        state.refused = state.refused.saturating_add(1);
        let last = self.nodes.last(strand);
        Err(if strained > last { strand.edges() } else { last })
    }
}

impl Strand {
    /// Does not take a substep of `dt` (s), in which points at rest in the world have moved by `frame_delta`: nodes stay
    /// where they were on the head, as far as their edges' lengths let them when the root has moved; those up to `last` at
    /// rest.
    pub(crate) fn give_way(
        &mut self,
        last: usize,
        most_strain: f32,
        frame_delta: Isometry3d,
        dt: f32,
    ) {
        let back = frame_delta.inverse();
        for edge in 0..self.edges() {
            let (start, shifted) = (self.positions[edge], self.positions[edge + 1]);
            let mut end = back * shifted;
            let (along, l) = ((end - start).as_dvec3(), self.rest_lengths[edge]);
            let length = along.length() as f32;
            if (length - l).abs() > 0.1 * most_strain * l {
                end = start + along.as_vec3().normalize_or(self.root_frame * Vec3::Z) * l;
            }
            self.positions[edge + 1] = end;
            self.orientations[edge] = (back.rotation * self.orientations[edge]).normalize();
        }
        for (v, p) in self.velocities.iter_mut().zip(&self.positions).take(last + 1) {
            *v = (*p - frame_delta * *p) / dt;
        }
        self.tensions[..last].fill(0.0);
        self.angular_velocities[..last].fill(Vec3::ZERO);
        self.step_succeeded();
    }

    /// After a substep of `dt` (s) in which points at rest in the world have moved by `frame_delta`: if what jams the strand
    /// strains an edge by more than this, such edges come to their lengths, with what hangs on them, and nodes to rest.
    pub(crate) fn come_to_length(&mut self, most_strain: f32, frame_delta: Isometry3d, dt: f32) {
        if self.peak_strain() <= most_strain {
            return;
        }
        let mut shift = Vec3::ZERO;
        for edge in 0..self.edges() {
            let (start, l) = (self.positions[edge], self.rest_lengths[edge]);
            let free = self.positions[edge + 1] + shift;
            let along = free - start;
            if (along.length() - l).abs() > most_strain * l {
                let end = start + along.normalize_or(self.root_frame * Vec3::Z) * l;
                shift += end - free;
                self.positions[edge + 1] = end;
            } else {
                self.positions[edge + 1] = free;
            }
        }
        for (v, p) in self.velocities.iter_mut().zip(&self.positions) {
            *v = (*p - frame_delta * *p) / dt;
        }
        self.tensions.fill(0.0);
        self.angular_velocities.fill(Vec3::ZERO);
    }
}

/// Reports targets out of reach once, until they are within reach again.
pub(super) fn report_out_of_reach(
    mut strands: Query<(Entity, &Strand, &HeldNodes, &mut HeldNodesState)>,
    mut faults: MessageWriter<HairFault>,
) {
    for (entity, strand, held, mut state) in strands.iter_mut().filter(|s| s.1.nodes() > 1) {
        let by_length = held.out_of_reach(strand);
        let by_way = || {
            let at = held.targets.iter().zip(&strand.positions).enumerate().skip(1);
            let short = at.filter_map(|(i, (target, p))| Some((i, target.as_ref()?.distance(*p))));
            short
                .max_by(|a, b| a.1.total_cmp(&b.1))
                .filter(|(_, short)| *short > (1.0 - TAUT) * strand.length())
        };
        let is_news = state.refused >= REFUSALS && !state.is_led;
        let by_way = if is_news { by_way() } else { None };
        let message = match (by_length, by_way) {
            (Some((node, short)), _) => Some(format!(
                "node {node} of the strand is held {short} m farther away than hair of {} m reaches; \
                 it is held as near to its target as possible",
                strand.length()
            )),
            (None, Some((node, short))) => Some(format!(
                "node {node} of the strand is held {short} m farther away than hair of {} m reaches by the way \
                 that colliders leave; it is held as near to its target as it gets by that",
                strand.length()
            )),
            (None, None) => None,
        };
        let out_of_reach = message.is_some() || state.out_of_reach && state.pace.is_some();
        if let Some(message) = message.filter(|_| !state.out_of_reach) {
            faults.write(HairFault::new(FaultKind::Strand, message).of(entity));
        }
        state.set_if_neq(HeldNodesState { out_of_reach, ..*state });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn strand() -> Strand {
        let points: Vec<Vec3> = (0..6).map(|i| Vec3::X * (0.1 * i as f32)).collect();
        Strand::from_polyline(&points).unwrap()
    }

    fn held(targets: &[Option<Vec3>]) -> Vec<(usize, Vec3)> {
        HeldNodes { targets: targets.to_vec(), ..default() }.within_reach(&strand(), None).collect()
    }

    #[test]
    fn what_is_within_reach_stays() {
        let at = Vec3::new(0.05, 0.1, 0.1);
        assert_eq!(held(&[None, None, Some(at)]), [(2, at)]);
        let root = Vec3::Y * 0.01;
        assert_eq!(held(&[Some(root), None, Some(at)]), [(0, root), (2, at)]);
        assert_eq!(held(&[None; 9]), []);
    }

    #[test]
    fn no_part_is_held_longer_than_it_is() {
        let far = Some(Vec3::Y * 4e37);
        let places = held(&[None, None, far, far, None, far, far]);
        let expected = [(2, 0.198), (3, 0.298), (5, 0.496)];
        assert_eq!(places.len(), 3, "{places:?}");
        for ((node, place), (at, height)) in places.into_iter().zip(expected) {
            assert_eq!(node, at);
            assert!(place.distance(Vec3::Y * height) < 1e-6, "{place}");
        }
    }

    #[test]
    fn a_target_that_is_not_finite_holds_nothing_and_is_reported() {
        let strand = strand();
        let out = |first: Option<Vec3>, x: f32| {
            let held = HeldNodes { targets: vec![None, first, Some(Vec3::X * x)], ..default() };
            (held.within_reach(&strand, None).count(), held.out_of_reach(&strand))
        };
        assert!(matches!(out(Some(Vec3::NAN), 0.1), (1, Some((1, _)))));
        assert_eq!(out(Some(Vec3::X * 0.1), 0.20001), (2, None), "rounding");
        assert!(matches!(out(None, 0.248), (1, Some((2, s))) if (s - 0.05).abs() < 1e-6));
    }
}

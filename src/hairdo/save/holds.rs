//! What holds strands in a hairdo: ties, and nodes that the game holds. In a file from format 3 on.
//!
//! Behind the looks: the number of ties, then each with radius, seconds, place, turn and scale; then strand by strand 0
//! where nothing holds it, 1 and the tie's index, the node and its place in it, or 2, the number of held nodes, and each
//! with its place.

use super::{
    Hairdo, HairdoError, Hold, StyledStrand, StyledTie,
    bytes::{Reader, Writer},
};
use crate::{
    base::setting::Ranged,
    hair::strand::{HeldNodes, TickPose},
    hairdo::tie::{HairTie, TieProgress, Tied, TiedStrands},
    keratin::treatment::WoundOn,
};
use bevy::prelude::*;

/// A tie that has come with a hairdo, and goes with it.
#[derive(Component)]
struct FromHairdo;

/// How far apart ties are that are one and the same (m of the hair).
const SAME_PLACE: f32 = 1e-3;

impl StyledTie {
    fn of(world: &World, hair: &TickPose, tie: Entity) -> Option<Self> {
        let (hair, at) = (hair.now(), world.get::<TickPose>(tie)?.now());
        Some(Self {
            tie: world.get::<HairTie>(tie)?.clamped(),
            place: hair.point_in(at.translation),
            turn: (hair.rotation.inverse() * at.rotation).normalize(),
            scale: at.size() / hair.size(),
        })
    }

    fn is(&self, other: &Self) -> bool {
        self.tie.radius == other.tie.radius && self.place.distance(other.place) < SAME_PLACE
    }

    fn is_valid(&self) -> bool {
        let turn = self.turn.length_squared();
        self.tie.violations().is_empty()
            && self.place.is_finite()
            && (0.25..=4.0).contains(&turn)
            && self.scale.is_finite()
            && self.scale > 0.0
    }
}

/// The ties of some strands, and what holds each.
pub(super) fn holds_of(
    world: &World,
    hair: Entity,
    members: &[Entity],
) -> (Vec<StyledTie>, Vec<Option<Hold>>) {
    let (mut known, mut ties) = (Vec::new(), Vec::new());
    let pose = world.get::<TickPose>(hair);
    let holds = members.iter().map(|member| {
        if world.get::<WoundOn>(*member).is_some() {
            return None;
        }
        let tied = world.get::<Tied>(*member).zip(world.get::<TieProgress>(*member));
        if let Some((on, progress)) = tied.filter(|(_, progress)| !progress.waits()) {
            let index = known.iter().position(|tie| *tie == on.0).or_else(|| {
                ties.push(StyledTie::of(world, pose?, on.0)?);
                known.push(on.0);
                Some(known.len() - 1)
            })?;
            let TieProgress { node, place, .. } = *progress;
            return Some(Hold::Tied { tie: index as u32, node, place });
        }
        let held = world.get::<HeldNodes>(*member)?.targets.iter().zip(0..);
        let held: Vec<_> = held.filter_map(|(target, node)| Some((node, (*target)?))).collect();
        (!held.is_empty()).then_some(Hold::Nodes(held))
    });
    let holds = holds.collect();
    (ties, holds)
}

impl Hairdo {
    /// Ties strands and holds nodes as the hairdo has them, after its strands have been put on. Ties that hold them at
    /// their places are used again.
    pub(super) fn hold(&self, world: &mut World, hair: Entity, members: &[Entity]) {
        let mut before: Vec<Entity> =
            members.iter().filter_map(|member| Some(world.get::<Tied>(*member)?.0)).collect();
        before.sort_unstable();
        before.dedup();
        let pose = world.get::<TickPose>(hair).cloned().unwrap_or_default();
        let there: Vec<_> = before
            .iter()
            .filter_map(|tie| Some((*tie, StyledTie::of(world, &pose, *tie)?)))
            .collect();
        let ties: Vec<Entity> = self
            .ties
            .iter()
            .map(|tie| match there.iter().find(|(_, own)| own.is(tie)) {
                Some((entity, _)) => *entity,
                None => {
                    let place = Transform {
                        translation: tie.place,
                        rotation: tie.turn,
                        scale: Vec3::splat(tie.scale),
                    };
                    world.spawn((tie.tie, place, FromHairdo, ChildOf(hair))).id()
                }
            })
            .collect();
        for (member, style) in members.iter().zip(&self.strands) {
            let mut strand = world.entity_mut(*member);
            match &style.hold {
                None => {
                    strand.remove::<Tied>();
                }
                Some(Hold::Nodes(nodes)) => {
                    strand.remove::<Tied>().insert(held(nodes.iter().copied()));
                }
                Some(Hold::Tied { tie, node, place }) => {
                    let at = style.positions[*node as usize];
                    let progress = TieProgress::tied(*node, *place);
                    strand.remove::<WoundOn>();
                    strand.insert((Tied(ties[*tie as usize]), progress, held([(*node, at)])));
                }
            }
        }
        for tie in before {
            let is_empty = world.get::<TiedStrands>(tie).is_none_or(|tied| tied.is_empty());
            if is_empty && world.get::<FromHairdo>(tie).is_some() {
                world.despawn(tie);
            }
        }
    }

    /// Whether there is more than format 2 can hold.
    pub(super) fn has_holds(&self) -> bool {
        self.strands.iter().any(|strand| strand.hold.is_some())
    }

    pub(super) fn write_holds(&self, out: &mut Writer) {
        out.put(&(self.ties.len() as u64));
        for StyledTie { tie, place, turn, scale } in &self.ties {
            out.put(&([tie.radius, tie.seconds, *scale], place.to_array(), turn.to_array()));
        }
        for strand in &self.strands {
            match &strand.hold {
                None => out.put(&0_u8),
                Some(Hold::Tied { tie, node, place }) => {
                    out.put(&(1_u8, *tie, *node, place.to_array()));
                }
                Some(Hold::Nodes(nodes)) => {
                    out.put(&(2_u8, nodes.len() as u64));
                    nodes.iter().for_each(|(node, at)| out.put(&(*node, at.to_array())));
                }
            }
        }
    }

    pub(super) fn read_holds(&mut self, from: &mut Reader<'_>) -> Result<(), HairdoError> {
        type Numbers = ([f32; 3], [f32; 3], [f32; 4]);
        let ties = from.count(size_of::<Numbers>(), "a number of ties that fit in the file")?;
        self.ties =
            from.many(ties, "a tie", |([radius, seconds, scale], place, turn): Numbers| {
                StyledTie {
                    tie: HairTie { radius, seconds },
                    place: Vec3::from_array(place),
                    turn: Quat::from_array(turn),
                    scale,
                }
            })?;
        if self.ties.iter().any(|tie| !tie.is_valid()) {
            return Err(from.wrong("ties of valid radius, place and scale"));
        }
        for strand in &mut self.strands {
            strand.hold = match from.take::<u8>("what holds a strand")? {
                0 => None,
                1 => {
                    let (tie, node, place): (u32, u32, [f32; 3]) = from.take("a tied node")?;
                    Some(Hold::Tied { tie, node, place: Vec3::from_array(place) })
                }
                2 => {
                    let count = from.count(13, "a number of held nodes that fit in the file")?;
                    let node = |(node, at): (u32, [f32; 3])| (node, Vec3::from_array(at));
                    Some(Hold::Nodes(from.many(count, "a held node", node)?))
                }
                _ => return Err(from.wrong("0, 1 or 2 for what holds a strand")),
            };
        }
        Ok(())
    }

    /// Whether its strands' holds are possible.
    pub(super) fn check_holds(&self) -> Result<(), HairdoError> {
        for (index, strand) in self.strands.iter().enumerate() {
            let nodes = strand.positions.len();
            let check = |first: usize, node: u32, place: Vec3| {
                let (what, strand, at) = ("held node", index, node as usize);
                if !(first..nodes).contains(&at) {
                    let (found, expected) = (f64::from(node), "a node of the strand");
                    return Err(HairdoError::OutOfRange { what, strand, at, found, expected });
                }
                if !place.is_finite() {
                    return Err(HairdoError::NonFinite { what, strand, at });
                }
                Ok(())
            };
            match &strand.hold {
                None => {}
                Some(Hold::Tied { tie, node, place }) => {
                    if *tie as usize >= self.ties.len() {
                        let (what, at, found) = ("tie", *node as usize, f64::from(*tie));
                        let (strand, expected) = (index, "a tie of the hairdo");
                        return Err(HairdoError::OutOfRange { what, strand, at, found, expected });
                    }
                    check(1, *node, *place)?;
                }
                Some(Hold::Nodes(nodes)) => {
                    nodes.iter().try_for_each(|(node, place)| check(0, *node, *place))?;
                }
            }
        }
        Ok(())
    }
}

impl StyledStrand {
    /// What holds it, for a strand of these lengths (m): the nodes that are as far along it; free where it is too
    /// short.
    pub(super) fn hold_for(&self, lengths: &[f32]) -> Option<Hold> {
        let there = |node: u32| nearest_node(&self.rest_lengths, node as usize, lengths);
        match self.hold.as_ref()? {
            Hold::Tied { tie, node, place } => {
                let node = there(*node).filter(|node| *node > 0)? as u32;
                Some(Hold::Tied { tie: *tie, node, place: *place })
            }
            Hold::Nodes(nodes) => {
                let nodes = nodes.iter().filter_map(|(node, at)| Some((there(*node)? as u32, *at)));
                let mut nodes: Vec<_> = nodes.collect();
                nodes.dedup_by_key(|(node, _)| *node);
                (!nodes.is_empty()).then_some(Hold::Nodes(nodes))
            }
        }
    }
}

/// Nodes held at places.
fn held(nodes: impl IntoIterator<Item = (u32, Vec3)>) -> HeldNodes {
    let mut targets = Vec::new();
    for (node, at) in nodes {
        let node = node as usize;
        if targets.len() <= node {
            targets.resize(node + 1, None);
        }
        targets[node] = Some(at);
    }
    HeldNodes { targets, ..default() }
}

/// The node of a strand with `new` lengths that is as far along it as `node` along `old` ones; `None` if it is shorter.
fn nearest_node(old: &[f32], node: usize, new: &[f32]) -> Option<usize> {
    let along: f32 = old.iter().take(node).sum();
    let mut arc = 0.0;
    let arcs = core::iter::once(0.0).chain(new.iter().map(|l| {
        arc += l;
        arc
    }));
    let (nearest, off) =
        arcs.map(|arc| arc - along).enumerate().min_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
    let edge = new.get(nearest.saturating_sub(1))?;
    (off >= -0.5 * edge).then_some(nearest)
}

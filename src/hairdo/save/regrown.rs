//! Hair that grows again from another version of its groom keeps what has been done to it: how bonds and pose differ from
//! how it grew, its water, what holds it, and how much is left of its style.

use super::{
    Hairdo, StyledStrand, StyledTie,
    apply::members,
    resample::{Along, MAX_BEND},
};
use crate::{
    hair::strand::{Strand, return_to_cpu},
    hairdo::{
        save::Hold,
        style::{HairStyle, KeptStyle, StyledJoints},
        tie::Tied,
    },
    keratin::bond::{BondKind, Bonds},
    solver::rod::frame::full,
};
use bevy::prelude::*;
use std::sync::{Arc, Mutex};

/// What has been done to a hair, on its way from strands that go to those that grow in their place.
#[derive(Clone, Default)]
pub(crate) struct Regrowth(Arc<Mutex<Option<Done>>>);

struct Done {
    hair: Entity,
    /// Of the strands that go.
    hairdo: Hairdo,
    /// The style of each of them, if it is watched.
    styles: Vec<Option<Vec<Vec3>>>,
    watched: Option<(HairStyle, KeptStyle)>,
    /// The ties that hold them.
    ties: Vec<Entity>,
}

/// Which strands of a hair are meant.
type Meant = fn(EntityRef<'_>) -> bool;

impl Regrowth {
    /// By a command, what has been done to the strands of a hair that are `meant`. Nothing where it cannot be told.
    pub(crate) fn take(commands: &mut Commands, hair: Entity, meant: Meant) -> Self {
        let taken = Self::default();
        let to = taken.clone();
        commands.queue(move |world: &mut World| {
            return_to_cpu(world, hair);
            if let Ok(mut to) = to.0.lock() {
                *to = Done::of(world, hair, meant);
            }
        });
        taken
    }

    /// By a command, puts it on the strands of a hair that are `meant`.
    pub(crate) fn put_on(self, commands: &mut Commands, hair: Entity, meant: Meant) {
        commands.queue(move |world: &mut World| {
            let done = self.0.lock().ok().and_then(|mut done| done.take());
            if let Some(done) = done {
                done.put_on(world, hair, meant);
            }
        });
    }
}

/// The strands of a hair, and which of them are meant.
fn strands_of(world: &World, hair: Entity, meant: Meant) -> Vec<(Entity, bool)> {
    let whole = members(world, hair).into_iter();
    let whole = whole.filter(|member| world.get::<Strand>(*member).is_some());
    whole.map(|member| (member, meant(world.entity(member)))).collect()
}

impl Done {
    fn of(world: &World, hair: Entity, meant: Meant) -> Option<Self> {
        let whole = Hairdo::of_strands(world, hair).ok()?;
        let all = strands_of(world, hair, meant);
        let own = || all.iter().zip(&whole.strands).filter(|((_, is_meant), _)| *is_meant);
        let strands: Vec<_> = own().map(|(_, strand)| strand.clone()).collect();
        let style = |id: Entity| world.get::<StyledJoints>(id).map(|style| style.0.clone());
        let styles = own().map(|((id, _), _)| style(*id)).collect();
        let ties = own().filter_map(|((id, _), _)| Some(world.get::<Tied>(*id)?.0));
        let mut ties: Vec<Entity> = ties.collect();
        ties.sort_unstable();
        ties.dedup();
        let watched = world.get::<HairStyle>(hair).copied().zip(world.get(hair).cloned());
        (!strands.is_empty()).then_some(Self {
            hair,
            hairdo: Hairdo { strands, ..whole },
            styles,
            watched,
            ties,
        })
    }

    fn put_on(self, world: &mut World, hair: Entity, meant: Meant) {
        let all = strands_of(world, hair, meant);
        for (id, _) in all.iter().filter(|(_, is_meant)| *is_meant) {
            let mut strand = world.entity_mut(*id);
            let (Some(own), bonds) = (strand.get::<Strand>(), strand.get::<Bonds>()) else {
                continue;
            };
            if bonds.is_none_or(|bonds| bonds.joints.len() != own.edges()) {
                let bonds = Bonds::of(own);
                strand.insert(bonds);
            }
        }
        let Ok(mut grown) = Hairdo::of_strands(world, hair) else { return };
        let sources = self.hairdo.sources(all.iter().filter(|(_, is)| *is).count());
        let mut styles = Vec::new();
        let tie_count = self.hairdo.ties.len() as u32;
        let mut next = 0;
        for ((id, is_meant), strand) in all.iter().zip(&mut grown.strands) {
            if !is_meant {
                if let Some(Hold::Tied { tie, .. }) = &mut strand.hold {
                    *tie += tie_count;
                }
                continue;
            }
            let source = sources(next, strand.positions[0]);
            next += 1;
            let before = &self.hairdo.strands[source];
            if let Some(style) = &self.styles[source] {
                styles.push((*id, before.style_on(style, strand)));
            }
            *strand = before.resampled(strand).regrown(strand);
        }
        let ties: Vec<StyledTie> = self.hairdo.ties.iter().chain(&grown.ties).copied().collect();
        let on_same = self.hair == hair;
        // So that the ties which are there hold the new strands.
        let first = all.iter().filter(|(_, is_meant)| *is_meant && on_same);
        for ((id, _), tie) in first.zip(&self.ties) {
            if world.get_entity(*tie).is_ok() {
                world.entity_mut(*id).insert(Tied(*tie));
            }
        }
        let done = Hairdo { ties, look: None, ..grown }.checked();
        if done.and_then(|done| done.apply(world, hair)).is_err() {
            return;
        }
        for (id, style) in styles {
            world.entity_mut(id).insert(StyledJoints(style));
        }
        if let Some(watched) = self.watched.filter(|_| !on_same) {
            world.entity_mut(hair).insert(watched);
        }
    }
}

impl StyledStrand {
    /// A style of this strand's joints, on a strand of other lengths.
    fn style_on(&self, style: &[Vec3], layout: &Self) -> Vec<Vec3> {
        let own: Vec<Vec3> = self.remembered(BondKind::Peptide).collect();
        let styled: Vec<Vec3> = own.iter().zip(style).map(|(own, by)| *own + *by).collect();
        if styled.len() != own.len() {
            return Vec::new();
        }
        let along = Along::new(&self.rest_lengths, &layout.rest_lengths);
        let [own, styled] = [own, styled]
            .map(|shapes| along.resample_shapes(self.root_frame, &shapes, layout.root_frame));
        styled.iter().zip(own).map(|(styled, own)| *styled - own).collect()
    }

    /// The same on a strand that grows in another shape: all that differs from how it grew differs as much from that.
    fn regrown(mut self, layout: &Self) -> Self {
        let grows: Vec<Vec3> = layout.remembered(BondKind::Peptide).collect();
        let before = self.remembered(BondKind::Peptide);
        let by: Vec<Vec3> = grows.iter().zip(before).map(|(grows, own)| *grows - own).collect();
        if by.len() != self.joints.len() || by.iter().all(|by| by.length_squared() < 1e-12) {
            return self;
        }
        let present: Vec<Vec3> = self.shape().collect();
        for (joint, by) in self.joints.iter_mut().zip(&by) {
            joint.shapes.iter_mut().for_each(|shape| *shape += *by);
        }
        let (mut turn, mut place) = (self.root_frame, self.positions[0]);
        for (i, (present, by)) in present.iter().zip(&by).enumerate() {
            turn = (turn * full((*present + *by).clamp_length_max(MAX_BEND))).normalize();
            place += turn * Vec3::Z * self.rest_lengths[i];
            self.orientations[i] = turn;
            self.positions[i + 1] = place;
        }
        self
    }
}

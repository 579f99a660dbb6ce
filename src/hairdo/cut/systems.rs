//! Cuts strands when they are asked for.

use super::{
    CutBy, CutHair, HairCut,
    model::{Meeting, at_length, through_plane, within},
};
use crate::{
    base::fault::{FaultKind, HairFault},
    hair::{
        strand::{
            AddedMass, CutStrand, FollowerCuts, HeldNodes, SHORTEST_END, Strand, StrandHistory,
            Strands, lacks_strands, return_to_cpu,
        },
        worn::{hairs_of, report_no_hair},
    },
    hairdo::{
        region::wrong_plane,
        tie::{TieProgress, Tied},
    },
    keratin::{
        bond::{Bonds, RestShape},
        treatment::{WindingProgress, WoundOn},
    },
    water::{Moisture, WaterLedger},
};
use bevy::prelude::*;

/// Cutting.
#[derive(Clone, Copy, Debug, Default)]
pub struct CutPlugin;

impl Plugin for CutPlugin {
    fn build(&self, app: &mut App) {
        if lacks_strands::<Self>(app) {
            return;
        }
        app.register_type::<CutStrand>()
            .register_type::<FollowerCuts>()
            .register_type::<CutBy>()
            .register_type::<CutHair>()
            .register_type::<HairCut>()
            .add_observer(cut);
    }
}

fn cut(request: On<CutHair>, mut commands: Commands) {
    let request = *request.event();
    commands.queue(move |world: &mut World| cut_all(world, &request));
}

impl CutBy {
    /// Why it cannot be done.
    fn wrong(&self) -> Option<String> {
        match *self {
            Self::Length(length) if !(length >= SHORTEST_END && length.is_finite()) => {
                Some(format!("to a length of {length} m, expected {SHORTEST_END} or more"))
            }
            Self::Length(_) => None,
            Self::Plane { point, normal } => {
                wrong_plane(point, normal).map(|wrong| format!("at {wrong}"))
            }
        }
    }

    fn meets(&self, strand: &Strand) -> Meeting {
        match *self {
            Self::Length(length) => at_length(strand.rest_lengths(), length),
            Self::Plane { point, normal } => through_plane(strand.positions(), point, normal),
        }
    }
}

fn cut_all(world: &mut World, request: &CutHair) {
    let of_region = || request.region.wrong().map(|wrong| format!("of a region above {wrong}"));
    if let Some(wrong) = request.by.wrong().or_else(of_region) {
        let message = format!("CutHair {wrong}: nothing is cut");
        world.write_message(HairFault::new(FaultKind::Setting, message).of(request.hair));
        return;
    }
    let hairs = hairs_of(world, request.hair);
    if hairs.is_empty() {
        report_no_hair(world, "CutHair", request.hair);
    }
    for hair in hairs {
        return_to_cpu(world, hair);
        let members: Vec<Entity> =
            world.get::<Strands>(hair).into_iter().flat_map(|members| members.iter()).collect();
        let CutHair { by, region, .. } = *request;
        let mut answer = HairCut { hair, by, region, strands: 0, refused: 0, length: 0.0 };
        let mut drained = 0.0;
        for member in members {
            let Ok(mut strand) = world.get_entity_mut(member) else { continue };
            let Some(own) = strand.get::<Strand>() else { continue };
            if !own.positions().first().is_some_and(|root| region.contains(*root)) {
                continue;
            }
            let meeting = by.meets(own);
            let before = own.length();
            match cut_strand(&mut strand, meeting) {
                Some(water) => {
                    answer.strands += 1;
                    drained += water;
                    let now = strand.get::<Strand>().map_or(0.0, Strand::length);
                    answer.length += before - now;
                }
                None => answer.refused += usize::from(meeting != Meeting::Misses),
            }
        }
        if let Some(mut ledger) = world.get_resource_mut::<WaterLedger>()
            && drained != 0.0
        {
            ledger.replace(-drained);
        }
        world.trigger(answer);
    }
}

/// Cuts a strand with all that it carries. Returns the water that is lost (m³), or `None` where it is not cut.
fn cut_strand(entity: &mut EntityWorldMut<'_>, meeting: Meeting) -> Option<f64> {
    let Meeting::At(place) = meeting else { return None };
    let whole = entity.get::<Strand>()?;
    let old = whole.rest_lengths().to_vec();
    let before = entity.get::<CutStrand>().copied().filter(|cut| cut.fits(whole.nodes()));
    let mut cut = before.unwrap_or_else(|| CutStrand::whole(whole));
    if !entity.get_mut::<Strand>()?.cut(place, &mut cut) {
        return None;
    }
    let strand = entity.get::<Strand>()?;
    let (nodes, edges, lengths) = (strand.nodes(), strand.edges(), strand.rest_lengths().to_vec());
    if let Some(mut history) = entity.get_mut::<StrandHistory>() {
        // Drawn where it was, up to the new tip.
        let before = &mut history.positions;
        if let [from, to] = [before.get(place.edge), before.get(place.edge + 1)].map(|p| p.copied())
            && let (Some(from), Some(to)) = (from, to)
        {
            before.truncate(nodes - 1);
            before.push(from.lerp(to, place.share));
        } else {
            before.clear();
        }
    }
    if let Some(mut bonds) = entity.get_mut::<Bonds>() {
        bonds.joints.truncate(edges);
    }
    if let Some(mut rest) = entity.get_mut::<RestShape>() {
        *rest = RestShape::default();
    }
    if let Some(mut added) = entity.get_mut::<AddedMass>() {
        *added = AddedMass::default();
    }
    if let Some(mut held) = entity.get_mut::<HeldNodes>() {
        // The new tip is where no node was.
        held.targets.truncate(nodes - 1);
    }
    if entity.contains::<WoundOn>() {
        if let Some(mut winding) = entity.get_mut::<WindingProgress>() {
            *winding = WindingProgress::default();
        }
        if let Some(mut held) = entity.get_mut::<HeldNodes>() {
            held.targets.clear();
        }
    }
    if entity.get::<TieProgress>().is_some_and(|tie| tie.node as usize >= nodes - 1) {
        entity.remove::<Tied>();
    }
    let lost = entity
        .get_mut::<Moisture>()
        .map_or(0.0, |mut water| water.cut(|carried| within(carried, &old, &lengths)));
    entity.insert(cut);
    Some(lost)
}

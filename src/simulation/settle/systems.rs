//! After a tick of the game: some ticks of hair that settles.

use super::{SettleSettings, Settling};
use crate::{
    base::{
        schedule::{HairStep, SettleTick, SettleTickHairs},
        setting::Settings,
    },
    hair::strand::{Hair, Strand, StrandHistory, Strands, TickPose},
    keratin::bond::BondChanges,
};
use bevy::{ecs::system::SystemState, prelude::*};

/// How long all of it has to be still (s): longer than the turning point of a swing.
const STILL_SECONDS: f32 = 0.25;

/// The hair that settles in this tick of the game, with its settings.
type SettlingHairs = Vec<(Entity, SettleSettings)>;

fn settling_hairs(
    hairs: Query<(Entity, Option<&Strands>), (With<Hair>, With<Settling>)>,
    settings: Settings<SettleSettings>,
    strands: Query<(&Strand, &StrandHistory)>,
) -> SettlingHairs {
    // A tick of the game has to come first: it ties roots, fits bonds and gathers colliders.
    let has_ticked = |members: &Strands| {
        let mut theirs = strands.iter_many(members.collection());
        theirs.all(|(strand, history)| history.positions.len() == strand.nodes())
    };
    let ready = hairs.iter().filter(|(_, members)| members.is_some_and(has_ticked));
    ready.map(|(hair, _)| (hair, settings.of(hair))).collect()
}

/// Runs additional ticks of all hair that settles.
pub(super) fn settle(world: &mut World) {
    let mut hairs = world.run_system_cached(settling_hairs).unwrap_or_default();
    let present = *world.resource::<HairStep>();
    if hairs.is_empty() || present.count == 0 {
        return;
    }
    // Nothing else moves meanwhile: neither the head nor colliders.
    for mut pose in world.query::<&mut TickPose>().iter_mut(world) {
        pose.bypass_change_detection().hold();
    }
    let mut damping = SystemState::<SettleDamping>::new(world);
    for round in 0.. {
        hairs.retain(|(hair, settings)| {
            let settling = world.get::<Settling>(*hair);
            let goes_on = settling.is_some_and(|settling| {
                settling.done < settings.ticks && settling.still < STILL_SECONDS
            });
            if !goes_on {
                end(world, *hair);
            }
            goes_on && round < settings.at_once
        });
        if hairs.is_empty() {
            break;
        }
        world.resource_mut::<SettleTickHairs>().0 = Some(hairs.iter().map(|h| h.0).collect());
        for index in 0..present.count {
            *world.resource_mut::<HairStep>() = HairStep { index, ..present };
            world.run_schedule(SettleTick);
        }
        let seconds = present.dt * present.count as f32;
        for (hair, settings) in &hairs {
            let Ok(damping) = damping.get_mut(world) else { continue };
            damping.slow_down(*hair, settings, seconds);
        }
    }
    world.resource_mut::<SettleTickHairs>().0 = None;
    *world.resource_mut::<HairStep>() = present;
}

/// Damps hair that settles, and measures its rest.
#[derive(bevy::ecs::system::SystemParam)]
struct SettleDamping<'w, 's> {
    hairs: Query<'w, 's, (&'static mut Settling, &'static Strands)>,
    strands: Query<'w, 's, (&'static mut Strand, &'static mut BondChanges)>,
}

impl SettleDamping<'_, '_> {
    /// After an additional tick of this many seconds.
    fn slow_down(mut self, hair: Entity, settings: &SettleSettings, seconds: f32) {
        let Ok((mut settling, members)) = self.hairs.get_mut(hair) else { return };
        let retained = bevy::math::ops::exp(-settings.damping * seconds);
        let mut fastest: f32 = 0.0;
        let mut members = self.strands.iter_many_mut(members.collection());
        while let Some((mut strand, mut changes)) = members.fetch_next() {
            // Discards the drying by blowers meanwhile.
            *changes.bypass_change_detection() = default();
            let (_, velocities, _, spins) = strand.bypass_change_detection().parts_mut();
            for v in velocities.iter_mut().chain(spins) {
                *v *= retained;
            }
            fastest = velocities.iter().map(|v| v.length_squared()).fold(fastest, f32::max);
        }
        settling.done += 1;
        settling.still =
            if fastest.sqrt() < settings.speed { settling.still + seconds } else { 0.0 };
    }
}

/// Ends settling: the hair is at rest and is drawn from now on.
pub(super) fn end(world: &mut World, hair: Entity) {
    let members = world.get::<Strands>(hair).map(|members| members.collection().to_vec());
    for strand in members.unwrap_or_default() {
        if let Ok(mut strand) = world.get_entity_mut(strand)
            && let Ok((mut strand, mut history)) =
                strand.get_components_mut::<(&mut Strand, &mut StrandHistory)>()
        {
            strand.bypass_change_detection().rest();
            history.bypass_change_detection().remember(&strand);
        }
    }
    if let Ok(mut hair) = world.get_entity_mut(hair) {
        hair.remove::<Settling>();
    }
}

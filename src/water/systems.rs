//! Water in the tick, and the balance of the ledger.

use super::{
    Droplet, DropletRules, HairWetting, Moisture, Shower, SoakHair, WaterLedger,
    bridge::{HairDried, HoldsWater, IsWet, join_wet_strands, update_is_wet, widen_contact},
    droplet_contact::{WaterField, wet_strands},
    exchange::{FoundWater, exchange_water, repair_moistures, run_showers},
    merge::merge_droplets,
    motion::{follow_strands, move_droplets},
    strand_block,
    submerge::submerge,
    volume::WaterVolume,
};
use crate::{
    base::{
        schedule::{HairStep, HairSystems, HairTick, first_substep, last_substep, shared_substep},
        setting,
        stretch::{self, Stretch},
    },
    forces::{contact::TickColliders, environment::vapour::DryingAir},
    hair::{
        strand::{
            Hair, Here, MissedOnGpu, ShiftWorld, Strand, TickPose, keep_required, lacks_strands,
        },
        worn,
    },
};
use bevy::{ecs::entity_disabling::Disabled, prelude::*};

/// Droplets, showers, moisture and drying.
pub struct WaterPlugin;

impl Plugin for WaterPlugin {
    fn build(&self, app: &mut App) {
        if lacks_strands::<Self>(app) {
            return;
        }
        worn::setting::<HairWetting>(app);
        strand_block::plugin(app);
        setting::resource::<DropletRules>(app);
        setting::component::<Shower>(app);
        keep_required::<Shower, TickPose>(app);
        setting::component::<WaterVolume>(app);
        keep_required::<WaterVolume, Stretch<WaterVolume>>(app);
        stretch::plugin::<WaterVolume>(app);
        app.init_resource::<WaterLedger>()
            .init_resource::<WaterField>()
            .init_resource::<FoundWater>()
            .init_resource::<TickColliders>()
            .init_resource::<DryingAir>()
            .init_resource::<MissedOnGpu<SoakHair>>()
            .add_message::<SoakHair>()
            .register_type::<WaterLedger>()
            .register_type::<Droplet>()
            .register_type::<HairDried>()
            .register_type::<Moisture>()
            .register_type::<SoakHair>()
            .register_required_components::<Strand, Moisture>()
            .register_required_components::<Hair, IsWet>()
            .register_required_components::<Hair, HoldsWater>()
            .add_observer(|soak: On<SoakHair>, mut messages: MessageWriter<SoakHair>| {
                messages.write(*soak.event());
            })
            .add_observer(shift_droplets)
            .add_observer(count_lost_droplet)
            .add_observer(count_lost_moisture)
            .add_systems(
                HairTick,
                (repair_moistures, submerge).chain().in_set(HairSystems::Submersion),
            )
            .add_systems(
                HairTick,
                (
                    count_overwritten,
                    run_showers.run_if(shared_substep),
                    exchange_water.run_if(first_substep),
                    (update_is_wet, widen_contact).chain().run_if(first_substep),
                )
                    .chain()
                    .in_set(HairSystems::WaterExchange),
            )
            .add_systems(
                HairTick,
                (
                    // Not in other substeps: what was written to a droplet is changed until it is repaired.
                    (move_droplets.run_if(shared_substep), merge_droplets.run_if(last_substep))
                        .chain()
                        .in_set(HairSystems::Droplets),
                    wet_strands.run_if(shared_substep).in_set(HairSystems::DropletContact),
                    join_wet_strands.in_set(HairSystems::Bridges),
                ),
            )
            .add_systems(
                HairTick,
                (follow_strands.run_if(shared_substep), sum_held_water)
                    .chain()
                    .in_set(HairSystems::WaterLedger),
            );
    }
}

/// Drops go along with a shifted world.
fn shift_droplets(shift: On<ShiftWorld>, mut drops: Query<&mut Droplet>) {
    for mut drop in &mut drops {
        drop.position += shift.by;
        drop.before += shift.by;
    }
}

/// Counts the water of droplets despawned from outside as removed.
fn count_lost_droplet(
    lost: On<Discard, Droplet>,
    mut droplets: Query<&mut Droplet, Allow<Disabled>>,
    mut ledger: ResMut<WaterLedger>,
) {
    if let Ok(mut droplet) = droplets.get_mut(lost.entity) {
        // A component taken off its entity may be inserted elsewhere, where it counts as new.
        ledger.water_out += core::mem::take(&mut droplet.counted).0;
    }
}

/// The same for wet strands.
fn count_lost_moisture(
    lost: On<Discard, Moisture>,
    mut strands: Query<&mut Moisture, Allow<Disabled>>,
    mut ledger: ResMut<WaterLedger>,
) {
    if let Ok(mut moisture) = strands.get_mut(lost.entity) {
        ledger.water_out += moisture.take_counted();
    }
}

/// What sums in another order may differ by, as a share.
const ROUNDING: f64 = 1e-12;

/// Once a tick: counts the water of components that were assigned another value from outside. Only where
/// there was an assignment, so that the ledger still detects errors of the tick itself.
fn count_overwritten(
    step: Res<HairStep>,
    droplets: Query<Ref<Droplet>, Allow<Disabled>>,
    strands: Query<&Moisture, Allow<Disabled>>,
    // What is written to hair on the GPU is found once it is back.
    watched: Query<Ref<Moisture>, (Allow<Disabled>, Here)>,
    (mut ledger, mut found): (ResMut<WaterLedger>, ResMut<FoundWater>),
) {
    let written = || {
        droplets.iter().any(|d| d.is_changed() && !d.is_added())
            || watched.iter().any(|m| m.is_changed() && !m.is_added())
    };
    if step.index > 0 {
        return;
    }
    let is_written = ledger.water_in > 0.0 && written();
    let is_restored = core::mem::take(&mut found.is_restored);
    if is_written || is_restored {
        let counted = droplets.iter().map(|d| d.counted.0).sum::<f64>()
            + strands.iter().map(|m| m.counted()).sum::<f64>();
        let lost = ledger.water_in - ledger.water_out - counted;
        // Put back with its balance nothing is missing, and no bit changes.
        if is_written || lost.abs() > ROUNDING * ledger.water_in.max(counted) {
            ledger.record(-lost);
            found.any |= is_restored;
            found.busy |= is_restored;
        }
    }
}

/// At the end of a tick: the water present, summed in the order of the entities.
fn sum_held_water(
    step: Res<HairStep>,
    droplets: Query<&Droplet, Allow<Disabled>>,
    strands: Query<&Moisture, Allow<Disabled>>,
    mut ledger: ResMut<WaterLedger>,
) {
    if step.index + 1 == step.count && ledger.water_in > 0.0 {
        ledger.held = droplets.iter().map(|d| d.counted.0).sum::<f64>()
            + strands.iter().map(Moisture::volume).sum::<f64>();
    }
}

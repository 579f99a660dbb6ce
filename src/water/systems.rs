//! Water's places in the tick, and what it tells and counts.

use super::{
    Droplet, DropletRules, Moisture, Shower, SoakHair, WaterLedger, Wetting,
    bridge::{IsWet, join_wet_strands, see_wet_hair},
    droplet_contact::{WaterField, wet_strands},
    exchange::{exchange_water, mend_moistures, run_showers},
    motion::{follow_strands, merge_droplets, move_droplets},
    strand_block,
};
use crate::{
    schedule::{HairStep, HairSystems, HairTick, first_substep},
    setting,
    strand::{Hair, Strand},
};
use bevy::prelude::*;

/// Droplets, showers, moisture and the air that dries.
pub struct WaterPlugin;

impl Plugin for WaterPlugin {
    fn build(&self, app: &mut App) {
        setting::plugin::<Wetting>(app);
        strand_block::plugin(app);
        setting::resource::<DropletRules>(app);
        setting::component::<Shower>(app);
        app.init_resource::<WaterLedger>()
            .init_resource::<WaterField>()
            .add_message::<SoakHair>()
            .register_type::<WaterLedger>()
            .register_type::<Droplet>()
            .register_type::<Moisture>()
            .register_type::<SoakHair>()
            .register_required_components::<Strand, Moisture>()
            .register_required_components::<Hair, IsWet>()
            .add_observer(count_lost_droplet)
            .add_observer(count_lost_moisture)
            .add_systems(
                HairTick,
                (mend_moistures, run_showers, exchange_water, see_wet_hair.run_if(first_substep))
                    .chain()
                    .in_set(HairSystems::WaterExchange),
            )
            .add_systems(
                HairTick,
                (
                    (move_droplets, merge_droplets).chain().in_set(HairSystems::Droplets),
                    wet_strands.in_set(HairSystems::DropletContact),
                    join_wet_strands.in_set(HairSystems::Bridges),
                ),
            )
            .add_systems(
                HairTick,
                (follow_strands, close_books).chain().in_set(HairSystems::Ledger),
            );
    }
}

/// Droplets that somebody despawns take their water with them.
fn count_lost_droplet(
    lost: On<Discard, Droplet>,
    droplets: Query<&Droplet>,
    mut ledger: ResMut<WaterLedger>,
) {
    if let Ok(droplet) = droplets.get(lost.entity) {
        ledger.water_out += droplet.counted;
    }
}

/// Strands that somebody despawns while wet, likewise.
fn count_lost_moisture(
    lost: On<Discard, Moisture>,
    strands: Query<&Moisture>,
    mut ledger: ResMut<WaterLedger>,
) {
    if let Ok(moisture) = strands.get(lost.entity) {
        ledger.water_out += moisture.volume();
    }
}

/// At the end of a tick: what there is, summed in the order of the entities.
fn close_books(
    step: Res<HairStep>,
    droplets: Query<&Droplet>,
    strands: Query<&Moisture>,
    mut ledger: ResMut<WaterLedger>,
) {
    if step.index + 1 == step.count && ledger.water_in > 0.0 {
        ledger.held = droplets.iter().map(|d| d.counted).sum::<f64>()
            + strands.iter().map(Moisture::volume).sum::<f64>();
    }
}

//! Registers what settles hair.

use super::{
    SettleSettings, Settling,
    elsewhere::{Elsewhere, settle_elsewhere},
    systems::settle,
};
use crate::{
    base::schedule::{HairFrame, HairTicked, lacks},
    hair::{strand::lacks_strands, worn},
    keratin::bond::BondPlugin,
};
use bevy::prelude::*;

/// Hair settles before it is drawn.
#[derive(Clone, Copy, Debug, Default)]
pub struct SettlePlugin;

impl Plugin for SettlePlugin {
    fn build(&self, app: &mut App) {
        if lacks_strands::<Self>(app) {
            return;
        }
        lacks::<BondPlugin, Self>(app);
        worn::setting::<SettleSettings>(app);
        app.add_systems(HairTicked, settle.run_if(any_with_component::<Settling>)).add_systems(
            HairFrame,
            settle_elsewhere
                .run_if(any_with_component::<Settling>.or_else(any_with_component::<Elsewhere>)),
        );
    }
}

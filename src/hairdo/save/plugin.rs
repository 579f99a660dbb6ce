//! The plugin.

use super::{Hairdo, HairdoError, StyledStrand, events};
use crate::{base::schedule::lacks, hair::strand::lacks_strands, keratin::bond::BondPlugin};
use bevy::prelude::*;

/// Registers hairdos for reflection, and serves requests for them.
#[derive(Clone, Copy, Debug, Default)]
pub struct SavePlugin;

impl Plugin for SavePlugin {
    fn build(&self, app: &mut App) {
        if lacks_strands::<Self>(app) {
            return;
        }
        lacks::<BondPlugin, Self>(app);
        app.register_type::<Hairdo>()
            .register_type::<StyledStrand>()
            .register_type::<HairdoError>()
            .register_type::<events::CaptureHairdo>()
            .register_type::<events::HairdoCaptured>()
            .register_type::<events::ApplyHairdo>()
            .register_type::<events::HairdoApplied>()
            .register_type::<events::HairdoRejected>()
            .add_observer(events::take)
            .add_observer(events::apply);
        #[cfg(feature = "gpu")]
        app.add_observer(events::answer_arrived);
    }
}

//! The plugin group.

use crate::{
    bond::BondPlugin,
    contact::ContactPlugin,
    environment::EnvironmentPlugin,
    lod::LodPlugin,
    schedule::TickPlugin,
    sleep::SleepPlugin,
    solve::{RodPlugin, SpringPlugin},
    strand::StrandPlugin,
    treatment::TreatmentPlugin,
    water::WaterPlugin,
};
use bevy::{
    app::PluginGroupBuilder,
    ecs::schedule::{InternedScheduleLabel, ScheduleLabel},
    prelude::*,
};

/// Everything that makes hair move, and with the feature `render` be seen.
///
/// ```
/// use bevy::prelude::*;
/// use bevy_keratin::prelude::*;
///
/// App::new().add_plugins((MinimalPlugins, HairPlugins::default()));
/// // in the schedule of your choice:
/// App::new().add_plugins((MinimalPlugins, HairPlugins::new(FixedUpdate)));
/// ```
#[derive(Clone, Debug)]
pub struct HairPlugins {
    schedule: InternedScheduleLabel,
}

impl HairPlugins {
    /// Hair that ticks in `schedule`, with the time that passes there.
    pub fn new(schedule: impl ScheduleLabel) -> Self {
        Self { schedule: schedule.intern() }
    }
}

impl Default for HairPlugins {
    /// Ticks in [`FixedPostUpdate`].
    fn default() -> Self {
        Self::new(FixedPostUpdate)
    }
}

impl PluginGroup for HairPlugins {
    fn build(self) -> PluginGroupBuilder {
        let group = PluginGroupBuilder::start::<Self>()
            .add(TickPlugin::new(self.schedule))
            .add(StrandPlugin)
            .add(BondPlugin)
            .add(EnvironmentPlugin)
            .add(ContactPlugin)
            .add(TreatmentPlugin)
            .add(WaterPlugin)
            .add(RodPlugin)
            .add(SpringPlugin)
            .add(SleepPlugin)
            .add(LodPlugin);
        #[cfg(feature = "render")]
        let group = group.add(crate::render::HairRenderPlugin::for_schedule(self.schedule));
        #[cfg(feature = "save")]
        let group = group.add(crate::save::SavePlugin);
        #[cfg(feature = "groom")]
        let group = group
            .add(crate::groom::GroomPlugin)
            .add(crate::plant::PlantPlugin)
            .add(crate::collider_fit::ColliderFitPlugin)
            .add(crate::attach::AttachPlugin)
            .add(crate::wear::WearPlugin);
        group
    }
}

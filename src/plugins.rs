//! The plugin group.

use crate::{
    base::schedule::TickPlugin,
    forces::{contact::ContactPlugin, environment::EnvironmentPlugin},
    hair::{look::LookPlugin, strand::StrandPlugin},
    hairdo::style::StylePlugin,
    keratin::{bond::BondPlugin, treatment::TreatmentPlugin},
    simulation::{
        lod::LodPlugin,
        settle::SettlePlugin,
        sleep::SleepPlugin,
        solve::{RodPlugin, SpringPlugin},
    },
    water::WaterPlugin,
};
use bevy::{
    app::PluginGroupBuilder,
    ecs::schedule::{InternedScheduleLabel, ScheduleLabel},
    prelude::*,
    time::TimeUpdateStrategy,
};

/// All plugins that simulate hair and, with the feature `render`, draw it.
///
/// ```
/// use bevy::prelude::*;
/// use bevy_keratin::prelude::*;
///
/// App::new().add_plugins((MinimalPlugins, HairPlugins::default()));
/// // at once in a schedule of your choice, for instance that of a rollback:
/// App::new().add_plugins((MinimalPlugins, HairPlugins::new(FixedUpdate)));
/// ```
#[derive(Clone, Debug, Default)]
pub struct HairPlugins {
    schedule: Option<InternedScheduleLabel>,
}

impl HairPlugins {
    /// Hair that ticks at once in `schedule`, with the time that passes there; see
    /// [`TickPlugin::new`](crate::base::schedule::TickPlugin::new). By default the fixed ticks of a frame
    /// run when its animations are done.
    pub fn new(schedule: impl ScheduleLabel) -> Self {
        Self { schedule: Some(schedule.intern()) }
    }
}

/// Advances an app by `ticks` fixed ticks, one per frame, whatever the clock says: for a game's
/// tests.
///
/// ```
/// use bevy::prelude::*;
/// use bevy_keratin::{prelude::*, run_ticks};
///
/// let mut app = App::new();
/// app.add_plugins((MinimalPlugins, HairPlugins::default()));
/// let hair = app.world_mut().spawn(Hair).id();
/// let hanging = Strand::from_polyline(&[Vec3::ZERO, Vec3::X * 0.05, Vec3::X * 0.1]).unwrap();
/// let strand = app.world_mut().spawn((StrandOf(hair), hanging)).id();
/// run_ticks(&mut app, 30);
/// assert!(app.world().get::<Strand>(strand).unwrap().positions()[2].y < 0.0, "it falls");
/// ```
pub fn run_ticks(app: &mut App, ticks: u32) {
    let clock = app.world_mut().remove_resource::<TimeUpdateStrategy>();
    app.insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
    (0..ticks).for_each(|_| app.update());
    app.insert_resource(clock.unwrap_or_default());
}

impl PluginGroup for HairPlugins {
    fn build(self) -> PluginGroupBuilder {
        let group = PluginGroupBuilder::start::<Self>()
            .add(self.schedule.map_or_else(TickPlugin::default, TickPlugin::new))
            .add(StrandPlugin)
            .add(BondPlugin)
            .add(EnvironmentPlugin)
            .add(ContactPlugin)
            .add(TreatmentPlugin)
            .add(WaterPlugin)
            .add(RodPlugin)
            .add(SpringPlugin)
            .add(SettlePlugin)
            .add(SleepPlugin)
            .add(LodPlugin)
            .add(StylePlugin)
            .add(LookPlugin);
        #[cfg(feature = "render")]
        let group = group.add(crate::render::HairRenderPlugin {
            interpolate: self.schedule.is_none_or(crate::base::schedule::is_fixed),
        });
        #[cfg(feature = "gpu")]
        let group = group.add(crate::gpu::HairGpuPlugin);
        #[cfg(feature = "save")]
        let group = group.add(crate::hairdo::save::SavePlugin);
        #[cfg(feature = "groom")]
        let group = group
            .add(crate::authoring::groom::GroomPlugin)
            .add(crate::authoring::plant::PlantPlugin)
            .add(crate::authoring::collider_fit::ColliderFitPlugin)
            .add(crate::authoring::attach::AttachPlugin)
            .add(crate::authoring::wear::WearPlugin);
        group
    }
}

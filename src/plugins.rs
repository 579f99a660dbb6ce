//! The plugin group.

use crate::{
    base::schedule::TickPlugin,
    forces::{contact::ContactPlugin, environment::EnvironmentPlugin},
    hair::{look::LookPlugin, strand::StrandPlugin},
    hairdo::{cut::CutPlugin, rollback::RollbackPlugin, style::StylePlugin, tie::TiePlugin},
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
/// | plugin | what it does | needs |
/// |---|---|---|
/// | [`TickPlugin`] | the clock and the order of systems in a tick | |
/// | [`StrandPlugin`] | hair and strands as entities, their frames, who moves them | `TickPlugin` |
/// | [`BondPlugin`] | rest shapes from bonds, bonds that break and re-form | strands |
/// | [`EnvironmentPlugin`] | gravity, wind, wind zones, blowers, drag, climate | strands |
/// | [`ContactPlugin`] | colliders and contact between strands | strands |
/// | [`TreatmentPlugin`] | treatments and perm rods | strands, `BondPlugin` |
/// | [`WaterPlugin`] | droplets, showers, water volumes, wetting and drying | strands; `BondPlugin` to wet hair |
/// | [`RodPlugin`] | steps Cosserat rods | strands, `BondPlugin` |
/// | [`SpringPlugin`] | steps mass-spring strands | strands, `BondPlugin` |
/// | [`SettlePlugin`] | settles new hair before it is drawn | strands, `BondPlugin` |
/// | [`SleepPlugin`] | puts strands at rest to sleep and wakes them | strands, `BondPlugin` |
/// | [`LodPlugin`] | levels of detail, guides and followers, the budget | strands |
/// | [`StylePlugin`] | measures how much of a style is left | strands, `BondPlugin` |
/// | [`TiePlugin`] | hair ties | strands |
/// | [`CutPlugin`] | cuts hair | strands |
/// | [`RollbackPlugin`] | registers snapshots for rollback | |
/// | [`LookPlugin`] | registers colour, width and dye | |
/// | [`ReportPlugin`](crate::debug::ReportPlugin) | fills `HairReport`s where there are any | strands |
/// | `HairRenderPlugin` | draws hair and droplets | feature `render`, strands, Bevy's renderer |
/// | `HairGpuPlugin` | simulates hair by compute shaders | feature `gpu`, strands, `BondPlugin`, Bevy's renderer |
/// | `SavePlugin` | captures and applies hairdos | feature `save`, strands, `BondPlugin` |
/// | `GroomPlugin` | loads grooms and grows them | feature `groom`, Bevy's `AssetPlugin` |
/// | `PlantPlugin` | registers the settings of planting | feature `groom` |
/// | `RecipePlugin` | loads recipes, and puts their settings on hair | feature `groom`, Bevy's `AssetPlugin` |
/// | `ColliderFitPlugin` | registers the results of fitting colliders | feature `groom` |
/// | `AttachPlugin` | roots follow meshes and bones | feature `groom`, strands |
/// | `WearPlugin` | hair on characters with `WearHair` | feature `groom`, strands |
///
/// Strands are those of `StrandPlugin`. Without a plugin of this table that they need, plugins do nothing: that is
/// logged once.
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
/// use bevy_keratin::prelude::*;
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
            .add(TiePlugin)
            .add(CutPlugin)
            .add(RollbackPlugin)
            .add(LookPlugin)
            .add(crate::debug::ReportPlugin);
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
            .add(crate::authoring::recipe::RecipePlugin)
            .add(crate::authoring::collider_fit::ColliderFitPlugin)
            .add(crate::authoring::attach::AttachPlugin)
            .add(crate::authoring::wear::WearPlugin);
        group
    }
}

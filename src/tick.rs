//! The tick: figure 1 of \[B\], read from top to bottom. The one place that knows the order.
//!
//! Each fixed tick runs the schedule [`HairTick`] once per substep, with the sets of
//! [`HairSystems`] one after the other. It runs on a single thread and treats ambiguities as errors;
//! systems go wide inside, over strands.

use bevy::{
    app::PluginGroupBuilder,
    ecs::schedule::{
        InternedScheduleLabel, LogLevel, ScheduleBuildSettings, ScheduleLabel,
        SingleThreadedExecutor,
    },
    prelude::*,
};

use crate::{
    air::AirPlugin,
    bond::BondPlugin,
    contact::ContactPlugin,
    fault::{Fault, HairFault},
    lod::LodPlugin,
    rod::RodPlugin,
    setting::{Bound, InvalidValue},
    sleep::SleepPlugin,
    spring::SpringPlugin,
    strand::StrandPlugin,
    style::StylePlugin,
    water::WaterPlugin,
};

/// The schedule of one substep. Add systems to it in one of [`HairSystems`], `First` and `Last` best.
#[derive(ScheduleLabel, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct HairTick;

/// The parts of a substep, in the order they run.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum HairSystems {
    /// Empty, for users.
    First,
    /// Where the scalp is now: frames move, strands fall asleep and wake, free nodes stay behind by
    /// inertia, new strands get their bonds.
    Roots,
    /// Gravity, wind (equation 17) and drag change velocities; water soaks, flows and dries; drying
    /// (19), water, treatments and whoever else ask for changes of bond rates.
    ExternalForces,
    /// Strands push each other apart (equation 18); droplets move, land and pull (\[W\] 2); colliders
    /// and held nodes are gathered.
    Interaction,
    /// Stiffness from the cuticle (13, 14), rest shapes from the bonds (15).
    RestShape,
    /// Predict, project stretch–shear, bend–twist and contacts (1–12), limit lengths, velocities.
    Projection,
    /// Bonds that re-formed remember the present shape; rates move (16).
    BondUpdate,
    /// Empty, for users.
    Last,
}

impl HairSystems {
    /// All sets in their order.
    pub const ALL: [Self; 8] = [
        Self::First,
        Self::Roots,
        Self::ExternalForces,
        Self::Interaction,
        Self::RestShape,
        Self::Projection,
        Self::BondUpdate,
        Self::Last,
    ];
}

/// Into how many substeps a tick is divided.
#[derive(Resource, Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Resource, Default, Clone, PartialEq)]
pub enum HairSubsteps {
    /// As many as bring the substep to the paper's 1/360 s or just below, whatever the app's rate:
    /// 6 at 60 Hz, 3 at 120 Hz.
    #[default]
    Auto,
    /// This many; 0 counts as 1.
    Fixed(u32),
}

impl HairSubsteps {
    /// A fixed number of substeps.
    ///
    /// # Errors
    /// When it is 0 or more than 1000.
    pub fn fixed(count: u32) -> Result<Self, InvalidValue> {
        SUBSTEPS.check(count as f32)?;
        Ok(Self::Fixed(count))
    }

    /// The number of substeps for a tick of `seconds`.
    pub fn count(&self, seconds: f32) -> u32 {
        match *self {
            // Clocks count nanoseconds: 1/60 s is not quite six times 1/360 s.
            Self::Auto => ((seconds * 360.0 - 1e-3).ceil() as u32).clamp(1, 1000),
            Self::Fixed(n) => n.clamp(1, 1000),
        }
    }
}

const SUBSTEPS: Bound = Bound::new("HairSubsteps", 1.0, 1000.0, "6 suit a tick of 1/60 s");

fn report_substeps(substeps: Res<HairSubsteps>, mut faults: MessageWriter<HairFault>) {
    if let HairSubsteps::Fixed(count) = *substeps
        && let Err(wrong) = SUBSTEPS.check(count as f32)
    {
        let entity = Entity::PLACEHOLDER;
        faults.write(HairFault { entity, fault: Fault::Setting(wrong) });
    }
}

/// The substep that is running.
#[derive(Resource, Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Resource, Default, Clone, PartialEq)]
pub struct HairStep {
    /// Its length (s).
    pub dt: f32,
    /// Its number within the tick, from 0.
    pub index: u32,
    /// How many the tick has.
    pub count: u32,
}

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
            .add(TickPlugin { schedule: self.schedule })
            .add(StrandPlugin)
            .add(BondPlugin)
            .add(AirPlugin)
            .add(ContactPlugin)
            .add(StylePlugin)
            .add(WaterPlugin)
            .add(RodPlugin)
            .add(SpringPlugin)
            .add(SleepPlugin)
            .add(LodPlugin);
        #[cfg(feature = "render")]
        let group = group.add(crate::render::HairRenderPlugin::for_schedule(self.schedule));
        #[cfg(feature = "groom")]
        let group = group.add(crate::groom::GroomPlugin);
        group
    }
}

/// Runs [`HairTick`] in the chosen schedule.
#[derive(Debug)]
pub struct TickPlugin {
    schedule: InternedScheduleLabel,
}

impl Plugin for TickPlugin {
    fn build(&self, app: &mut App) {
        crate::fault::plugin(app);
        app.init_resource::<HairSubsteps>()
            .init_resource::<HairStep>()
            .register_type::<HairSubsteps>()
            .register_type::<HairStep>()
            .edit_schedule(HairTick, |schedule| {
                use HairSystems::*;
                schedule
                    .set_executor(SingleThreadedExecutor::new())
                    .set_build_settings(ScheduleBuildSettings {
                        ambiguity_detection: LogLevel::Error,
                        ..default()
                    })
                    .configure_sets(
                        (
                            First,
                            Roots,
                            ExternalForces,
                            Interaction,
                            RestShape,
                            Projection,
                            BondUpdate,
                            Last,
                        )
                            .chain(),
                    );
            })
            .add_systems(PreUpdate, report_substeps.run_if(resource_changed::<HairSubsteps>))
            .add_systems(self.schedule, {
                let tick = run_hair_tick.into_configs();
                // Where both are in one schedule, hair sees where bodies have come to.
                #[cfg(feature = "avian")]
                let tick = tick.after(avian3d::prelude::PhysicsSystems::Writeback);
                tick
            });
    }
}

/// One tick: as many substeps as [`HairSubsteps`] asks for. No time, no tick.
fn run_hair_tick(world: &mut World) {
    let seconds = world.resource::<Time>().delta_secs();
    if seconds <= 0.0 {
        return;
    }
    let count = world.resource::<HairSubsteps>().count(seconds);
    let dt = seconds / count as f32;
    for index in 0..count {
        *world.resource_mut::<HairStep>() = HairStep { dt, index, count };
        world.run_schedule(HairTick);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn auto_substeps_come_near_the_papers_step() {
        for (rate, count) in [(60.0, 6), (120.0, 3), (240.0, 2), (30.0, 12), (64.0, 6), (360.0, 1)]
        {
            assert_eq!(HairSubsteps::Auto.count(1.0 / rate), count, "{rate} Hz");
        }
        assert_eq!(HairSubsteps::Fixed(0).count(0.1), 1);
        assert!(HairSubsteps::fixed(0).is_err());
    }
}

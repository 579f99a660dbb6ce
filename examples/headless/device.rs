//! `--gpu`: the same scene on the GPU, without a window.

use bevy::{
    app::{TaskPoolOptions, TaskPoolPlugin},
    prelude::*,
    render::{
        RenderPlugin, pipelined_rendering::PipelinedRenderingPlugin, renderer::RenderAdapterInfo,
    },
    window::ExitCondition,
    winit::WinitPlugin,
};
use bevy_keratin::{
    HairStep, WindReceived,
    gpu::{HairResidence, fetch_strands},
    prelude::*,
    render::HairRenderPlugin,
};

/// Which ticks were on the device.
#[derive(Resource, Debug, Default)]
pub struct Ticks {
    /// How many.
    pub on_gpu: u64,
    /// Why the first after hand-over that was not.
    away: Option<HairResidence>,
    last: HairResidence,
}

/// Bevy with a render device and neither window nor pictures, and hair that goes there.
pub fn plugins(app: &mut App, pools: TaskPoolOptions) {
    let exit_condition = ExitCondition::DontExit;
    let bevy = DefaultPlugins
        .set(TaskPoolPlugin { task_pool_options: pools })
        .set(WindowPlugin { primary_window: None, exit_condition, ..default() })
        .set(RenderPlugin { synchronous_pipeline_compilation: true, ..default() })
        .set(bevy::log::LogPlugin { filter: "error".into(), ..default() })
        .disable::<WinitPlugin>()
        .disable::<PipelinedRenderingPlugin>();
    app.add_plugins((bevy, HairPlugins::default().build().disable::<HairRenderPlugin>()))
        .insert_resource(HairGpu { software: true, blocking: true, checkpoint: 0.0, ..default() })
        .insert_resource(HairDefault(SimulateOn::Gpu))
        .init_resource::<Ticks>()
        .add_systems(PostStartup, leave_uncounted)
        .add_systems(FixedPreUpdate, fetch)
        .add_systems(HairTick, count.in_set(HairSystems::Last));
}

/// Counting the wind that strands receive is not supported there.
fn leave_uncounted(mut commands: Commands, strands: Query<Entity, With<WindReceived>>) {
    strands.iter().for_each(|strand| _ = commands.entity(strand).remove::<WindReceived>());
}

/// What the scene measures, it measures on strands.
pub fn fetch(world: &mut World) {
    let mut hairs = world.query_filtered::<Entity, With<Hair>>();
    let hairs: Vec<Entity> = hairs.iter(world).collect();
    hairs.into_iter().for_each(|hair| _ = fetch_strands(world, hair));
}

fn count(step: Res<HairStep>, hair: Single<&HairResidence, With<Hair>>, mut ticks: ResMut<Ticks>) {
    if step.index > 0 {
        return;
    }
    ticks.last = **hair;
    match **hair {
        HairResidence::Gpu => ticks.on_gpu += 1,
        elsewhere if ticks.on_gpu > 0 => _ = ticks.away.get_or_insert(elsewhere),
        _ => {}
    }
}

impl Ticks {
    /// Whether all ticks after hand-over were on the device, and if not why.
    pub fn check(&self) -> Result<(), String> {
        let why = |residence| match residence {
            HairResidence::Cpu(why) | HairResidence::Returning(why) => why.to_string(),
            HairResidence::Gpu => "nothing".into(),
        };
        match self.away {
            None if self.on_gpu > 0 => Ok(()),
            None => Err(format!("--gpu: the hair never left the CPU: {}", why(self.last))),
            Some(away) => Err(format!(
                "--gpu: after {} ticks on the device the hair returned to the CPU: {}",
                self.on_gpu,
                why(away)
            )),
        }
    }
}

/// The device's name and kind.
pub fn adapter(world: &World) -> Option<String> {
    let info = world.get_resource::<RenderAdapterInfo>()?;
    Some(format!("{} ({:?}, {:?})", info.name, info.device_type, info.backend))
}

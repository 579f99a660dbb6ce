//! What draws: in a window or without one.

use bevy::{
    app::PluginGroupBuilder,
    log::LogPlugin,
    prelude::*,
    render::{
        RenderPlugin,
        pipelined_rendering::PipelinedRenderingPlugin,
        settings::{Backends, WgpuSettings},
    },
    window::{ExitCondition, WindowResolution},
    winit::WinitPlugin,
};
use bevy_keratin::{prelude::*, render::HairRenderPlugin};

/// An app with hair that is drawn into a window; without a window where `offscreen`.
pub fn app(title: &str, size: (u32, u32), offscreen: bool, assets: AssetPlugin) -> App {
    let mut app = App::new();
    if offscreen {
        // A picture shows its own frame, not one between two.
        let hair = HairPlugins::default().set(HairRenderPlugin { interpolate: false });
        app.add_plugins((windowless().set(assets), hair));
    } else {
        let resolution = WindowResolution::new(size.0, size.1);
        let window = Window { title: title.into(), resolution, ..default() };
        let window = WindowPlugin { primary_window: Some(window), ..default() };
        let plugins = DefaultPlugins.set(window).set(renderer()).set(log()).set(assets);
        app.add_plugins((plugins, HairPlugins::default()));
    }
    app
}

/// Hair is drawn by storage buffers in the vertex stage, which GL lacks.
fn renderer() -> RenderPlugin {
    let mut settings = WgpuSettings::default();
    if std::env::var_os("WGPU_BACKEND").is_none() {
        settings.backends = Some(Backends::PRIMARY);
    }
    RenderPlugin {
        render_creation: settings.into(),
        synchronous_pipeline_compilation: true,
        ..default()
    }
}

/// Software rendering, bare displays and missing drivers are all right or reported in other words.
const QUIET: &str = "warn,bevy_log=off,bevy_render::renderer=error,bevy_light=error,bevy_egui=error,\
     wgpu=error,wgpu_hal=off,winit=error";

fn log() -> LogPlugin {
    LogPlugin { filter: QUIET.into(), ..default() }
}

/// Bevy's plugins for drawing without a window.
fn windowless() -> PluginGroupBuilder {
    let window =
        WindowPlugin { primary_window: None, exit_condition: ExitCondition::DontExit, ..default() };
    let plugins = DefaultPlugins.set(window).set(renderer()).set(log());
    plugins.disable::<WinitPlugin>().disable::<PipelinedRenderingPlugin>()
}

/// Width and height from the command line.
pub fn size(text: &str) -> Result<(u32, u32), String> {
    let sides = text.split_once('x').and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    let valid = |side: u32| (16..=8192).contains(&side);
    sides
        .filter(|&(w, h)| valid(w) && valid(h))
        .ok_or_else(|| "expected WIDTHxHEIGHT of 16 to 8192 each, such as 1280x720".into())
}

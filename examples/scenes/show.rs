//! Shows an example in a window, or by `--offscreen DIR` in pictures without one.

#[path = "../salon/failure.rs"]
mod failure;
#[path = "../salon/picture.rs"]
mod picture;
#[path = "../salon/renderer.rs"]
mod renderer;

use bevy::{
    asset::AssetPlugin,
    camera::{
        primitives::Aabb,
        visibility::{DynamicSkinnedMeshBounds, NoFrustumCulling, VisibilityClass},
    },
    core_pipeline::prepass::DepthPrepass,
    gltf::{GltfMaterialName, GltfMeshName, GltfSceneName},
    input::{
        ButtonState,
        keyboard::{Key, KeyboardInput},
    },
    light::{CascadeShadowConfigBuilder, DirectionalLightShadowMap},
    mesh::skinning::SkinnedMesh,
    prelude::*,
    time::TimeUpdateStrategy,
    transform::components::TransformTreeChanged,
};
use bevy_keratin::prelude::*;
use clap::Parser;
use std::{error::Error, path::PathBuf, process::ExitCode};

/// Keys that are pressed one after the other, and the name of the picture that is drawn once the hair
/// they make the character wear has settled.
pub type Step<'a> = (&'a [KeyCode], &'a str);

/// How long hair settles before a picture (s), and how long it may take until it is worn (ticks).
const SETTLING: f32 = 1.5;
const PATIENCE: u32 = 6000;

#[derive(Parser)]
#[command(version)]
struct Arguments {
    /// Draws no window, but PNGs into this folder.
    #[arg(long, value_name = "DIR")]
    offscreen: Option<PathBuf>,
    /// Width and height of pictures or window (pixels).
    #[arg(long, default_value = "800x800", value_name = "WxH", value_parser = renderer::size)]
    size: (u32, u32),
}

/// Runs what `build` adds to an app with light and a camera before a head at 1.6 m.
pub fn run(title: &str, script: &[Step], build: impl FnOnce(&mut App)) -> ExitCode {
    let arguments = Arguments::parse();
    failure::explain_known();
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/assets").into();
    let assets = AssetPlugin { file_path: folder, ..default() };
    let mut app = renderer::app(title, arguments.size, arguments.offscreen.is_some(), assets);
    app.insert_resource(Time::<Fixed>::from_hz(60.0))
        .insert_resource(ClearColor(Color::srgb(0.2, 0.21, 0.23)))
        .insert_resource(DirectionalLightShadowMap { size: 4096 })
        .insert_resource(GlobalAmbientLight { brightness: 320.0, ..default() })
        .add_systems(Startup, light);
    register(&mut app);
    build(&mut app);
    let shown = match &arguments.offscreen {
        Some(folder) => pictures(&mut app, script, folder, arguments.size),
        None => {
            app.add_systems(Startup, |mut commands: Commands| {
                commands.spawn(camera());
            });
            match app.run() {
                AppExit::Success => Ok(()),
                AppExit::Error(code) => Err(format!("it ended with code {code}").into()),
            }
        }
    };
    match shown {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// What glTF scenes are made of. Apps with Bevy's default features have it from
/// `reflect_auto_register`.
fn register(app: &mut App) {
    app.register_type::<Transform>()
        .register_type::<GlobalTransform>()
        .register_type::<TransformTreeChanged>()
        .register_type::<Visibility>()
        .register_type::<InheritedVisibility>()
        .register_type::<ViewVisibility>()
        .register_type::<VisibilityClass>()
        .register_type::<DynamicSkinnedMeshBounds>()
        .register_type::<NoFrustumCulling>()
        .register_type::<Aabb>()
        .register_type::<Name>()
        .register_type::<Children>()
        .register_type::<ChildOf>()
        .register_type::<Mesh3d>()
        .register_type::<MeshMaterial3d<StandardMaterial>>()
        .register_type::<SkinnedMesh>()
        .register_type::<GltfSceneName>()
        .register_type::<GltfMaterialName>()
        .register_type::<GltfMeshName>();
}

/// Whether everybody wears the hair that they are to wear.
fn is_worn(world: &mut World) -> bool {
    let mut worn = world.query::<(&WornHair, Option<&WornPreset>)>();
    let mut wearers = world.query::<(Entity, &WearHair)>();
    wearers.iter(world).all(|(wearer, wear)| {
        worn.iter(world).any(|(worn, preset)| {
            let is_as_long = preset.is_none_or(|preset| preset.length == wear.length);
            worn.wearer == wearer && worn.hair == wear.hair && is_as_long
        })
    })
}

fn camera() -> impl Bundle {
    let place = Transform::from_xyz(0.4, 1.62, 0.9).looking_at(Vec3::Y * 1.52, Vec3::Y);
    (Camera3d::default(), Msaa::Sample4, DepthPrepass, place)
}

fn light(mut commands: Commands) {
    let light = |at: Vec3, lux: f32, color: Color, shadow_maps_enabled: bool| {
        let light = DirectionalLight {
            illuminance: lux,
            color,
            shadow_maps_enabled,
            shadow_normal_bias: 0.8,
            ..default()
        };
        let cascades =
            CascadeShadowConfigBuilder { num_cascades: 1, maximum_distance: 4.0, ..default() };
        let place = Transform::from_translation(at).looking_at(Vec3::ZERO, Vec3::Y);
        (light, cascades.build(), place)
    };
    commands.spawn(light(Vec3::new(1.0, 1.6, 1.2), 8000.0, Color::srgb(1.0, 0.95, 0.88), true));
    commands.spawn(light(Vec3::new(-1.5, 0.5, 0.9), 2500.0, Color::srgb(0.8, 0.88, 1.0), false));
    commands.spawn(light(Vec3::new(-0.7, 1.0, -1.5), 4000.0, Color::WHITE, false));
}

fn pictures(
    app: &mut App,
    script: &[Step],
    folder: &std::path::Path,
    size: (u32, u32),
) -> Result<(), Box<dyn Error>> {
    picture::folder(folder)?;
    let pictures = picture::Pictures::new(app, size, 1, camera());
    for (keys, name) in script {
        app.insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
        for key in *keys {
            press(app, *key, ButtonState::Pressed);
            app.update();
            press(app, *key, ButtonState::Released);
            app.update();
        }
        let mut ticks = 0;
        app.update();
        while !is_worn(app.world_mut()) {
            app.update();
            ticks += 1;
            if ticks == PATIENCE {
                return Err(format!("{name}: no hair was worn").into());
            }
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
        (0..(60.0 * SETTLING) as u32).for_each(|_| app.update());
        app.insert_resource(TimeUpdateStrategy::FixedTimesteps(0));
        let path = folder.join(format!("{name}.png"));
        pictures.take(app, &path)?;
        println!("{}", path.display());
    }
    Ok(())
}

fn press(app: &mut App, key_code: KeyCode, state: ButtonState) {
    app.world_mut().write_message(KeyboardInput {
        key_code,
        logical_key: Key::Dead(None),
        state,
        text: None,
        repeat: false,
        window: Entity::PLACEHOLDER,
    });
}

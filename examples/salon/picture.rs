//! Pictures of an app that has no window.

use bevy::{
    camera::RenderTarget,
    prelude::*,
    render::{
        render_resource::{TextureFormat, TextureUsages},
        view::screenshot::{Screenshot, ScreenshotCaptured},
    },
    time::TimeUpdateStrategy,
};
use core::fmt::Display;
use std::{io, path::Path};

/// The picture that came back.
#[derive(Resource, Default)]
struct Captured(Option<Image>);

/// How often the app may update until a picture comes back.
const PATIENCE: u32 = 100;
/// Drawn updates until meshes, textures and pipelines are on the device.
const WARM_UP: u32 = 2;

/// A camera that draws into an image when asked to.
pub struct Pictures {
    camera: Entity,
    target: Handle<Image>,
}

impl Pictures {
    /// Finishes the app's plugins and gets everything onto the device, without a tick.
    pub fn new(app: &mut App, (width, height): (u32, u32), camera: impl Bundle) -> Self {
        let mut image =
            Image::new_target_texture(width, height, TextureFormat::Rgba8UnormSrgb, None);
        image.texture_descriptor.usage |= TextureUsages::COPY_SRC;
        let target = app.world_mut().resource_mut::<Assets<Image>>().add(image);
        let camera =
            app.world_mut().spawn((camera, RenderTarget::Image(target.clone().into()))).id();
        app.init_resource::<Captured>().insert_resource(TimeUpdateStrategy::FixedTimesteps(0));
        app.finish();
        app.cleanup();
        for _ in 0..WARM_UP {
            app.update();
        }
        // Nothing is drawn on the way: only the ticks count.
        activate(app, camera, false);
        Self { camera, target }
    }

    /// Draws the world as it is now into a PNG.
    pub fn take(&self, app: &mut App, path: &Path) -> io::Result<()> {
        save(self.draw(app)?, path)
    }

    /// Draws the world as it is now.
    pub fn draw(&self, app: &mut App) -> io::Result<Image> {
        activate(app, self.camera, true);
        app.world_mut().spawn(Screenshot::image(self.target.clone())).observe(
            |shot: On<ScreenshotCaptured>, mut captured: ResMut<Captured>| {
                captured.0 = Some(shot.image.clone());
            },
        );
        for _ in 0..PATIENCE {
            app.update();
            // Once is enough; the rest is waiting.
            activate(app, self.camera, false);
            if let Some(image) = app.world_mut().resource_mut::<Captured>().0.take() {
                return Ok(image);
            }
        }
        Err(io::Error::other("the graphics device gave no picture back"))
    }
}

/// Makes the folder that pictures go into.
pub fn folder(path: &Path) -> io::Result<()> {
    std::fs::create_dir_all(path).map_err(|error| unwritable(path, error))
}

/// Writes a PNG, whole or not at all: whoever looks at the folder meanwhile finds no half of one.
pub fn save(picture: Image, path: &Path) -> io::Result<()> {
    let picture = picture.try_into_dynamic().map_err(io::Error::other)?.into_rgb8();
    let unfinished = path.with_extension("part.png");
    picture.save(&unfinished).map_err(|error| unwritable(path, error))?;
    std::fs::rename(unfinished, path).map_err(|error| unwritable(path, error))
}

/// Says which path it was: the system's errors do not.
fn unwritable(path: &Path, error: impl Display) -> io::Error {
    let path = path.display();
    io::Error::other(format!("{path} cannot be written: {error}; name a folder that can be"))
}

fn activate(app: &mut App, camera: Entity, active: bool) {
    if let Some(mut camera) = app.world_mut().get_mut::<Camera>(camera) {
        camera.is_active = active;
    }
}

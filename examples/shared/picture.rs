//! Pictures of an app that has no window.

use bevy::{
    asset::RenderAssetUsages,
    camera::RenderTarget,
    prelude::*,
    render::{
        render_resource::{Extent3d, TextureDimension, TextureFormat, TextureUsages},
        view::screenshot::{Screenshot, ScreenshotCaptured},
    },
    time::TimeUpdateStrategy,
};
use core::fmt::Display;
use std::{
    io,
    path::Path,
    time::{Duration, Instant},
};

/// The picture that came back.
#[derive(Resource, Default)]
struct Captured(Option<Image>);

/// How long a picture may take: a software device draws it slowly, a graphics card answers late.
const PATIENCE: Duration = Duration::from_secs(120);
/// Drawn updates until meshes, textures and pipelines are on the device.
const WARM_UP: u32 = 2;

/// The largest side that every graphics device draws (pixels).
const LARGEST: u32 = 8192;

/// A camera that draws into an image when asked to.
pub struct Pictures {
    camera: Entity,
    target: Handle<Image>,
    /// How many pixels along and across are averaged into one.
    times: u32,
}

impl Pictures {
    /// Finishes the app's plugins and gets everything onto the device, without a tick. Pictures are
    /// drawn `times` larger and averaged in linear light: 3 is what a still deserves.
    pub fn new(
        app: &mut App,
        (width, height): (u32, u32),
        times: u32,
        camera: impl Bundle,
    ) -> Self {
        let times = times.min(LARGEST / width.max(height)).max(1);
        let (width, height) = (times * width, times * height);
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
        Self { camera, target, times }
    }

    /// Draws the world as it is now into a PNG.
    #[allow(dead_code, reason = "presets and gallery put pictures together")]
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
        let start = Instant::now();
        while start.elapsed() < PATIENCE {
            app.update();
            // Once is enough; the rest is waiting.
            activate(app, self.camera, false);
            if let Some(image) = app.world_mut().resource_mut::<Captured>().0.take() {
                return Ok(averaged(&image, self.times));
            }
        }
        Err(io::Error::other("the graphics device gave no picture back"))
    }
}

/// The picture with `times` by `times` pixels averaged into one, in linear light.
fn averaged(picture: &Image, times: u32) -> Image {
    let (width, height) = (picture.width() / times, picture.height() / times);
    let bytes = picture.data.as_deref().unwrap_or_default();
    let light: [f32; 256] = core::array::from_fn(|i| Color::srgb_u8(i as u8, 0, 0).to_linear().red);
    let mean = |x: u32, y: u32, channel: u32| {
        let near = (0..times * times).map(|i| (times * x + i % times, times * y + i / times));
        let places = near.map(|(x, y)| (4 * (y * times * width + x) + channel) as usize);
        places.map(|i| light[usize::from(bytes.get(i).copied().unwrap_or(0))]).sum::<f32>()
            / (times * times) as f32
    };
    let pixels = (0..width * height).flat_map(|i| {
        let [red, green, blue] = [0, 1, 2].map(|channel| mean(i % width, i / width, channel));
        Color::linear_rgb(red, green, blue).to_srgba().to_u8_array()
    });
    of_pixels(width, height, pixels.collect())
}

/// Pictures of one height as one, from left to right.
#[allow(dead_code, reason = "the presets and the gallery do")]
pub fn beside(views: &[Image]) -> Image {
    let height = views.iter().map(Image::height).min().unwrap_or(0);
    let row = |image: &Image, y: u32| {
        let bytes = image.data.as_deref().unwrap_or_default();
        let wide = 4 * image.width() as usize;
        let start = y as usize * wide;
        bytes.get(start..start + wide).unwrap_or_default().to_vec()
    };
    let rows = (0..height).flat_map(|y| views.iter().flat_map(move |view| row(view, y)));
    of_pixels(views.iter().map(Image::width).sum(), height, rows.collect())
}

/// Pictures of one width as one, from top to bottom.
#[allow(dead_code, reason = "the gallery does")]
pub fn below(views: &[Image]) -> Image {
    let bytes = views.iter().flat_map(|view| view.data.clone().unwrap_or_default());
    let width = views.iter().map(Image::width).min().unwrap_or(0);
    of_pixels(width, views.iter().map(Image::height).sum(), bytes.collect())
}

fn of_pixels(width: u32, height: u32, bytes: Vec<u8>) -> Image {
    Image::new(
        Extent3d { width, height, depth_or_array_layers: 1 },
        TextureDimension::D2,
        bytes,
        TextureFormat::Rgba8UnormSrgb,
        RenderAssetUsages::default(),
    )
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

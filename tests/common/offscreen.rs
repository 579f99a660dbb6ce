//! A camera without a window: draws into an image and reads it back. Works on a software device.
#![allow(dead_code, reason = "each test binary uses its own part")]

use bevy::{
    app::PluginGroupBuilder,
    camera::RenderTarget,
    prelude::*,
    render::{
        RenderPlugin,
        render_resource::{TextureFormat, TextureUsages},
        view::screenshot::{Screenshot, ScreenshotCaptured},
    },
    time::TimeUpdateStrategy,
    window::ExitCondition,
    winit::WinitPlugin,
};
use bevy_keratin::prelude::*;

/// A picture, eight bits a channel as on a screen.
#[derive(Clone, PartialEq)]
pub struct Picture {
    pub width: u32,
    pub height: u32,
    pub rgba: Vec<u8>,
}

impl Picture {
    pub fn at(&self, x: u32, y: u32) -> [u8; 3] {
        let i = 4 * (y * self.width + x) as usize;
        [self.rgba[i], self.rgba[i + 1], self.rgba[i + 2]]
    }

    pub fn pixels(&self) -> impl Iterator<Item = [u8; 3]> + '_ {
        self.rgba.chunks_exact(4).map(|p| [p[0], p[1], p[2]])
    }

    /// How many pixels differ from `background` by more than a trace.
    pub fn covered(&self, background: [u8; 3]) -> usize {
        self.pixels().filter(|p| p.iter().zip(background).any(|(a, b)| a.abs_diff(b) > 6)).count()
    }

    pub fn mean_luma(&self) -> f32 {
        let sum: f32 = self.pixels().map(luma).sum();
        sum / (self.width * self.height) as f32
    }

    pub fn save(&self, path: &str) {
        let size = bevy::render::render_resource::Extent3d {
            width: self.width,
            height: self.height,
            depth_or_array_layers: 1,
        };
        Image::new(
            size,
            bevy::render::render_resource::TextureDimension::D2,
            self.rgba.clone(),
            TextureFormat::Rgba8UnormSrgb,
            default(),
        )
        .try_into_dynamic()
        .unwrap()
        .save(path)
        .unwrap();
    }
}

pub fn luma([r, g, b]: [u8; 3]) -> f32 {
    0.2126 * f32::from(r) + 0.7152 * f32::from(g) + 0.0722 * f32::from(b)
}

#[derive(Resource, Default)]
struct Caught(Option<Picture>);

/// An app that draws, and its one camera.
pub struct Offscreen {
    pub app: App,
    pub camera: Entity,
    target: Handle<Image>,
}

/// Bevy's plugins without a window.
pub fn windowless() -> PluginGroupBuilder {
    DefaultPlugins
        .set(WindowPlugin {
            primary_window: None,
            exit_condition: ExitCondition::DontExit,
            ..default()
        })
        .set(RenderPlugin { synchronous_pipeline_compilation: true, ..default() })
        .set(bevy::log::LogPlugin { filter: "warn".into(), ..default() })
        .disable::<WinitPlugin>()
        .disable::<bevy::render::pipelined_rendering::PipelinedRenderingPlugin>()
}

/// Whether there is anything that can draw; says so on the test's output if not.
pub fn has_adapter() -> bool {
    use bevy::render::settings::WgpuSettings;
    let settings = WgpuSettings::default();
    let backends = settings.backends.unwrap_or_default();
    let instance = wgpu_probe::has_adapter(backends.bits());
    if !instance {
        eprintln!("skipped: no graphics adapter, install mesa-vulkan-drivers to draw in software");
    }
    instance
}

mod wgpu_probe {
    /// Bevy panics without an adapter, so that must be known before.
    pub fn has_adapter(_: u32) -> bool {
        // A Vulkan loader with at least one driver description, or a platform that always has one.
        if !cfg!(target_os = "linux") {
            return true;
        }
        let folders = ["/usr/share/vulkan/icd.d", "/etc/vulkan/icd.d"];
        std::env::var_os("VK_ICD_FILENAMES").is_some()
            || std::env::var_os("VK_DRIVER_FILES").is_some()
            || folders
                .iter()
                .any(|f| std::fs::read_dir(f).is_ok_and(|mut entries| entries.next().is_some()))
    }
}

impl Offscreen {
    /// `None`, with the reason printed, where nothing can draw. The tick stands still until
    /// `ticking` is told.
    pub fn new(width: u32, height: u32) -> Option<Self> {
        if !has_adapter() {
            return None;
        }
        let mut app = App::new();
        app.add_plugins((windowless(), HairPlugins::default()))
            .insert_resource(TimeUpdateStrategy::FixedTimesteps(0))
            .insert_resource(ClearColor(Color::BLACK))
            .insert_resource(GlobalAmbientLight::NONE)
            .init_resource::<Caught>();
        let mut image =
            Image::new_target_texture(width, height, TextureFormat::Rgba8UnormSrgb, None);
        image.texture_descriptor.usage |= TextureUsages::COPY_SRC;
        let target = app.world_mut().resource_mut::<Assets<Image>>().add(image);
        let camera = app
            .world_mut()
            .spawn((Camera3d::default(), RenderTarget::Image(target.clone().into()), Msaa::Sample4))
            .id();
        app.finish();
        app.cleanup();
        Some(Self { app, camera, target })
    }

    /// Runs `ticks` fixed ticks with every frame from now on.
    pub fn ticking(&mut self, ticks: u32) {
        self.app.insert_resource(TimeUpdateStrategy::FixedTimesteps(ticks));
    }

    pub fn look(&mut self, from: Vec3, at: Vec3) {
        let mut camera = self.app.world_mut().entity_mut(self.camera);
        camera.insert(Transform::from_translation(from).looking_at(at, Vec3::Y));
    }

    /// Draws the world as it is now.
    pub fn draw(&mut self) -> Picture {
        // Assets arrive over the first frames; then one frame is caught.
        for _ in 0..3 {
            self.app.update();
        }
        self.draw_now()
    }

    /// Draws without frames in advance.
    pub fn draw_now(&mut self) -> Picture {
        self.app.world_mut().resource_mut::<Caught>().0 = None;
        self.app.world_mut().spawn(Screenshot::image(self.target.clone())).observe(
            |shot: On<ScreenshotCaptured>, mut caught: ResMut<Caught>| {
                let size = shot.image.texture_descriptor.size;
                caught.0 = Some(Picture {
                    width: size.width,
                    height: size.height,
                    rgba: shot.image.data.clone().unwrap_or_default(),
                });
            },
        );
        for _ in 0..20 {
            self.app.update();
            if let Some(picture) = self.app.world_mut().resource_mut::<Caught>().0.take() {
                return picture;
            }
        }
        panic!("no picture came back");
    }

    /// Pipelines that did not become ready, with the reason.
    pub fn unready_pipelines(&self) -> Vec<String> {
        use bevy::render::render_resource::{
            CachedPipelineState, PipelineCache, PipelineDescriptor,
        };
        let render = self.app.sub_app(bevy::render::RenderApp).world();
        let label = |descriptor: &PipelineDescriptor| match descriptor {
            PipelineDescriptor::RenderPipelineDescriptor(d) => d.label.clone(),
            PipelineDescriptor::ComputePipelineDescriptor(d) => d.label.clone(),
        };
        (render.resource::<PipelineCache>().pipelines())
            .filter(|p| !matches!(p.state, CachedPipelineState::Ok(_)))
            .map(|p| format!("{:?}: {:?}", label(&p.descriptor), p.state))
            .collect()
    }

    /// Where a point of the world lies in the picture.
    pub fn project(&mut self, point: Vec3) -> Option<Vec2> {
        let entity = self.app.world().entity(self.camera);
        let camera = entity.get::<Camera>()?;
        camera.world_to_viewport(entity.get::<GlobalTransform>()?, point).ok()
    }
}

/// Guides on a ball of `radius` around the origin, growing outward and falling under their weight:
/// `count` of them in a spiral from the crown down to the height `lowest` (a share of the radius).
pub fn head_of_guides(count: usize, radius: f32, length: f32, nodes: usize) -> Vec<Vec<Vec3>> {
    let golden = core::f32::consts::PI * (3.0 - 5.0f32.sqrt());
    (0..count)
        .map(|i| {
            let y = 1.0 - 1.05 * (i as f32 + 0.5) / count as f32;
            let (sin, cos) = (golden * i as f32).sin_cos();
            let flat = (1.0 - y * y).max(0.0).sqrt();
            let out = Vec3::new(cos * flat, y, sin * flat);
            fall(out * radius, out, length, nodes, radius)
        })
        .filter(|points| {
            // The face is free.
            let root = points[0] / radius;
            !(root.z > 0.35 && root.y < 0.55)
        })
        .collect()
}

/// A strand that leaves along `out`, lies down over the ball and hangs.
fn fall(root: Vec3, out: Vec3, length: f32, nodes: usize, radius: f32) -> Vec<Vec3> {
    let step = length / (nodes - 1) as f32;
    let mut points = vec![root];
    let mut way = out;
    let back = Vec3::new(0.0, -1.0, -0.25);
    for _ in 1..nodes {
        let p = points[points.len() - 1];
        way = (way + back * (step * 28.0)).normalize();
        let mut next = p + way * step;
        let clear = radius * 1.05;
        if next.length() < clear {
            next = next.normalize() * clear;
        }
        way = (next - p).normalize_or(way);
        points.push(p + way * step);
    }
    points
}

//! A camera without a window: draws into an image and reads it back. Works on a software device.
#![allow(dead_code, unreachable_pub, reason = "each test binary uses its own part")]

use bevy::{
    app::PluginGroupBuilder,
    asset::io::embedded::EmbeddedAssetRegistry,
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

/// The same with the render world in a thread of its own, as games have it.
pub fn pipelined() -> PluginGroupBuilder {
    windowless().enable::<bevy::render::pipelined_rendering::PipelinedRenderingPlugin>()
}

/// Whether a Vulkan driver is installed: looks for a driver's description where the loader does, because Bevy
/// panics without an adapter.
pub fn has_adapter() -> bool {
    let named = ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"].into_iter().find_map(std::env::var_os);
    let folders = ["/usr/share/vulkan/icd.d", "/etc/vulkan/icd.d"].map(std::fs::read_dir);
    match named {
        Some(files) => std::env::split_paths(&files).any(|file| file.exists()),
        None if !cfg!(target_os = "linux") => true,
        None => folders.into_iter().flatten().flatten().next().is_some(),
    }
}

/// With `SHADERS` in the environment, shaders are read from this folder: changes are seen without building
/// the crate again.
fn read_shaders(app: &mut App) {
    let Some(folder) = std::env::var_os("SHADERS") else { return };
    let folder = std::path::PathBuf::from(folder);
    let inner = folder.join("volume");
    let files = [&folder, &inner].map(|of| std::fs::read_dir(of).unwrap());
    let files = files.into_iter().flatten().map(|file| file.unwrap().path());
    for file in files.filter(|file| file.extension().is_some_and(|end| end == "wgsl")) {
        let inside = file.strip_prefix(&folder).unwrap();
        let path = std::path::Path::new("bevy_keratin/render").join(inside);
        let source = std::fs::read(&file).unwrap();
        let known = app.world().resource::<EmbeddedAssetRegistry>();
        known.insert_asset(file, &path, source);
        let url = format!("embedded://{}", path.display());
        app.world().resource::<AssetServer>().reload(url);
    }
    (0..20).for_each(|_| app.update());
}

impl Offscreen {
    /// The tick stands still until `ticking` is set.
    pub fn new(width: u32, height: u32) -> Self {
        Self::with_plugins(width, height, HairPlugins::default().build())
    }

    /// The same without the hair's plugins.
    pub fn without_hair(width: u32, height: u32) -> Self {
        Self::of(width, height, bevy::app::NoopPluginGroup.build(), windowless(), false)
    }

    /// The same with the hair's plugins added before Bevy's.
    pub fn with_hair_first(width: u32, height: u32) -> Self {
        Self::of(width, height, HairPlugins::default().build(), windowless(), true)
    }

    /// The same with these of the hair's plugins.
    pub fn with_plugins(width: u32, height: u32, hair: PluginGroupBuilder) -> Self {
        Self::of(width, height, hair, windowless(), false)
    }

    /// The same with the render world in a thread of its own.
    pub fn pipelined(width: u32, height: u32) -> Self {
        Self::of(width, height, HairPlugins::default().build(), pipelined(), false)
    }

    fn of(
        width: u32,
        height: u32,
        hair: PluginGroupBuilder,
        others: PluginGroupBuilder,
        hair_first: bool,
    ) -> Self {
        let mut app = App::new();
        if hair_first {
            app.add_plugins((hair, others));
        } else {
            app.add_plugins((others, hair));
        }
        app.insert_resource(TimeUpdateStrategy::FixedTimesteps(0))
            .insert_resource(ClearColor(Color::BLACK))
            .insert_resource(GlobalAmbientLight::NONE)
            .insert_resource(bevy::light::DirectionalLightShadowMap { size: 1024 })
            .insert_resource(bevy::light::PointLightShadowMap { size: 512 })
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
        read_shaders(&mut app);
        Self { app, camera, target }
    }

    /// The image that the camera draws into.
    pub fn target(&self) -> Handle<Image> {
        self.target.clone()
    }

    /// Runs `ticks` fixed ticks with every frame from now on.
    pub fn ticking(&mut self, ticks: u32) {
        self.app.insert_resource(TimeUpdateStrategy::FixedTimesteps(ticks));
    }

    pub fn look(&mut self, from: Vec3, at: Vec3) {
        let mut camera = self.app.world_mut().entity_mut(self.camera);
        camera.insert(Transform::from_translation(from).looking_at(at, Vec3::Y));
    }

    /// From now on pictures are not averaged along strands.
    pub fn leave_grain(&mut self) {
        let smoothing = HairSmoothing { reach: 0.0, ..default() };
        self.app.world_mut().entity_mut(self.camera).insert(smoothing);
    }

    /// Draws the world as it is now.
    pub fn draw(&mut self) -> Picture {
        // Assets arrive over the first frames, which draw nothing: a processor in the place of a graphics card takes
        // seconds for one. Then there is a frame before the one that is caught.
        self.activate(false);
        (0..2).for_each(|_| self.app.update());
        self.activate(true);
        self.app.update();
        self.draw_now()
    }

    /// Lets assets arrive while nothing is drawn, then draws one frame only: for large pictures.
    pub fn draw_once(&mut self) -> Picture {
        self.activate(false);
        (0..3).for_each(|_| self.app.update());
        self.activate(true);
        self.draw_now()
    }

    fn activate(&mut self, on: bool) {
        if let Some(mut camera) = self.app.world_mut().get_mut::<Camera>(self.camera) {
            camera.is_active = on;
        }
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
            // It comes back in the next frame, in which nothing need be drawn.
            self.activate(false);
            if let Some(picture) = self.app.world_mut().resource_mut::<Caught>().0.take() {
                self.activate(true);
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

/// Guides on a ball of `radius` around the origin, parted in the middle and combed to the sides:
/// about `count` of them in a spiral over the scalp; the face looks along +z.
pub fn head_of_guides(count: usize, radius: f32, length: f32, nodes: usize) -> Vec<Vec<Vec3>> {
    let golden = core::f32::consts::PI * (3.0 - 5.0f32.sqrt());
    let root = |i: usize| {
        let y = 1.0 - 1.15 * (i as f32 + 0.5) / count as f32;
        let (sin, cos) = (golden * i as f32).sin_cos();
        let flat = (1.0 - y * y).max(0.0).sqrt();
        Vec3::new(cos * flat, y, sin * flat)
    };
    (0..count)
        .map(root)
        // The face and the ears are free.
        .filter(|r| !(r.z > 0.25 && r.y < 0.62 || r.z > 0.05 && r.y < 0.2))
        .map(|root| combed(root, radius, length, nodes))
        .collect()
}

/// A strand that lies down over the ball to its side and hangs.
fn combed(root: Vec3, radius: f32, length: f32, nodes: usize) -> Vec<Vec3> {
    let step = length / (nodes - 1) as f32;
    let side = if root.x < 0.0 { -1.0 } else { 1.0 };
    let mut points = vec![root * radius];
    let mut way = (root + Vec3::new(side, 0.3, -0.4)).normalize();
    for _ in 1..nodes {
        let p = points[points.len() - 1];
        let out = p.normalize();
        let comb = if out.y > 0.1 { 0.9 } else { 0.05 };
        let pull = Vec3::new(side * comb, -1.0, -0.35 * comb - 0.1);
        way = (way + pull * (step * 30.0)).normalize();
        let next = p + way * step;
        // A layer of hair lies between the ball and the outer strands.
        let clear = radius * (1.08 + 0.06 * root.y.max(0.0));
        if next.length() < clear {
            way = (next.normalize() * clear - p).normalize_or(way);
        }
        points.push(p + way * step);
    }
    points
}

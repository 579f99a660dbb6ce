//! The loops.

use crate::{
    Arguments, bust, environment, figure, orbit,
    picture::{self, Pictures},
    renderer,
    scenes::{Scene, SceneKind},
    set,
    solid::Paint,
    studio,
};
use bevy::{
    core_pipeline::{prepass::DepthPrepass, tonemapping::Tonemapping},
    light::{CascadeShadowConfigBuilder, DirectionalLightShadowMap},
    math::ops::sin,
    prelude::*,
    time::TimeUpdateStrategy,
};
use bevy_keratin::{Shower, plant::HairPreset, prelude::*, render::HairView};
use core::f32::consts::TAU;

/// Takes the pictures of a loop as they are drawn.
pub type Shown<'a> = &'a mut dyn FnMut(Image) -> Result;

/// How many pictures a loop has, how many ticks they are apart, and for how long each is shown (ms).
#[derive(Clone, Copy)]
struct Reel {
    count: u32,
    apart: u32,
    milliseconds: u32,
}

impl Reel {
    /// The same story in at most so many pictures.
    fn at_most(self, most: u32) -> Self {
        if self.count <= most {
            return self;
        }
        let ticks = (self.count - 1) * self.apart;
        let apart = ticks.div_ceil(most.saturating_sub(1).max(1));
        let count = most.min(ticks / apart + 1);
        Self { count, apart, milliseconds: self.milliseconds * apart / self.apart }
    }
}

/// An app and its camera.
type Stage = (App, Pictures);

/// Draws the pictures of a reel, those of several stages beside each other; before each tick an app may be
/// changed, by the number of that tick. Gives for how long each picture is shown (ms).
fn film(
    stages: &mut [Stage],
    reel: Reel,
    show: Shown,
    mut before: impl FnMut(&mut App, u32) -> Result,
) -> Result<u32> {
    for tick in 0..(reel.count - 1) * reel.apart + 1 {
        let mut drawn = Vec::with_capacity(stages.len());
        for (app, pictures) in &mut *stages {
            app.insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
            before(app, tick)?;
            app.update();
            if tick % reel.apart == 0 {
                app.insert_resource(TimeUpdateStrategy::FixedTimesteps(0));
                drawn.push(pictures.draw(app)?);
            }
        }
        if !drawn.is_empty() {
            show(picture::beside(&drawn))?;
        }
    }
    Ok(reel.milliseconds)
}

/// A variant of a scene, `near` as far as usual and looked at from `aside`.
fn scene(
    arguments: &Arguments,
    scene: Scene,
    view: HairView,
    size: (u32, u32),
    (near, aside): (f32, Vec3),
) -> Stage {
    let mut app = renderer::app("", (0, 0), true, default());
    set::furnish(&mut app, scene, view);
    arguments.thin_out(&mut app);
    let camera = (orbit::bundle(scene.kind), DepthPrepass);
    let pictures = Pictures::new(&mut app, size, arguments.supersample, camera);
    let mut orbits = app.world_mut().query::<(&mut orbit::Orbit, &mut Transform)>();
    for (mut orbit, mut place) in orbits.iter_mut(app.world_mut()) {
        orbit.distance *= near;
        orbit.focus += aside;
        *place = orbit.pose();
    }
    (app, pictures)
}

fn story(kind: SceneKind, variant: Option<&str>) -> Result<Scene> {
    Ok(Scene::new(kind, variant)?)
}

pub fn perm(arguments: &Arguments, show: Shown) -> Result<u32> {
    let size = arguments.scaled(440, 440);
    let perm = story(SceneKind::Perm, None)?;
    let near = (0.72, Vec3::new(0.03, 0.02, 0.0));
    let reel = Reel { count: 58, apart: 15, milliseconds: 90 }.at_most(arguments.most);
    let mut stages = [scene(arguments, perm, HairView::Natural, size, near)];
    film(&mut stages, reel, show, |_, _| Ok(()))
}

/// Two scenes beside each other.
fn both(arguments: &Arguments, scenes: [(Scene, HairView); 2], show: Shown) -> Result<u32> {
    let size = arguments.scaled(340, 340);
    let near = (0.86, Vec3::new(0.0, 0.03, 0.0));
    let reel = Reel { count: 48, apart: 25, milliseconds: 100 }.at_most(arguments.most);
    let mut stages = scenes.map(|(played, view)| scene(arguments, played, view, size, near));
    film(&mut stages, reel, show, |_, _| Ok(()))
}

pub fn bedhead(arguments: &Arguments, show: Shown) -> Result<u32> {
    let treated = story(SceneKind::Bedhead, Some("treated"))?;
    let dry = story(SceneKind::Bedhead, Some("never-wet"))?;
    both(arguments, [(treated, HairView::Natural), (dry, HairView::Natural)], show)
}

pub fn blow_dry(arguments: &Arguments, show: Shown) -> Result<u32> {
    let dried = story(SceneKind::BlowDry, None)?;
    let bonds = HairView::Bond(BondKind::Hydrogen);
    both(arguments, [(dried, HairView::Natural), (dried, bonds)], show)
}

/// A bust that has settled, and its camera.
pub fn settled(
    arguments: &Arguments,
    preset: HairPreset,
    size: (u32, u32),
) -> Result<(App, bust::Bust, Pictures)> {
    settled_before(bust::ground(preset), arguments, preset, size)
}

/// The same before another ground.
pub fn settled_before(
    ground: Color,
    arguments: &Arguments,
    preset: HairPreset,
    size: (u32, u32),
) -> Result<(App, bust::Bust, Pictures)> {
    let mut app = bust::app("", ground);
    bust::light(&mut app);
    arguments.thin_out(&mut app);
    let bust = bust::wear(&mut app, preset)?;
    let camera = bust::camera(&mut app);
    let pictures = Pictures::new(&mut app, size, arguments.supersample, camera);
    bust::look(&mut app, FROM, MIDDLE);
    app.insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
    // In one picture alone nobody sees whether it has settled.
    let seconds = if arguments.most > 1 { bust::SETTLING } else { 0.5 };
    for _ in 0..(60.0 * seconds) as u32 {
        app.update();
    }
    Ok((app, bust, pictures))
}

/// From where busts are seen, and the middle of the picture (m).
pub const FROM: Vec3 = Vec3::new(0.27, 0.05, 0.61);
pub const MIDDLE: Vec3 = Vec3::new(0.0, -0.05, 0.0);

/// Rain begins, hair hangs in wet locks.
pub fn rain(arguments: &Arguments, show: Shown) -> Result<u32> {
    let size = arguments.scaled(400, 440);
    let (mut app, _, pictures) = settled(arguments, HairPreset::Wavy, size)?;
    app.insert_resource(HairProcessTime(40.0));
    let reel = Reel { count: 48, apart: 6, milliseconds: 100 }.at_most(arguments.most);
    film(&mut [(app, pictures)], reel, show, |app, tick| {
        if tick == 12 {
            let (mut shower, place) = Shower::rain_on(Vec3::Y * 0.1);
            shower.rate *= 2.0;
            app.world_mut().spawn((shower, place));
        }
        if tick == 200 {
            let showers = app.world_mut().query_filtered::<Entity, With<Shower>>();
            let showers: Vec<Entity> = { showers }.iter(app.world()).collect();
            showers.into_iter().for_each(|shower| _ = app.world_mut().despawn(shower));
        }
        Ok(())
    })
}

/// A head is shaken, and comes to rest where it was.
pub fn shake(arguments: &Arguments, show: Shown) -> Result<u32> {
    const SECONDS: f32 = 1.5;
    let size = arguments.scaled(440, 440);
    let (app, bust, pictures) = settled(arguments, HairPreset::Curly, size)?;
    let reel = Reel { count: 52, apart: 3, milliseconds: 50 }.at_most(arguments.most);
    film(&mut [(app, pictures)], reel, show, |app, tick| {
        let share = (tick as f32 / 60.0 / SECONDS).min(1.0);
        let turn = 2.6 * share * (1.0 - share) * sin(TAU * 1.7 * SECONDS * share);
        let upright = bust::upright();
        let turned = upright.with_rotation(Quat::from_rotation_y(turn) * upright.rotation);
        app.world_mut().entity_mut(bust.hair).insert(turned);
        Ok(())
    })
}

/// A figure walks in a circle, in wind; the camera goes along.
pub fn walk(arguments: &Arguments, show: Shown) -> Result<u32> {
    let size = arguments.scaled(400, 440);
    let mut app = renderer::app("", (0, 0), true, default());
    app.insert_resource(Time::<Fixed>::from_hz(60.0))
        .insert_resource(ClearColor(Color::srgb(0.44, 0.46, 0.48)))
        .insert_resource(DirectionalLightShadowMap { size: 4096 })
        .insert_resource(GlobalAmbientLight::NONE)
        .insert_resource(figure::Wears(HairPreset::Wavy))
        .insert_resource(HairWind { velocity: Vec3::new(-1.4, 0.0, -0.7), gusts: 0.5, ..default() })
        .add_plugins(figure::FigurePlugin)
        .add_systems(Startup, daylight);
    arguments.thin_out(&mut app);
    let surroundings =
        environment::studio(&mut app.world_mut().resource_mut::<Assets<Image>>(), 450.0);
    let projection = PerspectiveProjection { fov: 0.5, near: 0.05, ..default() };
    let camera = (
        Camera3d::default(),
        Projection::from(projection),
        Tonemapping::TonyMcMapface,
        Msaa::Sample4,
        DepthPrepass,
        surroundings,
    );
    let pictures = Pictures::new(&mut app, size, arguments.supersample, camera);
    let ahead = if arguments.most > 1 { 60 } else { 2 };
    app.insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
    (0..ahead).for_each(|_| app.update());
    let reel = Reel { count: 48, apart: 4, milliseconds: 67 }.at_most(arguments.most);
    film(&mut [(app, pictures)], reel, show, |app, _| {
        let mut figures = app.world_mut().query_filtered::<&Transform, With<figure::Figure>>();
        let figure = *figures.single(app.world())?;
        let turn = figure.rotation * Quat::from_euler(EulerRot::YXZ, 0.62, -0.07, 0.0);
        let focus = figure.translation + Vec3::Y * 1.36;
        let place = Transform::from_translation(focus + turn * Vec3::Z * 2.1).with_rotation(turn);
        let mut cameras = app.world_mut().query_filtered::<&mut Transform, With<Camera>>();
        cameras.iter_mut(app.world_mut()).for_each(|mut camera| *camera = place);
        Ok(())
    })
}

fn daylight(mut commands: Commands, mut paint: Paint) {
    let light = |at: Vec3, lux: f32, color: Color| {
        let light = DirectionalLight {
            illuminance: lux,
            color,
            shadow_maps_enabled: true,
            shadow_normal_bias: 0.8,
            ..default()
        };
        let cascades =
            CascadeShadowConfigBuilder { num_cascades: 1, maximum_distance: 4.5, ..default() };
        (light, cascades.build(), Transform::from_translation(at).looking_at(Vec3::ZERO, Vec3::Y))
    };
    commands.spawn(light(Vec3::new(1.0, 1.6, 1.2), 8500.0, Color::srgb(1.0, 0.95, 0.88)));
    commands.spawn(light(Vec3::new(-0.7, 0.7, -1.5), 7000.0, Color::WHITE));
    studio::room(&mut commands, &mut paint, 0.0, 4.0);
}

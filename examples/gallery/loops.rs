//! The loops.

use crate::{
    Arguments, bust, environment, figure, orbit,
    picture::{self, Pictures},
    renderer,
    scenes::{Scene, SceneKind},
    set, skeleton,
    solid::Paint,
    studio,
};
use bevy::{
    core_pipeline::{prepass::DepthPrepass, tonemapping::Tonemapping},
    light::{CascadeShadowConfigBuilder, NotShadowCaster},
    math::ops::sin,
    prelude::*,
    time::TimeUpdateStrategy,
};
use bevy_keratin::{Shower, authoring::plant::HairPreset, prelude::*, render::HairView};
use core::f32::consts::{FRAC_PI_2, TAU};

/// Takes the pictures of a loop as they are drawn.
pub type Shown<'a> = &'a mut dyn FnMut(Image) -> Result;

/// How many pictures a loop has, how many ticks they are apart, and for how long each is shown (ms).
#[derive(Clone, Copy)]
pub struct Reel {
    pub count: u32,
    apart: u32,
    pub milliseconds: u32,
    /// The last one is shown as long, for the eye to rest; where the loop closes as long as the others.
    pub last: u32,
}

/// For how long the last picture of a story is shown (ms).
const REST: u32 = 900;

impl Reel {
    /// The same story in at most so many pictures.
    fn at_most(self, most: u32) -> Self {
        if self.count <= most {
            return self;
        }
        let ticks = (self.count - 1) * self.apart;
        let apart = ticks.div_ceil(most.saturating_sub(1).max(1));
        let count = most.min(ticks / apart + 1);
        let milliseconds = self.milliseconds * apart / self.apart;
        Self { count, apart, milliseconds, last: self.last.max(milliseconds) }
    }
}

/// An app and its camera.
type Stage = (App, Pictures);

/// Draws the pictures of a reel, those of several stages beside each other; before each tick an app may be
/// changed, by the number of that tick.
fn film(
    stages: &mut [Stage],
    reel: Reel,
    show: Shown,
    mut before: impl FnMut(&mut App, u32) -> Result,
) -> Result<Reel> {
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
    Ok(reel)
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

pub fn perm(arguments: &Arguments, show: Shown) -> Result<Reel> {
    let size = arguments.scaled(440, 440);
    let perm = story(SceneKind::Perm, None)?;
    let near = (0.72, Vec3::new(0.03, 0.02, 0.0));
    let reel = Reel { count: 58, apart: 15, milliseconds: 90, last: REST }.at_most(arguments.most);
    let mut stages = [scene(arguments, perm, HairView::Natural, size, near)];
    film(&mut stages, reel, show, |_, _| Ok(()))
}

/// Two scenes beside each other.
fn both(arguments: &Arguments, scenes: [(Scene, HairView); 2], show: Shown) -> Result<Reel> {
    let size = arguments.scaled(340, 340);
    let near = (0.86, Vec3::new(0.0, 0.03, 0.0));
    let reel = Reel { count: 48, apart: 25, milliseconds: 100, last: REST }.at_most(arguments.most);
    let mut stages = scenes.map(|(played, view)| scene(arguments, played, view, size, near));
    film(&mut stages, reel, show, |_, _| Ok(()))
}

pub fn bedhead(arguments: &Arguments, show: Shown) -> Result<Reel> {
    let treated = story(SceneKind::Bedhead, Some("treated"))?;
    let dry = story(SceneKind::Bedhead, Some("never-wet"))?;
    both(arguments, [(treated, HairView::Natural), (dry, HairView::Natural)], show)
}

/// Wet hair is lifted and dried by a blower; beside it the same head, wet.
pub fn blow_dry(arguments: &Arguments, show: Shown) -> Result<Reel> {
    /// From when to when it blows (ticks).
    const BLOWN: [u32; 2] = [20, 210];
    const NOZZLE: Vec3 = Vec3::new(-0.04, -0.19, 0.22);
    const AIM: Vec3 = Vec3::new(0.09, -0.10, 0.0);
    let size = arguments.scaled(320, 400);
    let (mut app, bust, pictures) = settled(arguments, HairPreset::Wavy, size)?;
    soak(&mut app, bust.hair, 1.6);
    app.insert_resource(HairProcessTime(20.0));
    let hang = if arguments.most > 1 { 90 } else { 2 };
    app.insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
    (0..hang).for_each(|_| app.update());
    app.insert_resource(HairProcessTime(60.0));
    let nozzle = app.world_mut().run_system_cached(nozzle)?;
    let reel = Reel { count: 25, apart: 11, milliseconds: 150, last: 1500 };
    let reel = reel.at_most(arguments.most);
    film(&mut [(app, pictures)], reel, &mut beside_first(show), |app, tick| {
        // Up and down along the hair.
        let swept = Vec3::Y * 0.05 * sin(TAU * tick as f32 / 50.0);
        let (_, place) = Blower::blow_dry(NOZZLE, AIM + swept);
        let world = app.world_mut();
        world.entity_mut(nozzle).insert(place);
        if tick == BLOWN[0] {
            world.entity_mut(nozzle).insert(Blower::new(60.0)?);
        }
        if tick == BLOWN[1] {
            world.entity_mut(nozzle).remove::<Blower>();
        }
        Ok(())
    })
}

/// What a blower blows from, along −Z.
fn nozzle(mut commands: Commands, mut paint: Paint) -> Entity {
    let black = paint.matte(Color::srgb(0.03, 0.03, 0.035), 0.4);
    let red = paint.matte(Color::srgb(0.45, 0.02, 0.03), 0.35);
    let barrel = paint.meshes.add(Cylinder::new(0.032, 0.1));
    let tip = paint.meshes.add(Cylinder::new(0.023, 0.05));
    let handle = paint.meshes.add(Cylinder::new(0.016, 0.12));
    let along = Transform::from_rotation(Quat::from_rotation_x(FRAC_PI_2));
    let nozzle = commands.spawn((Transform::default(), Visibility::default())).id();
    let parts = [
        (tip, black.clone(), along.with_translation(Vec3::Z * 0.025)),
        (barrel, red, along.with_translation(Vec3::Z * 0.1)),
        (handle, black, Transform::from_xyz(0.0, -0.07, 0.11)),
    ];
    for (mesh, material, place) in parts {
        commands.spawn((Mesh3d(mesh), MeshMaterial3d(material), place, ChildOf(nozzle)));
    }
    nozzle
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

/// Shows each picture beside the first.
fn beside_first(show: Shown) -> impl FnMut(Image) -> Result {
    let mut first = None;
    move |picture| {
        let first = first.get_or_insert_with(|| picture.clone()).clone();
        show(picture::beside(&[first, picture]))
    }
}

fn soak(app: &mut App, target: Entity, wetness: f32) {
    app.world_mut().write_message(SoakHair { target, wetness });
}

/// Rain begins, hair hangs in wet locks; beside it the same head before the rain.
pub fn rain(arguments: &Arguments, show: Shown) -> Result<Reel> {
    /// When it begins and ends (ticks).
    const RAIN: [u32; 2] = [20, 170];
    let size = arguments.scaled(320, 400);
    let (mut app, bust, pictures) = settled(arguments, HairPreset::Wavy, size)?;
    app.insert_resource(HairProcessTime(40.0));
    let reel = Reel { count: 22, apart: 10, milliseconds: 150, last: 1500 };
    let reel = reel.at_most(arguments.most);
    film(&mut [(app, pictures)], reel, &mut beside_first(show), |app, tick| {
        if tick == RAIN[0] {
            let (mut shower, place) = Shower::rain_on(Vec3::Y * 0.1);
            shower.rate *= 2.0;
            app.world_mut().spawn((shower, place));
        }
        // Minutes of rain in seconds: what they soak is more than these drops bring.
        if (RAIN[0]..RAIN[1]).contains(&tick) && tick % 5 == 0 {
            let share = (tick - RAIN[0]) as f32 / (RAIN[1] - RAIN[0]) as f32;
            soak(app, bust.hair, (2.4 * share).min(2.0));
        }
        if tick == RAIN[1] {
            let showers = app.world_mut().query_filtered::<Entity, With<Shower>>();
            let showers: Vec<Entity> = { showers }.iter(app.world()).collect();
            showers.into_iter().for_each(|shower| _ = app.world_mut().despawn(shower));
        }
        Ok(())
    })
}

/// A figure in daylight, and a camera that goes along: `yaw` from the way that it faces (rad), `near` (m).
fn outdoors(arguments: &Arguments, preset: HairPreset, pose: Posed, size: (u32, u32)) -> Stage {
    let mut app = renderer::app("", (0, 0), true, default());
    app.insert_resource(Time::<Fixed>::from_hz(60.0))
        .insert_resource(ClearColor(Color::srgb(0.44, 0.46, 0.48)))
        .insert_resource(GlobalAmbientLight::NONE)
        .insert_resource(figure::Wears(preset))
        .insert_resource(pose)
        .add_plugins(figure::FigurePlugin)
        .add_systems(Startup, daylight)
        .add_systems(PostUpdate, (hold, follow_guides).chain().before(HairTicks));
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
    (app, pictures)
}

/// How a figure is held and from where it is seen.
#[derive(Resource, Clone, Copy)]
struct Posed {
    /// Whether it stands instead of walking.
    stands: bool,
    /// How far its head is turned where it stands (rad).
    turn: f32,
    /// From the way that it faces to the camera (rad).
    yaw: f32,
    /// From its head to the camera (m).
    away: f32,
    /// What is in the middle of the picture (m), above the floor.
    height: f32,
}

/// Where it does not walk, it stands and turns its head.
fn hold(
    posed: Res<Posed>,
    mut figures: Query<&mut Transform, (With<figure::Figure>, Without<figure::Bone>)>,
    mut bones: Query<(&figure::Bone, &mut Transform)>,
) {
    if !posed.stands {
        return;
    }
    let mut pose = skeleton::walk(0.0);
    for leg in [skeleton::THIGH, skeleton::SHIN, skeleton::FOOT] {
        for leg in [leg, leg + skeleton::OTHER_SIDE] {
            pose[leg] = skeleton::at_rest(leg);
        }
    }
    pose[0] = skeleton::at_rest(0);
    pose[skeleton::NECK].rotation = Quat::from_rotation_y(0.4 * posed.turn);
    pose[skeleton::HEAD].rotation =
        Quat::from_rotation_y(0.6 * posed.turn) * Quat::from_rotation_x(0.02);
    for (bone, mut place) in &mut bones {
        *place = pose[bone.0];
    }
    figures.iter_mut().for_each(|mut figure| *figure = skeleton::path(0.0));
}

/// What goes along with the figure, and where it is at first.
#[derive(Component)]
struct Along(Transform);

/// Camera, light and wind stay where they are, seen from the figure.
fn follow_guides(
    posed: Res<Posed>,
    figures: Query<&Transform, (With<figure::Figure>, Without<Along>, Without<Camera>)>,
    mut cameras: Query<&mut Transform, (With<Camera>, Without<Along>)>,
    mut others: Query<(&Along, &mut Transform), Without<Camera>>,
    mut wind: ResMut<HairWind>,
) {
    let Ok(figure) = figures.single() else { return };
    let turn = figure.rotation * Quat::from_euler(EulerRot::YXZ, posed.yaw, -0.06, 0.0);
    let focus = figure.translation + Vec3::Y * posed.height;
    let place =
        Transform::from_translation(focus + turn * Vec3::Z * posed.away).with_rotation(turn);
    cameras.iter_mut().for_each(|mut camera| *camera = place);
    for (along, mut place) in &mut others {
        *place = *figure * along.0;
    }
    wind.velocity = if posed.stands { Vec3::ZERO } else { figure.rotation * HEAD_WIND };
}

/// What blows against who walks (m/s), and a little from the side.
const HEAD_WIND: Vec3 = Vec3::new(0.5, 0.0, -1.2);

/// A head is shaken, and hair comes to rest after it.
pub fn shake(arguments: &Arguments, show: Shown) -> Result<Reel> {
    /// When it begins and for how long (s), and how often a second.
    const SHAKEN: (f32, f32) = (0.2, 1.5);
    const PACE: f32 = 1.4;
    const WIDE: f32 = 0.8;
    let size = arguments.scaled(480, 440);
    let posed = Posed { stands: true, turn: 0.0, yaw: 0.4, away: 1.55, height: 1.52 };
    let (mut app, pictures) = outdoors(arguments, HairPreset::Long, posed, size);
    settle(arguments, &mut app);
    let reel = Reel { count: 25, apart: 7, milliseconds: 117, last: REST }.at_most(arguments.most);
    film(&mut [(app, pictures)], reel, show, |app, tick| {
        let share = ((tick as f32 / 60.0 - SHAKEN.0) / SHAKEN.1).clamp(0.0, 1.0);
        // At once, and to a stop at once.
        let wide = WIDE * (8.0 * share.min(1.0 - share)).min(1.0);
        app.world_mut().resource_mut::<Posed>().turn = wide * sin(TAU * PACE * SHAKEN.1 * share);
        Ok(())
    })
}

/// Lets what was planted come to rest; in one picture alone nobody sees it.
fn settle(arguments: &Arguments, app: &mut App) {
    let ticks = if arguments.most > 1 { (60.0 * bust::SETTLING) as u32 } else { 2 };
    app.insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
    (0..ticks).for_each(|_| app.update());
}

/// A figure walks, looks aside and back; the camera goes along.
pub fn walk(arguments: &Arguments, show: Shown) -> Result<Reel> {
    let size = arguments.scaled(480, 440);
    let posed = Posed { stands: false, turn: 0.0, yaw: 1.1, away: 1.75, height: 1.5 };
    let (mut app, pictures) = outdoors(arguments, HairPreset::Long, posed, size);
    // It looks aside from 1.2 to 4.2 s.
    let ahead = if arguments.most > 1 { 69 } else { 2 };
    app.insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
    (0..ahead).for_each(|_| app.update());
    let reel = Reel { count: 39, apart: 5, milliseconds: 83, last: 83 }.at_most(arguments.most);
    film(&mut [(app, pictures)], reel, show, |_, _| Ok(()))
}

/// While the figure takes three double steps it goes past eleven of so many: a loop of them closes.
const COLUMNS: u32 = 23;

/// Light that goes along, a room, and columns to walk past.
fn daylight(mut commands: Commands, mut paint: Paint) {
    let light = |at: Vec3, lux: f32, color: Color| {
        let light = DirectionalLight {
            illuminance: lux,
            color,
            shadow_maps_enabled: true,
            shadow_normal_bias: 0.6,
            shadow_depth_bias: 0.002,
            ..default()
        };
        let cascades = CascadeShadowConfigBuilder {
            num_cascades: 1,
            minimum_distance: 0.6,
            maximum_distance: 2.6,
            ..default()
        };
        let place = Transform::from_translation(at).looking_at(Vec3::ZERO, Vec3::Y);
        (light, cascades.build(), place, Along(place))
    };
    commands.spawn(light(Vec3::new(1.2, 1.2, 0.9), 8500.0, Color::srgb(1.0, 0.95, 0.88)));
    commands.spawn(light(Vec3::new(-0.9, 0.6, -1.2), 7500.0, Color::WHITE));
    studio::room(&mut commands, &mut paint, 0.0, 4.0);
    let column = paint.meshes.add(Cylinder::new(0.13, 6.0));
    let stone = paint.matte(Color::srgb(0.30, 0.33, 0.36), 0.9);
    for i in 0..COLUMNS {
        let at = Quat::from_rotation_y(TAU * i as f32 / COLUMNS as f32) * Vec3::new(0.0, 3.0, 5.2);
        commands.spawn((
            Mesh3d(column.clone()),
            MeshMaterial3d(stone.clone()),
            Transform::from_translation(at),
            NotShadowCaster,
        ));
    }
}

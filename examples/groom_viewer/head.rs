//! The groom on a ball for a head, its motion, and what is measured of it.

use crate::{Arguments, camera, solid::Paint, studio};
use bevy::{math::bounding::BoundingSphere, prelude::*};
use bevy_keratin::{groom::*, prelude::*};
use core::{f32::consts::TAU, fmt};

/// How far the head turns to either side (rad), once a second.
const TURN: f32 = TAU / 6.0;

/// The groom as it comes from the file.
#[derive(Resource)]
pub struct Loading(pub Handle<Groom>);

/// That the groom is there, and the ball around all of it (m).
#[derive(Resource)]
pub struct Shown {
    pub middle: Vec3,
    pub reach: f32,
    /// The point in the head around which it turns (m).
    pivot: Vec3,
    /// Its turn at rest (rad), which shows the hair from aside.
    rest: f32,
}

#[derive(Component)]
struct Head;

/// What has been measured up to now.
#[derive(Resource, Default)]
pub struct Measure {
    strands: usize,
    followers: usize,
    peak_strain: f32,
    strain: f32,
    /// When it was at most (s).
    peak_at: f32,
    deepest: f32,
    broken: usize,
    /// Ticks of motion.
    ticks: u32,
}

impl fmt::Display for Measure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} strands and {} followers, strain {:.1} % now and {:.1} % at most (at {:.2} s), {:.2} mm deep in \
             the head, {} broken strands",
            self.strands,
            self.followers,
            100.0 * self.strain,
            100.0 * self.peak_strain,
            self.peak_at,
            1000.0 * self.deepest,
            self.broken
        )
    }
}

pub struct HeadPlugin;

impl Plugin for HeadPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Measure>()
            .insert_resource(Time::<Fixed>::from_hz(60.0))
            .add_systems(Startup, load)
            .add_systems(Update, put_on.run_if(not(resource_exists::<Shown>)))
            .add_systems(FixedUpdate, shake)
            .add_systems(FixedLast, measure);
    }
}

fn load(mut commands: Commands, assets: Res<AssetServer>, arguments: Res<Arguments>) {
    let (scale, up) = (arguments.scale, arguments.up.map(UpAxis::from));
    let name = arguments.file.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let load = assets.load_builder().with_settings(move |s: &mut GroomSettings| {
        (s.scale, s.up) = (scale, up);
    });
    commands.insert_resource(Loading(load.load(name)));
}

/// Grows the groom on a ball that fits its roots, the ball's centre being the origin.
fn put_on(
    mut commands: Commands,
    mut paint: Paint,
    mut grooms: ResMut<Assets<Groom>>,
    loading: Res<Loading>,
    arguments: Res<Arguments>,
) -> Result {
    let Some(groom) = grooms.get(&loading.0) else {
        return Ok(());
    };
    let fallback = || {
        let middle = groom.roots().sum::<Vec3>() / groom.len().max(1) as f32;
        BoundingSphere::new(middle, 1e-3)
    };
    let ball = groom.fit_head().unwrap_or_else(fallback);
    let groom = groom.clone().moved(-Vec3::from(ball.center))?;
    let (low, high) = groom
        .points()
        .iter()
        .fold((Vec3::MAX, Vec3::MIN), |(low, high), p| (low.min(*p), high.max(*p)));
    let middle = 0.5 * (low + high);
    // Hair on the back of something large: turned around where it grows, and shown from aside.
    let aside = middle * Vec3::new(1.0, 0.0, 1.0);
    let (pivot, rest) = match aside.length() > 0.5 * ball.radius() {
        true => (aside, camera::YAW - 1.2 - aside.x.atan2(aside.z)),
        false => (Vec3::ZERO, 0.0),
    };
    // Room for the swing.
    let (middle, reach) = (pivot + middle * Vec3::Y, 0.5 * (high - low).length());
    let size = reach / 0.25;
    studio::light(&mut commands, middle, size);
    studio::room(&mut commands, &mut paint, middle.y - 1.3 * reach, 1.6 * size);
    println!(
        "{} strands, {} nodes, head of radius {:.3} m at {}",
        groom.len(),
        groom.points().len(),
        ball.radius(),
        ball.center
    );

    let head = (
        Head,
        Mesh3d(paint.meshes.add(Sphere::new(0.985 * ball.radius()).mesh().uv(96, 64))),
        MeshMaterial3d(paint.matte(Color::srgb(0.62, 0.42, 0.32), 0.6)),
        HairCollider::sphere(ball.radius())?,
        place(pivot, rest),
    );
    let guides = GroomGuides { count: arguments.guides, nodes: arguments.nodes, ..default() };
    let hair = GroomedHair { groom: grooms.add(groom), guides };
    let stiffness = Stiffness::from_bending_length(arguments.stiffness)?;
    commands.spawn((head, children![(hair, stiffness, HairFollowers::new(100_000))]));
    commands.insert_resource(Shown { middle, reach, pivot, rest });
    Ok(())
}

/// Turned around a vertical axis through `pivot`, which stays.
fn place(pivot: Vec3, turn: f32) -> Transform {
    let rotation = Quat::from_rotation_y(turn);
    Transform::from_translation(pivot - rotation * pivot).with_rotation(rotation)
}

/// ±60° once a second, then still.
fn shake(
    mut heads: Query<&mut Transform, With<Head>>,
    arguments: Res<Arguments>,
    shown: Option<Res<Shown>>,
    mut measure: ResMut<Measure>,
) {
    let Some(shown) = shown else {
        return;
    };
    for mut head in &mut heads {
        measure.ticks += 1;
        let seconds = measure.ticks as f32 / 60.0;
        // Pictures end with a second of rest.
        let end = arguments.offscreen.as_ref().map_or(f32::MAX, |_| arguments.seconds);
        let turn = (TAU * seconds.min(end)).sin() * TURN;
        *head = place(shown.pivot, shown.rest + turn);
    }
}

fn measure(
    mut measure: ResMut<Measure>,
    strands: Query<&Strand>,
    heads: Query<&HairCollider, With<Head>>,
    drawn: Query<&bevy_keratin::render::HairBuffers>,
) {
    measure.strands = strands.iter().count();
    let drawn: u32 = drawn.iter().map(|b| b.strand_count).sum();
    measure.followers = (drawn as usize).saturating_sub(measure.strands);
    measure.broken = strands.iter().filter(|s| !s.is_finite()).count();
    measure.strain = strands.iter().map(Strand::peak_strain).fold(0.0, f32::max);
    if measure.strain > measure.peak_strain {
        measure.peak_strain = measure.strain;
        measure.peak_at = measure.ticks as f32 / 60.0;
    }
    let radius = heads.iter().find_map(|head| match head.shape {
        bevy_keratin::contact::ColliderShape::Sphere(ball) => Some(ball.radius),
        _ => None,
    });
    let radius = radius.unwrap_or_default();
    // Roots are where the groom has them; the first free node may have to leave the head steeply.
    let depth = |strand: &Strand| {
        let free = strand.positions().iter().skip(1);
        free.map(|p| radius - p.length()).fold(0.0, f32::max)
    };
    measure.deepest = strands.iter().map(depth).fold(0.0, f32::max);
}

//! The groom on a head, its motion, and what is measured of it.

use crate::{Arguments, camera, solid::Paint, stand_in, studio};
use bevy::prelude::*;
use bevy_keratin::{FaultKind, authoring::groom::*, prelude::*};
use core::{f32::consts::TAU, fmt};

/// How far the head turns to either side (rad), once a second.
const TURN: f32 = TAU / 6.0;

/// The groom as it comes from the file.
#[derive(Resource)]
pub struct Loading(pub Handle<Groom>);

/// Metres per unit and the axis that is up, as the file says or is usual for its kind.
#[derive(Resource)]
pub struct Usual {
    pub scale: f32,
    pub up: UpAxis,
}

/// Why no hair has grown.
#[derive(Resource, Default)]
pub struct Refused(pub Vec<String>);

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

/// The half axes of the head's skull (m).
#[derive(Component)]
struct Skull(Vec3);

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
            .init_resource::<Refused>()
            .insert_resource(Time::<Fixed>::from_hz(60.0))
            .add_systems(Startup, load)
            .add_systems(Update, put_on.pipe(give_up).run_if(not(resource_exists::<Shown>)))
            .add_systems(Last, refuse)
            .add_systems(FixedUpdate, shake)
            .add_systems(FixedLast, measure);
    }
}

fn refuse(mut faults: MessageReader<HairFault>, mut refused: ResMut<Refused>) {
    let faults = faults.read().filter(|fault| fault.kind == FaultKind::Groom);
    refused.0.extend(faults.map(ToString::to_string));
}

fn give_up(
    In(shown): In<Result>,
    mut refused: ResMut<Refused>,
    mut exit: MessageWriter<AppExit>,
    arguments: Res<Arguments>,
) {
    if let Err(error) = shown {
        // Without the trace that Bevy puts behind it.
        let error = error.to_string().lines().next().unwrap_or_default().to_owned();
        if arguments.offscreen.is_none() {
            eprintln!("error: {}: {error}", arguments.file.display());
        }
        refused.0.push(error);
        exit.write(AppExit::error());
    }
}

fn load(
    mut commands: Commands,
    assets: Res<AssetServer>,
    arguments: Res<Arguments>,
    usual: Res<Usual>,
) {
    let scale = Some(arguments.scale.unwrap_or(usual.scale));
    let up = arguments.up.map(UpAxis::from);
    let name = arguments.file.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let roots = arguments.roots.into();
    let (strict, keep_strays) = (arguments.strict, arguments.keep_strays);
    let load = assets.load_builder().with_settings(move |s: &mut GroomSettings| {
        // What is short is known once the scale is.
        (s.scale, s.up, s.shortest_segment) = (scale, up, 0.0);
        (s.roots, s.strict, s.keep_strays) = (roots, strict, keep_strays);
    });
    commands.insert_resource(Loading(load.load(name)));
}

/// The groom in a size that hair can have. A scale that was asked for stays.
fn sized(groom: &Groom, usual: &Usual, asked: Option<f32>, up: Option<UpAxis>) -> Result<Groom> {
    let scale = asked.unwrap_or(usual.scale);
    let mut factor = 1.0;
    if let Some(odd) = groom.odd_size(scale) {
        println!("with {scale} m a unit {odd}");
        if asked.is_none() {
            println!("shown as by --scale {}", odd.scale);
            factor = odd.scale / scale;
        }
    }
    let (groom, losses) =
        groom.clone().scaled(factor)?.merged(GroomSettings::default().shortest_segment)?;
    if groom.is_empty() {
        return Err(GroomError::Empty.into());
    }
    if !losses.is_empty() {
        println!("{losses}");
    }
    let up = up.unwrap_or(usual.up);
    if let Some(odd) = groom.odd_up(up) {
        let name = format!("{odd:?}").to_lowercase().replace("neg", "neg-");
        println!("with {up:?} up it lies on its side or stands on its head; try --up {name}");
    }
    Ok(groom)
}

/// Grows the groom on a head that fits its roots, the middle of its skull being the origin. Where no head
/// fits, as for a tail or a fringe, the origin is the middle of the roots, and nothing is below.
fn put_on(
    mut commands: Commands,
    mut paint: Paint,
    mut grooms: ResMut<Assets<Groom>>,
    loading: Res<Loading>,
    (arguments, usual): (Res<Arguments>, Res<Usual>),
) -> Result {
    let Some(groom) = grooms.get(&loading.0) else {
        return Ok(());
    };
    let up = arguments.up.map(UpAxis::from);
    let groom = sized(groom, &usual, arguments.scale, up)?;
    let ball = groom.fit_head();
    let roots = || groom.roots().map(|r| r / groom.len() as f32).sum::<Vec3>();
    let centre = ball.map_or_else(roots, |ball| ball.center.into());
    let radius = ball.map_or(0.0, |ball| ball.radius());
    let groom = groom.moved(-centre)?;
    let skull = ball.map(|_| stand_in::skull(&groom, radius));
    let (mut low, high) = groom.extents().unwrap_or_default();
    if let Some(skull) = skull {
        // Down to the chin.
        low = low.min(Vec3::new(low.x, -1.8 * skull.y, low.z));
    }
    let middle = 0.5 * (low + high);
    // Hair on the back of something large: turned around where it grows, and shown from aside.
    let aside = middle * Vec3::new(1.0, 0.0, 1.0);
    let (pivot, rest) = match aside.length() > 0.5 * radius {
        true => (aside, camera::YAW - 1.2 - aside.x.atan2(aside.z)),
        false => (Vec3::ZERO, 0.0),
    };
    // Room for the swing.
    let (middle, reach) = (pivot + middle * Vec3::Y, 0.5 * (high - low).length());
    let size = reach / 0.25;
    studio::light(&mut commands, middle, size);
    print!("{} strands, {} nodes, ", groom.len(), groom.points().len());
    let head = commands.spawn((Head, Visibility::default(), place(pivot, rest))).id();
    let mut floor = middle.y - 1.3 * reach;
    match skull {
        Some(skull) => {
            println!("head of radius {radius:.3} m at {centre}");
            let melanin = HairLook::default().melanin;
            let end = stand_in::spawn(&mut commands, &mut paint, head, (&groom, skull), melanin)?;
            floor = floor.min(-1.05 * end);
            commands.entity(head).insert(Skull(skull));
        }
        None => println!("no head: the roots are too few of one to tell where it is"),
    }
    studio::room(&mut commands, &mut paint, floor, 1.6 * size);
    let (count, nodes) = (arguments.guides as usize, arguments.nodes as usize);
    let guides = GroomGuides { count, nodes, ..default() };
    let hair = GroomedHair { groom: grooms.add(groom), guides };
    let stiffness = HairStiffness::from_bending_length(arguments.stiffness)?;
    commands.entity(head).with_child((hair, stiffness, HairFollowers::new(100_000)));
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
    heads: Query<&Skull>,
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
    let skull = heads.iter().next().map_or(Vec3::ZERO, |skull| skull.0);
    let radius = skull.min_element();
    // Roots are where the groom has them; the first free node may have to leave the head steeply.
    let depth = |strand: &Strand| {
        let free = strand.positions().iter().skip(1);
        let within = |p: &Vec3| 1.0 - (*p / skull.max(Vec3::splat(1e-9))).length();
        free.map(|p| radius * within(p)).fold(0.0, f32::max)
    };
    measure.deepest = strands.iter().map(depth).fold(0.0, f32::max);
}

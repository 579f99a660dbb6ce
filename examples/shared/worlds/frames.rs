//! Frames and ticks: heads that move by uneven frames, any rate of ticks.

use super::{Row, app, lean, one_strand, place_mut, ready, strand, strand_along};
use bevy::{
    animation::{AnimatedBy, AnimationTargetId, animated_field, prelude::*},
    prelude::*,
    time::TimeUpdateStrategy,
};
use bevy_keratin::{hair::strand::TickPose, prelude::*};
use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};
use std::time::Duration;

/// How a head moves: at a speed, turning on its way.
#[derive(Resource, Clone, Copy)]
pub struct Path {
    pub speed: f32,
    pub spin: f32,
}

impl Path {
    pub fn at(&self, seconds: f64) -> Transform {
        let along = (f64::from(self.speed) * seconds) as f32;
        let turn = (f64::from(self.spin) * seconds).rem_euclid(core::f64::consts::TAU) as f32;
        Transform::from_xyz(along, 0.0, 0.0).with_rotation(Quat::from_rotation_y(turn))
    }
}

/// Frames of a game (s).
struct Frames {
    name: &'static str,
    frame: fn(&mut Xoshiro256PlusPlus, usize) -> f64,
    /// How fast game time passes in each.
    pace: fn(usize) -> f32,
    /// What such a game may do besides.
    discards: &'static [Discards],
}

const FRAMES: Frames =
    Frames { name: "even", frame: |_, _| 1.0 / 60.0, pace: |_| 1.0, discards: &[] };
const EVEN: Frames = Frames { discards: &[Discards::Nothing, Discards::Clock], ..FRAMES };
const ALTERNATING: Frames = Frames {
    name: "alternating",
    frame: |_, i| [1.0 / 60.0, 1.0 / 30.0][i % 2],
    discards: &[Discards::Nothing, Discards::Clock],
    ..FRAMES
};
const ANY: Frames = Frames {
    name: "any",
    frame: |random, _| random.random_range(0.004..0.25),
    discards: &[Discards::Nothing],
    ..FRAMES
};

const ALL: [Frames; 7] = [
    EVEN,
    ALTERNATING,
    Frames {
        name: "hitches",
        frame: |random, i| match i % 40 {
            39 => random.random_range(0.05..0.25),
            _ => 1.0 / 60.0,
        },
        discards: &[Discards::Nothing, Discards::Overstep],
        ..FRAMES
    },
    Frames {
        name: "load spike",
        frame: |random, i| match i % 120 {
            0..60 => 1.0 / 60.0,
            _ => random.random_range(0.08..0.25),
        },
        discards: &[Discards::Ticks],
        ..FRAMES
    },
    ANY,
    // A second, and two at a twentieth.
    Frames {
        name: "bullet time 0.05",
        pace: |i| if i % 180 < 60 { 1.0 } else { 0.05 },
        discards: &[Discards::Nothing],
        ..FRAMES
    },
    // A second, and two in a fifth.
    Frames {
        name: "fast forward 10",
        pace: |i| if i % 72 < 60 { 1.0 } else { 10.0 },
        discards: &[Discards::Nothing],
        ..FRAMES
    },
];

/// What hair of a moving head does.
#[derive(Clone, Copy, Debug, Default)]
struct Ride {
    /// The largest error of the head's speed in a tick, as a share, and of its spin.
    errors: [f32; 2],
    /// The lean of the hair (°), least and most.
    lean: [f32; 2],
    /// The largest acceleration of a tip seen from the head (m/s²).
    acceleration: f32,
}

/// What moves a head.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Moved {
    Update,
    FixedUpdate,
    /// By frames, on a vehicle that ticks move, each half of the way.
    Both,
    /// By an animation player, in `PostUpdate`.
    Player,
}

/// What a game does against the spiral of death.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Discards {
    Nothing,
    /// The overstep of every 50th frame, which is less than a tick.
    Overstep,
    /// What is left after three ticks of a frame.
    Ticks,
    /// It is a new clock of fixed ticks, now and then, of another rate.
    Clock,
}

/// Has an animation player move a hair along a path.
fn animate(app: &mut App, hair: Entity, path: Path) {
    const END: f64 = 240.0;
    let places = [0.0, END].map(|at| (at as f32, path.at(at).translation));
    let turns = (0..=(END * 10.0) as usize).map(|i| {
        let at = 0.1 * i as f64;
        (at as f32, path.at(at).rotation)
    });
    let target = AnimationTargetId::from_name(&Name::new("Head"));
    let mut clip = AnimationClip::default();
    clip.add_curve_to_target(
        target,
        AnimatableCurve::new(
            animated_field!(Transform::translation),
            AnimatableKeyframeCurve::new(places).unwrap(),
        ),
    );
    clip.add_curve_to_target(
        target,
        AnimatableCurve::new(
            animated_field!(Transform::rotation),
            AnimatableKeyframeCurve::new(turns).unwrap(),
        ),
    );
    let world = app.world_mut();
    let clip = world.resource_mut::<Assets<AnimationClip>>().add(clip);
    let (graph, node) = AnimationGraph::from_clip(clip);
    let graph = world.resource_mut::<Assets<AnimationGraph>>().add(graph);
    let mut player = AnimationPlayer::default();
    player.play(node);
    world.entity_mut(hair).insert((player, AnimationGraphHandle(graph), target, AnimatedBy(hair)));
}

/// What carries a head in its own half of the way.
#[derive(Component)]
struct Vehicle;

/// 64 ticks a second, as Bevy's default is.
fn app_with_players() -> App {
    let mut app = App::new();
    app.add_plugins((
        MinimalPlugins,
        TransformPlugin,
        AssetPlugin::default(),
        AnimationPlugin,
        HairPlugins::default(),
    ));
    ready(&mut app);
    app
}

/// What is seen of a tick.
struct Tick {
    seconds: f32,
    speed: f32,
    spin: f32,
    lean: f32,
    tip: Vec3,
}

/// Rides along a path by these frames.
fn ride(path: Path, frames: &Frames, moved: Moved, discards: Discards, seconds: f64) -> Ride {
    #[derive(Resource, Default)]
    struct Seen(Vec<Tick>);
    let mut app = app_with_players();
    let (hair, id) = one_strand(&mut app);
    app.insert_resource(path).init_resource::<Seen>();
    let half = Path { speed: 0.5 * path.speed, spin: 0.0 };
    let own = if moved == Moved::Both { Path { spin: path.spin, ..half } } else { path };
    let walk = move |time: Res<Time>, mut heads: Query<&mut Transform, With<Hair>>| {
        heads.iter_mut().for_each(|mut head| *head = own.at(time.elapsed_secs_f64()));
    };
    match moved {
        Moved::FixedUpdate => _ = app.add_systems(FixedUpdate, walk),
        Moved::Update | Moved::Both => _ = app.add_systems(Update, walk),
        Moved::Player => animate(&mut app, hair, path),
    }
    if discards == Discards::Ticks {
        let limit = |mut time: ResMut<Time<Fixed>>,
                     frame: Res<Time<Virtual>>,
                     mut ticks: Local<(Duration, u32)>| {
            let count = if ticks.0 == frame.elapsed() { ticks.1 + 1 } else { 1 };
            *ticks = (frame.elapsed(), count);
            if count == 3 {
                time.discard_overstep(Duration::MAX);
            }
        };
        app.add_systems(FixedLast, limit);
    }
    if moved == Moved::Both {
        let vehicle = app.world_mut().spawn((Vehicle, Transform::default())).id();
        app.world_mut().entity_mut(hair).insert(ChildOf(vehicle));
        let drive = move |time: Res<Time>, mut all: Query<&mut Transform, With<Vehicle>>| {
            all.iter_mut().for_each(|mut place| *place = half.at(time.elapsed_secs_f64()));
        };
        app.add_systems(FixedUpdate, drive);
    }
    let watch = move |step: Res<HairStep>,
                      poses: Query<&TickPose>,
                      strands: Query<&Strand>,
                      mut before: Local<Option<Vec3>>,
                      mut seen: ResMut<Seen>| {
        let (Ok(pose), Ok(strand)) = (poses.get(hair), strands.get(id)) else { return };
        if step.index == 0 {
            *before = Some(pose.before().translation);
        }
        if let Some(from) = before.filter(|_| step.index + 1 == step.count) {
            let seconds = step.dt * step.count as f32;
            seen.0.push(Tick {
                seconds,
                speed: (pose.now().translation - from).length() / seconds,
                spin: pose.spin().length(),
                lean: lean(strand),
                tip: *strand.positions().last().unwrap(),
            });
        }
    };
    app.add_systems(HairTick, watch.in_set(HairSystems::Last));
    let mut random = Xoshiro256PlusPlus::seed_from_u64(38);
    // It starts from rest. Where time is discarded, fewer ticks pass.
    let [first, last] = [WARM_UP, WARM_UP + seconds].map(|at| (at * 64.0) as usize);
    for i in 0.. {
        let frame = (frames.frame)(&mut random, i);
        let pace = (frames.pace)(i);
        app.world_mut().resource_mut::<Time<Virtual>>().set_relative_speed(pace);
        if discards == Discards::Clock && i % 50 == 49 {
            let hertz = [30.0, 60.0, 64.0][(i / 50) % 3];
            app.insert_resource(Time::<Fixed>::from_hz(hertz));
        }
        app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_secs_f64(frame)));
        app.update();
        if discards == Discards::Overstep && i % 50 == 49 {
            app.world_mut().resource_mut::<Time<Fixed>>().discard_overstep(Duration::MAX);
        }
        if app.world().resource::<Seen>().0.len() > last {
            break;
        }
    }
    let seen = &app.world().resource::<Seen>().0[first..];
    let mut ride = Ride { lean: [f32::INFINITY, 0.0], ..default() };
    for tick in seen {
        for (i, (is, of)) in [(tick.speed, path.speed), (tick.spin, path.spin)].iter().enumerate() {
            if *of > 0.0 {
                ride.errors[i] = ride.errors[i].max((is / of - 1.0).abs());
            }
        }
        ride.lean = [ride.lean[0].min(tick.lean), ride.lean[1].max(tick.lean)];
    }
    for ticks in seen.windows(3) {
        let [a, b, c] = [&ticks[0], &ticks[1], &ticks[2]];
        if [a, b].iter().all(|tick| (tick.seconds - c.seconds).abs() < 1e-6) {
            let change = (a.tip - 2.0 * b.tip + c.tip).length() / c.seconds.powi(2);
            ride.acceleration = ride.acceleration.max(change);
        }
    }
    ride
}

/// How often a rider gets on a vehicle, or off it (ticks).
const STAYS: usize = 11;

/// A ride beside a vehicle and on it by turns, along the same way: where hair is at the end of each tick.
fn on_and_off(path: Path, frames: &Frames, by_ticks: bool, changes: bool) -> Vec<Strand> {
    const SEAT: Transform = Transform::from_xyz(0.5, 1.0, 0.0);
    #[derive(Resource, Default)]
    struct Seen(Vec<Strand>);
    let mut app = app_with_players();
    let (hair, id) = one_strand(&mut app);
    let vehicle = app.world_mut().spawn((Vehicle, Transform::default())).id();
    app.init_resource::<Seen>();
    let ride =
        move |time: Res<Time>,
              mut vehicles: Query<&mut Transform, With<Vehicle>>,
              mut riders: Query<(&mut Transform, Has<ChildOf>), Without<Vehicle>>| {
            let now = path.at(time.elapsed_secs_f64());
            vehicles.iter_mut().for_each(|mut place| *place = now);
            for (mut place, is_on_it) in &mut riders {
                *place = if is_on_it { SEAT } else { now * SEAT };
            }
        };
    match by_ticks {
        true => app.add_systems(FixedUpdate, ride),
        false => app.add_systems(Update, ride),
    };
    let watch = move |step: Res<HairStep>, strands: Query<&Strand>, mut seen: ResMut<Seen>| {
        if let Ok(strand) = strands.get(id)
            && step.index + 1 == step.count
        {
            seen.0.push(strand.clone());
        }
    };
    app.add_systems(HairTick, watch.in_set(HairSystems::Last).ambiguous_with_all());
    let mut random = Xoshiro256PlusPlus::seed_from_u64(38);
    let (mut seconds, mut last_change) = (0.0, 0);
    for i in 0.. {
        let ticks = app.world().resource::<Seen>().0.len();
        if changes && seconds > WARM_UP && ticks - last_change > STAYS {
            last_change = ticks;
            let was_on_it = app.world().get::<ChildOf>(hair).is_some();
            let at = app.world().get::<GlobalTransform>(hair).copied().unwrap_or_default();
            let mut rider = app.world_mut().entity_mut(hair);
            match was_on_it {
                true => rider.remove::<ChildOf>().insert(at.compute_transform()),
                false => rider.insert((ChildOf(vehicle), SEAT)),
            };
        }
        let frame = (frames.frame)(&mut random, i);
        seconds += frame;
        app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_secs_f64(frame)));
        app.update();
        if seconds > WARM_UP + 4.0 {
            break;
        }
    }
    app.world_mut().resource_mut::<Seen>().0.split_off((WARM_UP * 64.0) as usize)
}

/// Line 1: a rider who gets on a vehicle and off it, by another parent, is where he was, in each tick.
pub fn reparented() -> Vec<Row> {
    let mut rows = Vec::new();
    for (speed, spin) in [(3.0, 0.0), (12.0, 0.0), (3.0, 1.0)] {
        for by_ticks in [false, true] {
            for frames in [&EVEN, &ALL[2], &ANY] {
                let path = Path { speed, spin };
                let control = on_and_off(path, frames, by_ticks, false);
                let got = on_and_off(path, frames, by_ticks, true);
                let pairs = || control.iter().zip(&got);
                let off = pairs()
                    .map(|(a, b)| super::apart(a.positions(), b.positions()))
                    .fold(0.0, f32::max);
                let faster = pairs()
                    .map(|(a, b)| super::apart(a.velocities(), b.velocities()))
                    .fold(0.0, f32::max);
                let moved = if by_ticks { "FixedUpdate" } else { "Update" };
                let what = format!(
                    "{speed} m/s, {spin} rad/s, on and off a vehicle, {moved}, {} frames",
                    frames.name
                );
                // Within a frame that ticks do not see, a rider beside it goes straight, and one on it with its turn:
                // in 0.25 s by 1 rad/s at 0.5 m by 4 mm.
                let cuts_corners = spin > 0.0 && !by_ticks && frames.name == "any";
                let [most, most_faster] = if cuts_corners { [0.01, 0.1] } else { [1e-3, 0.01] };
                rows.extend([
                    Row::new(format!("{what}: ticks"), control.len() as f32, got.len() as f32, 0.0),
                    Row::at_most(format!("{what}: off (m)"), off, most),
                    Row::at_most(format!("{what}: other speed (m/s)"), faster, most_faster),
                ]);
            }
        }
    }
    rows
}

/// After how long rides are measured (s).
const WARM_UP: f64 = 4.0;

/// How heads ride: speeds (m/s) and spins (rad/s).
pub const RIDES: [(f32, f32); 5] = [(3.0, 0.0), (12.0, 0.0), (3.0, 8.0), (1.0, 0.0), (12.0, 8.0)];

/// Lines 1 and 2: hair of a head that moves evenly hangs as by even frames, whatever the frames are. Each ride is
/// measured for some `seconds`.
pub fn frames(rides: &[(f32, f32)], seconds: f64) -> Vec<Row> {
    let mut rows = Vec::new();
    for (speed, spin) in rides.iter().copied() {
        let path = Path { speed, spin };
        let control = ride(path, &EVEN, Moved::FixedUpdate, Discards::Nothing, seconds);
        for moved in [Moved::Update, Moved::FixedUpdate, Moved::Both, Moved::Player] {
            for (frames, discards) in ALL
                .iter()
                .flat_map(|frames| frames.discards.iter().map(move |discards| (frames, *discards)))
            {
                // Where time is discarded, what ticks move stands still and what frames move does not. What they
                // move by a clock that starts anew is somewhere else then.
                let is_other = match moved {
                    Moved::Both => discards != Discards::Nothing,
                    Moved::FixedUpdate => discards == Discards::Clock,
                    _ => false,
                };
                if !is_other {
                    rows.extend(row_of_ride(path, frames, moved, discards, &control, seconds));
                }
            }
        }
    }
    rows
}

/// One ride, against its control.
fn row_of_ride(
    path: Path,
    frames: &Frames,
    moved: Moved,
    discards: Discards,
    control: &Ride,
    seconds: f64,
) -> Vec<Row> {
    let Path { speed, spin } = path;
    let got = ride(path, frames, moved, discards, seconds);
    let and = match discards {
        Discards::Nothing => "",
        Discards::Overstep => ", overstep discarded",
        Discards::Ticks => ", at most 3 ticks a frame",
        Discards::Clock => ", new Time<Fixed> of 30, 60, 64 Hz",
    };
    let what = format!("{speed} m/s, {spin} rad/s, {} frames, {moved:?}{and}", frames.name);
    let [[least, most], [low, high]] = [control.lean, got.lean];
    let mut rows = vec![Row::at_most(format!("{what}: error of speed"), got.errors[0], 0.1)];
    if spin > 0.0 {
        rows.push(Row::at_most(format!("{what}: error of spin"), got.errors[1], 0.1));
    }
    // By frames it turns by up to 1.6 rad while no tick runs, and its hair with it, which then leans to where
    // the wind no longer comes from: it swings, and is not whipped.
    let turns_unseen =
        spin > 0.0 && discards == Discards::Ticks && matches!(moved, Moved::Update | Moved::Player);
    if turns_unseen {
        rows.extend([
            Row::at_most(format!("{what}: lean, turned unseen (°)"), high, 36.0 + 8.0 * speed),
            Row::at_most(format!("{what}: tips (m/s²)"), got.acceleration, 10.0 + 30.0 * speed),
        ]);
        return rows;
    }
    let tips = format!("{what}: tips, at most twice the control's or 0.5 m/s² more (m/s²)");
    rows.extend([
        Row::new(format!("{what}: least lean (°)"), least, low, 3.0),
        Row::new(format!("{what}: most lean (°)"), most, high, 3.0),
        Row::at_most(tips, got.acceleration, 2.0 * control.acceleration + 0.5),
    ]);
    rows
}

/// Line 3: how hair leans that is 10 cm off the axis of a head that spins at 17 rad/s (°).
fn lean_in_a_spin(hertz: f64) -> f32 {
    let mut app = app(hertz);
    let pivot = app.world_mut().spawn(Transform::default()).id();
    let (hair, id) = one_strand(&mut app);
    app.world_mut().entity_mut(hair).insert((ChildOf(pivot), Transform::from_xyz(0.1, 0.0, 0.0)));
    let mut turn = 0.0;
    for tick in 0..(4.0 * hertz) as usize {
        turn += 17.0 / hertz * (tick as f64 / hertz).min(1.0);
        let rotation = Quat::from_rotation_y(turn.rem_euclid(core::f64::consts::TAU) as f32);
        place_mut(&mut app, pivot, |place| place.rotation = rotation);
        app.update();
    }
    lean(&strand(&app, id))
}

/// Line 3: no speed is a jump that lasts, and the lean is the same at any rate of ticks.
pub fn riders() -> Vec<Row> {
    let lean_at = |hertz: f64, speed: f32| {
        let mut app = app(hertz);
        let (hair, id) = one_strand(&mut app);
        let mut x = 0.0;
        for tick in 0..(4.0 * hertz) as usize {
            x += f64::from(speed) / hertz * (tick as f64 / hertz).min(1.0);
            place_mut(&mut app, hair, |place| place.translation.x = x as f32);
            app.update();
        }
        lean(&strand(&app, id))
    };
    let mut rows = Vec::new();
    for speed in [2.0, 12.0, 60.0] {
        let control = lean_at(60.0, speed);
        for hertz in [10.0, 30.0, 144.0, 240.0] {
            let what = format!("{speed} m/s at {hertz} Hz: lean (°)");
            rows.push(Row::new(what, control, lean_at(hertz, speed), 0.01 * control));
        }
    }
    let small = lean_in_a_spin(480.0);
    rows.push(Row::new("control, spin of 17 rad/s at 480 Hz: lean (°)", 75.0, small, 15.0));
    for hertz in [30.0, 60.0, 64.0] {
        let what = format!("spin of 17 rad/s at {hertz} Hz: lean (°)");
        rows.push(Row::new(what, small, lean_in_a_spin(hertz), 0.02 * small));
    }
    let path = Path { speed: 14.0, spin: 0.0 };
    let control = ride(path, &EVEN, Moved::FixedUpdate, Discards::Nothing, 1.0);
    let frames = Frames { name: "30 Hz", frame: |_, _| 1.0 / 30.0, ..FRAMES };
    rows.extend(row_of_ride(path, &frames, Moved::Update, Discards::Nothing, &control, 4.0));
    rows
}

/// In how many substeps the strands have moved.
#[derive(Resource, Default)]
struct Solves {
    count: u32,
    last: Vec<Vec3>,
}

/// Solves of hair in a second.
fn solves(hertz: u32, wet: bool) -> f32 {
    let mut app = app(hertz.into());
    let count = |strands: Query<&Strand>, mut solves: ResMut<Solves>| {
        let now: Vec<Vec3> = strands.iter().flat_map(|s| s.positions().to_vec()).collect();
        solves.count += u32::from(now != solves.last);
        solves.last = now;
    };
    app.init_resource::<Solves>()
        .add_systems(HairTick, count.in_set(HairSystems::Last).ambiguous_with_all());
    let (hair, _) = strand_along(&mut app, 0.2, 4, Vec3::X);
    if wet {
        app.world_mut().trigger(SoakHair::dripping(hair));
    }
    (0..hertz / 4).for_each(|_| app.update());
    app.world_mut().resource_mut::<Solves>().count = 0;
    (0..hertz).for_each(|_| app.update());
    app.world().resource::<Solves>().count as f32
}

/// The lean of a strand in wind in the middle of its first swing, and when it has come to rest (°).
fn swing(hertz: f64) -> [f32; 2] {
    let mut app = app(hertz);
    app.insert_resource(HairWind { velocity: Vec3::X * 3.0, gusts: 0.0, ..default() });
    let (_, e) = strand_along(&mut app, 0.2, 6, Vec3::NEG_Y);
    [0.25, 3.75].map(|seconds| {
        super::run(&mut app, seconds);
        lean(&strand(&app, e))
    })
}

/// Line 5: a tick has as many solves as it needs at any rate, of at most 1/180 s each, and hair swings alike.
pub fn rates() -> Vec<Row> {
    let mut rows = Vec::new();
    for hertz in [60u32, 64, 72, 75, 90, 120, 144, 165, 180] {
        let each = 180u32.div_ceil(hertz);
        let what = format!("{hertz} Hz: solves of dry hair a second");
        rows.push(Row::new(what, (hertz * each) as f32, solves(hertz, false), 3.0));
    }
    for (hertz, expected) in [(60, 180), (72, 216)] {
        let what = format!("{hertz} Hz: solves of wet hair a second, as many as of dry hair");
        rows.push(Row::new(what, expected as f32, solves(hertz, true), 3.0));
    }
    let [swings, rests] = swing(60.0);
    rows.push(Row::new("control, 60 Hz: lean at rest (°)", 17.0, rests, 7.0));
    for hertz in [72.0, 75.0, 90.0, 120.0, 144.0, 165.0, 240.0] {
        let found = swing(hertz);
        rows.extend([
            Row::new(format!("{hertz} Hz: lean at rest (°)"), rests, found[1], 0.01 * rests),
            Row::new(format!("{hertz} Hz: lean in its swing (°)"), swings, found[0], 0.05 * swings),
        ]);
    }
    rows
}

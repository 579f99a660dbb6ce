//! What games do to a world rather than to hair, measured: frames, jumps, vehicles, scale.

use super::rows::Row;
use bevy::{prelude::*, time::TimeUpdateStrategy};
use bevy_keratin::{hair::strand::TickPose, prelude::*};
use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};
use std::time::Duration;

/// Radius of a head (m).
const HEAD: f32 = 0.09;

fn app(hertz: f64) -> App {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, HairPlugins::default()))
        .insert_resource(Time::<Fixed>::from_hz(hertz))
        .insert_resource(TimeUpdateStrategy::FixedTimesteps(1))
        .add_plugins(TransformPlugin);
    app.world_mut().resource_mut::<Time<Virtual>>().set_max_delta(Duration::MAX);
    app.finish();
    app.cleanup();
    app.update();
    app
}

/// A strand of 30 cm that hangs from its own frame.
fn one_strand(app: &mut App) -> (Entity, Entity) {
    let points: Vec<Vec3> = (0..=12).map(|i| Vec3::NEG_Y * (0.025 * i as f32)).collect();
    let hair = app.world_mut().spawn(Hair).id();
    let strand = Strand::from_polyline(&points).unwrap_or_default();
    (hair, app.world_mut().spawn((StrandOf(hair), strand)).id())
}

/// A head with strands all over its upper half, settled.
fn head(app: &mut App, strands: usize) -> Entity {
    let place = Transform::from_xyz(0.0, 1.6, 0.0);
    let ball = HairCollider::sphere(HEAD).unwrap_or_default();
    let head = app.world_mut().spawn((ball, place)).id();
    let hair = app.world_mut().spawn((Hair, ChildOf(head))).id();
    for i in 0..strands {
        let y = (i as f32 + 0.5) / strands as f32;
        let across = (1.0 - y * y).sqrt();
        let (sine, cosine) = (2.4 * i as f32).sin_cos();
        let normal = Vec3::new(across * cosine, y, across * sine);
        let points: Vec<Vec3> =
            (0..10).map(|k| normal * (HEAD + 0.002 + 0.025 * k as f32)).collect();
        let strand = Strand::from_polyline(&points).unwrap_or_default();
        app.world_mut().spawn((StrandOf(hair), strand));
    }
    for _ in 0..240 {
        app.update();
    }
    head
}

fn strand(app: &App, id: Entity) -> Strand {
    app.world().get::<Strand>(id).cloned().unwrap_or_default()
}

fn all(app: &mut App) -> Vec<Strand> {
    app.world_mut().query::<&Strand>().iter(app.world()).cloned().collect()
}

fn place_mut(app: &mut App, id: Entity, change: impl FnOnce(&mut Transform)) {
    if let Some(mut place) = app.world_mut().get_mut::<Transform>(id) {
        change(&mut place);
    }
}

/// All rows.
pub fn rows() -> Vec<Row> {
    [frames(), riders(), returns(), portals(), vehicles(), scales(), squashed(), hidden(), gusts()]
        .concat()
}

/// How a head moves: at a speed, turning on its way.
#[derive(Resource, Clone, Copy)]
struct Path {
    speed: f32,
    spin: f32,
}

impl Path {
    fn at(&self, seconds: f64) -> Transform {
        let along = (f64::from(self.speed) * seconds) as f32;
        let turn = (f64::from(self.spin) * seconds).rem_euclid(core::f64::consts::TAU) as f32;
        Transform::from_xyz(along, 0.0, 0.0).with_rotation(Quat::from_rotation_y(turn))
    }
}

/// Frames of a game (s).
struct Frames {
    name: &'static str,
    frame: fn(&mut Xoshiro256PlusPlus, usize) -> f64,
}

const EVEN: Frames = Frames { name: "even", frame: |_, _| 1.0 / 60.0 };

const UNEVEN: [Frames; 3] = [
    Frames { name: "alternating", frame: |_, i| [1.0 / 60.0, 1.0 / 30.0][i % 2] },
    Frames {
        name: "hitches",
        frame: |random, i| match i % 40 {
            39 => random.random_range(0.05..0.25),
            _ => 1.0 / 60.0,
        },
    },
    Frames { name: "any", frame: |random, _| random.random_range(0.004..0.25) },
];

/// What hair of a moving head does.
#[derive(Clone, Copy, Debug, Default)]
struct Ride {
    /// The largest error of the head's speed in a tick, as a share.
    speed_error: f32,
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
}

/// What carries a head in its own half of the way.
#[derive(Component)]
struct Vehicle;

/// Rides along a path by these frames; every 50th frame discards its overstep if `discards`.
fn ride(path: Path, frames: &Frames, moved: Moved, discards: bool, seconds: f64) -> Ride {
    #[derive(Resource, Default)]
    struct Seen(Vec<(f32, f32, Vec3)>);
    let mut app = app(64.0);
    let (hair, id) = one_strand(&mut app);
    app.insert_resource(path).init_resource::<Seen>();
    let half = Path { speed: 0.5 * path.speed, spin: 0.0 };
    let own = if moved == Moved::Both { Path { spin: path.spin, ..half } } else { path };
    let walk = move |time: Res<Time>, mut heads: Query<&mut Transform, With<Hair>>| {
        heads.iter_mut().for_each(|mut head| *head = own.at(time.elapsed_secs_f64()));
    };
    match moved {
        Moved::FixedUpdate => app.add_systems(FixedUpdate, walk),
        Moved::Update | Moved::Both => app.add_systems(Update, walk),
    };
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
            let speed = (pose.now().translation - from).length() / (step.dt * step.count as f32);
            let tip = *strand.positions().last().unwrap();
            seen.0.push((speed, lean(strand), tip));
        }
    };
    app.add_systems(HairTick, watch.in_set(HairSystems::Last));
    let mut random = Xoshiro256PlusPlus::seed_from_u64(38);
    let (mut passed, mut counted) = (0.0, 0);
    for i in 0.. {
        let frame = (frames.frame)(&mut random, i);
        app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_secs_f64(frame)));
        app.update();
        if discards && i % 50 == 49 {
            app.world_mut().resource_mut::<Time<Fixed>>().discard_overstep(Duration::MAX);
        }
        passed += frame;
        // It starts from rest.
        if passed < 3.0 {
            counted = app.world().resource::<Seen>().0.len();
        }
        if passed > 3.0 + seconds {
            break;
        }
    }
    let seen = &app.world().resource::<Seen>().0[counted..];
    let tick = 1.0 / 64.0;
    let mut ride = Ride { lean: [f32::INFINITY, 0.0], ..default() };
    for (speed, lean, _) in seen {
        if path.speed > 0.0 {
            ride.speed_error = ride.speed_error.max((speed / path.speed - 1.0).abs());
        }
        ride.lean = [ride.lean[0].min(*lean), ride.lean[1].max(*lean)];
    }
    for tips in seen.windows(3) {
        let [a, b, c] = [tips[0].2, tips[1].2, tips[2].2];
        ride.acceleration = ride.acceleration.max((a - 2.0 * b + c).length() / (tick * tick));
    }
    ride
}

/// The angle of a strand's chord to straight down (°).
fn lean(strand: &Strand) -> f32 {
    let p = strand.positions();
    (p[p.len() - 1] - p[0]).angle_between(Vec3::NEG_Y).to_degrees()
}

/// Lines 1 and 2: hair of a head that moves evenly hangs as by even frames, whatever the frames are.
pub fn frames() -> Vec<Row> {
    let mut rows = Vec::new();
    for (speed, spin) in [(3.0, 0.0), (12.0, 0.0), (3.0, 8.0)] {
        let path = Path { speed, spin };
        let control = ride(path, &EVEN, Moved::FixedUpdate, false, 5.0);
        for moved in [Moved::Update, Moved::FixedUpdate, Moved::Both] {
            for frames in &UNEVEN {
                for discards in [false, true] {
                    // Where ticks are discarded, what ticks move stands still and what frames move does not.
                    if discards && moved == Moved::Both {
                        continue;
                    }
                    let got = ride(path, frames, moved, discards, 5.0);
                    let discards = if discards { ", overstep discarded" } else { "" };
                    let what = format!(
                        "{speed} m/s, {spin} rad/s, {} frames, {moved:?}{discards}",
                        frames.name
                    );
                    let [[least, most], [low, high]] = [control.lean, got.lean];
                    let twice = 2.0 * control.acceleration + 0.5;
                    rows.extend([
                        Row::at_most(format!("{what}: error of speed"), got.speed_error, 0.1),
                        Row::new(format!("{what}: least lean (°)"), least, low, 3.0),
                        Row::new(format!("{what}: most lean (°)"), most, high, 3.0),
                        Row::at_most(format!("{what}: tips (m/s²)"), got.acceleration, twice),
                    ]);
                }
            }
        }
    }
    rows
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
    rows
}

/// The fastest node and the farthest move of one, seen from the head, in half a second from now on.
fn disturbance(app: &mut App, ids: &[Entity]) -> (f32, f32) {
    let places = |app: &App| -> Vec<Vec3> {
        ids.iter().flat_map(|id| strand(app, *id).positions().to_vec()).collect()
    };
    let began = places(app);
    let (mut before, mut fastest, mut farthest) = (began.clone(), 0.0f32, 0.0f32);
    for _ in 0..30 {
        app.update();
        let now = places(app);
        for ((now, before), began) in now.iter().zip(&before).zip(&began) {
            fastest = fastest.max(now.distance(*before) * 60.0);
            farthest = farthest.max(now.distance(*began));
        }
        before = now;
    }
    (fastest, farthest)
}

/// Line 4: what was not simulated comes back at rest where it is.
pub fn returns() -> Vec<Row> {
    use bevy::ecs::entity_disabling::Disabled;
    let mut rows = Vec::new();
    for (what, pauses) in [("pooled", false), ("turned in a pause", true)] {
        let mut app = app(60.0);
        let (hair, id) = one_strand(&mut app);
        for _ in 0..600 {
            app.update();
        }
        let away = |app: &mut App, away: bool| {
            let world = app.world_mut();
            match (pauses, away) {
                (true, true) => world.resource_mut::<Time<Virtual>>().pause(),
                (true, false) => world.resource_mut::<Time<Virtual>>().unpause(),
                (false, true) => {
                    world.entity_mut(hair).insert_recursive::<Strands>(Disabled);
                }
                (false, false) => {
                    world.entity_mut(hair).remove_recursive::<Strands, Disabled>();
                }
            }
        };
        away(&mut app, true);
        for _ in 0..10 {
            place_mut(&mut app, hair, |place| {
                place.translation.x += 0.12;
                place.rotate_y(0.15);
            });
            app.update();
        }
        away(&mut app, false);
        let (fastest, farthest) = disturbance(&mut app, &[id]);
        rows.extend([
            Row::at_most(format!("{what}: speed on return (m/s)"), fastest, 0.05),
            Row::at_most(format!("{what}: off on return (m)"), farthest, 1e-3),
        ]);
    }
    rows
}

/// How a runner is put elsewhere.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Put {
    Nowhere,
    /// Through a portal that nobody announces, turned.
    Found,
    /// By so many metres, announced.
    Announced(f32),
    /// With the world.
    Shifted,
}

/// Where ticks put a head.
#[derive(Component)]
struct Target(Transform);

/// The states of hair after a runner was put elsewhere.
fn run_and_put(speed: f32, put: Put, in_update: bool) -> Vec<Strand> {
    let mut app = app(60.0);
    let head = head(&mut app, 6);
    app.add_systems(FixedUpdate, |mut all: Query<(&Target, &mut Transform)>| {
        all.iter_mut().for_each(|(target, mut place)| *place = target.0);
    });
    let hair = app.world_mut().query_filtered::<Entity, With<Hair>>().single(app.world());
    let mut states = Vec::new();
    let mut world = Transform::IDENTITY;
    for tick in 0..150 {
        match put {
            _ if tick != 120 => {}
            Put::Nowhere => {}
            Put::Found => {
                let turn = Quat::from_rotation_y(1.2);
                world = Transform::from_xyz(64.0, 3.0, -40.0).with_rotation(turn);
            }
            Put::Announced(far) => {
                world = Transform::from_xyz(far, 0.0, 0.0);
                if let Ok(hair) = hair {
                    app.world_mut().commands().entity(hair).queue(Hair::teleport);
                }
            }
            Put::Shifted => {
                world = Transform::from_xyz(-512.0, 0.0, 256.0);
                app.world_mut().commands().trigger(ShiftWorld { by: world.translation });
            }
        }
        app.world_mut().flush();
        let eased = (tick as f32 / 60.0).min(1.0);
        let target = world * Transform::from_xyz(speed * eased * tick as f32 / 60.0, 0.0, 0.0);
        match in_update {
            true => place_mut(&mut app, head, |place| *place = target),
            false => _ = app.world_mut().entity_mut(head).insert(Target(target)).id(),
        }
        app.update();
        if tick >= 120 {
            states.extend(all(&mut app));
        }
    }
    states
}

/// Line 6: hair that runs through a portal, or in a world whose origin is shifted, goes on as without.
pub fn portals() -> Vec<Row> {
    let mut rows = Vec::new();
    for in_update in [true, false] {
        for speed in [0.0, 1.5, 8.0, 40.0] {
            let control = run_and_put(speed, Put::Nowhere, in_update);
            for put in [Put::Found, Put::Announced(0.3), Put::Announced(64.0), Put::Shifted] {
                let (mut off, mut faster) = (0.0f32, 0.0f32);
                for (a, b) in run_and_put(speed, put, in_update).iter().zip(&control) {
                    for (p, q) in a.positions().iter().zip(b.positions()) {
                        off = off.max(p.distance(*q));
                    }
                    for (v, w) in a.velocities().iter().zip(b.velocities()) {
                        faster = faster.max((v.length() - w.length()).abs());
                    }
                }
                let moved = if in_update { "Update" } else { "FixedUpdate" };
                let what = format!("{speed} m/s, {moved}, {put:?}");
                rows.extend([
                    Row::at_most(format!("{what}: off (m)"), off, 1e-3),
                    Row::at_most(format!("{what}: speed (m/s)"), faster, 0.05),
                ]);
            }
        }
    }
    rows
}

/// Where a head is in a vehicle that turns (m).
const SEAT: Vec3 = Vec3::new(0.0, 0.0, 0.8);

/// Moves a head and what belongs to its vehicle evenly along X, turning about Y, for some seconds; the
/// lean of its hair seen from the vehicle (°).
fn lean_in_a_vehicle(speed: f32, spin: f32, air: Option<WindZone>) -> f32 {
    let seat = if spin > 0.0 { SEAT } else { Vec3::ZERO };
    let mut app = app(60.0);
    let (hair, id) = one_strand(&mut app);
    let car = app.world_mut().spawn(Transform::default()).id();
    app.world_mut().entity_mut(hair).insert((ChildOf(car), Transform::from_translation(seat)));
    if let Some(zone) = air {
        app.world_mut().spawn((zone, Transform::default(), ChildOf(car)));
    }
    let mut way = 0.0;
    for tick in 0..360 {
        // Gathers speed in two seconds.
        let share = (tick as f32 / 120.0).min(1.0);
        way += share / 60.0;
        *app.world_mut().get_mut::<Transform>(car).unwrap() =
            Path { speed, spin }.at(f64::from(way));
        app.update();
    }
    lean(&strand(&app, id))
}

/// The lean of hair at rest under this gravity (°).
fn lean_under(gravity: Vec3) -> f32 {
    let mut app = app(60.0);
    app.insert_resource(HairGravity(gravity));
    let (_, id) = one_strand(&mut app);
    for _ in 0..360 {
        app.update();
    }
    lean(&strand(&app, id))
}

/// Line 7: in a closed cabin hair hangs straight, and a fan that rides along blows as one at rest.
pub fn vehicles() -> Vec<Row> {
    let cabin = WindZone { half_size: Vec3::splat(2.0), ..WindZone::shelter() };
    let open = lean_in_a_vehicle(20.0, 0.0, None);
    let mut rows = vec![Row::new("control, open at 20 m/s: lean (°)", 65.0, open, 20.0)];
    for (speed, spin) in [(20.0, 0.0), (20.0, 0.5), (0.0, 2.0)] {
        let closed = lean_in_a_vehicle(speed, spin, Some(cabin));
        // Where it turns it is pushed outward, as by a gravity that is tilted.
        let outward = spin * spin * (SEAT.z + 0.02);
        let expected = lean_under(Vec3::new(0.0, -9.81, outward));
        let what = format!("cabin at {speed} m/s, {spin} rad/s: lean (°)");
        rows.push(Row::new(what, expected, closed, 1.5));
    }
    let fan = WindZone { velocity: Vec3::X * 3.0, ..cabin };
    let rests = lean_in_a_vehicle(0.0, 0.0, Some(fan));
    let rides = lean_in_a_vehicle(20.0, 0.0, Some(fan));
    rows.push(Row::new("control, fan at rest: lean (°)", 17.0, rests, 7.0));
    rows.push(Row::new("fan at 20 m/s: lean (°)", rests, rides, 0.5));
    rows
}

/// Line 8: wind and a headwind of the same speed lean hair alike at any scale, and cancel.
pub fn scales() -> Vec<Row> {
    let lean_at = |scale: f32, speed: f32, wind: f32| {
        let mut app = app(60.0);
        app.insert_resource(HairWind { velocity: Vec3::X * wind, gusts: 0.0, ..default() });
        let (hair, id) = one_strand(&mut app);
        for tick in 0..300 {
            place_mut(&mut app, hair, |place| {
                place.scale = Vec3::splat(scale);
                place.translation.x += speed / 60.0 * (tick as f32 / 120.0).min(1.0);
            });
            app.update();
        }
        lean(&strand(&app, id))
    };
    let control = lean_at(1.0, 0.0, 5.0);
    let mut rows = Vec::new();
    for scale in [0.1, 1.0, 10.0] {
        for (what, speed, wind, expected, tolerance) in [
            ("in a wind of 5 m/s", 0.0, 5.0, control, 0.01 * control),
            ("running at 5 m/s", 5.0, 0.0, control, 0.01 * control),
            ("running with the wind", 5.0, 5.0, 0.0, 0.5),
        ] {
            let got = lean_at(scale, speed, wind);
            rows.push(Row::new(
                format!("scale {scale}, {what}: lean (°)"),
                expected,
                got,
                tolerance,
            ));
        }
    }
    rows
}

/// Line 8: a head that is scaled away in first person, while it walks and turns, comes back as it was.
pub fn hidden() -> Vec<Row> {
    let mut rows = Vec::new();
    for scale in [0.1, 0.01, 0.0001] {
        let mut app = app(60.0);
        let head = head(&mut app, 10);
        let before = all(&mut app);
        let mut solved = 0.0;
        for tick in 0..120 {
            place_mut(&mut app, head, |place| {
                place.scale = Vec3::splat(if (10..110).contains(&tick) { scale } else { 1.0 });
                if (10..105).contains(&tick) {
                    place.translation.x += 0.05;
                    place.rotate_y(0.05);
                }
            });
            app.update();
            let owner = app.world_mut().query::<&MotionOwner>().single(app.world());
            let moves = owner.is_ok_and(|owner| owner.moves());
            solved += f32::from(u8::from(moves && (12..108).contains(&tick)));
        }
        let mut off = 0.0f32;
        for (a, b) in all(&mut app).iter().zip(&before) {
            for (p, q) in a.positions().iter().zip(b.positions()) {
                off = off.max(p.distance(*q));
            }
        }
        rows.extend([
            Row::at_most(format!("head hidden at {scale}: off on return (m)"), off, 2e-3),
            Row::at_most(format!("head hidden at {scale}: ticks that move it"), solved, 0.0),
        ]);
    }
    rows
}

/// Line 9: gusts depend on the way of the wind, not on how long a game has run.
pub fn gusts() -> Vec<Row> {
    let worst = |hours: f64| {
        let mut app = app(60.0);
        let mut wind = HairWind { velocity: Vec3::X * 6.49, ..default() };
        app.insert_resource(wind);
        app.insert_resource(WindTravel(wind.velocity.as_dvec3() * (hours * 3600.0)));
        // The clock of a game that has run for so long.
        let elapsed = Duration::from_secs_f64(hours * 3600.0);
        app.world_mut().resource_mut::<Time<Fixed>>().advance_by(elapsed);
        let (_, id) = one_strand(&mut app);
        let (mut tips, mut worst) = ([Vec3::ZERO; 3], 0.0f32);
        for tick in 0..480 {
            wind.velocity.x += 0.02 / 480.0;
            wind.velocity = Quat::from_rotation_y(3.0f32.to_radians() / 60.0) * wind.velocity;
            app.insert_resource(wind);
            app.update();
            let tip = strand(&app, id).positions().last().copied().unwrap_or_default();
            tips = [tips[1], tips[2], tip];
            if tick > 180 {
                worst = worst.max((tips[0] - 2.0 * tips[1] + tips[2]).length() * 3600.0);
            }
        }
        worst
    };
    let [young, old] = [0.0, 10.0].map(worst);
    vec![Row::at_most("gusts that turn, after ten hours: tips (m/s²)", old, 1.6 * young)]
}

/// Line 8: on a head that is squashed and sheared, roots are where the skin is drawn, and strands keep
/// their lengths in the world.
pub fn squashed() -> Vec<Row> {
    let mut app = app(60.0);
    let head = head(&mut app, 10);
    let own: Vec<Vec3> = all(&mut app).iter().map(|strand| strand.positions()[0]).collect();
    // A parent that turns between two scales shears.
    let neck = app.world_mut().spawn(Transform::from_scale(Vec3::new(1.0, 1.3, 1.0))).id();
    app.world_mut().entity_mut(head).insert(ChildOf(neck));
    for tick in 0..90 {
        let share = (tick as f32 / 60.0).min(1.0);
        place_mut(&mut app, head, |place| {
            place.scale = Vec3::new(1.0 + 0.2 * share, 1.0 - 0.3 * share, 1.0);
            place.rotation = Quat::from_rotation_z(0.3);
        });
        app.update();
    }
    let global = |app: &App, id: Entity| app.world().get::<GlobalTransform>(id).copied();
    let skin = global(&app, head).unwrap_or_default();
    let hair = app.world_mut().query_filtered::<Entity, With<Hair>>().single(app.world());
    let drawn = hair.ok().and_then(|hair| global(&app, hair)).unwrap_or_default();
    let (mut off, mut strain) = (0.0f32, 0.0f32);
    for (strand, own) in all(&mut app).iter().zip(&own) {
        let root = drawn.transform_point(strand.positions()[0]);
        off = off.max(root.distance(skin.transform_point(*own)));
        strain = strain.max(strand.peak_strain());
    }
    let scales = drawn.compute_transform().scale;
    let uneven = scales.max_element() / scales.min_element() - 1.0;
    vec![
        Row::at_most("squashed head: roots off the drawn skin (m)", off, 1e-4),
        Row::at_most("squashed head: strands drawn longer along one axis", uneven, 1e-3),
        Row::at_most("squashed head: strain", strain, 0.02),
    ]
}

//! Jumps: what was away, portals, worlds that are shifted, with water too.

use super::{Row, all, app, head, one_strand, place_mut, strand};
use bevy::{ecs::entity_disabling::Disabled, prelude::*, time::TimeUpdateStrategy};
use bevy_keratin::{LodLevel, prelude::*};

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

/// Why hair is not simulated for some time.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Away {
    Pooled,
    Paused,
    /// Beyond the last level of detail.
    Frozen,
    /// Scaled down, as in first person.
    Hidden,
}

impl Away {
    fn set(self, app: &mut App, hair: Entity, away: bool) {
        let world = app.world_mut();
        match (self, away) {
            (Self::Paused, true) => world.resource_mut::<Time<Virtual>>().pause(),
            (Self::Paused, false) => world.resource_mut::<Time<Virtual>>().unpause(),
            (Self::Pooled, true) => {
                world.entity_mut(hair).insert_recursive::<Strands>(Disabled);
            }
            (Self::Pooled, false) => {
                world.entity_mut(hair).remove_recursive::<Strands, Disabled>();
            }
            (Self::Frozen, _) => {
                let share = HairScreenShare(if away { 1e-6 } else { 1.0 });
                let levels = vec![LodLevel::FROZEN];
                world.entity_mut(hair).insert((HairLod { levels, ..default() }, share));
            }
            (Self::Hidden, _) => place_mut(app, hair, |place| {
                place.scale = Vec3::splat(if away { 0.001 } else { 1.0 });
            }),
        }
    }
}

/// Line 4: what was not simulated comes back at rest where it is.
pub fn returns() -> Vec<Row> {
    let mut rows = Vec::new();
    for away in [Away::Pooled, Away::Paused, Away::Frozen, Away::Hidden] {
        let mut app = app(60.0);
        let (hair, id) = one_strand(&mut app);
        for _ in 0..600 {
            app.update();
        }
        away.set(&mut app, hair, true);
        for _ in 0..10 {
            place_mut(&mut app, hair, |place| {
                place.translation.x += 0.12;
                place.rotate_y(0.15);
            });
            app.update();
        }
        // Frozen hair that its head carries about is seen: it comes back while the head rests.
        if away == Away::Frozen {
            app.update();
        }
        away.set(&mut app, hair, false);
        let (fastest, farthest) = disturbance(&mut app, &[id]);
        rows.extend([
            Row::at_most(format!("{away:?}: speed on return (m/s)"), fastest, 0.05),
            Row::at_most(format!("{away:?}: off on return (m)"), farthest, 1e-3),
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
    /// Announced, turned, while time stands still for two frames.
    Paused,
    /// Back by so many metres along its way, as in an endless runner, without a word.
    Wrapped(f32),
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
            Put::Wrapped(far) => world = Transform::from_xyz(-far, 0.0, 0.0),
            Put::Paused => {}
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
            for put in [
                Put::Found,
                Put::Announced(0.3),
                Put::Announced(64.0),
                Put::Shifted,
                Put::Wrapped(3.0),
            ] {
                let (mut off, mut faster) = (0.0f32, 0.0f32);
                for (a, b) in run_and_put(speed, put, in_update).iter().zip(&control) {
                    for (p, q) in a.positions().iter().zip(b.positions()) {
                        off = off.max(p.distance(*q));
                    }
                    for (v, w) in a.velocities().iter().zip(b.velocities()) {
                        faster = faster.max(v.distance(*w));
                    }
                }
                let moved = if in_update { "Update" } else { "FixedUpdate" };
                let what = format!("{speed} m/s, {moved}, {put:?}");
                rows.extend([
                    Row::at_most(format!("{what}: off (m)"), off, 1e-3),
                    Row::at_most(format!("{what}: other velocity (m/s)"), faster, 0.05),
                ]);
            }
        }
    }
    rows
}

/// What moves a runner: its body, and its head which looks about.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Mover {
    Update,
    FixedUpdate,
    /// Its body by ticks, its head by frames, as animated characters are.
    BodyByTicks,
    HeadByTicks,
}

/// The states of hair after the frame of a hitch in which its runner is put elsewhere.
fn run_and_hitch(put: Put, mover: Mover, hitch: f64) -> Vec<Strand> {
    const SPEED: f32 = 8.0;
    #[derive(Resource)]
    struct World(Transform);
    let mut app = app(64.0);
    let body = app.world_mut().spawn(Transform::default()).id();
    let (hair, id) = one_strand(&mut app);
    app.world_mut().entity_mut(hair).insert(ChildOf(body));
    app.insert_resource(World(Transform::IDENTITY));
    let run = |time: Res<Time>,
               world: Res<World>,
               mut all: Query<&mut Transform, Without<Hair>>| {
        let t = time.elapsed_secs();
        let x = SPEED * if t < 1.0 { 0.5 * t * t } else { t - 0.5 };
        all.iter_mut().for_each(|mut place| *place = world.0 * Transform::from_xyz(x, 0.0, 0.0));
    };
    let nod = |time: Res<Time>, mut heads: Query<&mut Transform, With<Hair>>| {
        let t = time.elapsed_secs();
        for mut head in &mut heads {
            head.translation.y = 1.6 + 0.05 * (5.0 * t).sin();
            head.rotation = Quat::from_rotation_y(0.3 * (4.0 * t).sin());
        }
    };
    match mover {
        Mover::Update => app.add_systems(Update, (run, nod)),
        Mover::FixedUpdate => app.add_systems(FixedUpdate, (run, nod)),
        Mover::BodyByTicks => app.add_systems(FixedUpdate, run).add_systems(Update, nod),
        Mover::HeadByTicks => app.add_systems(Update, run).add_systems(FixedUpdate, nod),
    };
    let mut states = Vec::new();
    for frame in 0..150 {
        let seconds = if frame == 120 { hitch } else { 1.0 / 60.0 };
        let seconds = std::time::Duration::from_secs_f64(seconds);
        app.insert_resource(TimeUpdateStrategy::ManualDuration(seconds));
        if frame == 120 {
            let world = match put {
                Put::Found | Put::Paused => {
                    Transform::from_xyz(64.0, 3.0, -40.0).with_rotation(Quat::from_rotation_y(1.2))
                }
                Put::Announced(far) => Transform::from_xyz(0.0, 0.0, far),
                Put::Wrapped(far) => Transform::from_xyz(-far, 0.0, 0.0),
                Put::Nowhere | Put::Shifted => Transform::IDENTITY,
            };
            if matches!(put, Put::Announced(_) | Put::Paused) {
                app.world_mut().commands().entity(hair).queue(Hair::teleport);
                app.world_mut().flush();
            }
            app.insert_resource(World(world));
            if put == Put::Paused {
                app.world_mut().resource_mut::<Time<Virtual>>().pause();
                place_mut(&mut app, body, |place| *place = world * *place);
                app.update();
                app.update();
                app.world_mut().resource_mut::<Time<Virtual>>().unpause();
            }
        }
        app.update();
        if frame >= 120 {
            states.push(strand(&app, id));
        }
    }
    states
}

/// Line 6: in the frame of a hitch too, whatever moves a runner and its head that looks about.
pub fn hitches() -> Vec<Row> {
    let mut rows = Vec::new();
    for mover in [Mover::Update, Mover::FixedUpdate, Mover::BodyByTicks, Mover::HeadByTicks] {
        for hitch in [1.0 / 60.0, 0.1, 0.2] {
            let control = run_and_hitch(Put::Nowhere, mover, hitch);
            // In a frame that moves it a head that wraps around by less than 25 m/s has to say so.
            let by_frames = matches!(mover, Mover::Update | Mover::HeadByTicks);
            let far = if by_frames && hitch > 0.1 { 6.0 } else { 3.0 };
            for put in [
                Put::Found,
                Put::Announced(0.3),
                Put::Announced(3.0),
                Put::Paused,
                Put::Wrapped(far),
            ] {
                let states = run_and_hitch(put, mover, hitch);
                let off = states.iter().zip(&control);
                let off = off.map(|(a, b)| super::apart(a.positions(), b.positions()));
                let what = format!("{mover:?}, frame of {:.0} ms, {put:?}: off (m)", hitch * 1e3);
                rows.push(Row::at_most(what, off.fold(0.0, f32::max), 1e-3));
            }
        }
    }
    rows
}

/// The water of a runner.
#[derive(Clone, Copy, Debug, Default)]
struct Wet {
    /// In and on hair, and in droplets within 0.3 m of the head (m³).
    near: f64,
    /// In all droplets (m³).
    droplets: f64,
    /// The farthest droplet from the head (m).
    farthest: f32,
    /// The ledger's error.
    error: f64,
}

impl Wet {
    fn of(app: &mut App, head: Entity) -> Self {
        let world = app.world_mut();
        let head = world.get::<Transform>(head).map_or(Vec3::ZERO, |place| place.translation);
        let held: f64 = world.query::<&Moisture>().iter(world).map(Moisture::volume).sum();
        let error = world.resource::<WaterLedger>().error();
        let mut wet = Self { near: held, error, ..default() };
        for droplet in world.query::<&Droplet>().iter(world) {
            let off = droplet.position.distance(head);
            wet.droplets += droplet.volume;
            wet.near += if off < 0.3 { droplet.volume } else { 0.0 };
            wet.farthest = wet.farthest.max(off);
        }
        wet
    }
}

/// A runner that was sprinkled and is put elsewhere, by these droplets that still fall: before, and two ticks after.
fn wet_runner(speed: f32, put: Put, falling: u32) -> [Wet; 2] {
    let mut app = app(60.0);
    let head = head(&mut app, 30);
    let mut wet = [Wet::default(); 2];
    for tick in 0..78 {
        let eased = (tick as f32 / 60.0).min(1.0);
        let step = Vec3::X * (speed * eased / 60.0);
        place_mut(&mut app, head, |place| place.translation += step);
        if tick == 60 {
            let at = app.world().get::<Transform>(head).map_or(Vec3::ZERO, |it| it.translation);
            for i in 0..60 + falling {
                let (sine, cosine) = (2.4 * i as f32).sin_cos();
                let high = if i < 60 { 0.05 } else { 0.6 };
                let place = at + Vec3::new(0.1 * cosine, high, 0.1 * sine);
                let droplet =
                    Droplet::new(place, 5e-9).and_then(|it| it.with_velocity(60.0 * step));
                app.world_mut().spawn(droplet.unwrap_or_default());
            }
        }
        if tick == 75 {
            wet[0] = Wet::of(&mut app, head);
            let by = Vec3::new(-512.0, 0.0, 256.0);
            if put == Put::Shifted {
                app.world_mut().commands().trigger(ShiftWorld { by });
                app.world_mut().flush();
            }
            if put != Put::Nowhere {
                place_mut(&mut app, head, |place| place.translation += by);
            }
        }
        app.update();
    }
    wet[1] = Wet::of(&mut app, head);
    wet
}

/// Line 6: water in and on hair goes along through a portal, and all droplets with a world that is shifted.
pub fn wet_jumps() -> Vec<Row> {
    let mut rows = Vec::new();
    for speed in [0.0, 8.0] {
        let [control, found] = [Put::Nowhere, Put::Found].map(|put| {
            let [before, after] = wet_runner(speed, put, 0);
            ((after.near / before.near) as f32, after.error as f32)
        });
        let what = format!("wet, {speed} m/s, Found");
        rows.extend([
            Row::new(format!("{what}: share of the water on it"), control.0, found.0, 0.01),
            Row::at_most(format!("{what}: error of the ledger"), found.1, 1e-9),
        ]);
        let [control, shifted] =
            [Put::Nowhere, Put::Shifted].map(|put| wet_runner(speed, put, 60)[1]);
        let what = format!("in rain, {speed} m/s, Shifted");
        let share = |got: f64, control: f64| (got / control) as f32;
        let (near, droplets) =
            (share(shifted.near, control.near), share(shifted.droplets, control.droplets));
        rows.extend([
            Row::new(format!("{what}: water on hair, of the control's"), 1.0, near, 0.01),
            Row::new(format!("{what}: water in droplets, of the control's"), 1.0, droplets, 0.01),
            Row::new(
                format!("{what}: farthest droplet from the head (m)"),
                control.farthest,
                shifted.farthest,
                1e-3,
            ),
            Row::at_most(format!("{what}: error of the ledger"), shifted.error as f32, 1e-9),
        ]);
    }
    rows
}

/// How a world is moved.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Shift {
    Not,
    Told,
    Untold,
}

/// Strands, and drops in the air, for half a second after a world was moved back to its origin by `by`: with
/// gusts, a fan, water that hair dips into, and drops that fall, all at once.
fn weathers(shift: Shift, by: Vec3) -> (Vec<Strand>, Vec<Vec<Vec3>>) {
    let mut app = app(60.0);
    app.insert_resource(HairWind { velocity: Vec3::new(4.0, 0.0, 1.5), ..default() });
    let fan =
        WindZone { half_size: Vec3::new(0.4, 0.3, 0.3), velocity: Vec3::Z * 3.0, ..default() };
    app.world_mut().spawn((fan, Transform::from_xyz(0.8, 1.7, 0.1)));
    let pool = WaterVolume { half_size: Vec3::new(8.0, 0.5, 8.0), current: Vec3::Z, ..default() };
    app.world_mut().spawn((pool, Transform::from_xyz(0.0, 1.06, 0.0)));
    let head = head(&mut app, 24);
    let (mut strands, mut drops) = (Vec::new(), Vec::new());
    let mut origin = Vec3::ZERO;
    for tick in 0..150 {
        place_mut(&mut app, head, |place| place.translation.x += 1.0 / 60.0);
        if tick == 110 {
            let at = app.world().get::<Transform>(head).map_or(Vec3::ZERO, |it| it.translation);
            for i in 0..120 {
                let (sine, cosine) = (2.4 * i as f32).sin_cos();
                let high = 0.2 + 0.01 * i as f32;
                let droplet = Droplet::new(at + Vec3::new(0.1 * cosine, high, 0.1 * sine), 5e-9);
                app.world_mut().spawn(droplet.unwrap_or_default());
            }
        }
        if tick == 120 && shift != Shift::Not {
            origin = by;
            let world = app.world_mut();
            let mut roots = world.query_filtered::<&mut Transform, Without<ChildOf>>();
            roots.iter_mut(world).for_each(|mut place| place.translation += by);
            if shift == Shift::Told {
                world.commands().trigger(ShiftWorld { by });
                world.flush();
            }
        }
        app.update();
        if tick >= 120 {
            strands.extend(all(&mut app));
            let world = app.world_mut();
            let mut query = world.query::<&Droplet>();
            drops.push(query.iter(world).map(|it| it.position - origin).collect());
        }
    }
    (strands, drops)
}

/// Line 6: a shift of the world moves nothing of what is in it.
pub fn shifts() -> Vec<Row> {
    const BY: Vec3 = Vec3::new(-512.0, 0.0, 256.0);
    let control = weathers(Shift::Not, BY);
    let count = |drops: &[Vec<Vec3>]| drops.iter().map(Vec::len).sum::<usize>() as f32;
    // Of 99 in 100, in each tick, from the nearest: which of two that merge is left, their order, and whether one lands in
    // this tick or the next hang on rounding.
    let drops_off = |got: &[Vec<Vec3>]| {
        let ticks = control.1.iter().zip(got);
        let off = ticks.flat_map(|(own, got)| {
            let nearest =
                |at: &Vec3| got.iter().map(|p| p.distance(*at)).fold(f32::INFINITY, f32::min);
            own.iter().map(nearest).collect::<Vec<_>>()
        });
        let mut off: Vec<f32> = off.collect();
        off.sort_by(f32::total_cmp);
        off.get(off.len() * 99 / 100).copied().unwrap_or_default()
    };
    let compare = |shift| {
        let got = weathers(shift, BY);
        let pairs = || control.0.iter().zip(&got.0);
        let off = pairs().map(|(a, b)| super::apart(a.positions(), b.positions()));
        let faster = pairs().map(|(a, b)| super::apart(a.velocities(), b.velocities()));
        let [off, faster] = [off.fold(0.0, f32::max), faster.fold(0.0, f32::max)];
        [off, faster, drops_off(&got.1), count(&got.1)]
    };
    let [told, untold] = [Shift::Told, Shift::Untold].map(compare);
    let what = "gusts, fan, pool and falling drops, world shifted";
    let moved = f32::from(u8::from(untold[0] > 5e-3));
    vec![
        Row::at_most(format!("{what}: off (m)"), told[0], 1e-3),
        Row::at_most(format!("{what}: other velocity (m/s)"), told[1], 0.05),
        Row::at_most(format!("{what}: 99 of 100 drops off (m)"), told[2], 1e-3),
        // Of all ticks; one may be taken up a tick sooner.
        Row::new(format!("{what}: drops"), count(&control.1), told[3], 2.0),
        Row::new(format!("control, {what} without a word: hair is moved"), 1.0, moved, 0.0),
        Row::at_most(
            format!("control, {what} without a word: drops that are left near hair"),
            untold[3],
            0.5 * told[3],
        ),
    ]
}

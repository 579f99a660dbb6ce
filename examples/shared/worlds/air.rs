//! What hair moves against: air and water of vehicles, wind at any scale, gusts, rain far from the origin.

use super::{
    Row, app, fault_count, frames::Path, lean, one_strand, place_mut, run, shapes::aside, strand,
    strand_along,
};
use bevy::prelude::*;
use bevy_keratin::{DropletRules, prelude::*};
use std::time::Duration;

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
        rows.push(Row::new(what, expected, closed, 0.3));
    }
    let fan = WindZone { velocity: Vec3::X * 3.0, ..cabin };
    let rests = lean_in_a_vehicle(0.0, 0.0, Some(fan));
    let rides = lean_in_a_vehicle(20.0, 0.0, Some(fan));
    rows.push(Row::new("control, fan at rest: lean (°)", 17.0, rests, 7.0));
    rows.push(Row::new("fan at 20 m/s: lean (°)", rests, rides, 0.3));
    rows.extend(blowers());
    rows.extend(heaters());
    rows.extend(baths());
    rows
}

/// The lean of hair on a car of some scale in a closed cabin, or an open one, blown from behind (degrees); the
/// cabin ends 40 cm behind the hair, at the car's scale.
fn lean_before_a_blower(scale: f32, speed: f32, spin: f32, is_closed: bool, strength: f32) -> f32 {
    let mut app = app(60.0);
    let (hair, id) = one_strand(&mut app);
    let car = app.world_mut().spawn(Transform::default()).id();
    app.world_mut().entity_mut(hair).insert(ChildOf(car));
    let behind = Transform::from_xyz(-0.3, -0.1, 0.0).looking_to(Vec3::X, Vec3::Y);
    if strength > 0.0 {
        app.world_mut().spawn((Blower::new(strength).unwrap(), behind, ChildOf(car)));
    }
    if is_closed {
        let half_size = Vec3::new(1.4, 1.0, 1.0);
        let cabin = WindZone { half_size, falloff: 0.0, ..WindZone::shelter() };
        app.world_mut().spawn((cabin, Transform::from_xyz(1.0, 0.0, 0.0), ChildOf(car)));
    }
    let mut way = 0.0;
    for tick in 0..360 {
        way += (tick as f32 / 120.0).min(1.0) / 60.0;
        place_mut(&mut app, car, |place| {
            *place = Path { speed, spin }.at(f64::from(way)).with_scale(Vec3::splat(scale));
        });
        app.update();
    }
    lean(&strand(&app, id))
}

/// Line 7: the air of a blower, and of the end of a cabin, is where they are at any speed and scale.
fn blowers() -> Vec<Row> {
    let mut rows = Vec::new();
    for scale in [0.1, 1.0, 10.0] {
        let rests = lean_before_a_blower(scale, 0.0, 0.0, true, 10.0);
        rows.push(Row::new(
            format!("scale {scale}, control, blower at rest: lean (°)"),
            4.0,
            rests,
            1.5,
        ));
        for (speed, spin) in [(20.0, 0.0), (0.0, 1.0)] {
            let rides = lean_before_a_blower(scale, speed, spin, true, 10.0);
            let what =
                format!("scale {scale}, blower in a cabin at {speed} m/s, {spin} rad/s: lean (°)");
            rows.push(Row::new(what, rests, rides, 0.3));
        }
    }
    // In the open its air takes part of the headwind's place; so weak a jet pushes by nothing else.
    let open = lean_before_a_blower(1.0, 20.0, 0.0, false, 0.0);
    let blown = lean_before_a_blower(1.0, 20.0, 0.0, false, 1e-3);
    rows.push(Row::new("control, open at 20 m/s without a blower: lean (°)", 65.0, open, 20.0));
    rows.push(Row::at_most("open at 20 m/s in the jet of a blower: lean (°)", blown, open - 0.3));
    rows
}

/// The share of its water that damp hair has left after four seconds that count as five minutes, on a car that has
/// gone evenly for four seconds, in a zone or in the open; and the share of hydrogen bonds of dry hair there.
fn left_on_a_ride(speed: f32, wind: f32, zone: Option<WindZone>, sleeps: bool) -> [f32; 2] {
    let mut app = app(60.0);
    if !sleeps {
        app.insert_resource(HairDefault(SleepSettings::never()));
    }
    app.insert_resource(HairProcessTime(75.0));
    app.insert_resource(HairWind { velocity: Vec3::X * wind, gusts: 0.0, ..default() });
    let car = app.world_mut().spawn(Transform::default()).id();
    if let Some(zone) = zone {
        app.world_mut().spawn((zone, Transform::default(), ChildOf(car)));
    }
    let [(damp, id), (dry, other)] = [(); 2].map(|()| one_strand(&mut app));
    for hair in [damp, dry] {
        app.world_mut().entity_mut(hair).insert(ChildOf(car));
    }
    let (mut way, mut began) = (0.0, 1.0);
    // Hair that has been pushed back swings for some seconds, and dries as it does.
    const SOAKED: usize = 120 + 240;
    for tick in 0..SOAKED + 240 {
        way += (tick as f32 / 120.0).min(1.0) / 60.0;
        place_mut(&mut app, car, |place| *place = Path { speed, spin: 0.0 }.at(f64::from(way)));
        if tick == SOAKED {
            app.world_mut().trigger(SoakHair { target: damp, wetness: 0.5 });
            app.world_mut().write_message(
                HairTreatment::set(dry, BondKind::Hydrogen, 0.2).unwrap_or_else(|e| panic!("{e}")),
            );
        }
        app.update();
        if tick == SOAKED {
            began = app.world().get::<Moisture>(id).map_or(0.0, Moisture::volume);
        }
    }
    let ends = app.world().get::<Moisture>(id).map_or(0.0, Moisture::volume);
    let bonds = app.world().get::<Bonds>(other).map_or(0.0, |bonds| {
        let rates = bonds.joints.iter().map(|joint| joint.rates[BondKind::Hydrogen as usize]);
        rates.sum::<f32>() / bonds.joints.len().max(1) as f32
    });
    [(ends / began) as f32, bonds]
}

/// Line 7: a heater that rides along dries hair and sets its bonds as at rest; a headwind dries as wind does.
fn heaters() -> Vec<Row> {
    let zone = |warmth: f32, drying: f32| {
        Some(WindZone { half_size: Vec3::splat(2.0), warmth, drying, ..WindZone::shelter() })
    };
    let heater = zone(60.0, 0.01);
    let rests = left_on_a_ride(0.0, 0.0, heater, true);
    let rides = left_on_a_ride(20.0, 0.0, heater, true);
    let cold = left_on_a_ride(0.0, 0.0, None, true)[0];
    let windy = left_on_a_ride(0.0, -5.0, None, true)[0];
    let runs = left_on_a_ride(5.0, 0.0, None, true)[0];
    let sauna = left_on_a_ride(0.0, 0.0, zone(60.0, 0.0), true)[0];
    let awake = left_on_a_ride(0.0, 0.0, zone(60.0, 0.0), false)[0];
    vec![
        Row::new("heater in a cabin at 20 m/s: bonds set", rests[1], rides[1], 0.01),
        Row::new("heater in a cabin at 20 m/s: share of water left", rests[0], rides[0], 0.005),
        Row::new("control, heater at rest: share of water left", 0.1, rests[0], 0.05),
        Row::new("control, still air: share of water left", 0.7, cold, 0.1),
        Row::at_most("control, wind of 5 m/s: share of water left", windy, 0.5),
        Row::new("running at 5 m/s: share of water left", windy, runs, 0.01),
        Row::new("warm room, hair asleep: share of water left", awake, sauna, 0.02),
    ]
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

/// The largest acceleration of a tip (m/s²) in gusts that have come so many hours' way, while the mean wind changes
/// for some seconds.
fn worst_gust(hours: f64, seconds: f64, change: impl Fn(&mut HairWind)) -> f32 {
    let mut app = app(60.0);
    let mut wind = HairWind { velocity: Vec3::X * 6.49, ..default() };
    app.insert_resource(wind);
    app.insert_resource(WindTravel(wind.velocity.as_dvec3() * (hours * 3600.0)));
    // The clock of a game that has run for so long.
    let elapsed = Duration::from_secs_f64(hours * 3600.0);
    app.world_mut().resource_mut::<Time<Fixed>>().advance_by(elapsed);
    let (_, id) = one_strand(&mut app);
    let (mut tips, mut worst) = ([Vec3::ZERO; 3], 0.0f32);
    for tick in 0..(seconds * 60.0) as usize {
        change(&mut wind);
        app.insert_resource(wind);
        app.update();
        let tip = strand(&app, id).positions().last().copied().unwrap_or_default();
        tips = [tips[1], tips[2], tip];
        if tick > 180 {
            worst = worst.max((tips[0] - 2.0 * tips[1] + tips[2]).length() * 3600.0);
        }
    }
    worst
}

/// Line 9: gusts depend on the way of the wind, not on how long a game has run.
pub fn gusts() -> Vec<Row> {
    let steady = |_: &mut HairWind| {};
    let stronger = |wind: &mut HairWind| wind.velocity.x += 0.02 / 1200.0;
    let turning = |wind: &mut HairWind| {
        wind.velocity.x += 0.02 / 480.0;
        wind.velocity = Quat::from_rotation_y(3.0f32.to_radians() / 60.0) * wind.velocity;
    };
    let [young, old] = [0.0, 10.0].map(|hours| worst_gust(hours, 8.0, turning));
    let even = worst_gust(10.0, 20.0, steady);
    let changes = worst_gust(10.0, 20.0, stronger);
    vec![
        Row::at_most("gusts that turn, after ten hours: tips (m/s²)", old, 1.6 * young),
        Row::at_most("control, even gusts after ten hours: tips (m/s²)", even, 12.0),
        Row::new(
            "6.49 to 6.51 m/s in 20 s, after ten hours: tips (m/s²)",
            even,
            changes,
            0.1 * even,
        ),
    ]
}

/// After two seconds of rain: water in and on hair (m³), how many drops there are, the ledger's error, and faults.
struct Rained {
    held: f64,
    drops: f32,
    error: f32,
    faults: f32,
}

fn rained_on(place: Vec3, rules: DropletRules) -> Rained {
    let mut app = app(60.0);
    app.insert_resource(rules);
    let hair = app.world_mut().spawn((Hair, Transform::from_translation(place))).id();
    for i in 0..36 {
        let root = Vec3::new(0.01 * (i % 6) as f32 - 0.025, 0.0, 0.01 * (i / 6) as f32 - 0.025);
        let points: Vec<Vec3> =
            (0..6).map(|k| root + Vec3::new(0.02, -0.01, 0.0) * k as f32).collect();
        app.world_mut().spawn((StrandOf(hair), Strand::from_polyline(&points).unwrap()));
    }
    let above = Transform::from_translation(place + Vec3::Y).looking_to(Dir3::NEG_Y, Dir3::X);
    app.world_mut().spawn((Shower::rain(400.0, 0.08).unwrap(), above));
    run(&mut app, 2.0);
    let held = app.world_mut().query::<&Moisture>().iter(app.world()).map(Moisture::volume).sum();
    Rained {
        held,
        drops: app.world_mut().query::<&Droplet>().iter(app.world()).count() as f32,
        error: app.world().resource::<WaterLedger>().error() as f32,
        faults: fault_count(&app),
    }
}

/// Line 10: rain wets as much far from the origin.
pub fn far_rain() -> Vec<Row> {
    let near = rained_on(Vec3::ZERO, default());
    // 1e-8 m³ are 10 mg.
    let wet = near.held.min(1e-8) as f32;
    let mut rows =
        vec![Row::new("control, rain at the origin: water in hair (m³)", 1e-8, wet, 0.0)];
    for (place, off) in [
        (Vec3::new(150.0, 0.0, 0.0), 0.03),
        (Vec3::new(0.0, -150.0, 120.0), 0.03),
        (Vec3::new(3000.0, 100.0, -4000.0), 0.15),
    ] {
        let far = rained_on(place, default());
        let what = format!("rain {} m from the origin", place.length().round());
        rows.extend([
            Row::new(
                format!("{what}: water of that at the origin"),
                1.0,
                (far.held / near.held) as f32,
                off,
            ),
            Row::new(format!("{what}: drops of those"), 1.0, far.drops / near.drops, 0.1),
            Row::at_most(format!("{what}: error of the ledger"), far.error, 1e-9),
            Row::at_most(format!("{what}: faults"), far.faults, 0.0),
        ]);
    }
    // Bounds of one's own in the world still hold.
    for (what, place, rules) in [
        (
            "rain out of bounds of one's own",
            Vec3::X * 150.0,
            DropletRules { max: Vec3::splat(100.0), ..default() },
        ),
        (
            "rain from farther than removal_distance",
            Vec3::ZERO,
            DropletRules { removal_distance: 0.5, ..default() },
        ),
    ] {
        let none = rained_on(place, rules);
        rows.extend([
            Row::at_most(format!("{what}: water in hair (m³)"), none.held as f32, 0.0),
            Row::at_most(format!("{what}: drops"), none.drops, 0.0),
        ]);
    }
    rows
}

/// How far a strand leans to any side (°).
fn from_below(app: &App, e: Entity) -> f32 {
    let strand = strand(app, e);
    let p = strand.positions();
    aside(app, e).atan2(-(p[p.len() - 1] - p[0]).y).to_degrees()
}

/// A head in a bath of 2 m that move together, and how far its hair leans there (degrees).
fn in_bath(
    velocity: Vec3,
    turning: f32,
    offset: Vec3,
    bath: WaterVolume,
    inertia: HairInertia,
) -> f32 {
    let mut app = app(60.0);
    app.insert_resource(HairDefault(HairWetting { fibres: 100.0, soaking: 0.0, ..default() }));
    let ship = app.world_mut().spawn(Transform::default()).id();
    app.world_mut().spawn((bath, Transform::default(), ChildOf(ship)));
    let (hair, e) = strand_along(&mut app, 0.2, 8, Vec3::NEG_Y);
    app.world_mut().entity_mut(hair).insert((
        Transform::from_translation(offset),
        ChildOf(ship),
        inertia,
    ));
    for tick in 1..=300 {
        let seconds = tick as f32 / 60.0;
        place_mut(&mut app, ship, |place| {
            place.translation = velocity * seconds;
            place.rotation = Quat::from_rotation_y(turning * seconds);
        });
        app.update();
    }
    from_below(&app, e)
}

/// Line 7: water goes with what carries it.
fn baths() -> Vec<Row> {
    let pool = WaterVolume::pool(Vec3::ONE).unwrap();
    let stream = WaterVolume { current: Vec3::Z * 0.1, ..pool };
    let (fast, half) = (Vec3::X * 2.0, HairInertia { moving: 0.4, turning: 0.4, ..default() });
    let mut rows = Vec::new();
    for (what, bath) in [("bath", pool), ("bath with a current", stream)] {
        let rests = in_bath(Vec3::ZERO, 0.0, Vec3::ZERO, bath, default());
        for (share, inertia) in [("", HairInertia::default()), (", inertia 0.4", half)] {
            let moves = in_bath(fast, 0.0, Vec3::ZERO, bath, inertia);
            rows.push(Row::new(format!("{what} at 2 m/s{share}: lean (°)"), rests, moves, 1.0));
        }
    }
    let turns = in_bath(Vec3::ZERO, 0.5, Vec3::X * 0.5, pool, default());
    rows.push(Row::at_most("bath that turns: lean (°)", turns, 2.0));
    // Through water that rests hair is dragged.
    let lake = WaterVolume { half_size: Vec3::splat(1e3), ..pool };
    let mut app = app(60.0);
    app.insert_resource(HairDefault(HairWetting { fibres: 100.0, soaking: 0.0, ..default() }));
    app.world_mut().spawn(lake);
    let (hair, e) = strand_along(&mut app, 0.2, 8, Vec3::NEG_Y);
    for tick in 1..=300 {
        place_mut(&mut app, hair, |place| place.translation = fast * (tick as f32 / 60.0));
        app.update();
    }
    let dragged = from_below(&app, e);
    rows.push(Row::new("control, at 2 m/s through a lake: lean (°)", 90.0, dragged, 30.0));
    rows
}

//! Rows of presets in water, on a character who walks and looks around, each beside the same hair dry.

use crate::{
    Clock, PARTS, RUNS, TICKS, Walks, app, median, person, plant, print_parts, settle, time_parts,
};
use bevy::prelude::*;
use bevy_keratin::{HairScreenShare, authoring::plant::HairPreset, prelude::*};

/// Drops a second in rain.
const RAIN: f32 = 300.0;

/// What is measured while it lasts.
#[derive(Clone, Copy, PartialEq)]
enum State {
    Dry,
    Rain,
    Dripping,
    Drying,
    Diving,
}

const STATES: [(State, &str); 5] = [
    (State::Dry, "dry"),
    (State::Rain, "rain"),
    (State::Dripping, "dripping"),
    (State::Drying, "drying"),
    (State::Diving, "diving"),
];

/// Dives of which the best of each tick after emerging counts, and for how long that is looked at.
const DIVES: usize = 3;
const AFTER: usize = 120;

pub fn rows(name: &str, preset: HairPreset, threads: usize) {
    let strands = plant(preset);
    let mut apps = STATES.map(|(state, _)| {
        let mut app = app(threads);
        if std::env::var_os(PARTS).is_some() {
            time_parts(&mut app);
        }
        let hair = walker(&mut app, preset, &strands, Vec3::ZERO);
        settle(&mut app);
        begin(&mut app, hair, state);
        let seconds = if state == State::Rain { 3.0 } else { 0.5 };
        (0..(seconds * 60.0) as u32).for_each(|_| app.update());
        app
    });
    let times = apps_in_turns(&mut apps);
    for ((app, (_, state)), ms) in apps.iter_mut().zip(STATES).zip(times) {
        println!("{name}, {state} | {threads} | on | {ms:.2} | {:.2} of dry", ms / times[0]);
        if std::env::var_os(PARTS).is_some() {
            let drops = app.world_mut().query::<&Droplet>().iter(app.world()).count();
            println!("    {drops} droplets");
            print_parts(app);
        }
    }
    let dripping = times[2];
    let ticks: [Vec<f64>; DIVES] = core::array::from_fn(|_| emerging(preset, &strands, threads));
    let best = |tick: usize| ticks.iter().map(|ticks| ticks[tick]).fold(f64::INFINITY, f64::min);
    let longest = (0..AFTER).map(best).fold(0.0, f64::max);
    let mean = (0..AFTER).map(best).sum::<f64>() / AFTER as f64;
    println!(
        "{name}, emerging | {threads} | on | {mean:.2} | {:.2} of dry, longest tick {longest:.2}, {:.2} of \
         dripping",
        mean / times[0],
        longest / dripping
    );
}

/// Two near characters in rain and twenty in the background, beside the same without rain.
pub fn crowd(threads: usize) {
    let presets = HairPreset::ALL[..7].to_vec();
    let planted: Vec<_> = presets.iter().copied().map(plant).collect();
    let mut apps = [false, true].map(|rains| {
        let mut app = app(threads);
        for place in 0..22 {
            let (near, which) = (place < 2, place % presets.len());
            let at = Vec3::new((place % 12) as f32, 0.0, (place / 12) as f32) * 1.5;
            let hair = walker(&mut app, presets[which], &planted[which], at);
            let share = HairScreenShare(if near { 0.6 } else { 0.12 });
            app.world_mut().entity_mut(hair).insert((HairLod::default(), share));
            if rains && near {
                rain(&mut app, at);
            }
        }
        settle(&mut app);
        settle(&mut app);
        app
    });
    let [dry, wet] = apps_in_turns(&mut apps);
    println!("2 near + 20 background, dry | {threads} | on | {dry:.2}");
    println!("2 near in rain + 20 | {threads} | on | {wet:.2} | {:.2} of dry", wet / dry);
}

fn walker(app: &mut App, preset: HairPreset, strands: &[Strand], at: Vec3) -> Entity {
    let hair = person(app, preset, strands, at);
    app.world_mut().entity_mut(hair).insert(Walks { phase: 0.0 });
    hair
}

fn rain(app: &mut App, at: Vec3) {
    let (shower, place) = Shower::rain_on(at);
    app.world_mut().spawn((Shower { rate: RAIN, ..shower }, place));
}

/// A lake in which all hair is.
fn lake(app: &mut App) -> Entity {
    app.world_mut().spawn((WaterVolume::lake(), Transform::from_xyz(0.0, 2.0, 0.0))).id()
}

fn begin(app: &mut App, hair: Entity, state: State) {
    match state {
        State::Dry => {}
        State::Rain => rain(app, Vec3::ZERO),
        State::Dripping => app.world_mut().trigger(SoakHair::dripping(hair)),
        // A thin film that drips nowhere.
        State::Drying => app.world_mut().trigger(SoakHair { target: hair, wetness: 1.2 }),
        State::Diving => drop(lake(app)),
    }
}

/// The ticks after hair has come out of a lake (ms).
fn emerging(preset: HairPreset, strands: &[Strand], threads: usize) -> Vec<f64> {
    let mut app = app(threads);
    walker(&mut app, preset, strands, Vec3::ZERO);
    settle(&mut app);
    let lake = lake(&mut app);
    (0..60).for_each(|_| app.update());
    app.world_mut().despawn(lake);
    let tick = |_| {
        let start = Clock::start();
        app.update();
        start.passed().as_secs_f64() * 1e3
    };
    (0..AFTER).map(tick).collect()
}

/// Medians of interleaved runs of several apps (ms a tick).
pub fn apps_in_turns<const N: usize>(apps: &mut [App; N]) -> [f64; N] {
    let mut runs = [[0.0; RUNS]; N];
    for run in 0..RUNS {
        for (app, runs) in apps.iter_mut().zip(&mut runs) {
            // Warms the caches, which the other apps have used.
            (0..4).for_each(|_| app.update());
            let start = Clock::start();
            (0..TICKS).for_each(|_| app.update());
            runs[run] = start.passed().as_secs_f64() * 1e3 / f64::from(TICKS);
        }
    }
    runs.map(median)
}

//! `cargo bench --bench game`: what hair costs a game, in milliseconds a tick of 1/60 s.
//!
//! Each preset on a head with shoulders, at rest and on a character who walks and looks around,
//! with and without contact between strands; some as a skinned figure wears them, among the balls that fit
//! its skin; then presets in water, beside the same hair dry; then crowds. Medians of five runs of 20 ticks; nothing
//! is drawn and nothing sleeps. On one thread only its own processor time counts, whatever else runs
//! on the machine. `KERATIN_BENCH_ONLY=wavy,crowd` prints only these rows. `KERATIN_BENCH_PARTS=1` prints
//! after each crowd which parts of a substep take the time.

#[path = "../examples/shared/body.rs"]
#[allow(dead_code, reason = "the example uses all of it")]
mod body;
mod common;
#[path = "../examples/shared/head.rs"]
#[allow(dead_code, reason = "the pictures use all of it")]
mod head;
#[path = "../examples/shared/mannequin.rs"]
#[allow(dead_code, reason = "the salon uses all of it")]
mod mannequin;
#[path = "../examples/shared/skeleton.rs"]
#[allow(dead_code, reason = "the example uses all of it")]
mod skeleton;
#[path = "game/wet.rs"]
mod wet;
#[path = "game/worn.rs"]
mod worn;

/// What the mannequin takes from the scenes.
mod scenes {
    pub const HEAD_RADIUS: f32 = 0.1;
}

use bevy::{prelude::*, tasks::ComputeTaskPool};
use bevy_keratin::{
    HairScreenShare, SleepCounts,
    authoring::plant::{HairPreset, Scalp},
    prelude::*,
};
use std::{
    process::Command,
    time::{Duration, Instant},
};

const THREADS: &str = "KERATIN_BENCH_THREADS";

/// The rows to print, if not all: presets by name, `standing`, `worn`, `wet` or a preset as `wet-wavy`, `crowd`,
/// `wet-crowd`.
const ONLY: &str = "KERATIN_BENCH_ONLY";

/// Whether to print what each part of a substep takes.
const PARTS: &str = "KERATIN_BENCH_PARTS";

/// Ticks in a run, and runs of which the median is printed.
const TICKS: u32 = 20;
const RUNS: usize = 5;

fn main() {
    if let Ok(threads) = std::env::var(THREADS) {
        rows(threads.parse().expect("a number of threads"));
        return;
    }
    println!("name | threads | contact | ms");
    // Bevy's thread pools are made once a process.
    for threads in ["1", "2"] {
        let this = std::env::current_exe().expect("a running program");
        let status = Command::new(this).env(THREADS, threads).status();
        assert!(status.is_ok_and(|s| s.success()), "rows for {threads} threads");
    }
}

fn rows(threads: usize) {
    let only = std::env::var(ONLY).ok();
    let wanted = |name: &str| only.as_ref().is_none_or(|only| only.split(',').any(|o| o == name));
    for preset in HairPreset::ALL {
        let name = format!("{preset:?}").to_lowercase();
        if wanted(&name) {
            preset_rows(&name, preset, threads);
        }
    }
    for preset in HairPreset::ALL.into_iter().filter(|_| wanted("standing")) {
        standing_rows(preset, threads);
    }
    if wanted("worn") {
        worn::rows(threads);
    }
    for preset in HairPreset::ALL {
        let name = format!("{preset:?}").to_lowercase();
        if wanted("wet") || wanted(&format!("wet-{name}")) {
            wet::rows(&name, preset, threads);
        }
    }
    if wanted("crowd") {
        crowd_rows(threads);
    }
    if wanted("wet") || wanted("wet-crowd") {
        wet::crowd(threads);
    }
}

fn preset_rows(name: &str, preset: HairPreset, threads: usize) {
    let strands = plant(preset);
    let contact = preset.settings().contact;
    let without = StrandContact { strength: 0.0, ..contact };
    let pairs = StrandContact { method: ContactMethod::Pairs, ..contact };
    let soft = StrandContact { core: 0.0, ..pairs };
    // Each has come to rest with its own contact.
    let hows = [("on", contact), ("by pairs", pairs), ("pairs, no core", soft), ("off", without)];
    let mut hairs = [Entity::PLACEHOLDER; 4];
    let mut apps = [0, 1, 2, 3].map(|k| {
        let mut app = app(threads);
        hairs[k] = person(&mut app, preset, &strands, Vec3::ZERO);
        app.world_mut().entity_mut(hairs[k]).insert(hows[k].1);
        settle(&mut app);
        app
    });
    for moving in [false, true] {
        if moving {
            for (app, hair) in apps.iter_mut().zip(hairs) {
                app.world_mut().entity_mut(hair).insert(Walks { phase: 0.0 });
                settle(app);
            }
        }
        let state = if moving { "moving" } else { "at rest" };
        for ((how, _), ms) in hows.iter().zip(wet::apps_in_turns(&mut apps)) {
            println!("{name} {state} | {threads} | {how} | {ms:.2}");
        }
    }
    let nodes = strands.first().map_or(0, Strand::nodes);
    println!("{name}: {} guides of {nodes} nodes", strands.len());
}

/// Five seconds after a character has come to stand, beside one whose hair never sleeps.
fn standing_rows(preset: HairPreset, threads: usize) {
    let strands = plant(preset);
    let [sleeping, never] = [SleepSettings::default(), SleepSettings::never()].map(|sleep| {
        let mut app = app(threads);
        app.insert_resource(HairDefault(sleep));
        let hair = person(&mut app, preset, &strands, Vec3::ZERO);
        (0..300).for_each(|_| app.update());
        let awake = app.world().get::<SleepCounts>(hair).map_or(0, |counts| counts.awake);
        let [ms] = in_turns(&mut app, |_, _| {});
        (ms, awake)
    });
    println!(
        "{} standing | {threads} | on | {:.3} | {:.3} of never asleep, {} of {} awake",
        preset.name().to_lowercase(),
        sleeping.0,
        sleeping.0 / never.0,
        sleeping.1,
        strands.len()
    );
}

/// Two near characters, twenty in the background beside them, then a hundred far off as well.
fn crowd_rows(threads: usize) {
    // Seven heads of hair, always the same.
    let presets = HairPreset::ALL[..7].to_vec();
    let planted: Vec<_> = presets.iter().copied().map(plant).collect();
    let mut app = app(threads);
    let parts = std::env::var_os(PARTS).is_some();
    if parts {
        time_parts(&mut app);
    }
    let mut place = 0;
    let mut add = |app: &mut App, count: usize, share: f32| {
        for _ in 0..count {
            let which = place % presets.len();
            let at = Vec3::new((place % 12) as f32, 0.0, (place / 12) as f32) * 1.5;
            let hair = person(app, presets[which], &planted[which], at);
            app.world_mut().entity_mut(hair).insert((
                HairLod::default(),
                HairScreenShare(share),
                Walks { phase: place as f32 },
            ));
            place += 1;
        }
    };
    for (name, count, share) in
        [("2 near", 2, 0.6), ("2 near + 20 background", 20, 0.12), ("+ 100 far", 100, 0.02)]
    {
        add(&mut app, count, share);
        settle(&mut app);
        let [all] = in_turns(&mut app, |_, _| ());
        println!("{name} | {threads} | on | {all:.2}");
        if parts {
            print_parts(&mut app);
        }
    }
}

/// The time that each part of a substep takes.
#[derive(Resource)]
struct PartTimes {
    last: Clock,
    parts: Vec<(HairSystems, Duration)>,
}

/// Adds a clock between each part of a substep and the next.
fn time_parts(app: &mut App) {
    let all: Vec<HairSystems> = HairSystems::ALL
        .into_iter()
        .flat_map(|set| if set.parts().is_empty() { vec![set] } else { set.parts().to_vec() })
        .collect();
    app.insert_resource(PartTimes {
        last: Clock::start(),
        parts: all.iter().map(|part| (*part, Duration::ZERO)).collect(),
    });
    for (i, part) in all.iter().copied().enumerate() {
        let mark = move |mut times: ResMut<PartTimes>| {
            let times = &mut *times;
            times.parts[i].1 += times.last.passed();
            times.last = Clock::start();
        };
        match all.get(i + 1) {
            Some(next) => app.add_systems(HairTick, mark.after(part).before(*next)),
            None => app.add_systems(HairTick, mark.after(part)),
        };
    }
}

/// Prints the parts that take most, of the ticks of this crowd.
fn print_parts(app: &mut App) {
    let mut times = app.world_mut().resource_mut::<PartTimes>();
    times.parts.iter_mut().for_each(|(_, time)| *time = Duration::ZERO);
    (0..TICKS).for_each(|_| app.update());
    let mut parts = app.world().resource::<PartTimes>().parts.clone();
    // The first part counts what is between two substeps as well.
    parts.sort_by_key(|(_, time)| std::cmp::Reverse(*time));
    for (part, time) in parts.iter().filter(|(_, time)| time.as_micros() > 20 * u128::from(TICKS)) {
        println!("    {:.2} {part:?}", time.as_secs_f64() * 1e3 / f64::from(TICKS));
    }
}

/// Medians of interleaved runs (ms per tick), each prepared by `ready`.
fn in_turns<const N: usize>(app: &mut App, ready: impl Fn(&mut App, usize)) -> [f64; N] {
    let mut runs = [[0.0; RUNS]; N];
    for run in 0..RUNS {
        for (turn, runs) in runs.iter_mut().enumerate() {
            ready(app, turn);
            (0..4).for_each(|_| app.update());
            let start = Clock::start();
            (0..TICKS).for_each(|_| app.update());
            runs[run] = start.passed().as_secs_f64() * 1e3 / f64::from(TICKS);
        }
    }
    runs.map(median)
}

fn median(mut runs: [f64; RUNS]) -> f64 {
    runs.sort_by(f64::total_cmp);
    runs[RUNS / 2]
}

/// On one thread the time that it runs, so that others on the machine do not count; where there are
/// several, or the system does not tell, the time that passes.
struct Clock(Instant, Option<Duration>);

impl Clock {
    fn start() -> Self {
        Self(Instant::now(), Self::on_core())
    }

    fn on_core() -> Option<Duration> {
        if ComputeTaskPool::get().thread_num() > 0 {
            return None;
        }
        let stat = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
        stat.split(' ').next()?.parse().ok().map(Duration::from_nanos)
    }

    fn passed(&self) -> Duration {
        let on_core = self.1.and_then(|from| Self::on_core()?.checked_sub(from));
        on_core.unwrap_or_else(|| self.0.elapsed())
    }
}

fn settle(app: &mut App) {
    (0..90).for_each(|_| app.update());
}

/// The mannequin lies; its crown is at +X and its face at +Y. This puts it upright.
fn upright() -> Transform {
    Transform::from_matrix(Mat4::from_mat3(Mat3::from_cols(Vec3::Y, Vec3::Z, Vec3::X)))
}

fn plant(preset: HairPreset) -> Vec<Strand> {
    let scalp = Scalp { up: Dir3::X, front: Dir3::Y, height: 0.118, ..default() };
    let planted = preset.plant(&mannequin::mesh(), &scalp).expect("hair grows on the mannequin");
    let strand = |points: &[Vec3]| Strand::from_polyline(points).expect("points are apart");
    planted.groom.strands().map(|s| strand(s.points)).collect()
}

/// A character with hair and colliders at a position.
fn person(app: &mut App, preset: HairPreset, strands: &[Strand], at: Vec3) -> Entity {
    let world = app.world_mut();
    let body = world.spawn((Transform::from_translation(at), Person { at })).id();
    for (collider, place) in head::body().expect("solids of a body") {
        world.spawn((collider, place, ChildOf(body)));
    }
    let hair = world.spawn((Hair, upright(), preset.settings(), ChildOf(body))).id();
    for strand in strands {
        world.spawn((StrandOf(hair), strand.clone()));
    }
    hair
}

#[derive(Component)]
struct Person {
    at: Vec3,
}

/// On a hair: its wearer walks and looks around.
#[derive(Component)]
struct Walks {
    phase: f32,
}

/// Two steps per second that lift the head by 3 cm, and looks of 40° to both sides.
fn walk(
    time: Res<Time>,
    walkers: Query<(&Walks, &ChildOf)>,
    mut people: Query<(&Person, &mut Transform)>,
) {
    let t = time.elapsed_secs_wrapped();
    for (Walks { phase }, of) in &walkers {
        let Ok((Person { at }, mut place)) = people.get_mut(of.parent()) else { continue };
        let step = (12.6 * t + phase).sin();
        place.translation = *at + Vec3::new(0.02 * (6.3 * t + phase).sin(), 0.03 * step, 0.0);
        place.rotation = Quat::from_rotation_y(0.7 * (3.0 * t + phase).sin());
    }
}

fn app(threads: usize) -> App {
    let mut app = common::app(threads);
    app.add_plugins(HairPlugins::default())
        .insert_resource(HairDefault(SleepSettings::never()))
        .add_systems(FixedUpdate, walk);
    app
}

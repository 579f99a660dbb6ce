//! The table: what a tick of 1/60 s, 6 substeps, costs in a whole app. The direct solver takes two of
//! them as one, sweeps all with 5 iterations.
//!
//! What is compared runs interleaved, and the best of each is kept: load on the machine slows
//! single runs down, not ratios. Bevy's thread pools are made once a process, so each number of
//! threads gets a process of its own.

use super::{common, scalar::Twin};
use bevy::{prelude::*, tasks::ComputeTaskPool};
use bevy_keratin::{
    BondChanges, DropletRules, HairStep, SleepCounts, SolverMethod,
    forces::{
        contact::{ContactPlugin, Obstacles},
        environment::EnvironmentPlugin,
    },
    keratin::{
        bond::{BondPlugin, RestShape},
        treatment::TreatmentPlugin,
    },
    prelude::*,
    simulation::{sleep::SleepPlugin, solve::SpringPlugin},
    water::WaterPlugin,
};
use std::{process::Command, time::Instant};

const THREADS: &str = "KERATIN_BENCH_THREADS";

/// The rows to print, if not all: `memory`, `empty`, `sleep`, `hanging`, or strands and nodes such as `10000x16`.
const ONLY: &str = "KERATIN_BENCH_ONLY";

/// Prints the whole table, or in a process of its own the rows of one number of threads.
pub fn print() -> bool {
    if let Ok(threads) = std::env::var(THREADS) {
        rows(threads.parse().expect("a number of threads"));
        return false;
    }
    println!(
        "strands × nodes | threads | scalar sweeps, sweeps, direct, ns a segment and substep | tick, ms | \
         with sweeps, ms | direct / sweeps | bonds at rest | bonds moving | contacts | 1,000 droplets"
    );
    for threads in ["1", "2"] {
        let this = std::env::current_exe().expect("a running program");
        let status = Command::new(this).env(THREADS, threads).status();
        assert!(status.is_ok_and(|s| s.success()), "rows for {threads} threads");
    }
    true
}

fn rows(threads: usize) {
    let only = std::env::var(ONLY).ok();
    let wanted = |name: &str| only.as_ref().is_none_or(|only| only.split(',').any(|o| o == name));
    // First, before the process has freed memory to reuse.
    if threads == 1 && wanted("memory") {
        let [without, with] = memory();
        println!(
            "100000 × 16 | memory {without:.2} kB a strand, of all that is held for it; {with:.2} kB \
             with contact"
        );
    }
    if wanted("empty") {
        empty_row(threads);
    }
    if wanted("sleep") {
        sleep_row(threads);
    }
    for (strands, nodes) in [(200, 9), (10_000, 6), (10_000, 16), (1_000, 64), (100_000, 16)] {
        if wanted(&format!("{strands}x{nodes}")) {
            row(threads, strands, nodes);
        }
    }
    if wanted("hanging") {
        hanging_rows(threads);
    }
}

/// Frames without any hair: Bevy's own systems alone, then with the hair systems.
fn empty_row(threads: usize) {
    let bare = common::app(threads);
    let mut apps = [bare, app(threads, Kind::Tick, &[], None)];
    let mut best = [f64::INFINITY; 2];
    for _ in 0..300 {
        for (best, app) in best.iter_mut().zip(&mut apps) {
            *best = best.min(seconds(|| app.update()));
        }
    }
    println!("no strands | {threads} | {:.3} ms, Bevy alone {:.3}", best[1] * 1e3, best[0] * 1e3);
}

/// Contact between strands that hang at the same density, for several counts.
fn hanging_rows(threads: usize) {
    for strands in [1_000, 10_000, 100_000] {
        let mut app = app(threads, Kind::Tick, &patch(strands, 16), None);
        (0..4).for_each(|_| app.update());
        let [without, with] = contacts_off_and_on(&mut app, 3);
        println!(
            "{strands} × 16 hanging | {threads} | contacts {:.2} µs a strand, tick {:.2}",
            (with - without) * 1e6 / strands as f64,
            with * 1e6 / strands as f64,
        );
    }
}

/// The same head awake, asleep, and on the two levels of detail.
fn sleep_row(threads: usize) {
    let mut app = app(threads, Kind::Tick, &head(10_000, 16), Some(head_radius(10_000)));
    app.insert_resource(HairDefault(StrandContact::default()));
    let hair = app.world_mut().query_filtered::<Entity, With<Hair>>().single(app.world());
    let hair = hair.expect("one hair");
    app.world_mut().entity_mut(hair).insert(HairLod::default());
    (0..240).for_each(|_| app.update());
    // With limits this wide any motion counts as rest.
    let sleepy = SleepSettings { speed: 1.0, turning: 10.0, seconds: 0.2 };
    let (mut awake, mut asleep) = ([f64::INFINITY; 3], f64::INFINITY);
    for _ in 0..6 {
        app.insert_resource(HairDefault(SleepSettings::never()));
        for (best, share) in awake.iter_mut().zip([0.05, 0.2, 1.0]) {
            app.world_mut().entity_mut(hair).insert(HairScreenShare(share));
            app.update();
            *best = best.min(seconds(|| app.update()));
        }
        app.insert_resource(HairDefault(sleepy));
        (0..16).for_each(|_| app.update());
        asleep = asleep.min(seconds(|| app.update()));
        let sleepers = app.world().get::<SleepCounts>(hair);
        assert!(sleepers.is_some_and(SleepCounts::all), "{sleepers:?}");
    }
    println!(
        "10000 × 16 with contacts | {threads} | awake {:.2} ms, asleep {:.2} ms, 1 in {:.0} | levels \
         of detail {:.0} % and {:.0} %",
        awake[2] * 1e3,
        asleep * 1e3,
        awake[2] / asleep,
        awake[1] / awake[2] * 100.0,
        awake[0] / awake[2] * 100.0,
    );
}

fn row(threads: usize, strands: usize, nodes: usize) {
    let hair = head(strands, nodes);
    let work = (strands * (nodes - 1) * 6) as f64;
    let turns = (1_600_000 / (strands * nodes)).clamp(3, 20);
    let mut twins: Vec<Twin> = hair.iter().take(1000).map(Twin::of).collect();
    let mut scalar = || {
        for _ in 0..6 {
            twins.iter_mut().for_each(|t| t.step(1.0 / 360.0, 5));
        }
    };
    let kinds = [
        Kind::Projection,
        Kind::NoBonds,
        Kind::Tick,
        Kind::BondsMoving,
        Kind::SweepsAlone,
        Kind::Sweeps,
    ];
    let mut apps = kinds.map(|kind| app(threads, kind, &hair, Some(head_radius(strands))));
    for _ in 0..if strands > 10_000 { 2 } else { 30 } {
        apps.iter_mut().for_each(App::update);
    }
    let (mut best_scalar, mut best) = (f64::INFINITY, [f64::INFINITY; 6]);
    for _ in 0..turns {
        best_scalar = best_scalar.min(seconds(&mut scalar));
        for (best, app) in best.iter_mut().zip(&mut apps) {
            // Warms the caches, which the other apps have used; the scalar strands stay in them.
            app.update();
            *best = best.min(seconds(|| app.update()));
        }
    }
    best_scalar *= strands as f64 / strands.min(1000) as f64;
    let [projection, no_bonds, tick, moving, sweeps_alone, sweeps] = best;
    // Settled under contact, then with and without; then wetted, and beside the dry one.
    let percent = |a: f64, b: f64| format!("{:+.0} %", (a / b - 1.0) * 100.0);
    let [contacts, droplets] = if strands > 10_000 {
        ["-".into(), "-".into()]
    } else {
        let app = &mut apps[2];
        app.insert_resource(HairDefault(StrandContact::default()));
        (0..240).for_each(|_| app.update());
        let [without, with] = contacts_off_and_on(app, turns);
        app.insert_resource(HairDefault(StrandContact { strength: 0.0, ..default() }));
        scatter_droplets(app, 1000);
        (0..30).for_each(|_| app.update());
        let wet = (0..turns).map(|_| seconds(|| app.update())).fold(f64::INFINITY, f64::min);
        [percent(with, without), percent(wet, without)]
    };
    println!(
        "{strands} × {nodes} | {threads} | {:.0}, {:.1}, {:.1} | {:.2} | {:.2} | {:.2} | {} | {} | {contacts} | {droplets}",
        best_scalar / work * 1e9,
        sweeps_alone / work * 1e9,
        projection / work * 1e9,
        tick * 1e3,
        sweeps * 1e3,
        tick / sweeps,
        percent(tick, no_bonds),
        percent(moving, no_bonds),
    );
}

/// Memory per strand of a whole head (kB): its components and its share of blocks; then with
/// contact lists as well.
fn memory() -> [f64; 2] {
    let strands = 100_000;
    let hair = head(strands, 16);
    let before = resident();
    let mut app = app(1, Kind::Tick, &hair, Some(head_radius(strands)));
    [0.0, StrandContact::default().strength].map(|strength| {
        app.insert_resource(HairDefault(StrandContact { strength, ..default() }));
        (0..3).for_each(|_| app.update());
        (resident() - before) / strands as f64 / 1e3
    })
}

/// The resident memory of the process (bytes); NaN where the system does not report it.
fn resident() -> f64 {
    let pages = std::fs::read_to_string("/proc/self/statm").ok();
    let pages = pages.and_then(|text| text.split(' ').nth(1)?.parse::<f64>().ok());
    pages.unwrap_or(f64::NAN) * 4096.0
}

/// Droplets of 1 mm on the strands' nodes, that neither spread nor slide.
fn scatter_droplets(app: &mut App, count: usize) {
    let pinned = HairWetting { uptake: 0.0, sliding: 0.0, evaporation: 0.0, ..default() };
    app.insert_resource(HairDefault(pinned));
    app.insert_resource(DropletRules { merging: false, min: Vec3::splat(-10.0), ..default() });
    let mut strands = app.world_mut().query::<&Strand>();
    let nodes: Vec<Vec3> =
        strands.iter(app.world()).flat_map(|s| s.positions()[1..].to_vec()).collect();
    let drops: Vec<Droplet> = (0..count)
        .filter_map(|i| Droplet::new(nodes[i * 7919 % nodes.len()], 4.2e-9).ok())
        .collect();
    app.world_mut().spawn_batch(drops);
}

fn seconds(work: impl FnOnce()) -> f64 {
    let start = Instant::now();
    work();
    start.elapsed().as_secs_f64()
}

/// The best ticks without and with contact between strands, in turns.
fn contacts_off_and_on(app: &mut App, turns: usize) -> [f64; 2] {
    let mut best = [f64::INFINITY; 2];
    for _ in 0..turns {
        for (best, strength) in best.iter_mut().zip([0.0, StrandContact::default().strength]) {
            app.insert_resource(HairDefault(StrandContact { strength, ..default() }));
            app.update();
            *best = best.min(seconds(|| app.update()));
        }
    }
    best
}

/// 24 cm strands all over the upper half of a head, as dense as 10,000 on one of 9 cm.
fn head(strands: usize, nodes: usize) -> Vec<Strand> {
    let radius = head_radius(strands);
    let strand = |i: usize| {
        let y = 1.0 - (i as f32 + 0.5) / strands as f32;
        let across = (1.0 - y * y).sqrt();
        let (sin, cos) = (i as f32 * 2.399_963).sin_cos();
        let out = Vec3::new(across * cos, y, across * sin);
        along(out * (radius + 2e-3), out, nodes)
    };
    (0..strands).map(strand).collect()
}

fn head_radius(strands: usize) -> f32 {
    0.09 * (strands as f32 / 10_000.0).sqrt()
}

/// Strands that hang from a ceiling at constant density.
fn patch(strands: usize, nodes: usize) -> Vec<Strand> {
    let side = (strands as f32).sqrt().ceil() as usize;
    let uneven = |i: usize| (i as f32 * 0.618_034).fract() - 0.5;
    let strand = |i: usize| {
        let root = Vec3::new(
            (i % side) as f32 + 0.5 * uneven(i),
            0.0,
            (i / side) as f32 + 0.5 * uneven(7 * i + 3),
        );
        along(root * 2.26e-3, Vec3::NEG_Y, nodes)
    };
    (0..strands).map(strand).collect()
}

fn along(root: Vec3, direction: Vec3, nodes: usize) -> Strand {
    let step = 0.24 / (nodes - 1) as f32;
    let points: Vec<Vec3> = (0..nodes).map(|k| root + direction * (step * k as f32)).collect();
    Strand::from_polyline(&points).expect("points are apart")
}

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    /// Stretch–shear and bend–twist, with gather, scatter and integration, and nothing else.
    Projection,
    /// Everything but bonds and contact between strands.
    NoBonds,
    /// Everything but contact between strands.
    Tick,
    /// The same while every bond's rate moves.
    BondsMoving,
    /// The paper's projections alone.
    SweepsAlone,
    /// The tick with the paper's projections.
    Sweeps,
}

fn app(threads: usize, kind: Kind, hair: &[Strand], head: Option<f32>) -> App {
    let mut app = common::app(threads);
    let plugins = HairPlugins::default().build();
    match kind {
        Kind::Projection | Kind::SweepsAlone => app.add_plugins(
            plugins
                .disable::<EnvironmentPlugin>()
                .disable::<BondPlugin>()
                .disable::<ContactPlugin>()
                .disable::<TreatmentPlugin>()
                .disable::<WaterPlugin>()
                .disable::<SpringPlugin>()
                .disable::<SleepPlugin>(),
        ),
        Kind::NoBonds => app.add_plugins(plugins.disable::<BondPlugin>().disable::<SleepPlugin>()),
        Kind::Tick | Kind::BondsMoving | Kind::Sweeps => app.add_plugins(plugins),
    };
    // Resources of the plugins left out; contact between strands is off at first.
    app.init_resource::<HairDefault<BondInfluence>>()
        .init_resource::<HairGravity>()
        .insert_resource(HairDefault(AirDrag { rate: 3.0 }))
        .insert_resource(HairDefault(SleepSettings::never()))
        .insert_resource(HairDefault(StrandContact { strength: 0.0, ..default() }));
    // The projection alone is counted by the substep: it takes all six.
    let solver = match kind {
        Kind::Sweeps | Kind::SweepsAlone => {
            HairSolver { method: SolverMethod::Sweeps, ..default() }
        }
        Kind::Projection => HairSolver { substep: 1.0 / 360.0, ..default() },
        Kind::NoBonds | Kind::Tick | Kind::BondsMoving => HairSolver::default(),
    };
    app.insert_resource(HairDefault(solver));
    let alone = matches!(kind, Kind::Projection | Kind::SweepsAlone);
    if let Some(radius) = head.filter(|_| !alone) {
        let floor = HairCollider::plane(Dir3::Y);
        app.world_mut().spawn((HairCollider::sphere(radius).expect("a head"), Transform::IDENTITY));
        app.world_mut().spawn((floor, Transform::from_xyz(0.0, -2.0 * radius, 0.0)));
    }
    if kind == Kind::BondsMoving {
        app.add_systems(HairTick, stir.in_set(HairSystems::First));
    }
    let of = app.world_mut().spawn((Hair, Obstacles::default())).id();
    for strand in hair {
        let mut rest = RestShape::default();
        rest.darboux = (0..strand.edges()).map(|i| strand.darboux(i)).collect();
        rest.stiffness = vec![0.01; strand.edges()];
        app.world_mut().spawn((StrandOf(of), strand.clone(), rest, Bonds::default()));
    }
    app.update();
    app
}

/// Bonds break in one substep and form in the next.
fn stir(step: Res<HairStep>, mut strands: Query<(&Strand, &mut BondChanges)>) {
    let change = if step.index.is_multiple_of(2) { -1e-3 } else { 9e-4 };
    // On all threads, like a system of a game.
    let mut strands: Vec<_> = strands.iter_mut().collect();
    ComputeTaskPool::get().scope(|scope| {
        for strands in strands.chunks_mut(1024) {
            scope.spawn(async move {
                for (strand, changes) in strands {
                    (0..strand.edges())
                        .for_each(|i| changes.request(i, BondKind::Hydrogen, change));
                }
            });
        }
    });
}

//! A run of random inputs from a seed, logged with what hair came to, and played back from the log alone.
//!
//! `-- --scene replay --seed 7 --seconds 20 --write run.log`, then `-- --scene replay --read run.log`

use crate::report::state_hash;
use bevy::{
    app::{TaskPoolOptions, TaskPoolPlugin},
    prelude::*,
    time::TimeUpdateStrategy,
};
use bevy_keratin::prelude::*;
use clap::Args;
use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};
use serde::{Deserialize, Serialize};
use std::{
    fs::File,
    io::{BufRead, BufReader, BufWriter, Write},
    path::PathBuf,
    time::Duration,
};

const HERTZ: f64 = 60.0;
const VERSION: u32 = 1;
const STRANDS: usize = 160;
const NODES: usize = 12;
const RADIUS: f32 = 0.09;

#[derive(Args)]
#[group(id = "replay")]
pub struct Replay {
    /// Where the inputs of a replay come from.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Runs a replay and logs it to this file.
    #[arg(long, value_name = "LOG")]
    write: Option<PathBuf>,
    /// Plays a log back and compares.
    #[arg(long, value_name = "LOG")]
    read: Option<PathBuf>,
}

/// What a player or a game does.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
enum Input {
    /// The head walks and turns like this (m/s, rad/s).
    Move {
        velocity: Vec3,
        spin: Vec3,
    },
    /// Wind (m/s).
    Wind(Vec3),
    /// A blower at the head, warm or not, or none.
    Blow(Option<bool>),
    /// Rain above the head, or none.
    Shower(bool),
    Wet,
    Dry,
    /// Permanent waves.
    Perm(f32),
    /// All hair at this length (m).
    Cut(f32),
    Restyle,
}

impl Input {
    fn any(random: &mut Xoshiro256PlusPlus) -> Self {
        let mut vector =
            |most: f32| Vec3::from_array([0; 3].map(|_| random.random_range(-most..=most)));
        let (fast, slow) = (vector(1.5), vector(3.0));
        match random.random_range(0..16) {
            0..5 => Self::Move { velocity: fast, spin: slow },
            5 | 6 => Self::Wind(2.0 * slow),
            7 => Self::Blow(Some(true)),
            8 => Self::Blow(Some(false)),
            9 => Self::Blow(None),
            10 => Self::Shower(true),
            11 => Self::Shower(false),
            12 => Self::Wet,
            13 => Self::Dry,
            14 => Self::Perm(random.random_range(0.2..0.8)),
            _ if random.random_range(0..4) == 0 => Self::Cut(random.random_range(0.08..0.2)),
            _ => Self::Restyle,
        }
    }
}

/// A line of a log.
#[derive(Serialize, Deserialize)]
enum Line {
    Start {
        version: u32,
        seed: u64,
        ticks: u64,
        instructions: String,
    },
    Input {
        tick: u64,
        input: Input,
    },
    /// Once a second: a number made of every bit of the state, and where the tips are (m).
    State {
        tick: u64,
        hash: String,
        tips: Vec<Vec3>,
    },
}

/// What `--json` prints.
#[derive(Serialize)]
struct Outcome {
    seed: u64,
    ticks: u64,
    inputs: usize,
    instructions: String,
    /// That of the machine which wrote the log.
    instructions_logged: String,
    /// Whether all of the state was the same to the bit; true of a run that was written.
    equal: bool,
    /// The first second after which it was not.
    differs_after_seconds: Option<u64>,
    /// How far the tips were from those of the log at most, after each second (m).
    tips_off: Vec<f32>,
}

impl Replay {
    pub fn run(
        &self,
        seconds: Option<f32>,
        pools: TaskPoolOptions,
        json: bool,
    ) -> Result<(), Box<dyn std::error::Error>> {
        let outcome = match (&self.write, &self.read) {
            (Some(path), None) => {
                let seconds = seconds.unwrap_or(20.0);
                if !(1.0..=1e5).contains(&seconds) {
                    return Err(format!("--seconds is {seconds}, expected 1 to 100000").into());
                }
                let at = |error| format!("--write {} cannot be written: {error}", path.display());
                let file = File::create(path).map_err(at)?;
                write(self.seed, (seconds * HERTZ as f32) as u64, pools, BufWriter::new(file))?
            }
            (None, Some(path)) => {
                let at = |error| format!("--read {} cannot be read: {error}", path.display());
                read(BufReader::new(File::open(path).map_err(at)?), pools)?
            }
            _ => return Err("--scene replay needs one of --write LOG and --read LOG".into()),
        };
        crate::print(&outcome, json)?;
        let (is_same, now, then) =
            (outcome.equal, &outcome.instructions, &outcome.instructions_logged);
        match is_same || now != then {
            true => Ok(()),
            false => Err("the run differs from its log on the same instructions".into()),
        }
    }
}

/// The instructions that kernels run on, as far as they decide bits.
fn instructions() -> String {
    let wanted = std::env::var("KERATIN_SIMD").unwrap_or_default();
    let is_fused = cfg!(target_arch = "x86_64") && wanted != "sse2";
    #[cfg(target_arch = "x86_64")]
    let is_fused = is_fused && std::arch::is_x86_feature_detected!("fma");
    let arch = std::env::consts::ARCH;
    if is_fused { format!("{arch} with fused products") } else { arch.to_owned() }
}

fn write(
    seed: u64,
    ticks: u64,
    pools: TaskPoolOptions,
    mut log: impl Write,
) -> Result<Outcome, Box<dyn std::error::Error>> {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let instructions = instructions();
    let mut line = |line: &Line| -> Result<(), Box<dyn std::error::Error>> {
        serde_json::to_writer(&mut log, line)?;
        Ok(log.write_all(b"\n")?)
    };
    line(&Line::Start { version: VERSION, seed, ticks, instructions: instructions.clone() })?;
    let (mut run, mut inputs) = (Run::new(pools), 0);
    for tick in 0..ticks {
        // About two a second.
        if random.random_range(0..30) == 0 {
            let input = Input::any(&mut random);
            run.act(input);
            line(&Line::Input { tick, input })?;
            inputs += 1;
        }
        run.app.update();
        if is_second(tick) {
            let (hash, tips) = run.state();
            line(&Line::State { tick, hash, tips })?;
        }
    }
    log.flush()?;
    let instructions_logged = instructions.clone();
    let (equal, differs_after_seconds, tips_off) = (true, None, Vec::new());
    Ok(Outcome {
        seed,
        ticks,
        inputs,
        instructions,
        instructions_logged,
        equal,
        differs_after_seconds,
        tips_off,
    })
}

fn read(log: impl BufRead, pools: TaskPoolOptions) -> Result<Outcome, Box<dyn std::error::Error>> {
    let mut lines = log.lines().enumerate().map(|(number, line)| {
        let text = line.map_err(|error| format!("line {}: {error}", number + 1))?;
        serde_json::from_str::<Line>(&text)
            .map_err(|error| format!("line {}: {error}; write the log again", number + 1))
    });
    let Some(Line::Start { version, seed, ticks, instructions: instructions_logged }) =
        lines.next().transpose()?
    else {
        return Err("line 1 is no Start: name a log that --write has written".into());
    };
    if version != VERSION {
        let expected = "write it again with this version";
        return Err(format!("the log is of version {version}, not {VERSION}: {expected}").into());
    }
    let lines: Vec<Line> = lines.collect::<Result<_, _>>()?;
    let mut lines = lines.into_iter().peekable();
    let mut outcome = Outcome {
        seed,
        ticks,
        inputs: 0,
        instructions: instructions(),
        instructions_logged,
        equal: true,
        differs_after_seconds: None,
        tips_off: Vec::new(),
    };
    let mut run = Run::new(pools);
    for tick in 0..ticks {
        while let Some(Line::Input { input, .. }) =
            lines.next_if(|line| matches!(line, Line::Input { tick: at, .. } if *at == tick))
        {
            if let Input::Perm(rate) = &input
                && !(0.0..=1.0).contains(rate)
            {
                return Err(format!(
                    "the log's input of tick {tick} has a rate of {rate}, expected 0 to 1"
                )
                .into());
            }
            run.act(input);
            outcome.inputs += 1;
        }
        run.app.update();
        if !is_second(tick) {
            continue;
        }
        let (now, places) = run.state();
        let Some(Line::State { hash, tips, .. }) =
            lines.next_if(|line| matches!(line, Line::State { tick: at, .. } if *at == tick))
        else {
            return Err(format!(
                "the log has no state of tick {tick} where it should be: it was cut off, or edited"
            )
            .into());
        };
        let off = places.iter().zip(&tips).map(|(a, b)| a.distance(*b));
        let off = off.fold(0.0, f32::max);
        outcome.tips_off.push(off);
        if now != hash || places.len() != tips.len() || off != 0.0 {
            outcome.equal = false;
            outcome.differs_after_seconds.get_or_insert((tick + 1) / HERTZ as u64);
        }
    }
    match lines.count() {
        0 => Ok(outcome),
        more => Err(format!("the log has {more} lines after its last tick: it was edited").into()),
    }
}

fn is_second(tick: u64) -> bool {
    (tick + 1).is_multiple_of(HERTZ as u64)
}

/// A head with hair.
struct Run {
    app: App,
    hair: Entity,
    blower: Option<Entity>,
    shower: Option<Entity>,
}

/// How the head moves (m/s, rad/s).
#[derive(Component, Default)]
struct Moves {
    velocity: Vec3,
    spin: Vec3,
}

impl Run {
    fn new(pools: TaskPoolOptions) -> Self {
        let mut app = App::new();
        let bevy = MinimalPlugins.set(TaskPoolPlugin { task_pool_options: pools });
        app.add_plugins((bevy, HairPlugins::default()))
            .insert_resource(Time::<Fixed>::from_hz(HERTZ))
            .insert_resource(TimeUpdateStrategy::FixedTimesteps(1))
            .add_systems(FixedUpdate, moving);
        app.world_mut().resource_mut::<Time<Virtual>>().set_max_delta(Duration::MAX);
        app.finish();
        app.cleanup();
        let world = app.world_mut();
        let hair = world.spawn((Hair, Moves::default())).id();
        world.spawn((HairCollider::sphere(RADIUS).expect("a radius"), ChildOf(hair)));
        for i in 0..STRANDS {
            let y = 1.0 - (i as f32 + 0.5) / STRANDS as f32;
            let (sin, cos) = (i as f32 * 2.399_963).sin_cos();
            let across = (1.0 - y * y).sqrt();
            let out = Vec3::new(across * cos, y, across * sin);
            let node = |k: usize| out * (RADIUS + 2e-3 + 0.02 * k as f32);
            let points: Vec<Vec3> = (0..NODES).map(node).collect();
            let strand = Strand::from_polyline(&points).expect("nodes are apart");
            world.spawn((StrandOf(hair), strand));
        }
        app.update();
        Self { app, hair, blower: None, shower: None }
    }

    fn act(&mut self, input: Input) {
        let (world, hair) = (self.app.world_mut(), self.hair);
        let mut gone = |which: &mut Option<Entity>| which.take().map(|id| world.despawn(id));
        match input {
            Input::Blow(_) => _ = gone(&mut self.blower),
            Input::Shower(_) => _ = gone(&mut self.shower),
            _ => {}
        }
        match input {
            Input::Move { velocity, spin } => {
                world.entity_mut(hair).insert(Moves { velocity, spin });
            }
            Input::Wind(velocity) => world.resource_mut::<HairWind>().velocity = velocity,
            Input::Blow(Some(warm)) => {
                let blower = Blower { drying: if warm { 0.5 } else { 0.0 }, ..default() };
                let place = Transform::from_xyz(0.3, 0.1, 0.0).looking_at(Vec3::ZERO, Vec3::Y);
                self.blower = Some(world.spawn((blower, place, ChildOf(hair))).id());
            }
            Input::Shower(true) => {
                let shower = Shower::new(60.0, 1.5e-3).expect("a shower");
                let place = Transform::from_xyz(0.0, 0.5, 0.0);
                self.shower = Some(world.spawn((shower, place, ChildOf(hair))).id());
            }
            Input::Blow(None) | Input::Shower(false) => {}
            Input::Wet => _ = world.write_message(HairTreatment::wet(hair)),
            Input::Dry => _ = world.write_message(HairTreatment::dry(hair)),
            Input::Perm(rate) => {
                let perm = HairTreatment::set(hair, BondKind::Disulfide, rate);
                _ = world.write_message(perm.expect("a rate"));
            }
            Input::Cut(length) => world.trigger(CutHair::all(hair, CutBy::Length(length))),
            Input::Restyle => {
                world.commands().entity(hair).queue(Hair::restyle);
            }
        }
        world.flush();
    }

    fn state(&mut self) -> (String, Vec<Vec3>) {
        let world = self.app.world_mut();
        let mut all: Vec<_> = world.query::<(Entity, &Strand, &Bonds)>().iter(world).collect();
        all.sort_by_key(|(id, ..)| *id);
        let strands: Vec<Strand> = all.iter().map(|(_, strand, _)| (*strand).clone()).collect();
        let bonds: Vec<Bonds> = all.iter().map(|(.., bonds)| (*bonds).clone()).collect();
        let water = world.resource::<WaterLedger>();
        let hash = format!("{:016x}", state_hash(&strands, &bonds, water));
        let tip = |strand: &Strand| strand.positions().last().copied().unwrap_or_default();
        (hash, strands.iter().map(tip).collect())
    }
}

fn moving(time: Res<Time>, mut heads: Query<(&Moves, &mut Transform)>) {
    for (moves, mut place) in &mut heads {
        place.translation += moves.velocity * time.delta_secs();
        let turn = Quat::from_scaled_axis(moves.spin * time.delta_secs());
        place.rotation = (turn * place.rotation).normalize();
    }
}

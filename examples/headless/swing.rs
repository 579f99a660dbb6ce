//! A single strand, let go: how fast it swings, when it is lowest, where it comes to rest.
//!
//! Bare hair in empty space, so that theory can be held against it: no contact, no wear, no air while
//! it swings, thick air while it settles. Its swings are small: it is pulled aside by gravity tilted
//! by 3°, and let go.

use crate::trace;
use bevy::{prelude::*, time::TimeUpdateStrategy};
use bevy_keratin::{HairStep, prelude::*};
use clap::{Args, ValueEnum};
use serde::Serialize;
use std::{error::Error, time::Duration};

/// The strand of `--scene swing`.
#[derive(Args)]
pub struct Options {
    /// Length of the strand (m), for `swing`.
    #[arg(long, allow_negative_numbers = true, required_if_eq("scene", "swing"))]
    length: Option<f32>,
    /// Gravity-bending length (m), for `swing`.
    #[arg(long, allow_negative_numbers = true, required_if_eq("scene", "swing"))]
    bending_length: Option<f32>,
    /// Segments, for `swing`.
    #[arg(long, required_if_eq("scene", "swing"))]
    segments: Option<usize>,
    /// Where it is clamped to and let go, for `swing`.
    #[arg(long, required_if_eq("scene", "swing"))]
    from: Option<From>,
    /// Substeps a tick of 1/60 s, for `swing`; three if left out, as dry hair takes.
    #[arg(long)]
    substeps: Option<u32>,
}

/// Which way the root's clamp points.
#[derive(ValueEnum, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum From {
    Hanging,
    Level,
}

impl From {
    fn direction(self) -> Vec3 {
        match self {
            Self::Hanging => Vec3::NEG_Y,
            Self::Level => Vec3::X,
        }
    }
}

/// What `--json` prints.
#[derive(Serialize)]
pub struct Report {
    scene: &'static str,
    from: From,
    length: f32,
    bending_length: f32,
    segments: usize,
    substeps: u32,
    dt: f32,
    /// Of small swings about rest (s); none where they die before one is complete.
    period: Option<f64>,
    /// When the tip is lowest after it was let go level (s).
    low_point: Option<f64>,
    /// How far below its root the tip of a level strand settles, as a share of the length.
    sag: f64,
    /// Share of a small swing's energy that is left after a second.
    energy_left_1s: f64,
    strain_peak: f32,
    finite: bool,
}

impl Options {
    /// Runs it. What is missing was refused when arguments were read.
    pub fn run(&self) -> Result<Report, Box<dyn Error>> {
        let (Some(length), Some(bending_length), Some(segments), Some(from)) =
            (self.length, self.bending_length, self.segments, self.from)
        else {
            return Err("swing needs --length, --bending-length, --segments and --from".into());
        };
        if !(1e-3..=10.0).contains(&length) {
            return Err(format!("--length is {length} m, expected 0.001 to 10").into());
        }
        if !(1..=1024).contains(&segments) {
            return Err(format!("--segments is {segments}, expected 1 to 1024").into());
        }
        let stiffness = HairStiffness::from_bending_length(bending_length)?;
        let substeps = HairSubsteps::fixed(self.substeps.unwrap_or(3))?;
        let spawn = |world: &mut World, direction: Vec3| -> Result<Entity, Box<dyn Error>> {
            let at = |i: usize| direction * (length * i as f32 / segments as f32);
            let points: Vec<Vec3> = (0..=segments).map(at).collect();
            let strand = Strand::from_polyline(&points)?;
            let solver = HairSolver { substep: 1e-6, ..default() };
            let hair = world.spawn((Hair, stiffness, solver)).id();
            Ok(world.spawn((StrandOf(hair), strand)).id())
        };
        let mut app = bare_app(substeps);
        let level = spawn(app.world_mut(), From::Level.direction())?;
        let swinging = match from {
            From::Level => level,
            From::Hanging => spawn(app.world_mut(), from.direction())?,
        };
        let mut stage = Stage { app, level, swinging };
        let low_point = (from == From::Level).then(|| stage.fall()).flatten();
        let (settled, sag) = (stage.settle(), stage.sag());
        let (swing, substep) = stage.small_swing(&settled);
        let at_1s = swing[swing.len().min((1.0 / substep).round() as usize + 1) - 1];
        let energy_left_1s = match trace::decay(&swing, substep) {
            Some(rate) => (-rate).exp(),
            None => (at_1s / swing[0]).powi(2),
        };
        let watch = stage.app.world().resource::<Watch>();
        let step = stage.app.world().resource::<HairStep>();
        Ok(Report {
            scene: "swing",
            from,
            length,
            bending_length,
            segments,
            substeps: step.count,
            dt: step.dt,
            period: trace::period(&swing, substep),
            low_point,
            sag,
            energy_left_1s,
            strain_peak: watch.strain_peak,
            finite: watch.finite,
        })
    }
}

/// The longest that anything is waited for (s).
const PATIENCE: f64 = 40.0;

const DOWN: Vec3 = Vec3::new(0.0, -9.8, 0.0);

/// What is seen after each substep.
#[derive(Resource)]
struct Watch {
    positions: Vec<(Entity, Vec<Vec3>)>,
    strain_peak: f32,
    finite: bool,
}

fn watch(mut watch: ResMut<Watch>, strands: Query<(Entity, &Strand)>) {
    for (entity, strand) in &strands {
        watch.strain_peak = watch.strain_peak.max(strand.peak_strain());
        watch.finite &= strand.is_finite();
        watch.positions.push((entity, strand.positions().to_vec()));
    }
}

fn bare_app(substeps: HairSubsteps) -> App {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, HairPlugins::default()))
        .insert_resource(Time::<Fixed>::from_hz(60.0))
        .insert_resource(TimeUpdateStrategy::FixedTimesteps(1))
        .insert_resource(substeps)
        .insert_resource(HairGravity(DOWN))
        .insert_resource(HairDefault(AirDrag { rate: 0.0 }))
        .insert_resource(HairDefault(Cuticle { damage: 0.0, ..default() }))
        .insert_resource(HairDefault(StrandContact { strength: 0.0, ..default() }))
        .insert_resource(HairDefault(SleepSettings::never()))
        .insert_resource(Watch { positions: Vec::new(), strain_peak: 0.0, finite: true })
        .add_systems(HairTick, watch.in_set(HairSystems::Last));
    app.world_mut().resource_mut::<Time<Virtual>>().set_max_delta(Duration::MAX);
    app.finish();
    app.cleanup();
    app.update();
    app
}

struct Stage {
    app: App,
    level: Entity,
    swinging: Entity,
}

impl Stage {
    fn get(&self, strand: Entity) -> &Strand {
        self.app.world().get::<Strand>(strand).expect("strands stay")
    }

    /// One tick: the swinging strand after each substep.
    fn tick(&mut self) -> Vec<Vec<Vec3>> {
        self.app.update();
        let seen = core::mem::take(&mut self.app.world_mut().resource_mut::<Watch>().positions);
        seen.into_iter().filter(|(e, _)| *e == self.swinging).map(|(_, p)| p).collect()
    }

    fn substep(&self) -> f64 {
        self.app.world().resource::<HairStep>().dt.into()
    }

    /// From where it is, straight, to when its tip is lowest.
    fn fall(&mut self) -> Option<f64> {
        let height = |p: &Vec<Vec3>| p.last().map_or(0.0, |tip| f64::from(tip.y));
        let mut heights = vec![height(&self.get(self.swinging).positions().to_vec())];
        let mut ticks = 0.0;
        while ticks < 60.0 * PATIENCE {
            heights.extend(self.tick().iter().map(height));
            ticks += 1.0;
            if let Some(time) = trace::first_low(&heights, self.substep()) {
                return Some(time);
            }
        }
        None
    }

    /// Lets both come to rest in thick air.
    fn settle(&mut self) -> Vec<Vec3> {
        self.app.insert_resource(HairDefault(AirDrag { rate: 8.0 }));
        let places =
            |stage: &Self| [stage.level, stage.swinging].map(|s| stage.get(s).positions().to_vec());
        let mut before = places(self);
        for _ in 0..(2.0 * PATIENCE) as usize {
            for _ in 0..30 {
                self.tick();
            }
            let now = places(self);
            let moved = before.iter().flatten().zip(now.iter().flatten());
            let most = moved.map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
            before = now;
            if most < 1e-5 * self.get(self.level).length() {
                break;
            }
        }
        self.app.insert_resource(HairDefault(AirDrag { rate: 0.0 }));
        let [_, swinging] = before;
        swinging
    }

    fn sag(&self) -> f64 {
        let strand = self.get(self.level);
        let tip = strand.positions().last().map_or(0.0, |tip| tip.y);
        f64::from(strand.positions()[0].y - tip) / f64::from(strand.length())
    }

    /// Pulled aside and let go: how far along that displacement it is after each substep, weighted by
    /// mass, which is nearly the slowest swing alone.
    fn small_swing(&mut self, settled: &[Vec3]) -> (Vec<f64>, f64) {
        self.app.insert_resource(HairGravity(DOWN - Vec3::new(0.35, 0.35, 0.0)));
        let aside = self.settle();
        self.app.insert_resource(HairGravity(DOWN));
        let shape: Vec<_> = settled.iter().zip(&aside).map(|(p, q)| (q - p).as_dvec3()).collect();
        let tip = shape.len() - 1;
        let along = |places: &Vec<Vec3>| -> f64 {
            (places.iter().zip(settled).zip(&shape).enumerate())
                .map(|(i, ((now, p), s))| {
                    let mass = if i == tip { 0.5 } else { 1.0 };
                    mass * (now - p).as_dvec3().dot(*s)
                })
                .sum()
        };
        let mut swing = vec![along(&aside)];
        let mut seconds = 0.0;
        // At least the second that the energy is asked for, then until the period is known.
        let known =
            |swing: &[f64]| swing.windows(2).filter(|w| w[0] * w[1] < 0.0).count() >= trace::ZEROS;
        while seconds < 1.0 || (seconds < PATIENCE && !known(&swing)) {
            swing.extend(self.tick().iter().map(along));
            seconds += 1.0 / 60.0;
            let late = &swing[swing.len().saturating_sub(60)..];
            if seconds > 2.0 && late.iter().all(|a| a.abs() < 1e-3 * swing[0].abs()) {
                break;
            }
        }
        (swing, self.substep())
    }
}

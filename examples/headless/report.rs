//! The numbers that a run came to.

use crate::scenes::{Director, Scene, SceneKind, locks, measure};
use bevy::{math::DVec3, prelude::*};
use bevy_keratin::{HairStep, WindReceived, prelude::*};
use serde::Serialize;
use std::time::Duration;

#[derive(Serialize)]
struct Spread {
    min: f32,
    mean: f64,
    max: f32,
}

/// What `--json` prints.
#[derive(Serialize)]
pub struct Report {
    scene: &'static str,
    variant: &'static str,
    strands: usize,
    nodes: usize,
    substeps: u32,
    dt: f32,
    frames: u64,
    finite: bool,
    strain_peak: f32,
    /// The share of the held shape that the bonds alone would rest in.
    kept_rest: f64,
    /// The share that is there after settling without gravity.
    kept_zero_gravity: f64,
    /// The share that is there after settling under gravity.
    kept_hanging: f64,
    /// Mean radius of the held shape (m).
    curl_radius_held: Option<f64>,
    /// Mean radius without gravity (m); none for straight hair.
    curl_radius_zero_gravity: Option<f64>,
    /// Turns of the hanging hair.
    turns: f64,
    b_hydrogen: Spread,
    /// Mean of the hanging tips (m).
    tip_mean: [f64; 3],
    /// Largest |rate − min(1, b₀ + 0.3 Σ|Δv_w|)| over the joints, blow-dry treated only.
    drying_error: Option<f64>,
    /// Rank correlation of wind received and rate over unsaturated joints, blow-dry treated only.
    wind_rate_correlation: Option<f64>,
    /// Largest distance of a joint's shape without gravity from Σ f b Ω_j / Σ f b.
    relaxed_error: f64,
    /// Water that came, is there and has gone (m³), and what was lost count of, |in − held − out|/in.
    water_in: f64,
    water_held: f64,
    water_out: f64,
    water_error: f64,
    droplets: usize,
    /// The most droplets at a time, and how much higher than when it was dry any node has come, and is
    /// in the end (m), wet only.
    droplets_peak: usize,
    lift_peak: f32,
    lift: f32,
    /// Mean nearest distance between tips over the dry one, wet only.
    tip_spacing_ratio: Option<f64>,
    /// Share of strands in clusters linked at half the dry distance, wet only.
    clustered_share: Option<f64>,
    /// Hydrogen bonds' rate when pressing began, weighted by the held shape, shower only.
    b_pressed: Option<f64>,
    /// What the bonds kept of the held shape before the second shower, and their weighted rate after
    /// it, shower only.
    kept_dried: Option<f64>,
    b_rewet: Option<f64>,
    /// Where the hair was simulated, how many ticks on the graphics device, and which that is.
    residence: &'static str,
    gpu_ticks: u64,
    adapter: Option<String>,
    /// A number made of every bit of the state when the story ended.
    state_hash: String,
    wall_seconds: f64,
    sim_seconds: f64,
    /// Simulated seconds per second.
    real_time_factor: f64,
    ns_per_segment_iteration: f64,
    #[serde(skip)]
    segment: f32,
    #[serde(skip)]
    held: Vec<Vec<Vec3>>,
}

impl Report {
    /// Measures at the end of the story.
    pub fn new(world: &mut World, scene: Scene, frames: u64, wall: Duration) -> Self {
        let director = world.resource::<Director>().clone();
        let held = director.held.clone();
        let ledger = *world.resource::<WaterLedger>();
        let step = *world.resource::<HairStep>();
        let sim_seconds = frames as f64 / 60.0;
        let strands: Vec<Strand> = world.query::<&Strand>().iter(world).cloned().collect();
        let bonds: Vec<Bonds> = world.query::<&Bonds>().iter(world).cloned().collect();
        let tips = measure::tips(strands.iter());
        let (min, mean, max) = measure::hydrogen(bonds.iter());
        let segments: usize = strands.iter().map(Strand::edges).sum();
        let iterations = f64::from(step.count) * frames as f64;
        let segment = strands.first().map_or(0.0, |s| s.rest_lengths()[0]);
        let mut report = Self {
            scene: scene.kind.name(),
            variant: scene.variant,
            strands: strands.len(),
            nodes: strands.first().map_or(0, Strand::nodes),
            substeps: step.count,
            dt: step.dt,
            frames,
            finite: strands.iter().all(Strand::is_finite),
            strain_peak: world.resource::<measure::StrainPeak>().0,
            kept_rest: measure::kept_at_rest(bonds.iter(), &held),
            kept_zero_gravity: f64::NAN,
            kept_hanging: f64::NAN,
            curl_radius_held: measure::curl_radius(&held, &held, segment),
            curl_radius_zero_gravity: None,
            turns: measure::turns(&measure::shapes(strands.iter())),
            b_hydrogen: Spread { min, mean, max },
            tip_mean: tip_mean(world),
            drying_error: None,
            wind_rate_correlation: None,
            relaxed_error: f64::NAN,
            water_in: ledger.water_in,
            water_held: ledger.held,
            water_out: ledger.water_out,
            water_error: ledger.error(),
            droplets: world.query::<&Droplet>().iter(world).count(),
            droplets_peak: world.resource::<measure::Lift>().droplets,
            lift_peak: world.resource::<measure::Lift>().highest,
            lift: world.resource::<measure::Lift>().now,
            tip_spacing_ratio: director.dry_spacing.map(|dry| locks::tip_spacing(&tips) / dry),
            clustered_share: (director.dry_spacing)
                .map(|dry| locks::clustered_share(&tips, 0.5 * dry as f32)),
            b_pressed: director.rate(0),
            kept_dried: director.kept_dried,
            b_rewet: director.rate(1),
            residence: "cpu",
            gpu_ticks: 0,
            adapter: None,
            state_hash: format!("{:016x}", state_hash(&strands, &bonds, &ledger)),
            wall_seconds: wall.as_secs_f64(),
            sim_seconds,
            real_time_factor: sim_seconds / wall.as_secs_f64(),
            ns_per_segment_iteration: wall.as_nanos() as f64 / (segments as f64 * iterations),
            segment,
            held,
        };
        if scene.kind == SceneKind::BlowDry && scene.variant == "treated" {
            let wind: Vec<f32> = world
                .query::<&WindReceived>()
                .iter(world)
                .flat_map(|w| w.total.iter().copied())
                .collect();
            let rates = bonds.iter().flat_map(|b| b.rates(BondKind::Hydrogen));
            let pairs: Vec<(f32, f32)> = wind.into_iter().zip(rates).collect();
            let error = |&(w, b): &(f32, f32)| f64::from((b - (0.3 * w).min(1.0)).abs());
            // On the graphics device nobody counts it.
            if !pairs.is_empty() {
                report.drying_error = Some(pairs.iter().map(error).fold(0.0, f64::max));
                let open: Vec<_> = pairs.iter().filter(|(_, b)| *b < 1.0).copied().collect();
                report.wind_rate_correlation = Some(measure::rank_correlation(&open));
            }
        }
        report
    }

    /// All of it was simulated on this graphics device.
    #[cfg(feature = "gpu")]
    pub fn on_device(&mut self, ticks: u64, adapter: Option<String>) {
        (self.residence, self.gpu_ticks, self.adapter) = ("gpu", ticks, adapter);
    }

    /// Measures the settled hair under gravity.
    pub fn hanging(&mut self, world: &mut World) {
        let shapes = measure::shapes(world.query::<&Strand>().iter(world));
        self.kept_hanging = measure::kept(&shapes, &self.held);
        self.turns = measure::turns(&shapes);
        self.tip_mean = tip_mean(world);
        self.check(world);
    }

    /// Measures the settled hair without gravity.
    pub fn weightless(&mut self, world: &mut World) {
        let shapes = measure::shapes(world.query::<&Strand>().iter(world));
        self.kept_zero_gravity = measure::kept(&shapes, &self.held);
        self.curl_radius_zero_gravity = measure::curl_radius(&shapes, &self.held, self.segment);
        let bonds: Vec<Bonds> = world.query::<&Bonds>().iter(world).cloned().collect();
        let remembered = measure::remembered(bonds.iter(), &BondInfluence::default());
        self.relaxed_error = (shapes.iter().flatten().zip(remembered.iter().flatten()))
            .map(|(a, b)| f64::from(a.distance(*b)))
            .fold(0.0, f64::max);
        self.check(world);
    }

    fn check(&mut self, world: &mut World) {
        self.finite &= world.query::<&Strand>().iter(world).all(Strand::is_finite);
        self.strain_peak = world.resource::<measure::StrainPeak>().0;
    }
}

/// The mean place of the tips in the hair's frame (m).
pub fn tip_mean(world: &mut World) -> [f64; 3] {
    let tips: Vec<Vec3> = world
        .query::<&Strand>()
        .iter(world)
        .filter_map(|s| s.positions().last().copied())
        .collect();
    let mean = tips.iter().map(|t| t.as_dvec3()).sum::<DVec3>() / tips.len().max(1) as f64;
    mean.to_array()
}

/// FNV-1a over the bits of positions, velocities, orientations, bonds and water, in strand order.
pub fn state_hash(strands: &[Strand], bonds: &[Bonds], water: &WaterLedger) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    let mut eat = |x: f32| hash = (hash ^ u64::from(x.to_bits())).wrapping_mul(0x0100_0000_01b3);
    for s in strands {
        s.positions().iter().chain(s.velocities()).flat_map(|v| v.to_array()).for_each(&mut eat);
        s.orientations().iter().flat_map(|q| q.to_array()).for_each(&mut eat);
    }
    for joint in bonds.iter().flat_map(|b| &b.joints) {
        joint.shapes.iter().flat_map(|s| s.to_array()).chain(joint.rates).for_each(&mut eat);
    }
    for volume in [water.water_in, water.held, water.water_out] {
        eat(f32::from_bits((volume.to_bits() >> 32) as u32));
        eat(f32::from_bits(volume.to_bits() as u32));
    }
    hash
}

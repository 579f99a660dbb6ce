//! Strands of many lengths and stiffnesses in one app, and what they do substep by substep.
//!
//! All settings that the tests need are made here.

use bevy::{prelude::*, time::TimeUpdateStrategy};
use bevy_keratin::{HairStep, prelude::*};
use core::time::Duration;
use std::collections::HashMap;

/// What is read of a strand after each substep.
pub type Probe = Box<dyn FnMut(&Strand) -> f64 + Send + Sync>;

/// Bare hair: no wear, no contact, no sleep, no air, one tick an update.
pub struct Lab {
    pub app: App,
    hairs: HashMap<u32, Entity>,
    damping: f32,
    torsion: f32,
    /// Length of a substep (s).
    pub substep: f64,
    together: u32,
}

#[derive(Resource, Default)]
struct Recording {
    probes: Vec<(Entity, Probe, Vec<f64>)>,
    /// How many substeps the hair takes as one.
    together: u32,
}

fn record(step: Res<HairStep>, mut recording: ResMut<Recording>, strands: Query<&Strand>) {
    if !(step.index + 1).is_multiple_of(recording.together) {
        return;
    }
    for (entity, probe, values) in &mut recording.probes {
        values.push(probe(strands.get(*entity).unwrap()));
    }
}

impl Lab {
    /// At `hertz` with `substeps` each tick, none of them taken together.
    pub fn new(hertz: f64, substeps: u32) -> Self {
        let mut app = App::new();
        app.add_plugins((MinimalPlugins, HairPlugins::default()))
            .insert_resource(Time::<Fixed>::from_hz(hertz))
            .insert_resource(TimeUpdateStrategy::FixedTimesteps(1))
            .insert_resource(HairSubsteps::Fixed(substeps))
            .insert_resource(HairDefault(Cuticle { damage: 0.0, ..default() }))
            .insert_resource(HairDefault(StrandContact { strength: 0.0, ..default() }))
            .insert_resource(HairDefault(SleepSettings::never()))
            .insert_resource(HairDefault(HairSolver { substep: 1e-6, ..default() }))
            .init_resource::<Recording>()
            .add_systems(HairTick, record.in_set(HairSystems::Last));
        app.world_mut().resource_mut::<Time<Virtual>>().set_max_delta(Duration::MAX);
        app.finish();
        app.cleanup();
        app.update();
        let mut lab = Self {
            app,
            hairs: HashMap::new(),
            damping: HairStiffness::default().damping,
            torsion: HairStiffness::default().torsion,
            substep: 1.0 / (hertz * f64::from(substeps)),
            together: 1,
        };
        lab.drag(0.0);
        lab
    }

    /// The usual one: 60 Hz, six substeps.
    pub fn usual() -> Self {
        Self::new(60.0, 6)
    }

    /// As games run it: substeps taken together as far as the solver's default says.
    pub fn in_games() -> Self {
        let mut lab = Self::usual();
        lab.app.insert_resource(HairDefault(HairSolver::default()));
        lab.together = 2;
        lab.substep *= 2.0;
        assert!((lab.substep / f64::from(HairSolver::default().substep) - 1.0).abs() < 1e-6);
        lab
    }

    /// At the papers' substep, and at that of games.
    pub fn both() -> [(&'static str, Self); 2] {
        [("1/360 s", Self::usual()), ("1/180 s", Self::in_games())]
    }

    pub fn drag(&mut self, rate: f32) {
        self.app.insert_resource(HairDefault(AirDrag { rate }));
    }

    pub fn gravity(&mut self, gravity: Vec3) {
        self.app.insert_resource(HairGravity(gravity));
    }

    /// The least damping that hair may be given, for all hair to come.
    pub fn undamped(&mut self) {
        self.damping = 0.0;
    }

    /// G J / E I of all hair to come.
    pub fn torsion(&mut self, torsion: f64) {
        self.torsion = torsion as f32;
    }

    /// The hair of this stiffness (m).
    pub fn hair(&mut self, bending_length: f32) -> Entity {
        let world = self.app.world_mut();
        *self.hairs.entry(bending_length.to_bits()).or_insert_with(|| {
            let (damping, torsion) = (self.damping, self.torsion);
            let stiffness = HairStiffness { bending_length, damping, torsion };
            world.spawn((Hair, stiffness)).id()
        })
    }

    /// A strand at rest along `points` (m).
    pub fn strand(&mut self, bending_length: f32, points: &[Vec3]) -> Entity {
        let hair = self.hair(bending_length);
        let strand = Strand::from_polyline(points).unwrap();
        self.app.world_mut().spawn((StrandOf(hair), strand)).id()
    }

    /// A straight one.
    pub fn straight(
        &mut self,
        bending_length: f32,
        length: f32,
        segments: usize,
        direction: Vec3,
    ) -> Entity {
        self.strand(bending_length, &line(length, segments, direction))
    }

    pub fn get(&self, strand: Entity) -> &Strand {
        self.app.world().get::<Strand>(strand).unwrap()
    }

    pub fn tip(&self, strand: Entity) -> Vec3 {
        *self.get(strand).positions().last().unwrap()
    }

    /// How far the tip is below the root, as a share of the length.
    pub fn sag(&self, strand: Entity) -> f64 {
        let s = self.get(strand);
        f64::from(s.positions()[0].y - self.tip(strand).y) / f64::from(s.length())
    }

    pub fn run(&mut self, seconds: f64) {
        let tick = self.app.world().resource::<Time<Fixed>>().timestep().as_secs_f64();
        for _ in 0..(seconds / tick).round() as usize {
            self.app.update();
        }
    }

    /// Lets all come to rest, in thick air.
    pub fn settle(&mut self, seconds: f64) {
        self.drag(8.0);
        self.run(seconds);
        self.drag(0.0);
    }

    /// What the probes read now and after each substep.
    pub fn record(&mut self, seconds: f64, probes: Vec<(Entity, Probe)>) -> Vec<Vec<f64>> {
        let begin = |(entity, mut probe): (Entity, Probe)| {
            let now = probe(self.get(entity));
            (entity, probe, vec![now])
        };
        let probes = probes.into_iter().map(begin).collect();
        self.app.insert_resource(Recording { probes, together: self.together });
        self.run(seconds);
        let recorded =
            core::mem::take(&mut self.app.world_mut().resource_mut::<Recording>().probes);
        recorded.into_iter().map(|(_, _, values)| values).collect()
    }

    /// Pulls all strands a little aside by tilted gravity, lets go, and records how far along that
    /// small displacement they are, weighted by mass: nearly the slowest swing alone, other modes
    /// count with the square of their share.
    pub fn small_swings(&mut self, strands: &[Entity], seconds: f64) -> Vec<Vec<f64>> {
        let down = Vec3::NEG_Y * 9.8;
        let positions = |lab: &Self| -> Vec<Vec<Vec3>> {
            strands.iter().map(|s| lab.get(*s).positions().to_vec()).collect()
        };
        self.gravity(down);
        self.settle(3.0);
        let settled = positions(self);
        self.gravity(down - Vec3::new(0.35, 0.35, 0.0));
        self.settle(3.0);
        let aside = positions(self);
        self.gravity(down);
        let probes = (strands.iter().zip(settled).zip(aside))
            .map(|((strand, settled), aside)| {
                let mass = masses(self.get(*strand));
                let weight: Vec<_> = (settled.iter().zip(&aside).zip(mass))
                    .map(|((p, q), m)| (q - p).as_dvec3() * m)
                    .collect();
                let probe: Probe = Box::new(move |strand| {
                    (strand.positions().iter().zip(&settled).zip(&weight))
                        .map(|((now, p), w)| (now - p).as_dvec3().dot(*w))
                        .sum()
                });
                (*strand, probe)
            })
            .collect();
        self.record(seconds, probes)
    }
}

pub fn line(length: f32, segments: usize, direction: Vec3) -> Vec<Vec3> {
    (0..=segments).map(|i| direction * (length * i as f32 / segments as f32)).collect()
}

/// Mass of each node for a mass per length of 1 (m): half the edges beside it.
fn masses(strand: &Strand) -> Vec<f64> {
    let l = strand.rest_lengths();
    let edge = |i: Option<usize>| f64::from(i.and_then(|i| l.get(i)).copied().unwrap_or(0.0));
    (0..strand.nodes()).map(|i| 0.5 * (edge(i.checked_sub(1)) + edge(Some(i)))).collect()
}

/// Motion, height and bends of a strand that is straight at rest, μ = 1 (m³/s²).
pub fn energy(strand: &Strand, bending_length: f64) -> f64 {
    let l = strand.rest_lengths();
    let stiffness = super::theory::bending_stiffness(bending_length);
    let motion: f64 = (strand.velocities().iter().zip(strand.positions()).zip(masses(strand)))
        .skip(1)
        .map(|((v, p), m)| m * (0.5 * f64::from(v.length_squared()) + 9.8 * f64::from(p.y)))
        .sum();
    let bends: f64 = (0..strand.edges())
        .map(|i| {
            let before = if i == 0 { 0.0 } else { f64::from(l[i - 1]) };
            let cell = 0.5 * (before + f64::from(l[i]));
            // 2 (E I / l) |Q − 1|² = 4 (E I / l) (1 − cos θ/2), for small θ ½ (E I / l) θ².
            let q = strand.darboux(i);
            let off = f64::from(q.xyz().length_squared()) / (1.0 + f64::from(q.w.abs()));
            4.0 * stiffness / cell * off
        })
        .sum();
    motion + bends
}

//! An app with hair on a software device.

use crate::offscreen::windowless;
use bevy::{app::PluginGroupBuilder, prelude::*, time::TimeUpdateStrategy};
use bevy_keratin::{
    gpu::{HairResidence, fetch_strands},
    prelude::*,
};
use std::time::Duration;

pub struct Stage {
    pub app: App,
    pub hair: Entity,
}

/// No contact between strands, which is not supported on the device.
pub fn free() -> StrandContact {
    StrandContact { strength: 0.0, ..default() }
}

/// Curls on a ball that hang over its sides.
pub fn curls(count: usize, nodes: usize) -> Vec<Strand> {
    let strand = |i: usize| {
        let angle = i as f32 * 2.4;
        let out = Vec3::new(angle.cos(), 0.2 + 0.8 * i as f32 / count as f32, angle.sin());
        let out = out.normalize();
        let point = |k: usize| {
            let turn = k as f32 * 0.9;
            out * (0.082 + 0.016 * k as f32) + Vec3::new(turn.cos(), 0.0, turn.sin()) * 0.004
        };
        Strand::from_polyline(&(0..nodes + i % 3).map(point).collect::<Vec<_>>()).unwrap()
    };
    (0..count).map(strand).collect()
}

impl Stage {
    /// Hair of these strands, asked to be on `on`. A tick a frame.
    pub fn new(on: SimulateOn, strands: Vec<Strand>) -> Self {
        Self::with_plugins(windowless, on, strands)
    }

    /// The same with these of Bevy's plugins.
    pub fn with_plugins(
        plugins: fn() -> PluginGroupBuilder,
        on: SimulateOn,
        strands: Vec<Strand>,
    ) -> Self {
        let mut app = App::new();
        app.add_plugins((plugins(), HairPlugins::default()));
        Self::furnish(&mut app);
        app.finish();
        app.cleanup();
        app.update();
        let hair = Self::spawn(&mut app, on, strands);
        Self { app, hair }
    }

    /// What the tests have of settings: a software device, waiting for what returns to the CPU, nothing of what
    /// is not supported.
    pub fn furnish(app: &mut App) {
        app.insert_resource(Time::<Fixed>::from_hz(60.0))
            .insert_resource(TimeUpdateStrategy::FixedTimesteps(1))
            .insert_resource(HairGpu { software: true, blocking: true, ..default() })
            .insert_resource(HairDefault(free()))
            .insert_resource(HairDefault(SleepSettings::never()));
        app.world_mut().resource_mut::<Time<Virtual>>().set_max_delta(Duration::MAX);
    }

    pub fn spawn(app: &mut App, on: SimulateOn, strands: Vec<Strand>) -> Entity {
        Self::spawn_in(app.world_mut(), on, strands)
    }

    pub fn spawn_in(world: &mut World, on: SimulateOn, strands: Vec<Strand>) -> Entity {
        let hair = world.spawn((Hair, on, Transform::default())).id();
        world.spawn_batch(strands.into_iter().map(move |strand| (StrandOf(hair), strand)));
        hair
    }

    pub fn residence(&self) -> HairResidence {
        *self.app.world().get::<HairResidence>(self.hair).unwrap()
    }

    pub fn is_on_gpu(&self) -> bool {
        self.residence() == HairResidence::Gpu
    }

    /// Ticks, as many as asked for.
    pub fn run(&mut self, ticks: usize) {
        (0..ticks).for_each(|_| self.app.update());
    }

    /// With so many ticks a frame from now on.
    pub fn at_once(&mut self, ticks: u32) {
        self.app.insert_resource(TimeUpdateStrategy::FixedTimesteps(ticks));
    }

    /// Frames without a tick until the kernels are compiled.
    pub fn compile(&mut self) {
        let strand = Strand::from_polyline(&[Vec3::ZERO, Vec3::X * 0.01, Vec3::X * 0.02]).unwrap();
        let other = Self::spawn(&mut self.app, SimulateOn::Gpu, vec![strand]);
        let own = self.app.world_mut().entity_mut(self.hair).take::<SimulateOn>().unwrap();
        for _ in 0..500 {
            self.run(1);
            if self.app.world().get::<HairResidence>(other) == Some(&HairResidence::Gpu) {
                self.app.world_mut().despawn(other);
                self.app.world_mut().entity_mut(self.hair).insert(own);
                return;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        panic!("{:?}", self.app.world().get::<HairResidence>(other));
    }

    /// The present strands, wherever they are.
    pub fn strands(&mut self) -> Vec<Strand> {
        fetch_strands(self.app.world_mut(), self.hair);
        self.members().into_iter().map(|e| self.app.world().get(e).cloned().unwrap()).collect()
    }

    pub fn bonds(&mut self) -> Vec<Bonds> {
        fetch_strands(self.app.world_mut(), self.hair);
        self.members().into_iter().map(|e| self.app.world().get(e).cloned().unwrap()).collect()
    }

    pub fn members(&self) -> Vec<Entity> {
        self.app.world().get::<Strands>(self.hair).unwrap().iter().collect()
    }

    /// Every bit of its state.
    pub fn bits(&mut self) -> Vec<u32> {
        let (strands, bonds) = (self.strands(), self.bonds());
        let strands = strands.iter().flat_map(|strand| {
            let spins = strand.angular_velocities();
            let vectors = strand.positions().iter().chain(strand.velocities()).chain(spins);
            let vectors = vectors.flat_map(|v| v.to_array());
            let turns = strand.orientations().iter().flat_map(|q| q.to_array());
            vectors.chain(turns).collect::<Vec<f32>>()
        });
        let bonds = bonds.iter().flat_map(|bonds| &bonds.joints).flat_map(|joint| {
            let shapes = joint.shapes.iter().flat_map(|shape| shape.to_array());
            shapes.chain(joint.rates).collect::<Vec<f32>>()
        });
        strands.chain(bonds).map(f32::to_bits).collect()
    }

    pub fn faults(&self) -> Vec<HairFault> {
        let messages = self.app.world().resource::<bevy::ecs::message::Messages<HairFault>>();
        messages.iter_current_update_messages().cloned().collect()
    }
}

/// How far nodes are apart at most.
pub fn apart(a: &[Strand], b: &[Strand]) -> f32 {
    let places = a.iter().zip(b).flat_map(|(a, b)| a.positions().iter().zip(b.positions()));
    places.map(|(a, b)| a.distance(*b)).fold(0.0, f32::max)
}

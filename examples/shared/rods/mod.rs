//! Strands held against the closed forms of Kirchhoff's rod, a row for each figure.
//!
//! A strand of length L is given by Γ = ρ g A L³/(E I) = (L/L_g)³ and C = G J/(E I). Lengths are shares of L, onsets of
//! buckling shares of theory's. A rod of 8 segments may be four times as far off as one of 16: errors are of second
//! order in a segment's length.

mod friction;
mod onset;
mod ring;
mod shape;

#[allow(unused_imports, reason = "the plots use it")]
pub use friction::SLIPS;
pub use friction::{capstans, slips, slopes};
pub use onset::{curls, greenhill, no_lateral_buckling};
pub use ring::{rings, wrung};
pub use shape::{arcs, cantilevers, helices, tip_loads};

use super::rows::Row;
use bevy::{prelude::*, time::TimeUpdateStrategy};
use bevy_keratin::prelude::*;
use std::time::Duration;

/// Segments of a strand.
const SEGMENTS: [usize; 4] = [8, 16, 32, 64];

/// Length of a strand (m).
const LENGTH: f32 = 0.2;

const GRAVITY: f32 = 9.8;

/// A share of what 16 segments are allowed, for fewer.
fn allowed(at_16: f32, segments: usize) -> f32 {
    at_16 * (16.0 / segments as f32).powi(2).max(1.0)
}

/// Bare hair in empty space.
struct Lab {
    app: App,
}

/// What a strand is made of, and where it leaves its clamp to.
#[derive(Clone, Copy)]
struct Rod {
    gamma: f32,
    torsion: f32,
    segments: usize,
    way: Vec3,
    /// Curvature at rest: the axis it turns about in the world, as long as the angle on the whole length (rad).
    curl: Vec3,
    /// Twist at rest on the whole length (rad).
    twist: f32,
    /// How far its tip is moved aside at the start, growing with the square of the way.
    aside: Vec3,
}

impl Default for Rod {
    fn default() -> Self {
        let (way, none) = (Vec3::X, Vec3::ZERO);
        Self { gamma: 1.0, torsion: 0.46, segments: 16, way, curl: none, twist: 0.0, aside: none }
    }
}

/// Moves a tip, and the rest of its strand by the square of its share of the way.
fn move_aside(strand: &mut Strand, tip: Vec3) {
    let segments = strand.edges() as f32;
    for (i, place) in strand.positions_mut().iter_mut().enumerate() {
        *place += tip * (i as f32 / segments).powi(2);
    }
}

impl Lab {
    fn new() -> Self {
        let mut app = App::new();
        app.add_plugins((MinimalPlugins, HairPlugins::default()))
            .insert_resource(Time::<Fixed>::from_hz(60.0))
            .insert_resource(TimeUpdateStrategy::FixedTimesteps(1))
            .insert_resource(HairSubsteps::Fixed(3))
            .insert_resource(HairGravity(Vec3::NEG_Y * GRAVITY))
            .insert_resource(HairDefault(Cuticle { damage: 0.0, ..default() }))
            .insert_resource(HairDefault(StrandContact { strength: 0.0, ..default() }))
            .insert_resource(HairDefault(SleepSettings::never()));
        app.world_mut().resource_mut::<Time<Virtual>>().set_max_delta(Duration::MAX);
        app.finish();
        app.cleanup();
        app.update();
        Self { app }
    }

    fn rod(&mut self, rod: Rod) -> Entity {
        let Rod { gamma, torsion, segments, way, .. } = rod;
        let at = |i: usize| way * (LENGTH * i as f32 / segments as f32);
        let points: Vec<Vec3> = (0..=segments).map(at).collect();
        let mut strand = Strand::from_polyline(&points).unwrap_or_default();
        let local = strand.root_frame().inverse();
        let whole = local * rod.curl + Vec3::Z * rod.twist;
        let joint = Quat::from_scaled_axis(whole / segments as f32);
        // The clamp's joint has half a segment.
        let half = Quat::from_scaled_axis(whole * 0.5 / segments as f32);
        strand.pose((0..segments).map(|i| if i == 0 { half } else { joint }.xyz()));
        let bonds = Bonds::of(&strand);
        move_aside(&mut strand, rod.aside);
        let bending_length = LENGTH / gamma.cbrt();
        let stiffness = HairStiffness { bending_length, torsion, ..default() };
        let hair = self.app.world_mut().spawn((Hair, stiffness)).id();
        self.app.world_mut().spawn((StrandOf(hair), strand, bonds)).id()
    }

    /// Makes a rod's tip heavier, by as many weights of the rod.
    fn load_tip(&mut self, rod: Entity, weights: f32, segments: usize) {
        if let Some(mut added) = self.app.world_mut().get_mut::<AddedMass>(rod) {
            added.mass = vec![0.0; segments + 1];
            // The tip's own half cell weighs 1/(2 n).
            added.mass[segments] = weights * 2.0 * segments as f32;
        }
    }

    /// Wets a rod as if its joints had lost this share of their stiffness to water.
    fn soften(&mut self, rod: Entity, share: f32, segments: usize) {
        if let Some(mut added) = self.app.world_mut().get_mut::<AddedMass>(rod) {
            added.softening = vec![share; segments + 1];
        }
    }

    fn gravity(&mut self, down: f32) {
        self.app.insert_resource(HairGravity(Vec3::NEG_Y * down));
    }

    /// In air that takes this share of velocities a second (1/s).
    fn settle(&mut self, drag: f32, seconds: f32) {
        self.app.insert_resource(HairDefault(AirDrag { rate: drag }));
        for _ in 0..(60.0 * seconds) as usize {
            self.app.update();
        }
    }

    fn get(&self, rod: Entity) -> &[Vec3] {
        self.app.world().get::<Strand>(rod).map_or(&[], |strand| strand.positions())
    }

    /// Of the tip from the root, in lengths.
    fn tip(&self, rod: Entity) -> Vec3 {
        let places = self.get(rod);
        places.last().map_or(Vec3::NAN, |tip| (*tip - places[0]) / LENGTH)
    }
}

/// All rows.
pub fn rows() -> Vec<Row> {
    [
        cantilevers(1, &SEGMENTS),
        tip_loads(),
        greenhill(),
        arcs(&SEGMENTS),
        curls(),
        no_lateral_buckling(),
        rings(),
        wrung(),
        helices(),
        slips(&SEGMENTS),
        slopes(),
        capstans(),
    ]
    .concat()
}

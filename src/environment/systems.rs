//! `ExternalForces`: what the air and gravity do to velocities, and what wind asks of the bonds.

use super::{AirDrag, Blower, Climate, HairGravity, WindReceived, vapour::DryingAir, wind::wind};
use crate::{
    bond::{BondChanges, BondKind, model::drying},
    parallel::{AHEAD, for_each_part, in_turn, prefetch, tables},
    schedule::{EffectiveSubsteps, HairSystems, HairTick},
    setting::{self, Ranged, Settings},
    strand::{AddedMass, Hair, PerHair, Pose, Strand, StrandOf, StrandSleep, TickPose},
};
use bevy::prelude::*;

/// Gravity, wind and drag.
pub struct EnvironmentPlugin;

impl Plugin for EnvironmentPlugin {
    fn build(&self, app: &mut App) {
        setting::plugin::<AirDrag>(app);
        setting::component::<Blower>(app);
        setting::resource::<HairGravity>(app);
        setting::resource::<Climate>(app);
        app.register_type::<WindReceived>()
            .init_resource::<DryingAir>()
            .add_systems(
                HairTick,
                settle_climate.in_set(HairSystems::Air).run_if(resource_changed::<Climate>),
            )
            .add_systems(HairTick, apply_air.in_set(HairSystems::Air));
    }
}

fn settle_climate(climate: Res<Climate>, mut air: ResMut<DryingAir>) {
    *air = DryingAir::of(&climate.clamped());
}

/// A hair's air in its own frame.
struct LocalAir {
    gravity: Vec3,
    keep: f32,
    dt: f32,
    blowers: Vec<LocalBlower>,
}

/// A blower as seen in a frame, its values valid.
pub(crate) struct LocalBlower {
    pub nozzle: Vec3,
    /// Unit direction of its wind.
    pub aim: Vec3,
    pub blower: Blower,
}

/// The blowers that blow, seen in the frame of `pose`.
pub(crate) fn local_blowers(
    frame: &Pose,
    blowers: &Query<(&Blower, &TickPose)>,
) -> Vec<LocalBlower> {
    blowers
        .iter()
        .map(|(b, pose)| (b.clamped(), pose.now()))
        .filter(|(blower, _)| blower.strength > 0.0)
        .map(|(blower, pose)| LocalBlower {
            nozzle: frame.point_in(pose.translation),
            aim: frame.direction_in(pose.rotation * Vec3::NEG_Z),
            blower,
        })
        .collect()
}

/// A strand that air acts on, with the number of its hair's air.
type Blown<'a> =
    (usize, &'a mut Strand, &'a AddedMass, &'a mut BondChanges, Option<&'a mut WindReceived>);

fn apply_air(
    steps: EffectiveSubsteps,
    gravity: Res<HairGravity>,
    drag: Settings<AirDrag>,
    hairs: Query<&TickPose, With<Hair>>,
    blowers: Query<(&Blower, &TickPose)>,
    mut strands: Query<(
        &StrandOf,
        &StrandSleep,
        &mut Strand,
        &AddedMass,
        &mut BondChanges,
        Option<&mut WindReceived>,
    )>,
) {
    let gravity = gravity.clamped().0;
    let air_of = |hair: Entity| {
        let pose = hairs.get(hair).ok()?.now();
        let dt = steps.of(hair)?.dt;
        Some(LocalAir {
            gravity: pose.direction_in(gravity) * dt,
            keep: bevy::math::ops::exp(-drag.of(hair).rate * dt),
            dt,
            blowers: local_blowers(pose, &blowers),
        })
    };
    // Wind also dries hair that is carried.
    let is_spared =
        |sleep: &StrandSleep| sleep.is_asleep() || (sleep.is_follower() && blowers.is_empty());
    let ahead = |(_, strand, ..): &Blown<'_>| {
        let (_, velocities, _, spins) = strand.parts();
        prefetch(velocities);
        prefetch(spins);
    };
    for_each_part(tables(&mut strands), Vec::new, |items, rows| {
        let mut airs = PerHair::default();
        for (of, sleep, strand, added_mass, changes, received) in rows {
            if !is_spared(sleep)
                && let Some(air) = airs.index(of.0, || air_of(of.0))
            {
                items.push((air, strand, added_mass, changes, received));
            }
        }
        in_turn(items, AHEAD, ahead, |(air, strand, added_mass, changes, received)| {
            blow(&airs.values[*air], strand, added_mass, changes, received.as_deref_mut());
        });
        items.clear();
    });
}

/// What a hair's air does to one strand in a substep.
fn blow(
    air: &LocalAir,
    strand: &mut Strand,
    added_mass: &AddedMass,
    changes: &mut BondChanges,
    mut received: Option<&mut WindReceived>,
) {
    let (positions, velocities, _, spins) = strand.parts_mut();
    for v in velocities.iter_mut() {
        *v = *v * air.keep + air.gravity;
    }
    // Edges carry rotary inertia of their own, much of it on fine stiff strands: air that slowed
    // the nodes alone would leave them ringing.
    for spin in spins {
        *spin *= air.keep;
    }
    if air.blowers.is_empty() {
        return;
    }
    let edges = positions.len().saturating_sub(1);
    // Wet hair is heavier: the same wind moves it less.
    let heed = |i: usize| 1.0 / (1.0 + added_mass.mass.get(i).copied().unwrap_or(0.0));
    for i in 0..edges {
        // The tip has no edge of its own: it takes the last one's wind.
        let edge = positions[i + 1] - positions[i];
        let (mut change, mut dried) = (Vec3::ZERO, 0.0);
        for LocalBlower { nozzle, aim, blower } in &air.blowers {
            let w = wind(blower.strength, *nozzle, *aim, positions[i], edge) * air.dt;
            change += w;
            dried += drying(w.length(), blower.drying);
            if i + 1 == edges {
                velocities[i + 1] += wind(blower.strength, *nozzle, *aim, positions[i + 1], edge)
                    * (air.dt * heed(i + 1));
            }
        }
        velocities[i] += change * heed(i);
        // Where there is water, the wind dries that, and the bonds follow it.
        if added_mass.softening.is_empty() {
            changes.ask(i, BondKind::Hydrogen, dried);
        }
        if let Some(received) = received.as_deref_mut() {
            received.total.resize(edges, 0.0);
            received.total[i] += change.length();
        }
    }
}

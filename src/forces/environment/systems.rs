//! `ExternalForces`: air and gravity act on velocities, and wind on bonds.

use super::{
    AirDrag, Blower, Gravity, HairClimate, HairGravity, HairWind, WindReceived, WindZone,
    ZoneShape,
    blown::BlownAir,
    local::{LocalWinds, WindTravel, Winds, travel},
    vapour::DryingAir,
};
use crate::{
    base::{
        parallel::{AHEAD, Nanos, for_each_part, in_turn, prefetch, tables},
        schedule::{EffectiveSubsteps, HairSystems, HairTick, SettleTick, first_substep},
        setting::{self, Ranged, Settings},
        stretch::{self, Stretch},
    },
    hair::{
        strand::{
            AddedMass, FollowsHere, Hair, PerHair, ShiftWorld, SimulatedHere, Strand, StrandOf,
            StrandSleep, TickPose, carried_along, keep_required, lacks_strands,
        },
        worn,
    },
    keratin::bond::{BondChanges, BondKind},
};
use bevy::{math::Isometry3d, prelude::*};

/// Cost per strand (ns) in still air, and in wind.
const STILL: usize = 150;
const WINDY: usize = 2_000;

/// Gravity, wind and drag.
pub struct EnvironmentPlugin;

impl Plugin for EnvironmentPlugin {
    fn build(&self, app: &mut App) {
        if lacks_strands::<Self>(app) {
            return;
        }
        worn::setting::<AirDrag>(app);
        setting::component::<Blower>(app);
        setting::component::<WindZone>(app);
        setting::resource::<HairWind>(app);
        setting::resource::<HairGravity>(app);
        setting::resource::<HairClimate>(app);
        keep_required::<Strand, BlownAir>(app);
        keep_required::<Blower, TickPose>(app);
        keep_required::<WindZone, TickPose>(app);
        keep_required::<WindZone, Stretch<WindZone>>(app);
        stretch::plugin::<WindZone>(app);
        app.register_type::<WindReceived>()
            .register_type::<ZoneShape>()
            .register_type::<BlownAir>()
            .register_required_components::<Strand, BlownAir>()
            .init_resource::<DryingAir>()
            .add_systems(
                HairTick,
                update_drying_air.in_set(HairSystems::Air).run_if(resource_changed::<HairClimate>),
            )
            .init_resource::<WindTravel>()
            .register_type::<WindTravel>()
            .add_observer(|shift: On<ShiftWorld>, mut travel: ResMut<WindTravel>| {
                travel.0 += shift.by.as_dvec3();
            })
            .add_systems(
                HairTick,
                travel
                    .in_set(HairSystems::Roots)
                    .before(HairSystems::StrandHistory)
                    .run_if(first_substep),
            )
            .add_systems(HairTick, apply_air.in_set(HairSystems::Air))
            .add_systems(SettleTick, apply_air.in_set(HairSystems::Air));
    }
}

fn update_drying_air(climate: Res<HairClimate>, mut air: ResMut<DryingAir>) {
    *air = DryingAir::of(&climate.clamped());
}

/// A hair's air in its own frame.
struct LocalAir {
    gravity: Vec3,
    retained: f32,
    dt: f32,
    winds: LocalWinds,
    back: Option<Isometry3d>,
}

/// A strand that air acts on, with the index of its hair's air.
type InAir<'a> = (
    usize,
    &'a mut Strand,
    &'a AddedMass,
    &'a mut BondChanges,
    &'a mut BlownAir,
    Option<&'a mut WindReceived>,
    bool,
);

/// A strand in the air, as a query reads it.
type AirStrand = (
    &'static StrandOf,
    &'static StrandSleep,
    &'static mut Strand,
    &'static AddedMass,
    &'static mut BondChanges,
    &'static mut BlownAir,
    Option<&'static mut WindReceived>,
);

fn apply_air(
    steps: EffectiveSubsteps,
    gravity: Gravity,
    drag: Settings<AirDrag>,
    hairs: Query<&TickPose, With<Hair>>,
    winds: Winds,
    mut simulated: Query<AirStrand, SimulatedHere>,
    mut followers: Query<AirStrand, FollowsHere>,
) {
    if !steps.any() {
        return;
    }
    let gravity = gravity.clamped().0;
    let air_of = |hair: Entity| {
        let frame = hairs.get(hair).ok()?;
        let dt = steps.of(hair)?.dt;
        Some(LocalAir {
            gravity: frame.now().direction_in(gravity) * dt,
            retained: bevy::math::ops::exp(-drag.of(hair).rate * dt),
            dt,
            winds: winds.seen_from(frame),
            back: frame.back(),
        })
    };
    // Wind also dries followers.
    let dries = winds.dry();
    let ahead = |(_, strand, ..): &InAir<'_>| {
        let (_, velocities, _, spins) = strand.parts();
        prefetch(velocities);
        prefetch(spins);
    };
    let each = Nanos(if winds.are_still() { STILL } else { WINDY });
    let followers = dries.then(|| tables(&mut followers)).into_iter().flatten();
    for_each_part(each, tables(&mut simulated).chain(followers), Vec::new, |items, rows| {
        let mut airs = PerHair::default();
        for (of, sleep, strand, added_mass, changes, blown, received) in rows {
            if !sleep.is_asleep()
                && let Some(air) = airs.index(of.0, || air_of(of.0))
            {
                let follows = sleep.is_follower();
                items.push((air, strand, added_mass, changes, blown, received, follows));
            }
        }
        in_turn(items, AHEAD, ahead, |(air, strand, added, changes, blown, received, follows)| {
            let air = &airs.values[*air];
            // Inertia has not acted on followers.
            let back = air.back.as_ref().filter(|_| !*follows);
            // Followers are not solved.
            if !*follows {
                strand.begin_air();
            }
            blow((air, back), strand, added, changes, blown, received.as_deref_mut());
            if !*follows {
                strand.end_air();
            }
        });
        items.clear();
    });
}

/// Applies a hair's air to one strand in a substep.
fn blow(
    (air, back): (&LocalAir, Option<&Isometry3d>),
    strand: &mut Strand,
    added_mass: &AddedMass,
    changes: &mut BondChanges,
    BlownAir { nodes: at_nodes }: &mut BlownAir,
    mut received: Option<&mut WindReceived>,
) {
    at_nodes.clear();
    let (length, winds) = (strand.length(), &air.winds);
    let (positions, velocities, _, spins) = strand.parts_mut();
    let under = &added_mass.in_water;
    let headwind = winds.headwind * (1.0 - air.retained);
    if under.is_empty() {
        for v in velocities.iter_mut() {
            *v = *v * air.retained + air.gravity + headwind;
        }
    } else {
        for (i, v) in velocities.iter_mut().enumerate() {
            let water = under.get(i).copied().unwrap_or_default();
            let open = 1.0 - water.share;
            let retained = 1.0 - (1.0 - air.retained) * open;
            *v = *v * retained + air.gravity * water.gravity + headwind * open;
        }
    }
    // Edges have rotary inertia of their own, large on fine stiff strands: drag on the nodes alone
    // would leave them ringing. The same holds under water.
    for (i, spin) in spins.iter_mut().enumerate() {
        *spin *= under.get(i).map_or(air.retained, |water| air.retained * water.retained);
    }
    if winds.are_still() || positions.is_empty() {
        return;
    }
    let wind = winds.gusty_wind(positions[0]);
    let zones = winds.zones_near(positions[0], length);
    let relaxation = 1.0 - air.retained;
    let edges = positions.len().saturating_sub(1);
    // Wet hair is heavier: the same wind moves it less.
    let response = |i: usize| 1.0 / (1.0 + added_mass.mass.get(i).copied().unwrap_or(0.0));
    // No wind blows under water.
    let open = |i: usize| under.get(i).map_or(1.0, |water| 1.0 - water.share);
    let is_wet = added_mass.moves_bonds;
    for (i, velocity) in velocities.iter_mut().enumerate().take(edges + 1).filter(|_| edges > 0) {
        // The tip has no edge of its own: it uses the last one's wind.
        let e = i.min(edges - 1);
        let place = |i: usize| carried_along(positions, i, back);
        let edge = place(e + 1) - place(e);
        let mut blown = winds.at(wind, zones, place(i), edge);
        // What dries is the air that passes over the hair, which drag has slowed down by its part of the flow.
        let dragged = blown.flow * if under.is_empty() { relaxation } else { relaxation * open(i) };
        blown.velocity += winds.headwind - (*velocity + dragged);
        let wind = blown.acceleration * (air.dt * response(i)) + blown.flow * relaxation;
        *velocity += if under.is_empty() { wind } else { wind * open(i) };
        // On wet hair the wind dries the water, and the bonds follow that.
        if is_wet {
            at_nodes.push(blown);
        } else if i < edges {
            changes.request(i, BondKind::Hydrogen, blown.drying * air.dt);
        }
        if let Some(received) = received.as_deref_mut().filter(|_| i < edges) {
            received.total.resize(edges, 0.0);
            let total = &mut received.total[i];
            let before = if total.is_finite() { *total } else { 0.0 };
            *total = before + blown.acceleration.length() * air.dt;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{
        super::blown::{Blown, LocalBlower},
        *,
    };

    #[test]
    fn wind_acts_on_every_node_once() {
        let points: Vec<Vec3> = (0..4).map(|i| Vec3::new(0.0, 0.01 * i as f32, 0.2)).collect();
        let mut strand = Strand::from_polyline(&points).unwrap();
        let blower = Blower { drying: 0.5, ..default() };
        let blowers =
            vec![LocalBlower { nozzle: Vec3::ZERO, aim: Vec3::Z, blower, moves: default() }];
        let blown: Vec<Blown> =
            (0..4).map(|i| Blown::at(&blowers, 1.0, points[i], Vec3::Y * 0.01)).collect();
        let winds = LocalWinds { blowers, ..default() };
        let air = LocalAir { gravity: Vec3::ZERO, retained: 1.0, dt: 0.01, winds, back: None };
        let (mut changes, mut at_nodes) = (BondChanges::default(), BlownAir::default());
        let mut received = WindReceived::default();
        let mut wet = AddedMass { mass: vec![1.0; 4], ..default() };
        blow((&air, None), &mut strand, &wet, &mut changes, &mut at_nodes, Some(&mut received));
        for (i, blown) in blown.iter().enumerate() {
            let expected = blown.acceleration * (0.01 / 2.0);
            assert!(expected.length() > 1e-4);
            assert!(strand.velocities()[i].distance(expected) < 1e-6, "node {i}");
        }
        assert_eq!(received.total.len(), 3, "edges receive wind");
        for (i, total) in received.total.iter().enumerate() {
            assert!((total - 0.01 * blown[i].acceleration.length()).abs() < 1e-6, "edge {i}");
        }
        assert!(at_nodes.nodes.is_empty() && !changes.is_empty());
        // On wet hair the wind dries the water at every node.
        wet.moves_bonds = true;
        let mut changes = BondChanges::default();
        blow((&air, None), &mut strand, &wet, &mut changes, &mut at_nodes, None);
        assert!(at_nodes.nodes.len() == 4 && changes.is_empty());
    }
}

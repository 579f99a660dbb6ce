//! The bonds' two steps in the tick: `RestShape` (equation 15) and `BondUpdate` (equation 16).

use super::{
    bonds::{BondChanges, Bonds},
    kind::BondKind,
    lanes::{JointFrames, change, remembered_shapes, rest_shapes},
    model::cuticle_factor,
    rest::{Key, RestShape},
    settings::{BondInfluence, Cuticle},
};
use crate::{
    base::{
        fault::HairFault,
        lanes::simd_level,
        parallel::{AHEAD, Nanos, for_each_part, in_turn, prefetch, tables},
        schedule::{
            EffectiveSubsteps, HairSystems, HairTick, SettleTick, first_substep, last_substep,
        },
        setting::{self, Ranged, Settings, Violations, report},
    },
    hair::{
        strand::{
            AddedMass, Here, KinematicStrand, PerHair, SimulatedHere, Strand, StrandOf,
            StrandSleep, keep_required, lacks_strands,
        },
        worn,
    },
    solver::rod::{
        HairSolver, SolverMethod, StrandMaterial, Sweeps, constraint::stiffness_per_iteration,
    },
};
use bevy::{
    ecs::{entity_disabling::Disabled, query::QueryFilter},
    prelude::*,
};
use fearless_simd::Level;

/// Average cost per strand (ns); most need no update.
const SHAPE: Nanos = Nanos(200);
const CHANGE: Nanos = Nanos(200);

/// Rest shapes from bonds and bonds' memory.
pub struct BondPlugin;

impl Plugin for BondPlugin {
    fn build(&self, app: &mut App) {
        if lacks_strands::<Self>(app) {
            return;
        }
        worn::setting::<BondInfluence>(app);
        worn::setting::<Cuticle>(app);
        setting::component::<StrandMaterial>(app);
        worn::acts_only_on::<StrandMaterial, Without<Strand>>(
            app,
            "no Strand",
            "put it on strands",
        );
        keep_required::<Strand, Bonds>(app);
        keep_required::<Strand, BondChanges>(app);
        keep_required::<Strand, RestShape>(app);
        app.register_type::<BondKind>()
            .register_type::<Bonds>()
            .register_type::<BondChanges>()
            .register_type::<RestShape>()
            .register_required_components::<Strand, Bonds>()
            .register_required_components::<Strand, BondChanges>()
            .register_required_components::<Strand, RestShape>()
            .add_systems(
                HairTick,
                (
                    fit_bonds::<Without<KinematicStrand>>,
                    // Also in the last one, so that no strand that is simulated from the next tick on is missed.
                    fit_bonds::<With<KinematicStrand>>.run_if(first_substep.or_else(last_substep)),
                )
                    .chain()
                    .in_set(HairSystems::BondFit),
            )
            .add_systems(HairTick, generate_rest_shapes.in_set(HairSystems::RestShape))
            .add_systems(SettleTick, generate_rest_shapes.in_set(HairSystems::RestShape))
            .add_systems(HairTick, update_bonds.in_set(HairSystems::BondRates));
    }
}

/// Gives new and resized strands their bonds, and repairs invalid values written from outside. Our own
/// writes bypass change detection, so `Changed` means a write from outside the tick.
fn fit_bonds<F: QueryFilter>(
    mut strands: Query<
        (Entity, &Strand, &mut Bonds, Option<&mut RestShape>),
        // A write to a disabled strand would no longer count as a change once it is enabled.
        (Or<(Changed<Bonds>, Changed<Strand>, Changed<RestShape>)>, Here, Allow<Disabled>, F),
    >,
    mut faults: MessageWriter<HairFault>,
) {
    for (entity, strand, mut bonds, mut rest) in &mut strands {
        // Stiffness depends on the lengths, the shape on the bonds; user code may have written either.
        if let Some(rest) = &mut rest {
            let rest = rest.bypass_change_detection();
            (rest.closed, rest.key) = (false, None);
            // A strand that is not simulated would keep its non-finite values.
            if !rest.is_finite() {
                *rest = RestShape::default();
            }
        }
        let fits = bonds.joints.len() == strand.edges();
        if fits && !bonds.is_changed() {
            continue;
        }
        let bonds = bonds.bypass_change_detection();
        if !fits {
            bonds.fit(strand);
        }
        let mut violations = Violations::new();
        bonds.joints.clamp_values(&mut violations);
        violations.truncate(1);
        report(Some(entity), violations, &mut faults);
    }
}

/// A strand whose rest shape has to be updated.
type Shaped<'a> = (Key, &'a Strand, &'a Bonds, (&'a AddedMass, f32), &'a mut RestShape);

fn generate_rest_shapes(
    steps: EffectiveSubsteps,
    influence: Settings<BondInfluence>,
    sweeps: Settings<Sweeps>,
    cuticle: Settings<Cuticle>,
    solver: Settings<HairSolver>,
    mut strands: Query<
        (
            &StrandOf,
            &StrandSleep,
            &Strand,
            Ref<Bonds>,
            &AddedMass,
            &mut RestShape,
            Option<&StrandMaterial>,
        ),
        SimulatedHere,
    >,
) {
    if !steps.any() {
        return;
    }
    let key_of = |hair: Entity| {
        let substep = steps.of(hair)?;
        Some(Key {
            influence: influence.of(hair).as_array(),
            cuticle: cuticle.of(hair),
            sweeps: (solver.of(hair).method == SolverMethod::Sweeps).then(|| {
                let full = sweeps.of(hair);
                (Sweeps { iterations: substep.iterations(full.iterations), ..full }, substep.dt)
            }),
        })
    };
    let ahead = |(_, strand, bonds, _, rest): &Shaped<'_>| {
        prefetch(&bonds.joints);
        prefetch(strand.orientations());
        prefetch(&rest.darboux);
    };
    let level = simd_level();
    for_each_part(SHAPE, tables(&mut strands), Vec::new, |items, rows| {
        let mut keys = PerHair::default();
        for (of, sleep, strand, (bonds, is_changed), added_mass, rest, own) in rows {
            if !sleep.is_simulated() {
                continue;
            }
            let index = keys.index(of.0, || key_of(of.0));
            let Some(key) = index.map(|index| keys.values[index]) else { continue };
            let share = own.map_or(1.0, |own| own.clamped().stiffness);
            // Hair with all bonds closed, the usual case, costs only this test.
            if !rest.closed
                || rest.key != Some(key)
                || rest.share != share
                || is_changed
                || has_softened(&rest.softened, &added_mass.softening)
            {
                items.push((key, strand, bonds, (added_mass, share), rest));
            }
        }
        in_turn(items, AHEAD, ahead, |(key, strand, bonds, load, rest)| {
            shape(level, key, strand, bonds, *load, rest);
        });
        items.clear();
    });
}

/// A strand's rest shape and stiffness.
fn shape(
    level: Level,
    key: &Key,
    strand: &Strand,
    bonds: &Bonds,
    (added_mass, share): (&AddedMass, f32),
    rest: &mut RestShape,
) {
    let joints = &bonds.joints;
    rest.closed = joints.iter().all(|joint| joint.rates == [1.0; BondKind::COUNT]);
    rest.darboux.resize(joints.len(), Quat::IDENTITY);
    let is_other = rest.key != Some(*key)
        || rest.share != share
        || has_softened(&rest.softened, &added_mass.softening);
    let changed = is_other || rest.stiffness.len() != strand.edges();
    match key.sweeps {
        None => {
            rest.stiffness.resize(joints.len(), 0.0);
            let (darboux, closed) = (&mut rest.darboux, &mut rest.stiffness);
            let follows =
                remembered_shapes(level, frames(strand), joints, &key.influence, darboux, closed);
            rest.closed = !follows;
        }
        Some(_) => rest_shapes(level, frames(strand), joints, &key.influence, &mut rest.darboux),
    }
    // Of a strand that is not finite, which its step mends.
    if !rest.darboux.iter().map(|q| Vec4::from(*q)).sum::<Vec4>().is_finite() {
        rest.darboux.fill(Quat::IDENTITY);
        rest.closed = false;
    }
    if is_other {
        (rest.key, rest.share) = (Some(*key), share);
        rest.softened.clone_from(&added_mass.softening);
    }
    if changed || key.sweeps.is_none() {
        let mut distance = 0.0;
        rest.stiffness.resize(strand.edges(), 0.0);
        let joints = rest.stiffness.iter_mut().zip(strand.rest_lengths());
        for (i, (stiffness, length)) in joints.enumerate() {
            let softened = rest.softened.get(i).copied().unwrap_or(0.0);
            let cuticle = cuticle_factor(distance, key.cuticle.damage, key.cuticle.softening);
            distance += length;
            let factor = cuticle * (1.0 - softened) * share;
            *stiffness = match key.sweeps {
                None => *stiffness * factor,
                Some((sweeps, dt)) => {
                    stiffness_per_iteration(sweeps.per_substep(dt, factor), sweeps.iterations)
                }
            };
        }
    }
}

fn frames(strand: &Strand) -> JointFrames<'_> {
    JointFrames { root: strand.root_frame(), orientations: strand.orientations() }
}

/// Whether softening differs visibly from `before`. Water moves a little in every substep; the powers
/// are not recomputed for that.
fn has_softened(before: &[f32], now: &[f32]) -> bool {
    before.len() != now.len() || before.iter().zip(now).any(|(a, b)| (a - b).abs() > 2e-3)
}

/// A strand with requested changes of its bonds.
type Changing<'a> =
    (&'a Strand, &'a mut Bonds, &'a mut BondChanges, &'a mut RestShape, &'a mut StrandSleep);

fn update_bonds(
    mut strands: Query<
        (&Strand, &mut Bonds, &mut BondChanges, &mut RestShape, &mut StrandSleep),
        Here,
    >,
) {
    let ahead = |(strand, bonds, changes, ..): &Changing<'_>| {
        prefetch(&bonds.joints);
        prefetch(strand.orientations());
        changes.prefetch();
    };
    let level = simd_level();
    for_each_part(CHANGE, tables(&mut strands), Vec::new, |items: &mut Vec<Changing<'_>>, rows| {
        items.extend(rows.filter(|(_, _, changes, ..)| !changes.is_empty()));
        in_turn(items, AHEAD, ahead, |(strand, bonds, changes, rest, sleep)| {
            if changes.wake() {
                sleep.wake();
            }
            rest.closed = false;
            change(level, frames(strand), &mut bonds.joints, changes.requested());
            changes.clear(strand.edges());
        });
        items.clear();
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::rod::stiffness::REFERENCE_DT;

    /// Damage of the cuticle is measured from the root to the start of the joint's edge.
    #[test]
    fn every_joint_has_the_cuticle_of_its_place() {
        let places = [0.0, 0.01, 0.03, 0.08, 0.1];
        let points = places.map(|x| Vec3::X * x);
        let strand = Strand::from_polyline(&points).unwrap();
        let bonds = Bonds::of(&strand);
        let softening = [0.0, 0.1, 0.2, 0.3];
        let added = AddedMass { softening: softening.to_vec(), ..default() };
        let cuticle = Cuticle { damage: 4.0, softening: 0.5 };
        let influence = BondInfluence::default().as_array();
        let sweeps = Sweeps::default();
        for (key, share) in [(None, 1.0), (None, 4.0), (Some((sweeps, REFERENCE_DT)), 0.5)] {
            let key = Key { influence, cuticle, sweeps: key };
            let mut rest = RestShape::default();
            shape(simd_level(), &key, &strand, &bonds, (&added, share), &mut rest);
            for i in 0..4 {
                let factor = share * cuticle_factor(places[i], 4.0, 0.5) * (1.0 - softening[i]);
                let expected = match key.sweeps {
                    None => factor,
                    Some((s, dt)) => {
                        stiffness_per_iteration(s.per_substep(dt, factor), s.iterations)
                    }
                };
                let found = rest.stiffness[i];
                assert!((found / expected - 1.0).abs() < 1e-4, "{i}: {found}, not {expected}");
            }
        }
    }
}

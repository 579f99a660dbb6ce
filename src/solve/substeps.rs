//! How many of the tick's substeps each hair takes as one.

use crate::{
    rod::{HairSolver, SolverMethod},
    schedule::{HairStep, HairSystems, HairTick, MergedSubsteps, first_substep},
    setting::Settings,
    strand::{Hair, StrandModel},
    water::IsWet,
};
use bevy::prelude::*;

pub(super) fn plugin(app: &mut App) {
    app.add_systems(
        HairTick,
        choose_substeps.in_set(HairSystems::SubstepLength).run_if(first_substep),
    );
}

/// Directly solved rods without water take longer substeps.
fn choose_substeps(
    step: Res<HairStep>,
    solver: Settings<HairSolver>,
    model: Settings<StrandModel>,
    mut hairs: Query<(Entity, Option<&IsWet>, &mut MergedSubsteps), With<Hair>>,
) {
    for (hair, wet, mut merged) in &mut hairs {
        let solver = solver.of(hair);
        let takes_longer = solver.method == SolverMethod::Direct
            && model.of(hair) == StrandModel::Rod
            && wet.is_none_or(|wet| !wet.0);
        merged.set_if_neq(if takes_longer {
            MergedSubsteps::within(solver.substep, &step)
        } else {
            MergedSubsteps::default()
        });
    }
}

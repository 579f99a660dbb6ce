//! How many of the tick's substeps each hair takes as one.

use crate::{
    base::{
        schedule::{HairStep, HairSystems, HairTick, MergedSubsteps, first_substep},
        setting::Settings,
    },
    hair::strand::{Hair, PlayedHair, StrandModel, TickPose},
    solver::rod::{HairSolver, SolverMethod},
};
use bevy::prelude::*;

pub(super) fn plugin(app: &mut App) {
    app.add_systems(
        HairTick,
        choose_substeps.in_set(HairSystems::SubstepLength).run_if(first_substep),
    );
}

/// Directly solved rods take longer substeps.
fn choose_substeps(
    step: Res<HairStep>,
    solver: Settings<HairSolver>,
    model: Settings<StrandModel>,
    mut hairs: Query<(Entity, &TickPose, Has<PlayedHair>, &mut MergedSubsteps), With<Hair>>,
) {
    for (hair, pose, is_played, mut merged) in &mut hairs {
        if pose.waits() || is_played {
            merged.set_if_neq(MergedSubsteps::WAITS);
            continue;
        }
        let solver = solver.of(hair);
        let takes_longer =
            solver.method == SolverMethod::Direct && model.of(hair) == StrandModel::Rod;
        merged.set_if_neq(if takes_longer {
            MergedSubsteps::within(solver.substep, &step)
        } else {
            MergedSubsteps::default()
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::setting::HairDefault;
    use bevy::ecs::system::RunSystemOnce;

    #[test]
    fn only_rods_of_the_direct_solver_take_longer_substeps() {
        let mut world = World::new();
        world.insert_resource(HairStep { dt: 1.0 / 360.0, index: 0, count: 6 });
        world.init_resource::<HairDefault<HairSolver>>();
        world.init_resource::<HairDefault<StrandModel>>();
        let sweeps = HairSolver { method: SolverMethod::Sweeps, ..default() };
        let fine = HairSolver { substep: 1.0 / 360.0, ..default() };
        let hairs = [
            (world.spawn_empty().id(), 2),
            (world.spawn(sweeps).id(), 1),
            (world.spawn(StrandModel::MassSpring).id(), 1),
            (world.spawn(fine).id(), 1),
        ];
        for (hair, _) in hairs {
            world.entity_mut(hair).insert((Hair, MergedSubsteps(5)));
        }
        world.run_system_once(choose_substeps).unwrap();
        for (hair, merged) in hairs {
            assert_eq!(world.get(hair), Some(&MergedSubsteps(merged)));
        }
    }
}

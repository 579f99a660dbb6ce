//! Cosserat rods in the tick.

use super::{
    batch::for_each_batch,
    batched::{Batched, Source},
    gather::in_lanes,
};
use crate::{
    bond::{BondInfluence, Bonds, RestShape},
    contact::{LockContact, Obstacles},
    fault::HairFault,
    lanes::{LANES, put_numbers, put_quaternions, put_vectors, put4},
    parallel::{prefetch, tables},
    rod::{
        HairSolver, Stiffness,
        block::BlockLanes,
        obstacle::Obstacle,
        step::{StepParams, step, weigh},
    },
    schedule::{EffectiveSubsteps, HairSystems, HairTick},
    setting::{self, Settings},
    strand::{AddedMass, Hair, HeldNodes, Strand, StrandModel, StrandOf, StrandSleep},
};
use bevy::prelude::*;
use fearless_simd::Level;

/// Cosserat rods: the elastic projection.
#[derive(Clone, Copy, Debug, Default)]
pub struct RodPlugin;

impl Plugin for RodPlugin {
    fn build(&self, app: &mut App) {
        setting::plugin::<Stiffness>(app);
        setting::plugin::<HairSolver>(app);
        app.add_systems(HairTick, step_rods.in_set(HairSystems::Rods));
    }
}

/// What the projection needs of a hair, resolved once a substep.
struct HairParams {
    level: Level,
    step: StepParams,
    stiffness: Stiffness,
    influence: [f32; 4],
    obstacles: Vec<Obstacle>,
}

struct Rod<'a> {
    entity: Entity,
    hair: Entity,
    strand: &'a mut Strand,
    rest: &'a RestShape,
    bonds: &'a Bonds,
    added: &'a AddedMass,
    held: Option<&'a HeldNodes>,
}

impl Batched for Rod<'_> {
    type Params = HairParams;
    type Lanes = BlockLanes;

    fn entity(&self) -> Entity {
        self.entity
    }

    fn hair(&self) -> Entity {
        self.hair
    }

    fn source(&self) -> Source<'_> {
        Source { strand: self.strand, added: self.added, held: self.held }
    }

    fn strand_mut(&mut self) -> &mut Strand {
        self.strand
    }

    fn prefetch(&self) {
        self.strand.prefetch();
        prefetch(self.strand.rest_lengths());
        prefetch(&self.rest.darboux);
        prefetch(&self.rest.stiffness);
    }

    fn remembered(&self, params: &HairParams) -> Vec<Vec3> {
        self.bonds.joints.iter().map(|joint| joint.relaxed(&params.influence)).collect()
    }

    fn dt(params: &HairParams) -> f32 {
        params.step.dt
    }

    fn block(lanes: &mut BlockLanes) -> &mut BlockLanes {
        lanes
    }

    fn step(
        block: &mut BlockLanes,
        sources: &[Source<'_>; LANES],
        items: &[Self],
        params: &HairParams,
    ) {
        gather_frames(block, sources, items);
        weigh(params.level, block, Some(&params.stiffness));
        let near = block.near(&params.obstacles, params.step.dt, params.step.skin);
        step(params.level, block, &params.step, &near);
    }
}

fn step_rods(
    substeps: EffectiveSubsteps,
    model: Settings<StrandModel>,
    solver: Settings<HairSolver>,
    stiffness: Settings<Stiffness>,
    influence: Settings<BondInfluence>,
    contact: Settings<LockContact>,
    hairs: Query<Option<&Obstacles>, With<Hair>>,
    mut strands: Query<(
        (Entity, &StrandOf, &StrandSleep),
        &mut Strand,
        &RestShape,
        &Bonds,
        &AddedMass,
        Option<&HeldNodes>,
    )>,
    mut faults: MessageWriter<HairFault>,
) {
    let level = Level::new();
    let params_of = |hair: Entity| {
        let obstacles = hairs.get(hair).ok().filter(|_| model.of(hair) == StrandModel::Rod)?;
        let substep = substeps.of(hair)?;
        let s = solver.of(hair);
        Some(HairParams {
            level,
            step: StepParams {
                dt: substep.dt,
                iterations: substep.iterations(s.iterations),
                projection: s.projection,
                limiter_steps: s.limiter_steps,
                internal_damping: s.internal_damping,
                skin: contact.of(hair).radius,
            },
            stiffness: stiffness.of(hair),
            influence: influence.of(hair).as_array(),
            obstacles: obstacles.map_or_else(Vec::new, |all| all.over(substep.substeps)),
        })
    };
    let nodes = strands.iter().next().map_or(0, |(_, strand, ..)| strand.nodes());
    let lost = for_each_batch(
        tables(&mut strands),
        nodes,
        params_of,
        |((entity, of, sleep), strand, rest, bonds, added, held)| {
            let is_stepped = sleep.is_simulated()
                && strand.nodes() >= 2
                && rest.darboux.len() == strand.edges()
                && rest.stiffness.len() == strand.edges();
            let (entity, hair) = (*entity, of.0);
            is_stepped.then_some(Rod { entity, hair, strand, rest, bonds, added, held })
        },
    );
    faults.write_batch(lost);
}

/// Orientations, angular velocities, rest shapes and stiffness.
fn gather_frames(block: &mut BlockLanes, from: &[Source<'_>; LANES], items: &[Rod<'_>]) {
    let rest = in_lanes(items, |item| item.rest);
    let edges = &mut block.edges;
    for (group, four) in from.as_chunks::<4>().0.iter().enumerate() {
        let poses = four.map(|source| source.strand.parts());
        put_quaternions(edges, group, poses.map(|pose| pose.2), |e| &mut e.q);
        put_vectors(edges, group, poses.map(|pose| pose.3), |e| &mut e.omega);
    }
    for (group, four) in rest.as_chunks::<4>().0.iter().enumerate() {
        put_quaternions(edges, group, four.map(|rest| &rest.darboux[..]), |e| &mut e.rest);
        put_numbers(edges, group, four.map(|rest| &rest.stiffness[..]), |e| &mut e.k);
    }
    for (lane, source) in from.iter().enumerate() {
        put4(&mut block.root, lane, source.strand.root_frame());
    }
}

//! `Projection`: strands of a hair with equal node count are gathered into blocks, stepped side by
//! side, and scattered back.

use super::{
    Solver, Stiffness,
    batch::for_each_batch,
    block::{BlockLanes, Source, in_lanes, put4},
    obstacle::Obstacle,
    step::{StepParams, step, weigh},
    turn::{put_numbers, put_quaternions, put_vectors},
};
use crate::{
    bond::{BondInfluence, Bonds, RestShape},
    contact::{LockContact, Obstacles},
    fault::HairFault,
    lod::HairSteps,
    parallel::tables,
    prefetch::prefetch,
    setting::{self, Settings},
    strand::{Burden, HeldNodes, Sleep, Strand, StrandModel, StrandOf},
    tick::{HairSystems, HairTick},
};
use bevy::prelude::*;
use fearless_simd::Level;

/// Cosserat rods: the elastic projection.
pub struct RodPlugin;

impl Plugin for RodPlugin {
    fn build(&self, app: &mut App) {
        setting::plugin::<Stiffness>(app);
        setting::plugin::<Solver>(app);
        app.add_systems(HairTick, project.in_set(HairSystems::Projection));
    }
}

/// What the projection needs of a hair, resolved once a substep.
struct HairParams {
    step: StepParams,
    stiffness: Stiffness,
    influence: [f32; 4],
    obstacles: Vec<Obstacle>,
}

struct Item<'a> {
    entity: Entity,
    hair: Entity,
    strand: &'a mut Strand,
    rest: &'a RestShape,
    bonds: &'a Bonds,
    burden: &'a Burden,
    held: Option<&'a HeldNodes>,
}

impl Item<'_> {
    fn prefetch(&self) {
        self.strand.prefetch();
        prefetch(self.strand.rest_lengths());
        prefetch(&self.rest.darboux);
        prefetch(&self.rest.stiffness);
    }
}

pub(crate) fn project(
    steps: HairSteps,
    model: Settings<StrandModel>,
    solver: Settings<Solver>,
    stiffness: Settings<Stiffness>,
    influence: Settings<BondInfluence>,
    contact: Settings<LockContact>,
    hairs: Query<&Obstacles>,
    mut strands: Query<(
        (Entity, &StrandOf, &Sleep),
        &mut Strand,
        &RestShape,
        &Bonds,
        &Burden,
        Option<&HeldNodes>,
    )>,
    mut faults: MessageWriter<HairFault>,
) {
    let params_of = |hair: Entity| {
        let obstacles = hairs.get(hair).ok().filter(|_| model.of(hair) == StrandModel::Rod)?;
        let stride = steps.of(hair)?;
        let s = solver.of(hair);
        Some(HairParams {
            step: StepParams {
                dt: stride.dt,
                iterations: stride.iterations(s.iterations),
                projection: s.projection,
                limiter_steps: s.limiter_steps,
                internal_damping: s.internal_damping,
                skin: contact.of(hair).radius,
            },
            stiffness: stiffness.of(hair),
            influence: influence.of(hair).as_array(),
            obstacles: obstacles.over(stride.substeps),
        })
    };
    let level = Level::new();
    let nodes = strands.iter().next().map_or(0, |(_, strand, ..)| strand.nodes());
    let lost = for_each_batch(
        tables(&mut strands),
        nodes,
        params_of,
        |((entity, of, sleep), strand, rest, bonds, burden, held)| {
            let is_stepped = sleep.is_simulated()
                && strand.nodes() >= 2
                && rest.darboux.len() == strand.edges()
                && rest.stiffness.len() == strand.edges();
            is_stepped.then_some(Item {
                entity: *entity,
                hair: of.0,
                strand,
                rest,
                bonds,
                burden,
                held,
            })
        },
        |item| (item.hair, item.strand.nodes()),
        Item::prefetch,
        |block, items, params| solve(level, block, items, params),
    );
    faults.write_batch(lost);
}

/// One block through one substep. Says which strands had to be put back.
fn solve(
    level: Level,
    block: &mut BlockLanes,
    items: &mut [Item<'_>],
    params: &HairParams,
) -> Vec<HairFault> {
    block.resize(items[0].strand.nodes());
    gather(block, items, params.step.dt);
    weigh(level, block, Some(&params.stiffness));
    let near = block.near(&params.obstacles, params.step.dt, params.step.skin);
    step(level, block, &params.step, &near);
    let mut lost = Vec::new();
    block.scatter(
        items,
        |item| &mut *item.strand,
        |item| {
            let remembered = item.bonds.joints.iter().map(|j| j.relaxed(&params.influence));
            let fault = item.strand.put_back(remembered);
            lost.extend(fault.map(|fault| HairFault { entity: item.entity, fault }));
        },
    );
    lost
}

fn gather(block: &mut BlockLanes, items: &[Item<'_>], dt: f32) {
    let from = in_lanes(items, |item| Source {
        strand: item.strand,
        burden: item.burden,
        held: item.held,
    });
    block.gather_nodes(&from, dt);
    let rest = in_lanes(items, |item| item.rest);
    let edges = &mut block.edges;
    for (quarter, four) in from.as_chunks::<4>().0.iter().enumerate() {
        let poses = four.map(|source| source.strand.parts());
        put_quaternions(edges, quarter, poses.map(|pose| pose.2), |e| &mut e.q);
        put_vectors(edges, quarter, poses.map(|pose| pose.3), |e| &mut e.omega);
    }
    for (quarter, four) in rest.as_chunks::<4>().0.iter().enumerate() {
        put_quaternions(edges, quarter, four.map(|rest| &rest.darboux[..]), |e| &mut e.rest);
        put_numbers(edges, quarter, four.map(|rest| &rest.stiffness[..]), |e| &mut e.k);
    }
    for (lane, source) in from.iter().enumerate() {
        put4(&mut block.root, lane, source.strand.root_frame());
    }
}

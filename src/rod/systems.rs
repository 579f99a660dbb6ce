//! `Projection`: strands of a hair with equal node count are gathered into blocks, stepped side by
//! side, and scattered back.

use super::{
    LANES, Solver, Stiffness,
    block::{BlockLanes, StepParams, blocks_of, put3, put4, step},
    obstacle::Obstacle,
};
use crate::{
    bond::{BondInfluence, Bonds, RestShape},
    contact::{LockContact, Obstacles},
    fault::{Fault, HairFault},
    lod::HairSteps,
    parallel::for_each_block,
    setting::{self, Settings},
    strand::{Burden, HeldNodes, PerHair, Sleep, Strand, StrandModel, StrandOf},
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
    hair: usize,
    strand: Mut<'a, Strand>,
    rest: &'a RestShape,
    bonds: &'a Bonds,
    burden: &'a Burden,
    held: Option<&'a HeldNodes>,
    put_back: Option<Fault>,
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
        Entity,
        &StrandOf,
        &Sleep,
        &mut Strand,
        &RestShape,
        &Bonds,
        &Burden,
        Option<&HeldNodes>,
    )>,
    mut faults: MessageWriter<HairFault>,
) {
    let mut params = PerHair::default();
    let mut items: Vec<Item<'_>> = Vec::with_capacity(strands.iter().len());
    for (entity, of, sleep, strand, rest, bonds, burden, held) in &mut strands {
        if !sleep.is_simulated() {
            continue;
        }
        let index = params.index(of.0, || {
            let obstacles = hairs.get(of.0).ok().filter(|_| model.of(of.0) == StrandModel::Rod)?;
            let stride = steps.of(of.0)?;
            let s = solver.of(of.0);
            Some(HairParams {
                step: StepParams {
                    dt: stride.dt,
                    iterations: stride.iterations(s.iterations),
                    projection: s.projection,
                    limiter_steps: s.limiter_steps,
                    internal_damping: s.internal_damping,
                    skin: contact.of(of.0).radius,
                },
                stiffness: stiffness.of(of.0),
                influence: influence.of(of.0).as_array(),
                obstacles: obstacles.over(stride.substeps),
            })
        });
        if let Some(hair) = index
            && strand.nodes() >= 2
            && rest.darboux.len() == strand.edges()
        {
            items.push(Item { entity, hair, strand, rest, bonds, burden, held, put_back: None });
        }
    }
    let mut blocks = blocks_of(&mut items, |item| (item.hair, item.strand.nodes()));
    let level = Level::new();
    for_each_block(&mut blocks, BlockLanes::default, |block, items| {
        solve(level, block, items, &params.values[items[0].hair]);
    });
    for item in items {
        if let Some(fault) = item.put_back {
            faults.write(HairFault { entity: item.entity, fault });
        }
    }
}

/// One block through one substep.
fn solve(level: Level, block: &mut BlockLanes, items: &mut [Item<'_>], params: &HairParams) {
    block.resize(items[0].strand.nodes());
    for (lane, item) in items.iter().enumerate() {
        gather(block, lane, item, &params.stiffness, params.step.dt);
    }
    for lane in items.len()..LANES {
        block.repeat_lane(0, lane);
    }
    let near = block.near(&params.obstacles, params.step.dt, params.step.skin);
    step(level, block, &params.step, &near);
    for (lane, item) in items.iter_mut().enumerate() {
        if block.finite[lane] == 0.0 {
            block.scatter(lane, item.strand.bypass_change_detection());
        } else {
            let remembered = item.bonds.joints.iter().map(|j| j.relaxed(&params.influence));
            item.put_back = item.strand.put_back(remembered);
        }
    }
}

fn gather(block: &mut BlockLanes, lane: usize, item: &Item<'_>, stiffness: &Stiffness, dt: f32) {
    let strand = &*item.strand;
    block.gather_nodes(lane, strand, item.burden, item.held, dt);
    let (_, _, orientations, angular) = strand.parts();
    let lengths = strand.rest_lengths();
    let mean = lengths.iter().sum::<f32>() / lengths.len() as f32;
    for (i, edge) in block.edges.iter_mut().enumerate() {
        put4(&mut edge.q, lane, orientations[i]);
        put3(&mut edge.omega, lane, angular[i]);
        edge.l[lane] = lengths[i];
        edge.wq[lane] = stiffness.rotational_weight(lengths[i], mean);
        put4(&mut edge.rest, lane, item.rest.darboux[i]);
        edge.k[lane] = item.rest.stiffness[i];
    }
    put4(&mut block.root, lane, strand.root_frame());
}

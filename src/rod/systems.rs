//! `Projection`: strands of a hair with equal node count are gathered into blocks, stepped side by
//! side, and scattered back.

use super::{
    Solver, Stiffness,
    block::{BlockLanes, Source, blocks_of, in_lanes, put4},
    obstacle::Obstacle,
    step::{StepParams, step, weigh},
    turn::{put_numbers, put_quaternions, put_vectors},
};
use crate::{
    bond::{BondInfluence, Bonds, RestShape},
    contact::{LockContact, Obstacles},
    fault::{Fault, HairFault},
    lod::HairSteps,
    parallel::{emptied, for_each_block_ahead},
    prefetch::prefetch,
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

pub(crate) struct Item<'a> {
    entity: Entity,
    hair: usize,
    strand: Mut<'a, Strand>,
    rest: &'a RestShape,
    bonds: &'a Bonds,
    burden: &'a Burden,
    held: Option<&'a HeldNodes>,
    /// Boxed, because it is rare and the items are many.
    put_back: Option<Box<Fault>>,
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
    mut room: Local<Vec<Item<'static>>>,
) {
    let mut params = PerHair::default();
    let mut items: Vec<Item<'_>> = emptied(core::mem::take(&mut *room));
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
            && rest.stiffness.len() == strand.edges()
        {
            items.push(Item { entity, hair, strand, rest, bonds, burden, held, put_back: None });
        }
    }
    let mut blocks = blocks_of(&mut items, |item| (item.hair, item.strand.nodes()));
    let level = Level::new();
    for_each_block_ahead(
        &mut blocks,
        BlockLanes::default,
        |items| items.iter().for_each(Item::prefetch),
        |block, items| solve(level, block, items, &params.values[items[0].hair]),
    );
    for item in &mut items {
        if let Some(fault) = item.put_back.take() {
            faults.write(HairFault { entity: item.entity, fault: *fault });
        }
    }
    *room = emptied(items);
}

/// One block through one substep.
fn solve(level: Level, block: &mut BlockLanes, items: &mut [Item<'_>], params: &HairParams) {
    block.resize(items[0].strand.nodes());
    gather(block, items, params.step.dt);
    weigh(level, block, Some(&params.stiffness));
    let near = block.near(&params.obstacles, params.step.dt, params.step.skin);
    step(level, block, &params.step, &near);
    block.scatter(
        items,
        |item| item.strand.bypass_change_detection(),
        |item| {
            let remembered = item.bonds.joints.iter().map(|j| j.relaxed(&params.influence));
            item.put_back = item.strand.put_back(remembered).map(Box::new);
        },
    );
}

fn gather(block: &mut BlockLanes, items: &[Item<'_>], dt: f32) {
    let from = in_lanes(items, |item| Source {
        strand: &item.strand,
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

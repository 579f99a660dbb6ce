//! `Projection` for hair that is masses and springs.

use super::{
    Springs,
    block::{SpringLanes, StepParams, step},
};
use crate::{
    air::HairGravity,
    contact::{LockContact, Obstacles},
    fault::{Fault, HairFault},
    lod::HairSteps,
    parallel::{emptied, for_each_block_ahead},
    rod::{
        block::{Source, blocks_of, in_lanes},
        obstacle::Obstacle,
        project,
        step::weigh,
        turn::put_quaternions,
    },
    setting::{self, Settings},
    strand::{Burden, HeldNodes, PerHair, Sleep, Strand, StrandModel, StrandOf, TickPose},
    tick::{HairSystems, HairTick},
};
use bevy::prelude::*;
use fearless_simd::Level;

/// Mass-spring strands.
pub struct SpringPlugin;

impl Plugin for SpringPlugin {
    fn build(&self, app: &mut App) {
        setting::plugin::<Springs>(app);
        app.add_systems(HairTick, step_springs.in_set(HairSystems::Projection).after(project));
    }
}

/// What one hair's strands share in a substep.
struct HairParams {
    step: StepParams,
    obstacles: Vec<Obstacle>,
}

pub(crate) struct Item<'a> {
    entity: Entity,
    hair: usize,
    strand: Mut<'a, Strand>,
    burden: &'a Burden,
    held: Option<&'a HeldNodes>,
    /// Boxed, because it is rare and the items are many.
    put_back: Option<Box<Fault>>,
}

pub(crate) fn step_springs(
    steps: HairSteps,
    model: Settings<StrandModel>,
    springs: Settings<Springs>,
    contact: Settings<LockContact>,
    gravity: Res<HairGravity>,
    hairs: Query<(&Obstacles, &TickPose)>,
    mut strands: Query<(Entity, &StrandOf, &Sleep, &mut Strand, &Burden, Option<&HeldNodes>)>,
    mut faults: MessageWriter<HairFault>,
    mut room: Local<Vec<Item<'static>>>,
) {
    let gravity = if gravity.is_finite() { gravity.0 } else { Vec3::ZERO };
    let mut params = PerHair::default();
    let mut items: Vec<Item<'_>> = emptied(core::mem::take(&mut *room));
    for (entity, of, sleep, strand, burden, held) in &mut strands {
        if !sleep.is_simulated() {
            continue;
        }
        let index = params.index(of.0, || {
            let (obstacles, pose) = hairs.get(of.0).ok()?;
            let stride = steps.of(of.0)?;
            (model.of(of.0) == StrandModel::MassSpring).then(|| {
                let full = springs.of(of.0);
                let iterations = stride.iterations(full.iterations);
                let step = StepParams {
                    dt: stride.dt,
                    springs: Springs { iterations, ..full },
                    gravity: pose.now().direction_in(gravity),
                    skin: contact.of(of.0).radius,
                };
                HairParams { step, obstacles: obstacles.over(stride.substeps) }
            })
        });
        if let Some(hair) = index
            && strand.nodes() >= 2
        {
            items.push(Item { entity, hair, strand, burden, held, put_back: None });
        }
    }
    let mut blocks = blocks_of(&mut items, |item| (item.hair, item.strand.nodes()));
    let level = Level::new();
    for_each_block_ahead(
        &mut blocks,
        SpringLanes::default,
        |items| items.iter().for_each(|item| item.strand.prefetch()),
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
fn solve(level: Level, block: &mut SpringLanes, items: &mut [Item<'_>], params: &HairParams) {
    let HairParams { step: params, obstacles } = params;
    let strands = &mut block.strands;
    strands.resize(items[0].strand.nodes());
    let from = in_lanes(items, |item| Source {
        strand: &item.strand,
        burden: item.burden,
        held: item.held,
    });
    strands.gather_nodes(&from, params.dt);
    for (quarter, four) in from.as_chunks::<4>().0.iter().enumerate() {
        let orientations = four.map(|source| source.strand.orientations());
        put_quaternions(&mut strands.edges, quarter, orientations, |e| &mut e.q);
    }
    weigh(level, strands, None);
    let near = strands.near(obstacles, params.dt, params.skin);
    step(level, block, params, &near);
    block.strands.scatter(
        items,
        |item| item.strand.bypass_change_detection(),
        |item| item.put_back = item.strand.put_back(core::iter::empty()).map(Box::new),
    );
}

//! `Projection` for hair that is masses and springs.

use super::{
    Springs,
    block::{SpringLanes, StepParams, step},
};
use crate::{
    air::HairGravity,
    contact::{LockContact, Obstacles},
    fault::HairFault,
    lod::HairSteps,
    parallel::tables,
    rod::{
        batch::for_each_batch,
        block::{Source, in_lanes},
        obstacle::Obstacle,
        project,
        step::weigh,
        turn::put_quaternions,
    },
    setting::{self, Settings},
    strand::{Burden, HeldNodes, Sleep, Strand, StrandModel, StrandOf, TickPose},
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

struct Item<'a> {
    entity: Entity,
    hair: Entity,
    strand: &'a mut Strand,
    burden: &'a Burden,
    held: Option<&'a HeldNodes>,
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
) {
    let gravity = if gravity.is_finite() { gravity.0 } else { Vec3::ZERO };
    let params_of = |hair: Entity| {
        let (obstacles, pose) = hairs.get(hair).ok()?;
        let stride = steps.of(hair)?;
        (model.of(hair) == StrandModel::MassSpring).then(|| {
            let full = springs.of(hair);
            let iterations = stride.iterations(full.iterations);
            let step = StepParams {
                dt: stride.dt,
                springs: Springs { iterations, ..full },
                gravity: pose.now().direction_in(gravity),
                skin: contact.of(hair).radius,
            };
            HairParams { step, obstacles: obstacles.over(stride.substeps) }
        })
    };
    let level = Level::new();
    let nodes = strands.iter().next().map_or(0, |(_, _, _, strand, ..)| strand.nodes());
    let lost = for_each_batch(
        tables(&mut strands),
        nodes,
        params_of,
        |(entity, of, sleep, strand, burden, held)| {
            let is_stepped = sleep.is_simulated() && strand.nodes() >= 2;
            is_stepped.then_some(Item { entity: *entity, hair: of.0, strand, burden, held })
        },
        |item| (item.hair, item.strand.nodes()),
        |item| item.strand.prefetch(),
        |block, items, params| solve(level, block, items, params),
    );
    faults.write_batch(lost);
}

/// One block through one substep. Says which strands had to be put back.
fn solve(
    level: Level,
    block: &mut SpringLanes,
    items: &mut [Item<'_>],
    params: &HairParams,
) -> Vec<HairFault> {
    let HairParams { step: params, obstacles } = params;
    let strands = &mut block.strands;
    strands.resize(items[0].strand.nodes());
    let from = in_lanes(items, |item| Source {
        strand: item.strand,
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
    let mut lost = Vec::new();
    block.strands.scatter(
        items,
        |item| &mut *item.strand,
        |item| {
            let fault = item.strand.put_back(core::iter::empty());
            lost.extend(fault.map(|fault| HairFault { entity: item.entity, fault }));
        },
    );
    lost
}

//! Mass-spring strands in the tick.

use super::{
    batch::for_each_batch,
    batched::{Attempt, Batched, Member, Source},
};
use crate::{
    base::lanes::{LANES, put_quaternions, simd_level},
    base::{
        fault::HairFault,
        parallel::{Scratch, tables},
        schedule::{EffectiveSubsteps, HairSystems, HairTick, SettleTick, lacks},
        setting::Settings,
    },
    forces::{
        contact::{Obstacles, StrandContact},
        environment::Gravity,
    },
    hair::{
        strand::{
            AddedMass, Held, HeldNodes, HeldNodesState, SimulatedHere, Strand, StrandModel,
            StrandOf, StrandRank, StrandSleep, TickPose, lacks_strands,
        },
        worn,
    },
    keratin::bond::BondPlugin,
    solver::{
        mass_spring::{
            Springs,
            block::{SpringLanes, SpringParams, step},
        },
        rod::{block::BlockLanes, obstacle::Obstacle, step::weigh},
    },
};
use bevy::{math::Isometry3d, prelude::*};
use core::marker::PhantomData;
use fearless_simd::Level;

/// Mass-spring strands.
#[derive(Clone, Copy, Debug, Default)]
pub struct SpringPlugin;

impl Plugin for SpringPlugin {
    fn build(&self, app: &mut App) {
        if lacks_strands::<Self>(app) {
            return;
        }
        lacks::<BondPlugin, Self>(app);
        worn::setting::<Springs>(app);
        app.add_systems(HairTick, step_springs.in_set(HairSystems::Springs))
            .add_systems(SettleTick, step_springs.in_set(HairSystems::Springs));
    }
}

/// Parameters of a hair's strands in a substep.
struct HairParams<'a> {
    level: Level,
    step: SpringParams,
    /// How points at rest in the world moved in the hair's frame.
    frame_delta: Option<Isometry3d>,
    obstacles: &'a [Obstacle],
}

/// Springs need no more of a strand than all kernels do.
struct SpringColumns<'a>(PhantomData<&'a ()>);

impl<'a> Batched for SpringColumns<'a> {
    type Params = HairParams<'a>;
    type Lanes = SpringLanes;

    fn dt(params: &HairParams<'_>) -> f32 {
        params.step.dt
    }

    fn frame_delta(params: &HairParams<'_>) -> Option<Isometry3d> {
        params.frame_delta
    }

    fn block(lanes: &mut SpringLanes) -> &mut BlockLanes {
        &mut lanes.strands
    }

    fn step(
        lanes: &mut SpringLanes,
        sources: &[Source<'_>; LANES],
        _: &[Member<'_, Self>],
        HairParams { level, step: params, obstacles, .. }: &HairParams<'_>,
        _: Attempt,
    ) {
        let strands = &mut lanes.strands;
        for (group, four) in sources.as_chunks::<4>().0.iter().enumerate() {
            let orientations = four.map(|source| source.strand.orientations());
            put_quaternions(&mut strands.edges, group, orientations, |e| &mut e.q);
        }
        weigh(*level, strands, None);
        step(*level, lanes, params, obstacles);
    }
}

fn step_springs(
    substeps: EffectiveSubsteps,
    model: Settings<StrandModel>,
    springs: Settings<Springs>,
    contact: Settings<StrandContact>,
    gravity: Gravity,
    hairs: Query<(Entity, Option<&Obstacles>, &TickPose)>,
    mut strands: Query<
        (
            Entity,
            (&StrandOf, &StrandRank),
            &StrandSleep,
            &mut Strand,
            &AddedMass,
            (Option<&HeldNodes>, Option<&mut HeldNodesState>),
        ),
        SimulatedHere,
    >,
    mut faults: MessageWriter<HairFault>,
    scratch: Local<Scratch<SpringLanes>>,
) {
    let is_spring = |hair| model.of(hair) == StrandModel::MassSpring;
    if !substeps.any() || !hairs.iter().any(|(hair, ..)| is_spring(hair)) {
        return;
    }
    let gravity = gravity.clamped().0;
    let level = simd_level();
    let params_of = |hair: Entity| {
        let (_, obstacles, pose) = hairs.get(hair).ok()?;
        let substep = substeps.of(hair)?;
        is_spring(hair).then(|| {
            let full = springs.of(hair);
            let iterations = substep.iterations(full.iterations);
            let step = SpringParams {
                dt: substep.dt,
                springs: Springs { iterations, ..full },
                gravity: pose.now().direction_in(gravity),
                clearance: contact.of(hair).radius,
            };
            let obstacles = obstacles.map_or(&[][..], |all| &all.solids);
            HairParams { level, step, obstacles, frame_delta: pose.frame_delta() }
        })
    };
    let nodes = strands.iter().next().map_or(0, |(_, _, _, strand, ..)| strand.nodes());
    let lost = for_each_batch(
        tables(&mut strands),
        nodes,
        &scratch,
        params_of,
        |(entity, (of, rank), sleep, strand, added, held)| {
            let is_stepped = sleep.is_simulated() && strand.nodes() >= 2;
            let (entity, hair, rank) = (*entity, of.0, *rank);
            let held = Held::of(held.0, held.1);
            is_stepped.then_some(Member {
                entity,
                hair,
                rank,
                strand,
                added,
                held,
                own: SpringColumns(PhantomData),
            })
        },
    );
    faults.write_batch(lost);
}

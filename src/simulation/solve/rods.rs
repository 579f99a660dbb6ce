//! Cosserat rods in the tick.

use super::{
    batch::for_each_batch,
    batched::{Attempt, Batched, Kept, Member, Source},
    gather::in_lanes,
    substeps,
};
use crate::{
    base::{
        fault::HairFault,
        lanes::{LANES, put_numbers, put_quaternions, put_vectors, put3, put4, simd_level},
        parallel::{Scratch, prefetch, tables},
        schedule::{EffectiveSubsteps, HairSystems, HairTick, SettleTick, lacks},
        setting::{Ranged, Settings},
    },
    forces::contact::{Obstacles, StrandContact},
    hair::{
        strand::{
            AddedMass, Hair, Held, HeldNodes, HeldNodesState, SimulatedHere, Strand, StrandModel,
            StrandOf, StrandRank, StrandSleep, TickPose, lacks_strands,
        },
        worn,
    },
    keratin::bond::{BondInfluence, BondPlugin, Bonds, RestShape},
    solver::rod::{
        HairSolver, HairStiffness, SolverMethod, StrandMaterial, Sweeps,
        block::BlockLanes,
        direct::{self, DirectParams},
        obstacle::Obstacle,
        step::{self, SweepParams},
        stiffness::wet_twist_loss,
    },
};
use bevy::{math::Isometry3d, prelude::*};
use fearless_simd::Level;

/// Strain by which solids jam hair whose lengths the direct method keeps to a thousandth otherwise, and more than sweeps
/// leave.
pub(crate) const MOST_STRAIN: f32 = 0.04;
pub(crate) const MOST_SWEPT_STRAIN: f32 = 0.05;

/// Cosserat rods: the elastic projection.
#[derive(Clone, Copy, Debug, Default)]
pub struct RodPlugin;

impl Plugin for RodPlugin {
    fn build(&self, app: &mut App) {
        if lacks_strands::<Self>(app) {
            return;
        }
        lacks::<BondPlugin, Self>(app);
        worn::setting::<HairStiffness>(app);
        worn::setting::<HairSolver>(app);
        worn::setting::<Sweeps>(app);
        substeps::plugin(app);
        app.add_systems(HairTick, step_rods.in_set(HairSystems::Rods))
            .add_systems(SettleTick, step_rods.in_set(HairSystems::Rods));
    }
}

/// Parameters of a hair for the projection in a substep.
struct HairParams<'a> {
    level: Level,
    method: Method,
    dt: f32,
    /// How points at rest in the world moved in the hair's frame.
    frame_delta: Option<Isometry3d>,
    bending_length: f32,
    influence: [f32; 4],
    obstacles: &'a [Obstacle],
}

enum Method {
    Direct(DirectParams),
    Sweeps(SweepParams, Sweeps),
}

struct RodColumns<'a> {
    rest: &'a RestShape,
    bonds: &'a Bonds,
    /// As a share of its hair's.
    damping: f32,
}

impl<'a> Batched for RodColumns<'a> {
    type Params = HairParams<'a>;
    type Lanes = BlockLanes;

    fn prefetch(Member { strand, own, .. }: &Member<'_, Self>) {
        strand.prefetch();
        prefetch(strand.rest_lengths());
        prefetch(strand.tensions());
        prefetch(&own.rest.darboux);
        prefetch(&own.rest.stiffness);
    }

    fn remembered(&self, params: &HairParams<'_>) -> Vec<Vec3> {
        self.bonds.joints.iter().map(|joint| joint.relaxed(&params.influence)).collect()
    }

    fn kept(params: &HairParams<'_>) -> Kept {
        match params.method {
            Method::Direct(_) => Kept::Tensions,
            Method::Sweeps(..) => Kept::AngularVelocities,
        }
    }

    fn frame_delta(params: &HairParams<'_>) -> Option<Isometry3d> {
        params.frame_delta
    }

    fn most_strain(params: &HairParams<'_>) -> f32 {
        match params.method {
            Method::Direct(_) => MOST_STRAIN,
            Method::Sweeps(..) => MOST_SWEPT_STRAIN,
        }
    }

    fn most_free_strain(params: &HairParams<'_>) -> Option<f32> {
        match params.method {
            Method::Direct(_) => Some(MOST_STRAIN),
            Method::Sweeps(..) => None,
        }
    }

    fn may_repeat(params: &HairParams<'_>) -> bool {
        matches!(params.method, Method::Direct(_))
    }

    fn dt(params: &HairParams<'_>) -> f32 {
        params.dt
    }

    fn block(block: &mut BlockLanes) -> &mut BlockLanes {
        block
    }

    fn step(
        block: &mut BlockLanes,
        sources: &[Source<'_>; LANES],
        items: &[Member<'_, Self>],
        params: &HairParams<'_>,
        attempt: Attempt,
    ) {
        gather_frames(block, sources, items);
        match &params.method {
            Method::Direct(direct) => {
                gather_tensions(block, sources);
                gather_forces(block, sources);
                direct::split_forces(params.level, block, params.dt);
                gather_twist(block, sources);
                block.damping = in_lanes(items, |item| item.own.damping);
                gather_roots(block, sources, params.frame_delta.unwrap_or_default());
                direct::weigh(params.level, block, params.bending_length, params.dt);
                if attempt == Attempt::Second {
                    direct::soften(block);
                }
                direct::step(params.level, block, direct, params.obstacles);
            }
            Method::Sweeps(sweeps, settings) => {
                gather_spins(block, sources);
                step::weigh(params.level, block, Some((settings, params.bending_length)));
                step::step(params.level, block, sweeps, params.obstacles);
            }
        }
    }
}

fn step_rods(
    substeps: EffectiveSubsteps,
    model: Settings<StrandModel>,
    (solver, sweeps): (Settings<HairSolver>, Settings<Sweeps>),
    stiffness: Settings<HairStiffness>,
    influence: Settings<BondInfluence>,
    contact: Settings<StrandContact>,
    hairs: Query<(Option<&Obstacles>, &TickPose), With<Hair>>,
    mut strands: Query<
        (
            (Entity, &StrandOf, &StrandRank, &StrandSleep),
            &mut Strand,
            (&RestShape, Option<&StrandMaterial>),
            &Bonds,
            &AddedMass,
            (Option<&HeldNodes>, Option<&mut HeldNodesState>),
        ),
        SimulatedHere,
    >,
    mut faults: MessageWriter<HairFault>,
    scratch: Local<Scratch<BlockLanes>>,
) {
    if !substeps.any() {
        return;
    }
    let level = simd_level();
    let params_of = |hair: Entity| {
        let (obstacles, pose) =
            hairs.get(hair).ok().filter(|_| model.of(hair) == StrandModel::Rod)?;
        let substep = substeps.of(hair)?;
        let (dt, clearance, stiffness) = (substep.dt, contact.of(hair).radius, stiffness.of(hair));
        let solver = solver.of(hair);
        let method = match solver.method {
            SolverMethod::Direct => Method::Direct(DirectParams {
                dt,
                damping: stiffness.damping,
                torsion: stiffness.torsion,
                limiter_steps: solver.limiter_steps,
                clearance,
            }),
            SolverMethod::Sweeps => {
                let sweeps = sweeps.of(hair);
                let params = SweepParams {
                    dt,
                    iterations: substep.iterations(sweeps.iterations),
                    projection: sweeps.projection,
                    limiter_steps: sweeps.limiter_steps,
                    internal_damping: sweeps.internal_damping,
                    clearance,
                };
                Method::Sweeps(params, sweeps)
            }
        };
        Some(HairParams {
            level,
            method,
            dt,
            frame_delta: pose.frame_delta(),
            bending_length: stiffness.bending_length,
            influence: influence.of(hair).as_array(),
            obstacles: obstacles.map_or(&[], |all| &all.solids),
        })
    };
    let nodes = strands.iter().next().map_or(0, |(_, strand, ..)| strand.nodes());
    let lost = for_each_batch(
        tables(&mut strands),
        nodes,
        &scratch,
        params_of,
        |((entity, of, rank, sleep), strand, (rest, material), bonds, added, held)| {
            let is_stepped = sleep.is_simulated()
                && strand.nodes() >= 2
                && rest.darboux.len() == strand.edges()
                && rest.stiffness.len() == strand.edges();
            let (entity, hair, rank) = (*entity, of.0, *rank);
            let held = Held::of(held.0, held.1);
            let damping = material.map_or(1.0, |material| material.clamped().damping);
            let own = RodColumns { rest, bonds, damping };
            is_stepped.then_some(Member { entity, hair, rank, strand, added, held, own })
        },
    );
    faults.write_batch(lost);
}

/// Orientations, rest shapes and stiffness.
fn gather_frames(
    block: &mut BlockLanes,
    from: &[Source<'_>; LANES],
    items: &[Member<'_, RodColumns<'_>>],
) {
    let rest = in_lanes(items, |item| item.own.rest);
    let edges = &mut block.edges;
    for (group, four) in from.as_chunks::<4>().0.iter().enumerate() {
        let orientations = four.map(|source| source.strand.orientations());
        put_quaternions(edges, group, orientations, |e| &mut e.q);
    }
    for (group, four) in rest.as_chunks::<4>().0.iter().enumerate() {
        put_quaternions(edges, group, four.map(|rest| &rest.darboux[..]), |e| &mut e.rest);
        put_numbers(edges, group, four.map(|rest| &rest.stiffness[..]), |e| &mut e.k);
    }
    for (lane, source) in from.iter().enumerate() {
        put4(&mut block.root, lane, source.strand.root_frame());
    }
}

fn gather_tensions(block: &mut BlockLanes, from: &[Source<'_>; LANES]) {
    for (group, four) in from.as_chunks::<4>().0.iter().enumerate() {
        let tensions = four.map(|source| source.strand.tensions());
        put_numbers(&mut block.edges, group, tensions, |e| &mut e.tension);
    }
}

/// Velocities before the forces of this substep, into `kick`, and what air and gravity have added to them, into `push`.
fn gather_forces(block: &mut BlockLanes, from: &[Source<'_>; LANES]) {
    let forced = from.each_ref().map(|source| source.strand.forced());
    if forced.iter().all(Option::is_some) {
        let forced = forced.map(Option::unwrap_or_default);
        for (group, four) in forced.as_chunks::<4>().0.iter().enumerate() {
            put_vectors(&mut block.nodes, group, four.map(|(before, _)| before), |n| &mut n.kick);
            put_vectors(&mut block.nodes, group, four.map(|(_, blown)| blown), |n| &mut n.push);
        }
    } else {
        for n in &mut block.nodes {
            (n.kick, n.push) = (n.v, default());
        }
        for (lane, (before, blown)) in
            forced.into_iter().enumerate().filter_map(|(lane, forced)| Some((lane, forced?)))
        {
            for (n, (before, blown)) in block.nodes.iter_mut().zip(before.iter().zip(blown)) {
                put3(&mut n.kick, lane, *before);
                put3(&mut n.push, lane, *blown);
            }
        }
    }
}

/// Orientations of edges that are held, and what water takes from the resistance to twist.
fn gather_twist(block: &mut BlockLanes, from: &[Source<'_>; LANES]) {
    for edge in &mut block.edges {
        (edge.clamped, edge.twist_loss) = ([0.0; LANES], [0.0; LANES]);
    }
    for (lane, source) in from.iter().enumerate() {
        for (edge, softening) in block.edges.iter_mut().zip(&source.added.softening) {
            edge.twist_loss[lane] = wet_twist_loss(*softening);
        }
        let Some(held) = source.held.filter(|held| !held.nodes.frames.is_empty()) else { continue };
        let mut before = 0;
        for (node, _) in held.places(source.strand).filter(|(node, _)| *node > 0) {
            let frame =
                held.nodes.frames.get(node).copied().flatten().filter(|frame| frame.is_finite());
            if let (Some(frame), true) = (frame, node == before + 1) {
                let edge = &mut block.edges[node - 1];
                edge.clamped[lane] = 1.0;
                put4(&mut edge.q, lane, frame.normalize());
            }
            before = node;
        }
    }
}

/// Start positions and frames of the roots.
fn gather_roots(block: &mut BlockLanes, from: &[Source<'_>; LANES], frame_delta: Isometry3d) {
    for (lane, source) in from.iter().enumerate() {
        let (place, frame) = source.strand.root_before();
        put3(&mut block.nodes[0].from, lane, frame_delta * place);
        put4(&mut block.root_from, lane, frame_delta.rotation * frame);
    }
}

fn gather_spins(block: &mut BlockLanes, from: &[Source<'_>; LANES]) {
    for (group, four) in from.as_chunks::<4>().0.iter().enumerate() {
        let spins = four.map(|source| source.strand.angular_velocities());
        put_vectors(&mut block.edges, group, spins, |e| &mut e.omega);
    }
}

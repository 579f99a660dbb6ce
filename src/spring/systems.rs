//! `Projection` for hair that is masses and springs.

use super::{
    Springs,
    model::{Scratch, step},
};
use crate::{
    air::HairGravity,
    contact::{LockContact, Obstacles},
    fault::{Fault, HairFault},
    parallel::for_each_block,
    rod::{algebra::V3, obstacle::Obstacle, project},
    setting::{self, Settings},
    strand::{Burden, HeldNodes, PutBack, Strand, StrandModel, StrandOf, TickPose},
    tick::{HairStep, HairSystems, HairTick},
};
use bevy::{ecs::entity::EntityHashMap, prelude::*};

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
    springs: Springs,
    obstacles: Vec<Obstacle>,
    skin: f32,
    gravity: Vec3,
}

/// How many strands are one piece of work.
const BLOCK: usize = 16;

/// Room for the work on one strand.
#[derive(Default)]
struct Room {
    positions: Vec<Vec3>,
    velocities: Vec<Vec3>,
    step: Scratch,
}

struct Item<'a> {
    entity: Entity,
    hair: usize,
    strand: &'a mut Strand,
    burden: &'a Burden,
    held: Option<&'a HeldNodes>,
    put_back: Option<PutBack>,
}

fn step_springs(
    time: Res<HairStep>,
    model: Settings<StrandModel>,
    springs: Settings<Springs>,
    contact: Settings<LockContact>,
    gravity: Res<HairGravity>,
    hairs: Query<(&Obstacles, &TickPose)>,
    mut strands: Query<(Entity, &StrandOf, &mut Strand, &Burden, Option<&HeldNodes>)>,
    mut faults: MessageWriter<HairFault>,
) {
    let gravity = if gravity.is_finite() { gravity.0 } else { Vec3::ZERO };
    let mut params: Vec<HairParams> = Vec::new();
    let mut index_of = EntityHashMap::<Option<usize>>::default();
    let mut items: Vec<Item<'_>> = Vec::new();
    for (entity, of, strand, burden, held) in &mut strands {
        let index = *index_of.entry(of.0).or_insert_with(|| {
            let (obstacles, pose) = hairs.get(of.0).ok()?;
            (model.of(of.0) == StrandModel::MassSpring).then(|| {
                params.push(HairParams {
                    springs: springs.of(of.0),
                    obstacles: obstacles.solids.clone(),
                    skin: contact.of(of.0).radius,
                    gravity: pose.now().direction_in(gravity),
                });
                params.len() - 1
            })
        });
        if let Some(hair) = index
            && strand.nodes() >= 2
        {
            let strand = strand.into_inner();
            items.push(Item { entity, hair, strand, burden, held, put_back: None });
        }
    }
    let mut blocks: Vec<&mut [Item<'_>]> = items.chunks_mut(BLOCK).collect();
    for_each_block(&mut blocks, default, |scratch, block| {
        block.iter_mut().for_each(|item| advance(item, &params[item.hair], time.dt, scratch));
    });
    for item in &items {
        if let Some(how) = item.put_back {
            let fault = match how {
                PutBack::LastFinite => Fault::PutBack,
                PutBack::RestPose => Fault::Rebuilt,
            };
            faults.write(HairFault { entity: item.entity, fault });
        }
    }
}

/// One strand through one substep.
fn advance(item: &mut Item<'_>, params: &HairParams, dt: f32, scratch: &mut Room) {
    let HairParams { springs, obstacles, skin, gravity } = params;
    let held = |i: usize| item.held.and_then(|h| h.targets.get(i).copied().flatten());
    let inverse_mass = |i: usize| {
        let load = item.burden.mass.get(i).copied().unwrap_or(0.0);
        if i == 0 || held(i).is_some() { 0.0 } else { 1.0 / (1.0 + load) }
    };
    let Room { positions, velocities, step: inner } = scratch;
    positions.clear();
    positions.extend_from_slice(item.strand.positions());
    velocities.clear();
    velocities.extend_from_slice(item.strand.velocities());
    for (i, v) in velocities.iter_mut().enumerate() {
        if let Some(target) = held(i) {
            *v = (target - positions[i]) / dt;
        } else if i == 0 {
            *v = Vec3::ZERO;
        }
    }
    let out = |p: Vec3, from: Vec3| {
        obstacles.iter().fold(p, |p, obstacle| push_out(obstacle, p, from, *skin))
    };
    let lengths = item.strand.rest_lengths();
    step(positions, velocities, lengths, inverse_mass, springs, *gravity, dt, inner, out);
    if positions.iter().chain(&*velocities).all(|v| v.is_finite()) {
        item.strand.take_over(positions, velocities);
        item.strand.stepped_well();
    } else {
        item.put_back = item.strand.put_back(core::iter::empty());
    }
}

/// Out of a solid, held back along its surface by friction as far as it has got in.
fn push_out(obstacle: &Obstacle, p: Vec3, from: Vec3, skin: f32) -> Vec3 {
    let (normal, depth) = obstacle.solid.depth(V3::new(p.x, p.y, p.z), skin);
    if depth.is_nan() || depth <= 0.0 {
        return p;
    }
    let normal = Vec3::new(normal.x, normal.y, normal.z);
    let out = p + normal * depth;
    let from = obstacle.motion.map_or(from, |motion| motion.transform_point3(from));
    let slip = (out - from).reject_from_normalized(normal);
    let length = slip.length();
    out - slip * (obstacle.friction * depth / length.max(1e-12)).min(1.0)
}

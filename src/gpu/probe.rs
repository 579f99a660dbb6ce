//! Where strands are, for game code, wherever they are simulated.

use super::hair::GpuHair;
use crate::hair::strand::{OnGpu, Strand, StrandOf};
use bevy::{ecs::entity::EntityHashMap, prelude::*};

/// Asks where a strand is. Add it to a strand: [`HairProbed`] is triggered on it once a frame, wherever its
/// hair is simulated, without waiting for the GPU.
///
/// ```
/// # use bevy_keratin::prelude::*; use bevy::prelude::*;
/// fn follow_a_tip(In(strand): In<Entity>, mut commands: Commands) {
///     commands.entity(strand).insert(HairProbe).observe(|probed: On<HairProbed>| {
///         println!("its tip was at {:?}, {} ticks ago", probed.positions.last(), probed.age);
///     });
/// }
/// ```
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct HairProbe;

/// Where a strand with a [`HairProbe`] is.
#[derive(EntityEvent, Reflect, Clone, Debug, PartialEq)]
#[reflect(Clone, PartialEq)]
pub struct HairProbed {
    /// The strand.
    pub entity: Entity,
    /// The positions of its nodes, root first (m, in the hair's frame).
    pub positions: Vec<Vec3>,
    /// How many ticks ago that was: 0 on the CPU, some on the GPU.
    pub age: u32,
}

/// Strands of a hair on the GPU that are asked about at once; more take turns.
const AT_ONCE: usize = 64;

/// Tells what is known, and asks anew.
pub(super) fn probe(world: &mut World) {
    let mut found = Vec::new();
    let mut asked = EntityHashMap::<Vec<Entity>>::default();
    let mut probes =
        world.query_filtered::<(Entity, Option<&StrandOf>, &Strand, Has<OnGpu>), With<HairProbe>>();
    for (entity, of, strand, on_gpu) in probes.iter(world) {
        match of.filter(|_| on_gpu) {
            Some(of) => asked.entry(of.0).or_default().push(entity),
            None => {
                let positions = strand.positions().to_vec();
                found.push(HairProbed { entity, positions, age: 0 });
            }
        }
    }
    let mut hairs = world.query::<(Entity, &mut GpuHair)>();
    for (hair, mut gpu) in hairs.iter_mut(world) {
        let gpu = gpu.bypass_change_detection();
        let answer = gpu.link.take_probed();
        if let Some((strands, tick)) = answer {
            gpu.probe_turn += AT_ONCE;
            let age = gpu.ticks.saturating_sub(tick);
            found.extend(strands.into_iter().filter_map(|(strand, positions)| {
                let entity = *gpu.members.get(strand as usize)?;
                Some(HairProbed { entity, positions, age })
            }));
        }
        gpu.probed.clear();
        let Some(asked) = asked.get(&hair) else { continue };
        if gpu.numbers.is_empty() {
            gpu.numbers = gpu.members.iter().copied().zip(0..).collect();
        }
        let first = gpu.probe_turn % asked.len();
        let in_turn = asked.iter().cycle().skip(first).take(asked.len().min(AT_ONCE));
        gpu.probed.extend(in_turn.filter_map(|strand| gpu.numbers.get(strand).copied()));
    }
    for probed in found {
        if world.get::<HairProbe>(probed.entity).is_some() {
            world.trigger(probed);
        }
    }
    world.flush();
}

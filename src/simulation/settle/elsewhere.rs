//! Hair that settles on another thread while the game's time stands still or goes slowly: its ticks are not waited for.

use super::{
    Settling,
    ahead::{SettleAhead, SettleConditions, Settled},
    systems::end,
};
use crate::{
    forces::contact::HairCollider,
    hair::strand::{HairHere, Pose, Strand, Strands},
    keratin::bond::Bonds,
    solver::rod::StrandMaterial,
};
use bevy::{
    ecs::system::SystemState,
    prelude::*,
    tasks::{AsyncComputeTaskPool, Task, futures::check_ready},
};

/// The hair settles elsewhere.
#[derive(Component)]
#[component(clone_behavior = Ignore)]
pub(super) struct Elsewhere(Task<Option<Settled>>);

fn is_slow(time: Option<&Time<Virtual>>) -> bool {
    time.is_some_and(|time| time.is_paused() || time.relative_speed() < 1.0)
}

/// Sends hair that is to settle, and takes back what has.
pub(super) fn settle_elsewhere(
    world: &mut World,
    hairs: &mut QueryState<(Entity, Option<&mut Elsewhere>, Has<Settling>), HairHere>,
) {
    let is_slow = is_slow(world.get_resource());
    let (mut begun, mut ended) = (Vec::new(), Vec::new());
    for (hair, elsewhere, settles) in hairs.iter_mut(world) {
        let is_meant = is_slow && settles;
        match elsewhere {
            None if is_meant => begun.push(hair),
            None => {}
            Some(mut elsewhere) => match check_ready(&mut elsewhere.0) {
                Some(settled) if is_meant => ended.push((hair, settled)),
                None if is_meant => {}
                _ => ended.push((hair, None)),
            },
        }
    }
    for (hair, settled) in ended {
        world.entity_mut(hair).remove::<Elsewhere>();
        if let Some(settled) = settled {
            settled.lay(world, hair);
        }
    }
    for hair in begun {
        let Some(work) = Work::of(world, hair) else { continue };
        match AsyncComputeTaskPool::try_get() {
            Some(pool) => {
                let task = Elsewhere(pool.spawn(async move { work.settle() }));
                world.entity_mut(hair).insert(task);
            }
            None => {
                if let Some(settled) = work.settle() {
                    settled.lay(world, hair);
                }
            }
        }
    }
}

/// A hair with its surroundings, as they are now.
struct Work {
    strands: Vec<Strand>,
    materials: Vec<StrandMaterial>,
    solids: Vec<(HairCollider, Transform)>,
    pose: Pose,
    conditions: SettleConditions,
}

impl Work {
    /// `None` without strands, or where its transform is not valid.
    fn of(world: &mut World, hair: Entity) -> Option<Self> {
        let members = world.get::<Strands>(hair)?.collection();
        let strands = members.iter().filter_map(|member| world.get::<Strand>(*member).cloned());
        let strands: Vec<Strand> = strands.collect();
        let own = |member: &Entity| world.get::<StrandMaterial>(*member).copied();
        let materials = match members.iter().any(|member| own(member).is_some()) {
            true => members.iter().map(|member| own(member).unwrap_or_default()).collect(),
            false => Vec::new(),
        };
        let colliders: Vec<_> = world
            .query::<(Entity, &HairCollider)>()
            .iter(world)
            .map(|(entity, collider)| (entity, collider.clone()))
            .collect();
        let mut places = SystemState::<TransformHelper>::new(world);
        let places = places.get(world).ok()?;
        let place = |of: Entity| places.compute_global_transform(of).ok();
        let pose = Pose::of(&place(hair)?)?;
        let to_hair = pose.affine().inverse();
        let seen = |(of, collider): (Entity, HairCollider)| {
            let place = Transform::from_matrix((to_hair * place(of)?.affine()).into());
            place.is_finite().then_some((collider, place))
        };
        let solids = colliders.into_iter().filter_map(seen).collect();
        let conditions = SettleConditions::of(world, hair);
        (!strands.is_empty()).then_some(Self { strands, materials, solids, pose, conditions })
    }

    fn settle(&self) -> Option<Settled> {
        let ahead = SettleAhead {
            strands: &self.strands,
            materials: &self.materials,
            own: None,
            solids: &self.solids,
            size: self.pose.size(),
            gravity: self.pose.direction_in(self.conditions.gravity),
            conditions: &self.conditions,
        };
        ahead.settle(|| true)
    }
}

impl Settled {
    /// Lays a hair as it has settled, if its strands are still the same, and ends its settling. What is on it stays.
    pub(crate) fn lay(self, world: &mut World, hair: Entity) {
        let members = world.get::<Strands>(hair).map(|members| members.collection().to_vec());
        let members = members.unwrap_or_default();
        let nodes = |member: &Entity| world.get::<Strand>(*member).map(Strand::nodes);
        let is_same = members.len() == self.strands.len()
            && members.iter().zip(&self.strands).all(|(m, s)| nodes(m) == Some(s.0.nodes()));
        if !is_same {
            return;
        }
        for (member, (strand, bonds)) in members.into_iter().zip(self.strands) {
            let mut member = world.entity_mut(member);
            let edges = strand.edges();
            member.insert(strand);
            if member.get::<Bonds>().is_none_or(|bonds| bonds.joints.len() != edges) {
                member.insert(bonds);
            }
        }
        for fault in self.faults {
            world.write_message(fault.of(hair));
        }
        end(world, hair);
    }
}

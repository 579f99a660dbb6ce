//! The order of a hair's strands, whatever tables they lie in.

use super::{Regroomed, Strand, Strands};
use bevy::{ecs::entity_disabling::Disabled, prelude::*};

/// A strand's number among those of its hair: by node count, and of equal ones in the order of [`Strands`]. What sums
/// over strands or solves them side by side goes by it: the order of rows changes with what else lives in the world.
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct StrandRank(pub(crate) u32);

/// Numbers the strands of each hair of which some have come, gone or been cut.
pub(super) fn rank_strands(
    hairs: Query<&Strands, Changed<Regroomed>>,
    strands: Query<&Strand, Allow<Disabled>>,
    mut ranks: Query<&mut StrandRank, Allow<Disabled>>,
) {
    for members in &hairs {
        let nodes = |id: &Entity| strands.get(*id).map_or(0, Strand::nodes);
        let mut order: Vec<(usize, Entity)> =
            members.collection().iter().map(|id| (nodes(id), *id)).collect();
        order.sort_by_key(|(nodes, _)| *nodes);
        for (rank, (_, id)) in (0..).zip(order) {
            if let Ok(mut own) = ranks.get_mut(id) {
                own.set_if_neq(StrandRank(rank));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{super::StrandOf, *};
    use bevy::ecs::system::RunSystemOnce;

    #[test]
    fn strands_are_ranked_by_node_count_and_then_as_they_were_spawned() {
        let mut world = World::new();
        let hair = world.spawn(Regroomed::default()).id();
        let strand = |nodes: usize| {
            let points: Vec<Vec3> = (0..nodes).map(|k| Vec3::Y * k as f32).collect();
            Strand::from_polyline(&points).unwrap()
        };
        let ids = [5, 3, 4, 3].map(|nodes| world.spawn((StrandOf(hair), strand(nodes))).id());
        let ranks = |world: &mut World| {
            world.run_system_once(rank_strands).unwrap();
            ids.map(|id| world.get::<StrandRank>(id).map(|rank| rank.0))
        };
        assert_eq!(ranks(&mut world), [3, 0, 2, 1].map(Some));
        world.despawn(ids[1]);
        assert_eq!(ranks(&mut world), [Some(2), None, Some(1), Some(0)]);
    }
}

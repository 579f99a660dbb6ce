//! Nodes that something else moves: roots on a mesh, held nodes.

use super::record::{GpuJournal, KinematicTarget};
use crate::hair::strand::{HeldNodes, PerHair, Strand, StrandOf, Strands};
#[cfg(feature = "groom")]
use crate::{authoring::attach::TiedRoots, base::schedule::HairStep};
use bevy::{ecs::system::SystemParam, math::Isometry3d, prelude::*};

/// What gives nodes kinematic targets.
#[derive(SystemParam)]
pub(super) struct TargetQueries<'w, 's> {
    #[cfg(feature = "groom")]
    step: Res<'w, HairStep>,
    members: Query<'w, 's, &'static Strands>,
    #[cfg(feature = "groom")]
    strands: Query<'w, 's, &'static Strand>,
    held: Query<'w, 's, (Entity, &'static StrandOf, &'static Strand, &'static HeldNodes)>,
    #[cfg(feature = "groom")]
    tied: Query<'w, 's, &'static TiedRoots>,
}

/// Strands with held nodes, by their hair.
pub(super) type HeldStrands<'a> = PerHair<Vec<(Entity, &'a Strand, &'a HeldNodes)>>;

impl TargetQueries<'_, '_> {
    /// Strands with held nodes, hair by hair.
    pub(super) fn held(&self) -> HeldStrands<'_> {
        let mut all = HeldStrands::default();
        for (entity, of, strand, held) in &self.held {
            if held.targets.iter().any(Option::is_some)
                && let Some(hair) = all.index(of.0, || Some(Vec::new()))
            {
                all.values[hair].push((entity, strand, held));
            }
        }
        all
    }

    /// The kinematic targets of a hair in the substep that ends now.
    pub(super) fn of(
        &self,
        hair: Entity,
        held: &mut HeldStrands<'_>,
        journal: &mut GpuJournal,
    ) -> Vec<KinematicTarget> {
        let mut targets = Vec::new();
        let roots = self.roots(hair);
        targets.extend(roots.iter().zip(0..).map(|(root, strand)| KinematicTarget {
            strand,
            node: 0,
            place: Some(root.translation.into()),
            frame: root.rotation,
        }));
        let index = held.index(hair, || Some(Vec::new()));
        let held = index.map_or(&[][..], |index| &held.values[index]);
        let before = &mut journal.held;
        if held.is_empty() && before.nodes.is_empty() {
            return targets;
        }
        let Ok(members) = self.members.get(hair) else { return targets };
        if before.of.len() != members.len() {
            before.of = members.iter().zip(0..).collect();
        }
        let mut nodes = Vec::with_capacity(before.nodes.len());
        for (entity, strand, held) in held {
            let Some(&index) = before.of.get(entity) else { continue };
            let own = strand.positions().first().copied().unwrap_or_default();
            let root = roots.get(index as usize).map_or(own, |root| root.translation.into());
            for (node, place) in held.within_reach_of(root, strand).filter(|(node, _)| *node > 0) {
                let node = node as u32;
                nodes.push((index, node));
                let frame = Quat::IDENTITY;
                targets.push(KinematicTarget { strand: index, node, place: Some(place), frame });
            }
        }
        nodes.sort_unstable();
        let released = before.nodes.iter().filter(|node| nodes.binary_search(node).is_err());
        targets.extend(released.map(|(strand, node)| KinematicTarget {
            strand: *strand,
            node: *node,
            place: None,
            frame: Quat::IDENTITY,
        }));
        before.nodes = nodes;
        targets
    }

    /// The roots of a hair on a mesh, strand by strand; none where they stay.
    #[cfg(feature = "groom")]
    fn roots(&self, hair: Entity) -> Vec<Isometry3d> {
        let Ok((tied, members)) =
            self.tied.get(hair).and_then(|tied| Ok((tied, self.members.get(hair)?)))
        else {
            return Vec::new();
        };
        let t = (self.step.index + 1) as f32 / self.step.count as f32;
        let mut moved = tied.at(t).peekable();
        if moved.peek().is_none() {
            return Vec::new();
        }
        let moved: bevy::ecs::entity::EntityHashMap<Isometry3d> = moved.collect();
        let root = |strand: Entity| {
            let own = || {
                let strand = self.strands.get(strand).ok()?;
                Some(Isometry3d::new(*strand.positions().first()?, strand.root_frame()))
            };
            moved.get(&strand).copied().or_else(own).unwrap_or_default()
        };
        members.iter().map(root).collect()
    }

    #[cfg(not(feature = "groom"))]
    fn roots(&self, _: Entity) -> Vec<Isometry3d> {
        Vec::new()
    }
}

//! Which strands are simulated at a level, and which guides the others follow.

use super::{
    PresentLod,
    assign::assign_guides,
    follow::GuideOffsets,
    guides::{Follower, GroupStrand, Guides},
    spread::spread_order,
};
use crate::{
    base::setting::Settings,
    hair::strand::{
        FollowsHere, HairHere, HeldNodes, Here, KinematicStrand, PerHair, Regroomed, Strand,
        StrandHistory, StrandModel, StrandOf, StrandSleep, Strands,
    },
};
use bevy::{
    ecs::{
        entity::{EntityHashMap, EntityHashSet},
        entity_disabling::Disabled,
    },
    prelude::*,
};

/// A hair whose strands are to be partitioned into guides and followers.
struct HairPartition<'a> {
    hair: Entity,
    share: f32,
    level: usize,
    /// Whether a strand is simulated only until its state is finite again.
    repairs: bool,
    members: Vec<GroupStrand<'a>>,
    strands: Vec<Ref<'a, Strand>>,
}

/// At the start of a tick: where user code has written over what says that a strand is a follower, its hair
/// is looked at again.
pub(crate) fn note_overwritten(
    written: Query<&StrandOf, (Changed<StrandSleep>, With<KinematicStrand>, Here)>,
    mut hairs: Query<&mut Guides>,
) {
    for of in &written {
        if let Ok(mut guides) = hairs.get_mut(of.0) {
            guides.bypass_change_detection().partition_key = None;
        }
    }
}

/// At the start of a tick: which strands are simulated, and which guides each other one follows.
pub(crate) fn choose_guides(
    models: Settings<StrandModel>,
    held: Query<&StrandOf, (Changed<HeldNodes>, Here)>,
    mut released: RemovedComponents<HeldNodes>,
    (mut enabled, mut forgotten): (RemovedComponents<Disabled>, RemovedComponents<Follower>),
    (of, kinematic, came): (
        Query<&StrandOf>,
        Query<&StrandOf, FollowsHere>,
        Query<&StrandOf, (Added<KinematicStrand>, Here)>,
    ),
    mut hairs: Query<(Entity, &Strands, &mut PresentLod, &mut Guides, Ref<Regroomed>), HairHere>,
    mut strands: Query<(
        Entity,
        &StrandOf,
        Ref<Strand>,
        &mut StrandSleep,
        (&mut Follower, &mut StrandHistory),
        (Option<&HeldNodes>, Has<KinematicStrand>),
    )>,
    mut commands: Commands,
) {
    // Strands of springs have no twist for a neighbour to follow.
    let share_of = |hair: Entity, present: &PresentLod| match models.of(hair) {
        StrandModel::Rod => present.simulated_share(),
        StrandModel::MassSpring => 1.0,
    };
    // Strands that are held, and those that no longer are.
    let let_go = released.read().chain(forgotten.read()).filter_map(|strand| of.get(strand).ok());
    let touched: EntityHashSet = held.iter().chain(let_go).map(|of| of.0).collect();
    // Clones of followers, and followers that were disabled while the level ended, may be in hair without any.
    let again = enabled.read().filter_map(|entity| kinematic.get(entity).ok());
    let strayed: EntityHashSet = again.chain(&came).map(|of| of.0).collect();
    let has_level = |present: &PresentLod, guides: &Guides| {
        present.simulated_share() < 1.0 || present.followers > 0 || !guides.strands.is_empty()
    };
    let concerns = |hair: Entity, present: &PresentLod, guides: &Guides| {
        has_level(present, guides) || strayed.contains(&hair)
    };
    // Hair without outside writes keeps its partition.
    let mut unchanged = EntityHashSet::default();
    let mut any = false;
    for (hair, members, present, mut guides, regroomed) in &mut hairs {
        if !concerns(hair, &present, &guides) {
            continue;
        }
        let is_strayed = !has_level(&present, &guides);
        let partition_key = Some((share_of(hair, &present), present.level, members.len()));
        let guides = guides.bypass_change_detection();
        let is_touched = is_strayed || regroomed.is_changed() || touched.contains(&hair);
        if guides.partition_key == partition_key && !is_touched {
            unchanged.insert(hair);
        } else {
            any = true;
        }
        guides.partition_key = partition_key;
    }
    if !any {
        return;
    }
    let mut groups = PerHair::default();
    for (entity, of, strand, sleep, (follower, history), (held, is_kinematic)) in &mut strands {
        let index = groups.index(of.0, || {
            let (hair, _, present, guides, _) = hairs.get(of.0).ok()?;
            let (members, strands) = default();
            let (share, level) = (share_of(hair, present), present.level);
            (concerns(hair, present, guides) && !unchanged.contains(&hair))
                .then_some(HairPartition { hair, share, level, repairs: false, members, strands })
        });
        let Some(index) = index else { continue };
        let is_held = held.is_some_and(|held| held.targets.iter().any(Option::is_some));
        // A non-finite strand is repaired by being simulated. Only writes from outside make it so, also
        // while it is disabled and no system notices. Guides overwrite all but a follower's root.
        let is_followed = sleep.is_follower() && !strand.is_changed();
        let is_finite = if is_followed && follower.offsets.fit(strand.edges()) {
            strand.positions().first().is_some_and(|root| root.is_finite())
        } else {
            strand.is_finite()
        };
        let is_whole = strand.nodes() >= 2 && is_finite;
        let free = is_whole && !is_held;
        let group: &mut HairPartition<'_> = &mut groups.values[index];
        group.repairs |= !is_whole && strand.nodes() >= 2;
        group.members.push(GroupStrand { entity, sleep, follower, history, is_kinematic, free });
        group.strands.push(strand);
    }
    let mut counts = EntityHashMap::<usize>::default();
    for group in &mut groups.values {
        if let Ok((.., mut guides, _)) = hairs.get_mut(group.hair) {
            let guides = guides.bypass_change_detection();
            counts.insert(group.hair, partition(group, guides));
            guides.partition_key = guides.partition_key.filter(|_| !group.repairs);
            mark(group, &mut commands);
        }
    }
    for (hair, _, mut present, mut guides, _) in &mut hairs {
        if unchanged.contains(&hair) {
            continue;
        }
        let followers = counts.get(&hair).copied().unwrap_or(0);
        if present.followers != followers {
            present.followers = followers;
        }
        if !counts.contains_key(&hair) && !guides.strands.is_empty() {
            guides.bypass_change_detection().begin();
        }
    }
}

/// Marks the strands that are followers now, and those that are no more.
fn mark(group: &HairPartition<'_>, commands: &mut Commands) {
    let changed = |m: &&GroupStrand<'_>| m.sleep.is_follower() != m.is_kinematic;
    let (left, came): (Vec<_>, Vec<_>) =
        group.members.iter().filter(changed).partition(|member| member.is_kinematic);
    let came: Vec<_> = came.iter().map(|member| (member.entity, KinematicStrand)).collect();
    if !came.is_empty() {
        commands.try_insert_batch(came);
    }
    for member in left {
        commands.entity(member.entity).try_remove::<KinematicStrand>();
    }
}

/// Partitions a hair's strands into guides and followers; returns the number of followers.
fn partition(group: &mut HairPartition<'_>, guides: &mut Guides) -> usize {
    let HairPartition { share, level, members, strands, .. } = group;
    let mut ranks = Vec::new();
    if *share < 1.0 {
        rank(members, strands);
        ranks.extend(members.iter().filter(|m| m.free).filter_map(|m| m.follower.rank));
    }
    // The first free strands in spread order are guides; frozen hair has none.
    let wanted = match *share {
        share if share > 0.0 => ((share * ranks.len() as f32 - 1e-3).ceil() as usize).max(1),
        _ => 0,
    };
    // From this rank on they are followers.
    let first_follower =
        if wanted < ranks.len() { *ranks.select_nth_unstable(wanted).1 } else { u32::MAX };
    let mut same = guides.strands.len() == wanted && guides.level == *level;
    let mut count = 0;
    for (member, strand) in members.iter_mut().zip(strands.iter()) {
        let GroupStrand { entity, sleep, follower, history, free, .. } = member;
        let (sleep, follower) =
            (sleep.bypass_change_detection(), follower.bypass_change_detection());
        let is_follower = *free && follower.rank.is_some_and(|rank| rank >= first_follower);
        let is_guide = *free && !is_follower && first_follower < u32::MAX;
        let guide = follower.guide.filter(|_| is_guide);
        same &= !is_guide || guide.is_some_and(|i| guides.strands.get(i as usize) == Some(entity));
        count += usize::from(is_follower);
        if !is_follower && sleep.is_follower() {
            // It continues from its present position and velocity.
            sleep.set_follower(false);
            follower.thaws = follower.offsets.guides.is_empty();
            guides.thaws |= follower.thaws;
            if core::mem::take(&mut follower.synced_asleep) {
                sleep.wake_up();
            }
            follower.offsets = GuideOffsets::default();
            // Followers' history is written as they move.
            history.bypass_change_detection().remember(strand);
        }
        // A strand that was written to stays where it was put and follows from there.
        let is_new = !sleep.is_follower() || strand.is_changed();
        if is_follower && (is_new || !follower.offsets.fit(strand.edges())) {
            follower.offsets = GuideOffsets::default();
        }
        follower.guide = guide;
    }
    if count == 0 {
        guides.begin();
        return 0;
    }
    if !same {
        let keep = guides.level == *level;
        guides.level = *level;
        replace_guides(members, strands, guides, first_follower, keep);
    }
    assign_guides(members, strands, guides);
    count
}

/// Gives every strand its place in the spread order, if one has none yet.
fn rank(members: &mut [GroupStrand<'_>], strands: &[Ref<'_, Strand>]) {
    if members.iter().all(|m| !m.free || m.follower.rank.is_some()) {
        return;
    }
    let root = |strand: &Strand| strand.positions().first().copied();
    let (places, whole): (Vec<Vec3>, Vec<usize>) = (strands.iter().enumerate())
        .filter_map(|(i, strand)| Some((root(strand).filter(|p| p.is_finite())?, i)))
        .unzip();
    for (rank, i) in spread_order(&places).into_iter().enumerate() {
        let member = &mut members[whole[i as usize]];
        member.follower.bypass_change_detection().rank = Some(rank as u32);
    }
}

/// Replaces the guides. Followers whose guides all remain keep them, unless the level has changed:
/// then there may be nearer ones.
fn replace_guides(
    members: &mut [GroupStrand<'_>],
    strands: &[Ref<'_, Strand>],
    guides: &mut Guides,
    first_follower: u32,
    keep: bool,
) {
    let mut chosen: Vec<(u32, usize)> = (members.iter().enumerate())
        .filter_map(|(i, m)| Some((m.follower.rank.filter(|r| m.free && *r < first_follower)?, i)))
        .collect();
    chosen.sort_unstable();
    let before = core::mem::take(&mut guides.strands);
    guides.begin();
    let mut now = EntityHashMap::<u32>::default();
    for ((_, i), index) in chosen.into_iter().zip(0..) {
        let member = &mut members[i];
        member.follower.bypass_change_detection().guide = Some(index);
        guides.add(member.entity, &strands[i]);
        now.insert(member.entity, index);
    }
    let index_now: Vec<Option<u32>> = before.iter().map(|e| now.get(e).copied()).collect();
    for member in members {
        let offsets = &mut member.follower.bypass_change_detection().offsets;
        let stays = |(guide, _): &mut (u32, f32)| {
            let index = index_now.get(*guide as usize).copied().flatten();
            index.map(|index| *guide = index).is_some()
        };
        if !keep || !offsets.guides.iter_mut().all(stays) {
            *offsets = GuideOffsets::default();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        hair::strand::Hair,
        plugins::HairPlugins,
        simulation::lod::{HairLod, HairScreenShare, LodLevel},
    };
    use bevy::time::TimeUpdateStrategy;

    #[test]
    fn a_strand_that_is_let_go_changes_its_own_hair_only() {
        let mut app = App::new();
        app.add_plugins((MinimalPlugins, HairPlugins::default()))
            .insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
        app.update();
        let levels = vec![LodLevel { below: 0.5, strands: 0.25, ..default() }];
        let [own, other] = [0, 1].map(|_| {
            let lod = HairLod { levels: levels.clone(), ..default() };
            let hair = app.world_mut().spawn((Hair, lod, HairScreenShare(0.1))).id();
            let strands = [0.0, 0.01, 0.02, 0.03].map(|x| {
                let points = [0.0, -0.02, -0.04].map(|y| Vec3::new(x, y, 0.0));
                let strand = Strand::from_polyline(&points).unwrap();
                app.world_mut().spawn((StrandOf(hair), strand)).id()
            });
            (hair, strands)
        });
        app.world_mut()
            .entity_mut(own.1[2])
            .insert(HeldNodes { targets: vec![None, None, Some(Vec3::Y)], ..default() });
        app.update();
        app.update();
        // A value that only a new partition overwrites.
        for hair in [own.0, other.0] {
            app.world_mut().get_mut::<Guides>(hair).unwrap().level = 99;
        }
        app.world_mut().entity_mut(own.1[2]).remove::<HeldNodes>();
        app.update();
        let level = |hair| app.world().get::<Guides>(hair).unwrap().level;
        assert_eq!((level(own.0), level(other.0)), (1, 99));
    }
}

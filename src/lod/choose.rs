//! Which strands are simulated at a level, and the others' way after them.

use super::{
    PresentLod,
    follow::{Frame, GUIDES, StrandState, Ties},
    spread::spread_order,
};
use crate::{
    grid::KdTree,
    parallel::{Nanos, for_each},
    setting::Settings,
    strand::{Hair, HeldNodes, PerHair, Strand, StrandModel, StrandOf, StrandSleep, Strands},
};
use bevy::{
    ecs::entity::{EntityHashMap, EntityHashSet},
    prelude::*,
};

/// How many of the nearest guides are looked at for those that run most alike.
const CANDIDATES: usize = 8;

/// Where a smaller share of the strands is simulated, each of the others follows one.
const FEW: f32 = 0.125;

/// Guides that run as near as this count alike (m).
const ALIKE: f32 = 1e-3;

/// How a strand that is not simulated at its hair's level goes along with its guides, see
/// [`LodLevel::strands`](crate::LodLevel::strands). Kept by the tick.
#[derive(Component, Reflect, Clone, Debug, Default)]
#[reflect(Component, Default, Clone)]
pub struct Follower {
    /// Its place in the hair's even order, once that was asked for.
    rank: Option<u32>,
    /// Its index among the hair's guides.
    #[reflect(ignore)]
    guide: Option<u32>,
    #[reflect(ignore)]
    pub(super) ties: Ties,
    /// Where its root was when it came to lie still (m).
    pub(super) root: Vec3,
    /// Whether it was frozen and goes on in this tick.
    #[reflect(ignore)]
    pub(super) thaws: bool,
    /// Whether it sleeps because its guides do.
    pub(super) synced_asleep: bool,
}

/// The strands of a [`Hair`] that others are carried by. Kept by the tick.
#[derive(Component, Reflect, Clone, Debug, Default)]
#[reflect(Component, Default, Clone)]
pub struct Guides {
    /// In their even order.
    #[reflect(ignore)]
    pub(super) strands: Vec<Entity>,
    /// Where each one's frames begin in the list, and where the last one's end.
    #[reflect(ignore)]
    starts: Vec<u32>,
    /// Orientations of their edges as they were last seen.
    #[reflect(ignore)]
    turns: Vec<Quat>,
    /// Which may be followed, and which of them move.
    #[reflect(ignore)]
    usable: Vec<bool>,
    #[reflect(ignore)]
    pub(super) awake: Vec<bool>,
    level: usize,
    /// Whether any strand was frozen and goes on in this tick.
    #[reflect(ignore)]
    pub(super) thaws: bool,
    /// What the strands were told apart by: share that is simulated, level, number of strands.
    #[reflect(ignore)]
    told_apart: Option<(f32, usize, usize)>,
    /// How the hair's own frame has moved in this tick.
    #[reflect(ignore)]
    pub(super) frame: Frame,
}

impl Guides {
    pub(super) fn turns(&self, guide: u32) -> Option<&[Quat]> {
        let i = guide as usize;
        let (from, to) = (*self.starts.get(i)?, *self.starts.get(i + 1)?);
        self.turns.get(from as usize..to as usize).filter(|_| self.usable[i])
    }

    fn begin(&mut self) {
        self.strands.clear();
        self.turns.clear();
        self.usable.clear();
        self.awake.clear();
        self.starts.clear();
        self.starts.push(0);
    }

    fn add(&mut self, entity: Entity, strand: &Strand) {
        let seen = strand.orientations();
        self.strands.push(entity);
        self.turns.extend_from_slice(seen);
        self.starts.push(self.turns.len() as u32);
        self.usable.push(is_usable(seen));
        self.awake.push(true);
    }

    /// Sees where a guide is now.
    pub(super) fn see(&mut self, i: usize, strand: Option<&Strand>) {
        let (from, to) = (self.starts[i] as usize, self.starts[i + 1] as usize);
        let seen = strand.map_or(&[][..], Strand::orientations);
        self.usable[i] = seen.len() == to - from && is_usable(seen);
        if self.usable[i] {
            self.turns[from..to].copy_from_slice(seen);
        }
    }
}

fn is_usable(turns: &[Quat]) -> bool {
    turns.iter().all(|q| (0.5..2.0).contains(&q.length_squared()))
}

/// A hair whose strands are to be told apart.
struct Group<'a> {
    hair: Entity,
    share: f32,
    level: usize,
    /// Whether a strand is simulated only until it is whole again.
    mends: bool,
    members: Vec<Member<'a>>,
    strands: Vec<Ref<'a, Strand>>,
}

struct Member<'a> {
    entity: Entity,
    sleep: Mut<'a, StrandSleep>,
    carried: Mut<'a, Follower>,
    /// Whether it may be a guide or be carried: nothing holds it, and it is a strand at all.
    free: bool,
}

/// At the start of a tick: who is simulated, and who goes along with whom.
pub(crate) fn choose_guides(
    models: Settings<StrandModel>,
    touched: Query<&StrandOf, Or<(Changed<Strand>, Changed<HeldNodes>, Changed<StrandOf>)>>,
    mut let_go: RemovedComponents<HeldNodes>,
    mut hairs: Query<(Entity, &Strands, &mut PresentLod, &mut Guides), With<Hair>>,
    mut strands: Query<(
        Entity,
        &StrandOf,
        Ref<Strand>,
        &mut StrandSleep,
        &mut Follower,
        Option<&HeldNodes>,
    )>,
) {
    // Springs have no twist that a neighbour could follow.
    let share_of = |hair: Entity, present: &PresentLod| match models.of(hair) {
        StrandModel::Rod => present.share(),
        StrandModel::MassSpring => 1.0,
    };
    let concerns = |present: &PresentLod, guides: &Guides| {
        present.share() < 1.0 || present.carried > 0 || !guides.strands.is_empty()
    };
    // Hair whose strands nobody touched is told apart as before.
    let mut as_before = EntityHashSet::default();
    let any_let_go = let_go.read().count() > 0;
    let touched: EntityHashSet = touched.iter().map(|of| of.0).collect();
    let mut any = false;
    for (hair, members, present, mut guides) in &mut hairs {
        if !concerns(&present, &guides) {
            continue;
        }
        let told_apart = Some((share_of(hair, &present), present.level, members.len()));
        let guides = guides.bypass_change_detection();
        if guides.told_apart == told_apart && !any_let_go && !touched.contains(&hair) {
            as_before.insert(hair);
        } else {
            any = true;
        }
        guides.told_apart = told_apart;
    }
    if !any {
        return;
    }
    let mut groups = PerHair::default();
    for (entity, of, strand, sleep, carried, held) in &mut strands {
        let index = groups.index(of.0, || {
            let (hair, _, present, guides) = hairs.get(of.0).ok()?;
            let (members, strands) = default();
            let (share, level) = (share_of(hair, present), present.level);
            (concerns(present, guides) && !as_before.contains(&hair)).then_some(Group {
                hair,
                share,
                level,
                mends: false,
                members,
                strands,
            })
        });
        let Some(index) = index else { continue };
        let is_held = held.is_some_and(|held| held.targets.iter().any(Option::is_some));
        // What is not finite is mended by being simulated. Only others than the tick make it so.
        let is_whole = strand.nodes() >= 2 && (!strand.is_changed() || strand.is_finite());
        let free = is_whole && !is_held;
        let group: &mut Group<'_> = &mut groups.values[index];
        group.mends |= !is_whole && strand.nodes() >= 2;
        group.members.push(Member { entity, sleep, carried, free });
        group.strands.push(strand);
    }
    let mut counts = EntityHashMap::<usize>::default();
    for group in &mut groups.values {
        if let Ok((.., mut guides)) = hairs.get_mut(group.hair) {
            let guides = guides.bypass_change_detection();
            counts.insert(group.hair, part(group, guides));
            guides.told_apart = guides.told_apart.filter(|_| !group.mends);
        }
    }
    for (hair, _, mut present, mut guides) in &mut hairs {
        if as_before.contains(&hair) {
            continue;
        }
        let carried = counts.get(&hair).copied().unwrap_or(0);
        if present.carried != carried {
            present.carried = carried;
        }
        if !counts.contains_key(&hair) && !guides.strands.is_empty() {
            guides.bypass_change_detection().begin();
        }
    }
}

/// Parts a hair's strands into guides and carried ones; says how many are carried.
fn part(group: &mut Group<'_>, guides: &mut Guides) -> usize {
    let Group { share, level, members, strands, .. } = group;
    let mut ranks = Vec::new();
    if *share < 1.0 {
        rank(members, strands);
        ranks.extend(members.iter().filter(|m| m.free).filter_map(|m| m.carried.rank));
    }
    // The first so many of the free ones are guides; none of hair that is frozen.
    let wanted = match *share {
        share if share > 0.0 => ((share * ranks.len() as f32 - 1e-3).ceil() as usize).max(1),
        _ => 0,
    };
    // From this rank on they are carried.
    let first_carried =
        if wanted < ranks.len() { *ranks.select_nth_unstable(wanted).1 } else { u32::MAX };
    let mut same = guides.strands.len() == wanted && guides.level == *level;
    let mut count = 0;
    for (member, strand) in members.iter_mut().zip(strands.iter()) {
        let Member { entity, sleep, carried, free } = member;
        let (sleep, carried) = (sleep.bypass_change_detection(), carried.bypass_change_detection());
        let is_follower = *free && carried.rank.is_some_and(|rank| rank >= first_carried);
        let is_guide = *free && !is_follower && first_carried < u32::MAX;
        let guide = carried.guide.filter(|_| is_guide);
        same &= !is_guide || guide.is_some_and(|i| guides.strands.get(i as usize) == Some(entity));
        count += usize::from(is_follower);
        if !is_follower && sleep.is_follower() {
            // It goes on from where it is, as fast as it is.
            sleep.set_follower(false);
            carried.thaws = carried.ties.guides.is_empty();
            guides.thaws |= carried.thaws;
            if core::mem::take(&mut carried.synced_asleep) {
                sleep.wake_up();
            }
            carried.ties = Ties::default();
        }
        // Who was written to has been put somewhere: it stays there and goes on from there.
        if is_follower && (strand.is_changed() || !carried.ties.fit(strand.edges())) {
            carried.ties = Ties::default();
        }
        carried.guide = guide;
    }
    if count == 0 {
        guides.begin();
        return 0;
    }
    if !same {
        let keep = guides.level == *level;
        guides.level = *level;
        renew(members, strands, guides, first_carried, keep);
    }
    tie(members, strands, guides);
    count
}

/// Gives every strand its place in the even order, if one has none yet.
fn rank(members: &mut [Member<'_>], strands: &[Ref<'_, Strand>]) {
    if members.iter().all(|m| !m.free || m.carried.rank.is_some()) {
        return;
    }
    let root = |strand: &Strand| strand.positions().first().copied();
    let (places, whole): (Vec<Vec3>, Vec<usize>) = (strands.iter().enumerate())
        .filter_map(|(i, strand)| Some((root(strand).filter(|p| p.is_finite())?, i)))
        .unzip();
    for (rank, i) in spread_order(&places).into_iter().enumerate() {
        let member = &mut members[whole[i as usize]];
        member.carried.bypass_change_detection().rank = Some(rank as u32);
    }
}

/// Takes new guides. Strands whose guides stay go on with them, unless the level is another: then
/// there are nearer ones.
fn renew(
    members: &mut [Member<'_>],
    strands: &[Ref<'_, Strand>],
    guides: &mut Guides,
    first_carried: u32,
    keep: bool,
) {
    let mut chosen: Vec<(u32, usize)> = (members.iter().enumerate())
        .filter_map(|(i, m)| Some((m.carried.rank.filter(|r| m.free && *r < first_carried)?, i)))
        .collect();
    chosen.sort_unstable();
    let before = core::mem::take(&mut guides.strands);
    guides.begin();
    let mut now = EntityHashMap::<u32>::default();
    for ((_, i), index) in chosen.into_iter().zip(0..) {
        let member = &mut members[i];
        member.carried.bypass_change_detection().guide = Some(index);
        guides.add(member.entity, &strands[i]);
        now.insert(member.entity, index);
    }
    let index_now: Vec<Option<u32>> = before.iter().map(|e| now.get(e).copied()).collect();
    for member in members {
        let ties = &mut member.carried.bypass_change_detection().ties;
        let stays = |(guide, _): &mut (u32, f32)| {
            let index = index_now.get(*guide as usize).copied().flatten();
            index.map(|index| *guide = index).is_some()
        };
        if !keep || !ties.guides.iter_mut().all(stays) {
            *ties = Ties::default();
        }
    }
}

/// Ties those that are to be carried and hang on nobody to guides that are near and run alike.
fn tie(members: &mut [Member<'_>], strands: &[Ref<'_, Strand>], guides: &mut Guides) {
    let is_loose =
        |m: &Member<'_>| m.free && m.carried.guide.is_none() && m.carried.ties.guides.is_empty();
    if !members.iter().any(is_loose) {
        return;
    }
    if guides.strands.is_empty() {
        // Frozen: there is nobody to hang on.
        for member in members.iter_mut().filter(|m| is_loose(m) && !m.sleep.is_follower()) {
            member.sleep.bypass_change_detection().set_follower(true);
        }
        return;
    }
    let mut ahead: Vec<Option<&Strand>> = vec![None; guides.strands.len()];
    for (member, strand) in members.iter().zip(strands) {
        if let Some(place) = member.carried.guide.and_then(|i| ahead.get_mut(i as usize)) {
            *place = Some(strand);
        }
    }
    // Whoever was written to since the last tick is elsewhere now.
    ahead.iter().enumerate().for_each(|(i, strand)| guides.see(i, *strand));
    let guides = &*guides;
    // Where so few are simulated nobody sees that neighbours go alike.
    let most = if (guides.strands.len() as f32) < FEW * members.len() as f32 { 1 } else { GUIDES };
    let waypoints_of: Vec<[Vec3; 3]> =
        ahead.iter().map(|s| s.map_or([Vec3::ZERO; 3], waypoints)).collect();
    let nearest = KdTree::new(waypoints_of.iter().map(|c| c[0]).zip(0..));
    let mut loose: Vec<_> = (members.iter_mut())
        .zip(strands)
        .filter(|(m, _)| is_loose(m))
        .map(|(m, strand)| {
            m.sleep.bypass_change_detection().set_follower(true);
            (m.carried.bypass_change_detection(), &**strand)
        })
        .collect();
    for_each(&mut loose, Nanos(5_000), |(carried, strand)| {
        let own = waypoints(strand);
        let mut found: Vec<(f32, u32, StrandState<'_>)> = nearest
            .nearest::<CANDIDATES>(own[0])
            .filter_map(|(index, _)| {
                let i = index as usize;
                let guide = ahead[i]?;
                let apart = waypoints_of[i].iter().zip(own).map(|(a, b)| a.distance_squared(b));
                let turns = guides.turns(index)?;
                Some((apart.sum::<f32>() / 3.0, index, StrandState { turns, ..state_of(guide) }))
            })
            .collect();
        found.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        found.truncate(most);
        let weight = |apart: f32| 1.0 / (apart + ALIKE * ALIKE);
        let sum: f32 = found.iter().map(|f| weight(f.0)).sum();
        let guides = found.into_iter().map(|(apart, i, guide)| (i, weight(apart) / sum, guide));
        carried.ties = Ties::new(state_of(strand), guides);
        carried.root = own[0];
    });
}

fn state_of(strand: &Strand) -> StrandState<'_> {
    StrandState {
        positions: strand.positions(),
        velocities: strand.velocities(),
        turns: strand.orientations(),
        lengths: strand.rest_lengths(),
    }
}

/// Root, middle and tip: where a strand runs.
fn waypoints(strand: &Strand) -> [Vec3; 3] {
    let p = strand.positions();
    let last = p.len().saturating_sub(1);
    [0, last / 2, last].map(|i| p.get(i).copied().unwrap_or_default())
}

/// A strand that leaves its hair, or goes over to another, is simulated until it is chosen there.
pub(super) fn let_go(
    left: On<Discard, StrandOf>,
    mut strands: Query<(&mut StrandSleep, &mut Follower)>,
) {
    if let Ok((mut sleep, mut carried)) = strands.get_mut(left.entity) {
        if sleep.is_follower() {
            sleep.set_follower(false);
            sleep.wake_up();
        }
        *carried = Follower::default();
    }
}

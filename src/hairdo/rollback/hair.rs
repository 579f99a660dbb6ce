//! The state of one hair.

use super::{
    error::SnapshotError,
    framed::{HAIR, framed, unframed},
};
use crate::{
    base::{
        motion::TickMoment,
        tape::{Tape, hash},
    },
    forces::{
        contact::{HairReach, LockNeighbours, Obstacles},
        environment::{BlownAir, WindReceived},
    },
    hair::strand::{
        AddedMass, CutStrand, HeldNodes, HeldNodesState, MotionOwner, Settling, SleepCounts,
        SleepPose, Strand, StrandHistory, StrandSleep, Strands, TickPose,
    },
    hairdo::tie::TieProgress,
    keratin::{
        bond::{BondChanges, Bonds, RestShape},
        treatment::{Treatments, WindingProgress},
    },
    simulation::sleep::{Conditions, SleepSnapshot},
    water::{HoldsWater, Moisture},
};
use bevy::{
    ecs::{component::Mutable, query::QueryItem},
    prelude::*,
};

/// All of a hair's own state at the beginning of a tick, which decides every bit of what it does next, with the
/// [`HairWorldSnapshot`](crate::HairWorldSnapshot) of that tick. Taken and put back by
/// [`HairSnapshots`](crate::HairSnapshots).
///
/// Equal snapshots are equal to the bit. Untreated dry hair takes about 110 bytes a node, hair whose bonds differ 160, wet
/// hair 40 more.
#[derive(Reflect, Clone, Debug, Default, PartialEq, Eq)]
#[reflect(opaque)]
#[reflect(Default, Clone, Debug, PartialEq)]
pub struct HairSnapshot(Vec<u8>);

/// A hair, as a query reads it.
pub(super) type HairState = (
    Entity,
    Option<&'static Strands>,
    &'static MotionOwner,
    Has<Settling>,
    &'static mut TickPose,
    (
        Option<&'static mut SleepCounts>,
        Option<&'static mut SleepSnapshot>,
        Option<&'static mut HairReach>,
        Option<&'static mut LockNeighbours>,
        Option<&'static mut HoldsWater>,
        Option<&'static mut Obstacles>,
    ),
);

/// A strand, as a query reads it.
pub(super) type StrandState = (
    &'static mut Strand,
    &'static mut StrandHistory,
    &'static mut AddedMass,
    &'static mut StrandSleep,
    &'static mut SleepPose,
    (
        Option<&'static mut Bonds>,
        Option<&'static mut BondChanges>,
        Option<&'static mut RestShape>,
        Option<&'static mut Treatments>,
    ),
    (
        Option<&'static mut Moisture>,
        Option<&'static mut BlownAir>,
        Option<&'static mut WindReceived>,
    ),
    (
        Option<&'static mut HeldNodes>,
        Option<&'static mut HeldNodesState>,
        Option<&'static mut WindingProgress>,
        Option<&'static mut TieProgress>,
        Option<&'static CutStrand>,
    ),
);

/// The components of a strand.
struct StrandParts<'a> {
    strand: &'a mut Strand,
    history: Option<&'a mut StrandHistory>,
    added: &'a mut AddedMass,
    sleep: &'a mut StrandSleep,
    still: &'a mut SleepPose,
    bonds: Option<&'a mut Bonds>,
    changes: Option<&'a mut BondChanges>,
    rest: Option<&'a mut RestShape>,
    treatments: Option<&'a mut Treatments>,
    moisture: Option<&'a mut Moisture>,
    air: Option<&'a mut BlownAir>,
    received: Option<&'a mut WindReceived>,
    held: Option<&'a mut HeldNodes>,
    holding: Option<&'a mut HeldNodesState>,
    winding: Option<&'a mut WindingProgress>,
    tie: Option<&'a mut TieProgress>,
}

/// What is there, unmarked as changed: what was put back was not written from outside the tick.
fn seen<'a, T: Component<Mutability = Mutable>>(
    component: &'a mut Option<Mut<'_, T>>,
) -> Option<&'a mut T> {
    component.as_mut().map(Mut::bypass_change_detection)
}

impl<'a> StrandParts<'a> {
    fn of(item: &'a mut QueryItem<'_, '_, StrandState>) -> Self {
        let (strand, history, added, sleep, still, bonds, water, held) = item;
        Self {
            strand: strand.bypass_change_detection(),
            history: Some(history.bypass_change_detection()),
            added: added.bypass_change_detection(),
            sleep: sleep.bypass_change_detection(),
            still: still.bypass_change_detection(),
            bonds: seen(&mut bonds.0),
            changes: seen(&mut bonds.1),
            rest: seen(&mut bonds.2),
            treatments: seen(&mut bonds.3),
            moisture: seen(&mut water.0),
            air: seen(&mut water.1),
            received: seen(&mut water.2),
            held: seen(&mut held.0),
            holding: seen(&mut held.1),
            winding: seen(&mut held.2),
            tie: seen(&mut held.3),
        }
    }

    fn record(self, tape: &mut Tape<'_>) {
        self.strand.record(tape);
        if let (Tape::Read(_), Some(history)) = (&*tape, self.history) {
            history.remember(self.strand);
        }
        self.added.record(tape);
        self.sleep.record(tape);
        self.still.record(tape);
        part(tape, self.bonds, Bonds::record);
        part(tape, self.changes, BondChanges::record);
        part(tape, self.rest, RestShape::record);
        part(tape, self.treatments, Treatments::record);
        part(tape, self.moisture, Moisture::record);
        part(tape, self.air, BlownAir::record);
        part(tape, self.received, |received, tape| tape.list(&mut received.total));
        remnant(tape, self.held, HeldNodes::record);
        remnant(tape, self.holding, HeldNodesState::record);
        remnant(tape, self.winding, WindingProgress::record);
        remnant(tape, self.tie, TieProgress::record);
    }
}

/// A component that may be missing, then or now: that is as good as its default.
fn part<T: Default>(
    tape: &mut Tape<'_>,
    component: Option<&mut T>,
    record: impl FnOnce(&mut T, &mut Tape<'_>),
) {
    let mut was_there = component.is_some();
    tape.flags([&mut was_there]);
    match component {
        Some(component) if was_there => record(component, tape),
        Some(component) => *component = T::default(),
        None if was_there => record(&mut T::default(), tape),
        None => {}
    }
}

/// One that comes with a rod or a tie and stays when that is gone.
fn remnant<T: Default + PartialEq>(
    tape: &mut Tape<'_>,
    component: Option<&mut T>,
    record: impl FnOnce(&mut T, &mut Tape<'_>),
) {
    let writes = matches!(tape, Tape::Write(_));
    part(tape, component.filter(|is| !writes || **is != T::default()), record);
}

/// The components of a hair.
struct HairParts<'a> {
    pose: &'a mut TickPose,
    counts: Option<&'a mut SleepCounts>,
    sleep: Option<&'a mut SleepSnapshot>,
    reach: Option<&'a mut HairReach>,
    neighbours: Option<&'a mut LockNeighbours>,
    water: Option<&'a mut HoldsWater>,
    obstacles: Option<&'a mut Obstacles>,
}

impl HairParts<'_> {
    fn record(self, tape: &mut Tape<'_>, conditions: Option<Conditions>, tick: TickMoment) {
        self.pose.record(tape, tick);
        part(tape, self.counts, SleepCounts::record);
        part(tape, self.sleep, |sleep, tape| sleep.record(tape, conditions));
        part(tape, self.reach, HairReach::record);
        part(tape, self.neighbours, LockNeighbours::record);
        part(tape, self.water, |water, tape| tape.flags([&mut water.0]));
        part(tape, self.obstacles, Obstacles::record);
    }
}

/// A hair with its strands.
struct Whole<'a, 'w, 's> {
    members: &'a [Entity],
    parts: HairParts<'a>,
    strands: &'a mut Query<'w, 's, StrandState>,
}

impl Whole<'_, '_, '_> {
    fn record(self, tape: &mut Tape<'_>, conditions: Conditions, tick: TickMoment) {
        self.parts.record(tape, Some(conditions), tick);
        let mut strands = self.strands.iter_many_mut(self.members);
        while let Some(mut item) = strands.fetch_next() {
            StrandParts::of(&mut item).record(tape);
            // Taken before its first tick, in which strands are repaired and get bonds.
            if let (strand, .., (Some(bonds), ..), _, _) = &mut item
                && bonds.joints.len() != strand.edges()
            {
                strand.set_changed();
                bonds.set_changed();
            }
        }
    }

    /// How many nodes each strand has, and where it is cut.
    fn ends(&self) -> impl Iterator<Item = [u32; 2]> {
        self.strands.iter_many(self.members).map(|(strand, .., held)| {
            let cut = held.4.filter(|cut| cut.fits(strand.nodes()));
            [strand.nodes() as u32, cut.map_or(0, |cut| cut.end.to_bits())]
        })
    }
}

/// Calls `work` with a hair that can be taken or put back.
fn with_whole<T>(
    item: QueryItem<'_, '_, HairState>,
    strands: &mut Query<'_, '_, StrandState>,
    work: impl FnOnce(Whole<'_, '_, '_>) -> Result<T, SnapshotError>,
) -> Result<T, SnapshotError> {
    let (entity, members, owner, settles, mut pose, mut others) = item;
    let members = members.map_or(&[][..], |members| members.collection());
    if owner.is_on_gpu() {
        return Err(SnapshotError::OnGpu { entity });
    }
    if settles {
        return Err(SnapshotError::Settles { entity });
    }
    if strands.iter_many(members).any(|(_, _, _, sleep, ..)| sleep.is_follower()) {
        return Err(SnapshotError::Follows { entity });
    }
    let parts = HairParts {
        pose: pose.bypass_change_detection(),
        counts: seen(&mut others.0),
        sleep: seen(&mut others.1),
        reach: seen(&mut others.2),
        neighbours: seen(&mut others.3),
        water: seen(&mut others.4),
        obstacles: seen(&mut others.5),
    };
    work(Whole { members, parts, strands })
}

impl HairSnapshot {
    /// The snapshot as bytes, for the network or a file.
    pub fn to_bytes(&self) -> Vec<u8> {
        framed(HAIR, &self.0)
    }

    /// The snapshot of these bytes.
    ///
    /// # Errors
    /// When they are not those of a snapshot of this version, or damaged.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, SnapshotError> {
        let state = unframed(HAIR, bytes)?;
        (state.is_empty() || is_whole(state))
            .then(|| Self(state.to_vec()))
            .ok_or(SnapshotError::Damaged)
    }

    /// A hash of 64 bits: of equal states the same, on every machine.
    pub fn hash(&self) -> u64 {
        hash(&self.0)
    }

    /// How many bytes it holds.
    pub fn size(&self) -> usize {
        self.0.len()
    }

    pub(super) fn clear(&mut self) {
        self.0.clear();
    }

    pub(super) fn take(
        &mut self,
        hair: QueryItem<'_, '_, HairState>,
        strands: &mut Query<'_, '_, StrandState>,
        conditions: Conditions,
        tick: TickMoment,
    ) -> Result<(), SnapshotError> {
        with_whole(hair, strands, |whole| {
            let mut tape = Tape::Write(&mut self.0);
            tape.count(whole.ends().count(), 0);
            whole.ends().for_each(|mut end| tape.value(&mut end));
            whole.record(&mut tape, conditions, tick);
            Ok(())
        })
    }

    pub(super) fn restore(
        &self,
        hair: QueryItem<'_, '_, HairState>,
        strands: &mut Query<'_, '_, StrandState>,
        conditions: Conditions,
        tick: TickMoment,
    ) -> Result<(), SnapshotError> {
        with_whole(hair, strands, |whole| {
            let mut tape = Tape::of(&self.0);
            let own = own_ends(&mut tape);
            let (found, expected) = (own.len(), whole.ends().count());
            if found != expected {
                return Err(SnapshotError::Strands { found, expected });
            }
            let ends = own.zip(whole.ends()).enumerate();
            let other = ends.into_iter().find(|(_, (then, now))| then != now);
            if let Some((strand, (then, now))) = other {
                let [found, expected] = [then[0] as usize, now[0] as usize];
                return Err(match then[1] == now[1] {
                    true => SnapshotError::Nodes { strand, found, expected },
                    false => SnapshotError::Cut { strand },
                });
            }
            whole.record(&mut tape, conditions, tick);
            Ok(())
        })
    }
}

/// The strands' numbers of nodes and cuts that a snapshot begins with; leaves the tape after them.
fn own_ends<'a>(tape: &mut Tape<'a>) -> impl ExactSizeIterator<Item = [u32; 2]> + use<'a> {
    let count = tape.count(0, size_of::<[u32; 2]>());
    let ends = tape.next(count * size_of::<[u32; 2]>()).unwrap_or_default();
    ends.as_chunks::<8>().0.iter().map(|end| bytemuck::pod_read_unaligned(end))
}

/// Whether a state has all its parts, of lengths that belong together.
fn is_whole(state: &[u8]) -> bool {
    let mut tape = Tape::of(state);
    let ends = own_ends(&mut tape);
    let (mut pose, mut counts, mut reach) = (TickPose::default(), default(), default());
    let (mut sleep, mut neighbours, mut water) = (default(), LockNeighbours::default(), default());
    let mut obstacles = Obstacles::default();
    let hair = HairParts {
        pose: &mut pose,
        counts: Some(&mut counts),
        sleep: Some(&mut sleep),
        reach: Some(&mut reach),
        neighbours: Some(&mut neighbours),
        water: Some(&mut water),
        obstacles: Some(&mut obstacles),
    };
    hair.record(&mut tape, None, TickMoment::default());
    for [nodes, _] in ends {
        let (mut strand, mut added, mut sleep, mut still) =
            (Strand::default(), default(), default(), default());
        let (mut bonds, mut changes, mut rest, mut treatments) =
            (default(), default(), default(), default());
        let (mut moisture, mut air, mut received) = (Moisture::default(), default(), default());
        let (mut held, mut holding, mut winding, mut tie) =
            (default(), default(), default(), default());
        let parts = StrandParts {
            strand: &mut strand,
            history: None,
            added: &mut added,
            sleep: &mut sleep,
            still: &mut still,
            bonds: Some(&mut bonds),
            changes: Some(&mut changes),
            rest: Some(&mut rest),
            treatments: Some(&mut treatments),
            moisture: Some(&mut moisture),
            air: Some(&mut air),
            received: Some(&mut received),
            held: Some(&mut held),
            holding: Some(&mut holding),
            winding: Some(&mut winding),
            tie: Some(&mut tie),
        };
        parts.record(&mut tape);
        if !tape.is_whole() || !strand.has_nodes(nodes as usize) || !moisture.is_even() {
            return false;
        }
    }
    tape.is_at_end()
}

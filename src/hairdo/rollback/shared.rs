//! What the hairs of a world share.

use super::{
    error::SnapshotError,
    framed::{WORLD, framed, unframed},
};
use crate::{
    base::{
        motion::WorldMotion,
        tape::{Tape, hash},
    },
    forces::environment::WindTravel,
    hair::strand::{Hair, TickPose},
    water::{Droplet, FoundWater, Shower, WaterField, WaterLedger},
};
use bevy::{
    ecs::{component::Mutable, query::QueryFilter, system::SystemParam},
    prelude::*,
};

/// What the hairs of a world share at the beginning of a tick: droplets and showers, the balance of water, how far the
/// wind has travelled, and where colliders, blowers and other tools were. Taken and put back by
/// [`HairSnapshots`](crate::HairSnapshots).
///
/// It names strands and tools by their entities: bytes are of use in the world that they were taken in, or in one with the
/// same entities. About 90 bytes a droplet, 400 a collider.
#[derive(Reflect, Clone, Debug, Default, PartialEq, Eq)]
#[reflect(opaque)]
#[reflect(Default, Clone, Debug, PartialEq)]
pub struct HairWorldSnapshot(Vec<u8>);

/// What is shared.
#[derive(SystemParam)]
pub(super) struct SharedState<'w, 's> {
    commands: Commands<'w, 's>,
    wind: Option<ResMut<'w, WindTravel>>,
    ledger: Option<ResMut<'w, WaterLedger>>,
    found: Option<ResMut<'w, FoundWater>>,
    field: Option<ResMut<'w, WaterField>>,
    droplets: Query<'w, 's, (Entity, &'static mut Droplet)>,
    showers: Query<'w, 's, (Entity, &'static mut Shower)>,
    poses: Query<'w, 's, (Entity, &'static mut TickPose), Without<Hair>>,
}

impl SharedState<'_, '_> {
    /// Hair was put back, perhaps without what all hair shares: the next tick balances the water.
    pub(super) fn hair_was_restored(&mut self) {
        if let Some(found) = &mut self.found {
            found.bypass_change_detection().is_restored = true;
        }
    }
}

impl HairWorldSnapshot {
    /// The snapshot as bytes, for a file or another process of the same world.
    pub fn to_bytes(&self) -> Vec<u8> {
        framed(WORLD, &self.0)
    }

    /// The snapshot of these bytes.
    ///
    /// # Errors
    /// When they are not those of a snapshot of this version, or damaged.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, SnapshotError> {
        Ok(Self(unframed(WORLD, bytes)?.to_vec()))
    }

    /// A hash of 64 bits: of equal states the same.
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

    pub(super) fn take(&mut self, shared: &mut SharedState<'_, '_>, motion: &mut WorldMotion) {
        shared.record(&mut Tape::Write(&mut self.0), motion);
    }

    pub(super) fn restore(&self, shared: &mut SharedState<'_, '_>, motion: &mut WorldMotion) {
        if !self.0.is_empty() {
            shared.record(&mut Tape::of(&self.0), motion);
        }
    }
}

/// A resource of a plugin that may be missing.
fn part<T: Resource<Mutability = Mutable> + Default>(
    tape: &mut Tape<'_>,
    resource: &mut Option<ResMut<'_, T>>,
    record: impl FnOnce(&mut T, &mut Tape<'_>),
) {
    let mut was_there = resource.is_some();
    tape.flags([&mut was_there]);
    match resource {
        Some(resource) if was_there => record(resource.bypass_change_detection(), tape),
        None if was_there => record(&mut T::default(), tape),
        _ => {}
    }
}

/// A component of entities, each with its name: put back where it still is.
fn of_entities<T: Component<Mutability = Mutable> + Default, F: QueryFilter>(
    tape: &mut Tape<'_>,
    entities: &mut Query<'_, '_, (Entity, &mut T), F>,
    record: impl Fn(&mut T, &mut Tape<'_>),
) {
    let count = tape.count(entities.iter().count(), size_of::<u64>());
    if let Tape::Write(_) = tape {
        for (mut entity, mut component) in entities {
            tape.entity(&mut entity);
            record(component.bypass_change_detection(), tape);
        }
        return;
    }
    for _ in 0..count {
        let mut entity = Entity::PLACEHOLDER;
        tape.entity(&mut entity);
        match entities.get_mut(entity) {
            Ok((_, mut component)) => record(component.bypass_change_detection(), tape),
            Err(_) => record(&mut T::default(), tape),
        }
    }
}

impl SharedState<'_, '_> {
    fn record(&mut self, tape: &mut Tape<'_>, motion: &mut WorldMotion) {
        part(tape, &mut self.wind, |wind, tape| tape.value(&mut wind.0));
        part(tape, &mut self.ledger, WaterLedger::on_tape);
        part(tape, &mut self.found, FoundWater::record);
        part(tape, &mut self.field, WaterField::record);
        motion.record(tape);
        let tick = motion.moment();
        of_entities(tape, &mut self.poses, |pose, tape| pose.record(tape, tick));
        of_entities(tape, &mut self.showers, Shower::record);
        self.record_droplets(tape);
    }

    /// Droplets one after the other: those that are there become those that were.
    fn record_droplets(&mut self, tape: &mut Tape<'_>) {
        let mut left = tape.count(self.droplets.iter().count(), size_of::<Vec3>());
        for (entity, mut drop) in &mut self.droplets {
            let drop = drop.bypass_change_detection();
            if left > 0 {
                drop.record(tape);
                left -= 1;
            } else {
                // The balance is that of the snapshot.
                drop.forget();
                self.commands.entity(entity).despawn();
            }
        }
        for _ in 0..left {
            let mut drop = Droplet::default();
            drop.record(tape);
            self.commands.spawn(drop);
        }
    }
}

//! Strands that are no followers any more for other reasons than their hair's level.

use super::guides::Follower;
use crate::hair::strand::{KinematicStrand, Strand, StrandHistory, StrandOf, StrandSleep};
use bevy::prelude::*;

/// A strand that leaves its hair or moves to another is simulated until a level is chosen there.
pub(super) fn release_follower(
    left: On<Discard, StrandOf>,
    mut strands: Query<(Released, &mut Follower)>,
    mut commands: Commands,
) {
    if let Ok((strand, mut follower)) = strands.get_mut(left.entity) {
        release(left.entity, strand, &mut commands);
        *follower = Follower::default();
    }
}

/// A strand whose `Follower` was removed is simulated until it has guides again.
pub(super) fn release_without_follower(
    left: On<Remove, Follower>,
    mut strands: Query<Released>,
    mut commands: Commands,
) {
    if let Ok(strand) = strands.get_mut(left.entity) {
        release(left.entity, strand, &mut commands);
    }
}

/// What changes on a strand that is no follower any more.
type Released = (&'static mut StrandSleep, &'static Strand, &'static mut StrandHistory);

fn release(
    entity: Entity,
    (mut sleep, strand, mut history): (Mut<'_, StrandSleep>, &Strand, Mut<'_, StrandHistory>),
    commands: &mut Commands,
) {
    if sleep.is_follower() {
        sleep.set_follower(false);
        sleep.wake_up();
        history.bypass_change_detection().remember(strand);
        commands.entity(entity).try_remove::<KinematicStrand>();
    }
}

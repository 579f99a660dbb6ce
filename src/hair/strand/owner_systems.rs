//! Who moves a hair is decided here, but for hair that the GPU takes or returns, and asked for by these filters.

use super::{
    Hair, KinematicStrand, MotionOwner, OnGpu, PlayedHair, Settling, SleepCounts, Strands, TickPose,
};
use bevy::prelude::*;

/// Filters of hair whose state is here, and of hair whose state is on the GPU.
pub(crate) type HairHere = (With<Hair>, Without<OnGpu>);
#[cfg(feature = "gpu")]
pub(crate) type HairOnGpu = (With<Hair>, With<OnGpu>);

/// Filter of strands whose state is here.
pub(crate) type Here = Without<OnGpu>;

/// Filter of strands that the solver moves here, if they are awake.
pub(crate) type SimulatedHere = (Without<KinematicStrand>, Here);

/// Filter of strands that follow guides here, or are frozen.
pub(crate) type FollowsHere = (With<KinematicStrand>, Here);

/// Whether the present state of a hair is on the GPU.
#[cfg(feature = "save")]
pub(crate) fn is_on_gpu(world: &World, hair: Entity) -> bool {
    world.get::<MotionOwner>(hair).is_some_and(|owner| owner.is_on_gpu())
}

/// What decides who moves a hair.
type Facts = (
    &'static mut MotionOwner,
    (Has<OnGpu>, Has<PlayedHair>),
    Has<Settling>,
    Option<&'static SleepCounts>,
    Option<&'static Strands>,
    &'static TickPose,
);

/// Once a tick, after sleep has been decided.
pub(super) fn update_owners(mut hairs: Query<Facts, With<Hair>>) {
    for (mut owner, (on_gpu, is_played), settles, sleepers, members, pose) in &mut hairs {
        let rests = pose.waits() || sleepers.is_some_and(|s| s.awake == 0 && members.is_some());
        let sleeps = sleepers.is_some_and(SleepCounts::all);
        owner.set_if_neq(match (on_gpu, settles) {
            (true, _) if sleeps => MotionOwner::AsleepOnGpu,
            (true, _) => MotionOwner::Gpu,
            _ if is_played => MotionOwner::Played,
            (_, true) => MotionOwner::Settling,
            _ if sleeps => MotionOwner::Asleep,
            _ if rests => MotionOwner::Frozen,
            _ => MotionOwner::Simulated,
        });
    }
}

/// Hair that is to settle is not drawn from then on, even before the next tick.
pub(super) fn begin_settling(
    added: On<Add, (Settling, MotionOwner)>,
    mut hairs: Query<&mut MotionOwner, (With<Settling>, Without<OnGpu>)>,
) {
    if let Ok(mut owner) = hairs.get_mut(added.entity) {
        owner.set_if_neq(MotionOwner::Settling);
    }
}

/// Hair that has settled is drawn from then on.
pub(super) fn end_settling(
    left: On<Remove, Settling>,
    mut hairs: Query<&mut MotionOwner, Without<OnGpu>>,
) {
    if let Ok(mut owner) = hairs.get_mut(left.entity) {
        owner.set_if_neq(MotionOwner::Simulated);
    }
}

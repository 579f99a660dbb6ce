//! What would wake hair on the GPU, where it sleeps as a whole.

use super::{
    SleepSettings,
    systems::{RestSettings, SeenCollider, SleepSnapshot, WakeEvents},
};
use crate::{
    base::schedule::{HairStep, HairSystems, HairTick, first_substep},
    forces::{
        contact::{HairReach, Obstacles, TickColliders},
        environment::Winds,
    },
    hair::strand::{HairOnGpu, Regroomed, TickPose},
    solver::rod::obstacle::Solid,
};
use bevy::prelude::*;

/// What disturbs a hair on the GPU in this tick.
#[derive(Component, Clone, Debug, Default)]
#[component(clone_behavior = Ignore)]
pub(crate) struct Disturbance {
    pub(crate) sleep: SleepSettings,
    is_disturbed: bool,
    /// Colliders that appeared, disappeared or moved, with the distance within which they may act (m).
    solids: Vec<(Solid, f32)>,
}

impl Disturbance {
    /// Whether it disturbs hair in the box with these corners.
    pub(crate) fn acts_within(&self, low: Vec3, high: Vec3) -> bool {
        let acts = |(solid, reach): &(Solid, f32)| {
            !reach.is_finite() || solid.may_reach(low, high, *reach)
        };
        self.is_disturbed || self.solids.iter().any(acts)
    }
}

/// Part of the feature `gpu`.
pub(crate) fn watch_on_gpu(app: &mut App) {
    app.init_resource::<TickColliders>()
        .add_systems(HairTick, watch.in_set(HairSystems::Sleep).run_if(first_substep));
}

/// Once a tick.
fn watch(
    step: Res<HairStep>,
    settings: RestSettings,
    colliders: Res<TickColliders>,
    winds: Winds,
    mut hairs: Query<
        (
            Entity,
            &TickPose,
            &mut SleepSnapshot,
            &mut Disturbance,
            &Regroomed,
            (Option<&HairReach>, Option<&Obstacles>),
        ),
        HairOnGpu,
    >,
) {
    let mut scratch = Vec::new();
    for (hair, frame, mut snapshot, mut disturbance, regroomed, (reach, obstacles)) in &mut hairs {
        let near = colliders.near(frame, reach, &mut scratch);
        let seen = near.map(|placed| SeenCollider::of(frame, obstacles, placed)).collect();
        let WakeEvents { sleep, all_wake, solids, .. } = snapshot
            .bypass_change_detection()
            .wake_events(settings.of(hair), frame.now(), regroomed.members, seen, step.count);
        // Wind that reaches none of its strands keeps it awake as well.
        let air = winds.seen_from(frame);
        let is_blown = air.steady_wind() != Some(Vec3::ZERO)
            || air.blowers.iter().any(|seen| seen.blower.strength != 0.0);
        *disturbance.bypass_change_detection() =
            Disturbance { sleep, is_disturbed: all_wake || is_blown, solids };
    }
}

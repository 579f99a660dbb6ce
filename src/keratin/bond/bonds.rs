//! A strand's bonds, and requested changes of them.

use super::{kind::BondKind, model::JointBonds};
use crate::{
    base::{parallel::prefetch, tape::Tape},
    hair::strand::Strand,
};
use bevy::prelude::*;

/// The bonds of a strand: one [`JointBonds`] a joint, joint i at node i, joint 0 at the scalp.
///
/// Spawned empty it is filled in the next tick with closed bonds around the strand's present shape.
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct Bonds {
    /// The joints, root first; as many as the strand has edges.
    pub joints: Vec<JointBonds>,
}

impl Bonds {
    /// Closed bonds around the strand's present shape.
    pub fn of(strand: &Strand) -> Self {
        let joints =
            (0..strand.edges()).map(|i| JointBonds::closed(strand.darboux(i).xyz())).collect();
        Self { joints }
    }

    /// Bonds that are all closed around one shape take a fifth.
    pub(crate) fn record(&mut self, tape: &mut Tape<'_>) {
        let bits = |shape: &Vec3| shape.to_array().map(f32::to_bits);
        let is_plain = |joint: &JointBonds| {
            joint.rates == [1.0; BondKind::COUNT]
                && joint.shapes.iter().all(|shape| bits(shape) == bits(&joint.shapes[0]))
        };
        let mut are_plain = self.joints.iter().all(is_plain);
        tape.flags([&mut are_plain]);
        if !are_plain {
            tape.list(&mut self.joints);
            return;
        }
        let count = tape.count(self.joints.len(), size_of::<Vec3>());
        self.joints.resize(count, JointBonds::default());
        for joint in &mut self.joints {
            tape.value(&mut joint.shapes[0]);
            *joint = JointBonds::closed(joint.shapes[0]);
        }
    }

    /// Resizes to the strand's joints: kept joints, counted from the root, stay unchanged; new ones are
    /// closed around the present shape.
    pub(super) fn fit(&mut self, strand: &Strand) {
        let new = Self::of(strand).joints.into_iter().skip(self.joints.len());
        self.joints.extend(new);
        self.joints.truncate(strand.edges());
    }

    /// The rates of one kind, root first.
    pub fn rates(&self, kind: BondKind) -> impl Iterator<Item = f32> + '_ {
        self.joints.iter().map(move |j| j.rates[kind as usize])
    }
}

/// Requested changes of a strand's rates: Δb per joint and kind, summed over all requests of
/// `ExternalForces`, applied by `BondUpdate` through equation 16.
#[derive(Component, Reflect, Clone, Debug, Default)]
#[reflect(Component, Default, Clone)]
pub struct BondChanges {
    /// Δb per joint; empty without requests.
    #[reflect(ignore)]
    joints: Vec<[f32; BondKind::COUNT]>,
    #[reflect(ignore)]
    any: bool,
    /// Whether they wake a strand that sleeps.
    #[reflect(ignore)]
    wake: bool,
}

/// More joints than any strand has; requests beyond are ignored.
const MAX_JOINTS: usize = 1 << 16;

/// More than any rate can change by.
const MAX_CHANGE: f32 = 1e6;

impl BondChanges {
    /// Requests a change of `kind` at `joint`. Requests beyond the strand's joints and non-finite
    /// ones are ignored; peptide bonds are never cut.
    #[inline]
    pub fn request(&mut self, joint: usize, kind: BondKind, change: f32) {
        self.wake |= self.request_quietly(joint, kind, change);
    }

    /// The same of a change too small to wake a strand that sleeps. Returns whether it is not ignored.
    #[inline]
    pub(crate) fn request_quietly(&mut self, joint: usize, kind: BondKind, change: f32) -> bool {
        if change == 0.0 || !change.is_finite() || (kind == BondKind::Peptide && change < 0.0) {
            return false;
        }
        if joint >= self.joints.len() {
            // The strand's number of joints is not known here; no strand has more than this.
            if joint >= MAX_JOINTS {
                return false;
            }
            self.joints.resize(joint + 1, [0.0; BondKind::COUNT]);
        }
        let sum = &mut self.joints[joint][kind as usize];
        // The sum of two huge requests must stay finite.
        *sum = (*sum + change).clamp(-MAX_CHANGE, MAX_CHANGE);
        self.any = true;
        true
    }

    pub(crate) fn record(&mut self, tape: &mut Tape<'_>) {
        tape.flags([&mut self.any, &mut self.wake]);
        if self.any {
            tape.list(&mut self.joints);
        } else {
            self.joints.fill([0.0; BondKind::COUNT]);
        }
    }

    /// Whether nothing was requested.
    pub fn is_empty(&self) -> bool {
        !self.any
    }

    /// Whether what was requested wakes a strand that sleeps.
    pub(super) fn wake(&self) -> bool {
        self.wake
    }

    /// Prefetches the requests.
    pub(crate) fn prefetch(&self) {
        prefetch(&self.joints);
    }

    /// The requested change of each joint, root first.
    pub(super) fn requested(&self) -> &[[f32; BondKind::COUNT]] {
        &self.joints
    }

    /// Clears all requests, and frees memory for joints beyond the strand's `edges`.
    pub(super) fn clear(&mut self, edges: usize) {
        (self.any, self.wake) = (false, false);
        if self.joints.len() > edges {
            self.joints.truncate(edges);
            self.joints.shrink_to_fit();
        }
        self.joints.fill([0.0; BondKind::COUNT]);
    }
}

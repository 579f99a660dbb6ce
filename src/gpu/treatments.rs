//! Treatments of hair on the GPU: their clocks run here, their bonds are there.

use super::record::{MOST_TREATMENTS, SubstepRecord, TreatmentRecord};
use crate::keratin::{bond::BondKind, treatment::HairTreatment};
use bevy::prelude::*;

/// The treatments that act on a hair as a whole, on the hair's entity.
#[derive(Component, Clone, Debug, Default)]
#[component(clone_behavior = Ignore)]
pub(super) struct GpuTreatments {
    acting: Vec<HairTreatment>,
    /// What they did since the last record: of all joints, and range by range.
    whole: Affine,
    ranges: Vec<(core::ops::Range<u32>, Affine)>,
}

/// Rates b become retained · b + add, kind by kind.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Affine {
    retained: [f32; BondKind::COUNT],
    add: [f32; BondKind::COUNT],
}

impl Default for Affine {
    fn default() -> Self {
        Self { retained: [1.0; BondKind::COUNT], add: [0.0; BondKind::COUNT] }
    }
}

impl Affine {
    /// After a substep in which treatments with the sums of their `shares` took rates some of the way.
    fn then(&mut self, shares: [f32; BondKind::COUNT], adds: [f32; BondKind::COUNT]) {
        for kind in 0..BondKind::COUNT {
            let left = 1.0 - shares[kind];
            self.retained[kind] *= left;
            self.add[kind] = self.add[kind] * left + adds[kind];
        }
    }

    fn share(&self) -> [f32; BondKind::COUNT] {
        self.retained.map(|retained| 1.0 - retained)
    }
}

impl GpuTreatments {
    pub(super) fn new(acting: Vec<HairTreatment>) -> Self {
        Self { acting, ..default() }
    }

    pub(super) fn push(&mut self, treatment: HairTreatment) {
        self.acting.push(treatment);
    }

    pub(super) fn into_acting(self) -> Vec<HairTreatment> {
        self.acting
    }

    /// Whether any acts.
    pub(super) fn act(&self) -> bool {
        !self.acting.is_empty() || self.whole != Affine::default() || !self.ranges.is_empty()
    }

    /// Whether there are more ranges of joints than a record holds.
    pub(super) fn are_too_many(&self) -> bool {
        self.acting.iter().filter(|treat| treat.joints.is_some()).count() > MOST_TREATMENTS
    }

    /// A substep of `dt` (s) of the bonds' own time. Rust twin: treatment::systems, apply_treatments.
    pub(super) fn step(&mut self, dt: f32) {
        let zero = [0.0; BondKind::COUNT];
        let mut whole = (zero, zero);
        for treat in &mut self.acting {
            if treat.delay > 0.5 * dt {
                treat.delay -= dt;
                continue;
            }
            let part = if treat.seconds > dt { dt / treat.seconds } else { 1.0 };
            let (mut shares, mut adds) = (zero, zero);
            for (kind, to) in treat.rates.iter().enumerate() {
                if let Some(to) = to {
                    (shares[kind], adds[kind]) = (part, to * part);
                }
            }
            match &treat.joints {
                None => {
                    for kind in 0..BondKind::COUNT {
                        whole.0[kind] += shares[kind];
                        whole.1[kind] += adds[kind];
                    }
                }
                Some(joints) => {
                    let joint = |joint: usize| u32::try_from(joint).unwrap_or(u32::MAX);
                    let range = joint(joints.start)..joint(joints.end);
                    let known = self.ranges.iter_mut().find(|(known, _)| *known == range);
                    match known {
                        Some((_, affine)) => affine.then(shares, adds),
                        None => {
                            let mut affine = Affine::default();
                            affine.then(shares, adds);
                            self.ranges.push((range, affine));
                        }
                    }
                }
            }
            treat.seconds -= dt;
            treat.delay = 0.0;
        }
        if whole.0 != zero {
            self.whole.then(whole.0, whole.1);
        }
        self.acting.retain(|treat| treat.delay > 0.0 || treat.seconds > 0.0);
    }

    /// What they did, into a record. Ranges beyond what that holds stay for the next one.
    pub(super) fn write(&mut self, record: &mut SubstepRecord) {
        let whole = core::mem::take(&mut self.whole);
        (record.change, record.share) = (whole.add, whole.share());
        let count = self.ranges.len().min(MOST_TREATMENTS);
        let ranges = self.ranges.drain(..count).map(|(joints, affine)| TreatmentRecord {
            change: affine.add,
            share: affine.share(),
            joints,
        });
        record.treatments.extend(ranges);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As `apply_treatments` and eq 16 move a rate, substep by substep.
    fn alone(mut rate: f32, mut treats: Vec<HairTreatment>, kind: usize, dt: f32, n: usize) -> f32 {
        for _ in 0..n {
            let mut asked = 0.0;
            for treat in &mut treats {
                if treat.delay > 0.5 * dt {
                    treat.delay -= dt;
                    continue;
                }
                let share = if treat.seconds > dt { dt / treat.seconds } else { 1.0 };
                asked += treat.rates[kind].map_or(0.0, |to| (to - rate) * share);
                treat.seconds -= dt;
                treat.delay = 0.0;
            }
            treats.retain(|treat| treat.delay > 0.0 || treat.seconds > 0.0);
            rate = (rate + asked).clamp(0.0, 1.0);
        }
        rate
    }

    #[test]
    fn records_of_merged_substeps_move_rates_as_every_substep_does() {
        let hair = Entity::PLACEHOLDER;
        let dt = 1.0 / 360.0;
        let treats = vec![
            HairTreatment::wet(hair).over(0.05),
            HairTreatment::lotion(hair),
            HairTreatment::dry(hair).over(0.1).after(0.08),
        ];
        let mut on = GpuTreatments::new(treats.clone());
        let mut rates = [0.9; 4];
        for substep in 1..=90 {
            on.step(dt);
            if substep % 3 == 0 {
                let mut record = SubstepRecord::default();
                on.write(&mut record);
                for (kind, rate) in rates.iter_mut().enumerate() {
                    let change = record.change[kind] - *rate * record.share[kind];
                    *rate = (*rate + change).clamp(0.0, 1.0);
                    let expected = alone(0.9, treats.clone(), kind, dt, substep);
                    assert!((*rate - expected).abs() < 1e-5, "{substep}, {kind}");
                }
            }
        }
        assert!(on.into_acting().is_empty() && rates[0] > 0.99 && (rates[2] - 0.8).abs() < 1e-6);
    }

    #[test]
    fn ranges_beyond_what_a_record_holds_are_in_the_next_one() {
        let mut on = GpuTreatments::default();
        // One after the other, so that never more than one acts.
        for joint in 0..MOST_TREATMENTS + 3 {
            on.push(HairTreatment {
                joints: Some(joint..joint + 1),
                ..HairTreatment::dry(Entity::PLACEHOLDER)
            });
            on.step(1e9);
            assert!(!on.are_too_many());
        }
        let mut treated = Vec::new();
        while on.act() {
            let mut record = SubstepRecord::default();
            on.write(&mut record);
            assert!(record.treatments.len() <= MOST_TREATMENTS);
            treated.extend(record.treatments.iter().map(|treat| treat.joints.start as usize));
        }
        assert_eq!(treated, Vec::from_iter(0..MOST_TREATMENTS + 3));
    }
}

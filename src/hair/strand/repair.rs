//! Repair of strands written by reflection: inspectors and scene files can write private fields.

use super::{AddedMass, MAX_SEGMENT, MIN_SEGMENT, Strand, StrandHistory};
use crate::solver::rod::frame::parallel_transport;
use bevy::prelude::*;

/// Rest length used where the stored one is invalid and cannot be measured (m).
const UNKNOWN_LENGTH: f32 = 0.01;

impl Strand {
    /// The strand as the next tick would make it, where its arrays do not fit each other.
    #[cfg(feature = "save")]
    pub(crate) fn whole(&self) -> std::borrow::Cow<'_, Self> {
        use std::borrow::Cow;
        let [nodes, edges, lengths] =
            [self.positions.len(), self.orientations.len(), self.rest_lengths.len()];
        if edges == lengths && nodes.saturating_sub(1) == edges {
            return Cow::Borrowed(self);
        }
        let mut whole = self.clone();
        whole.repair();
        Cow::Owned(whole)
    }

    /// Makes the arrays consistent: one element for each node or edge, lengths above zero, unit
    /// orientations. Returns a description of the first error found.
    pub(crate) fn repair(&mut self) -> Option<String> {
        let nodes = self.positions.len();
        let edges = nodes.saturating_sub(1);
        let mut found = None;
        fn fit<T: Clone>(
            name: &str,
            values: &mut Vec<T>,
            count: usize,
            with: T,
            found: &mut Option<String>,
        ) {
            if values.len() != count {
                let length = values.len();
                found.get_or_insert_with(|| {
                    format!("the strand has {length} {name}, expected {count}: truncated or padded")
                });
                values.resize(count, with);
            }
        }
        fit("velocities", &mut self.velocities, nodes, Vec3::ZERO, &mut found);
        fit("rest lengths", &mut self.rest_lengths, edges, f32::NAN, &mut found);
        fit("orientations", &mut self.orientations, edges, Quat::from_array([0.0; 4]), &mut found);
        fit("angular velocities", &mut self.angular_velocities, edges, Vec3::ZERO, &mut found);
        fit("tensions", &mut self.tensions, edges, 0.0, &mut found);
        for (i, length) in self.rest_lengths.iter_mut().enumerate() {
            if !(MIN_SEGMENT..MAX_SEGMENT).contains(length) {
                let is = *length;
                let apart = self.positions[i].distance(self.positions[i + 1]);
                let known = (MIN_SEGMENT..MAX_SEGMENT).contains(&apart);
                *length = if known { apart } else { UNKNOWN_LENGTH };
                found.get_or_insert_with(|| {
                    format!(
                        "rest length {i} of the strand is {is} m, expected {MIN_SEGMENT} to {MAX_SEGMENT}: \
                         {length} m is used"
                    )
                });
            }
        }
        // A strand that is not simulated would keep non-finite values.
        for (i, v) in self.velocities.iter_mut().enumerate() {
            if !v.is_finite() {
                found.get_or_insert_with(|| {
                    format!("velocity {i} of the strand is {v}, expected a finite one")
                });
                *v = Vec3::ZERO;
            }
        }
        for (i, tension) in self.tensions.iter_mut().enumerate() {
            if !tension.is_finite() {
                found.get_or_insert_with(|| {
                    format!("tension {i} of the strand is {tension} N, expected a finite one")
                });
                *tension = 0.0;
            }
        }
        if self.root_before.take_if(|(p, q)| !(p.is_finite() && q.is_finite())).is_some() {
            found.get_or_insert_with(|| {
                "the strand's root before this tick is not finite, expected finite numbers: ignored"
                    .into()
            });
        }
        // The direct solver has no angular velocities, so nothing else would detect them.
        for (i, spin) in self.angular_velocities.iter_mut().enumerate() {
            if !spin.is_finite() {
                found.get_or_insert_with(|| {
                    format!("angular velocity {i} of the strand is {spin}, expected a finite one")
                });
                *spin = Vec3::ZERO;
            }
        }
        let is_unit = |q: &Quat| (0.5..2.0).contains(&q.length_squared());
        if !is_unit(&self.root_frame) {
            let is = self.root_frame;
            found.get_or_insert_with(|| {
                format!("the root frame of the strand is {is}, expected a unit quaternion")
            });
            self.root_frame =
                self.orientations.first().filter(|q| is_unit(q)).map_or(Quat::IDENTITY, |q| *q);
        }
        if let Some(i) = self.orientations.iter().position(|q| !is_unit(q)) {
            let is = self.orientations[i];
            found.get_or_insert_with(|| {
                format!("orientation {i} of the strand is {is}, expected a unit quaternion")
            });
            if self.positions.iter().all(|p| p.is_finite()) {
                self.orientations = parallel_transport(&self.positions, Some(self.root_frame));
            } else {
                self.orientations.fill(self.root_frame);
            }
        }
        found
    }
}

impl AddedMass {
    /// The largest added mass of a node, in masses of the dry node.
    pub(crate) const MOST: f32 = 1e6;

    /// Clamps masses and softening to their ranges. Returns a description of the first error found.
    pub(super) fn repair(&mut self) -> Option<String> {
        let lists =
            [("added mass", &mut self.mass, Self::MOST), ("softening", &mut self.softening, 1.0)];
        let mut found = None;
        for (name, values, most) in lists {
            for (i, value) in values.iter_mut().enumerate() {
                if !(0.0..=most).contains(value) {
                    found.get_or_insert_with(|| {
                        format!("{name} {i} of the strand is {value}, expected 0 to {most}")
                    });
                    // NaN becomes 0.
                    *value = value.max(0.0).min(most);
                }
            }
        }
        found
    }
}

impl StrandHistory {
    /// Clears a history that is not finite: the strand is drawn where it is.
    pub(super) fn repair(&mut self) -> Option<String> {
        if self.root.take_if(|root| !root.is_finite()).is_some() {
            return Some("the strand's drawn root is not finite: ignored".into());
        }
        let unknown = self.positions.iter().position(|p| !p.is_finite())?;
        let is = self.positions[unknown];
        self.positions.clear();
        Some(format!("position {unknown} of the strand's history is {is}, expected a finite one"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn strand() -> Strand {
        Strand::from_polyline(&[Vec3::ZERO, Vec3::X * 0.1, Vec3::X * 0.2]).unwrap()
    }

    #[test]
    fn a_valid_strand_is_left_unchanged() {
        let mut strand = strand();
        let before = format!("{strand:?}");
        assert_eq!(strand.repair(), None);
        assert_eq!(format!("{strand:?}"), before);
        assert_eq!(Strand::default().repair(), None);
    }

    #[test]
    fn invalid_parts_are_repaired_and_reported() {
        type Spoil = fn(&mut Strand);
        let spoils: [(Spoil, &str); 11] = [
            (|s| s.root_before = Some((Vec3::NAN, Quat::IDENTITY)), "root before this tick"),
            (|s| s.angular_velocities[1].x = f32::NAN, "angular velocity 1"),
            (|s| s.velocities.clear(), "0 velocities, expected 3"),
            (|s| s.tensions.push(1.0), "3 tensions, expected 2"),
            (|s| s.rest_lengths.truncate(1), "1 rest lengths, expected 2"),
            (|s| s.orientations.clear(), "0 orientations, expected 2"),
            (|s| s.positions.truncate(2), "3 velocities, expected 2"),
            (|s| s.positions.clear(), "3 velocities, expected 0"),
            (|s| s.rest_lengths[1] = f32::NAN, "rest length 1 of the strand is NaN"),
            (|s| s.rest_lengths[0] = -1.0, "rest length 0 of the strand is -1"),
            (|s| s.orientations[1] = Quat::from_array([0.0; 4]), "orientation 1"),
        ];
        for (spoil, message) in spoils {
            let mut strand = strand();
            spoil(&mut strand);
            let found = strand.repair().unwrap();
            assert!(found.contains(message), "{found}");
            assert_eq!(strand.repair(), None, "once is enough");
            assert!(strand.rest_lengths.iter().all(|l| (*l - 0.1).abs() < 1e-6));
            assert!(strand.is_finite());
        }
    }
    #[test]
    fn loads_are_clamped_to_their_range() {
        let mut added =
            AddedMass { mass: vec![1.0, f32::NAN, -2.0], softening: vec![0.5, 7.0], ..default() };
        assert!(
            added.repair().is_some_and(|found| found.contains("added mass 1 of the strand is NaN"))
        );
        assert_eq!(
            (&added.mass[..], &added.softening[..]),
            (&[1.0, 0.0, 0.0][..], &[0.5, 1.0][..])
        );
        assert_eq!(added.repair(), None);
    }
}

//! Whether arrays of a strand on the GPU were written to.

use bevy::math::Vec3;

/// Detects writes to a strand's arrays, without keeping them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Fingerprint {
    /// Of the root, which the tick moves where it is tied to a mesh.
    root: u64,
    places: u64,
    velocities: u64,
}

impl Fingerprint {
    pub(super) fn of(
        positions: impl Iterator<Item = Vec3> + Clone,
        velocities: impl Iterator<Item = Vec3>,
    ) -> Self {
        let places = positions.clone().skip(1);
        Self { root: sum(positions.take(1)), places: sum(places), velocities: sum(velocities) }
    }

    /// Whether positions and velocities are not those of the other.
    pub(super) fn differs(&self, other: &Self, is_tied: bool) -> (bool, bool) {
        let root = !is_tied && self.root != other.root;
        (root || self.places != other.places, self.velocities != other.velocities)
    }
}

fn sum(vectors: impl Iterator<Item = Vec3>) -> u64 {
    // Component by component, because each step waits for the one before.
    let mut sums = [0xcbf2_9ce4_8422_2325_u64; 3];
    for v in vectors {
        for (sum, x) in sums.iter_mut().zip(v.to_array()) {
            let mixed = (*sum ^ u64::from(x.to_bits())).wrapping_mul(0x0100_0000_01b3);
            *sum = mixed.rotate_left(23);
        }
    }
    sums[0] ^ sums[1].rotate_left(21) ^ sums[2].rotate_left(42)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_bit_that_is_written_is_seen_and_a_tied_root_is_not() {
        let of = |places: &[Vec3], speeds: &[Vec3]| {
            Fingerprint::of(places.iter().copied(), speeds.iter().copied())
        };
        let places: Vec<Vec3> = (0..5).map(|i| Vec3::new(0.1, 0.2, 0.3) * i as f32).collect();
        let before = of(&places, &places);
        for (node, axis) in (0..5).flat_map(|node| (0..3).map(move |axis| (node, axis))) {
            let mut moved = places.clone();
            moved[node][axis] = moved[node][axis].next_up();
            assert_eq!(of(&moved, &places).differs(&before, false), (true, false));
            assert_eq!(of(&moved, &places).differs(&before, true), (node > 0, false));
            assert_eq!(of(&places, &moved).differs(&before, true), (false, true));
        }
        assert_eq!(of(&places, &places).differs(&before, false), (false, false));
    }
}

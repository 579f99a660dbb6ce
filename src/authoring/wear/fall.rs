//! How hair lies when it is first drawn: as it settled, or as hair of the same roots did before it.

use crate::{
    base::grid::KdTree,
    hair::strand::Strand,
    keratin::bond::Bonds,
    simulation::lod::follow::{Frame, GuideOffsets, StrandPose, StrandState},
};
use bevy::prelude::*;

/// How far a root may be from one of the hair before, to be the same (m).
const SAME_ROOT: f32 = 2e-4;
/// How many of a hundred roots have to be the same.
const SAME: usize = 95;

/// How each strand of a hair fell from where it was planted.
pub(super) struct Fall(Vec<Fallen>);

struct Fallen {
    planted: Strand,
    settled: Vec<Quat>,
}

impl Fall {
    /// From strands as they were planted to the same at rest.
    pub(super) fn new(planted: &[Strand], settled: &[(Strand, Bonds)]) -> Self {
        let pairs = planted.iter().zip(settled);
        let each = pairs.map(|(planted, (settled, _))| Fallen {
            planted: planted.clone(),
            settled: settled.orientations().to_vec(),
        });
        Self(each.collect())
    }

    /// Strands that fall as those did which were at their roots before: each edge turns as the edge turned that was
    /// as far from the root. `None` where most have other roots.
    pub(super) fn carried(&self, planted: &[Strand]) -> Option<Vec<(Strand, Bonds)>> {
        let root = |strand: &Strand| strand.positions().first().copied();
        let roots = self.0.iter().zip(0u32..);
        let roots = roots.filter_map(|(fallen, i)| Some((root(&fallen.planted)?, i)));
        let tree = KdTree::new(roots);
        let nearest = |strand: &Strand| tree.nearest::<1>(root(strand)?).next();
        let near: Vec<(u32, f32)> = planted.iter().map(nearest).collect::<Option<_>>()?;
        let same = near.iter().filter(|(_, square)| *square < SAME_ROOT * SAME_ROOT).count();
        if near.is_empty() || 100 * same < SAME * near.len() {
            return None;
        }
        let each = planted.iter().zip(near);
        Some(
            each.map(|(strand, (i, _))| (self.0[i as usize].carry(strand), Bonds::of(strand)))
                .collect(),
        )
    }
}

impl Fallen {
    fn carry(&self, planted: &Strand) -> Strand {
        let still = vec![Vec3::ZERO; planted.nodes().max(self.planted.nodes())];
        let guide = [(0, 1.0, state(&self.planted, &still))];
        let mut offsets = GuideOffsets::new(state(planted, &still), guide);
        let mut positions = planted.positions().to_vec();
        let mut orientations = planted.orientations().to_vec();
        let mut pose = StrandPose {
            positions: &mut positions,
            before: &mut [],
            velocities: &mut vec![Vec3::ZERO; planted.nodes()],
            orientations: &mut orientations,
            spins: &mut [],
        };
        offsets.follow(&mut pose, |_| Some(&self.settled[..]), &Frame::default(), 1.0);
        let mut carried = planted.clone();
        carried.replace(
            positions,
            orientations,
            planted.rest_lengths().to_vec(),
            planted.root_frame(),
        );
        carried
    }
}

fn state<'a>(strand: &'a Strand, still: &'a [Vec3]) -> StrandState<'a> {
    StrandState {
        positions: strand.positions(),
        velocities: &still[..strand.nodes()],
        turns: strand.orientations(),
        lengths: strand.rest_lengths(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn strand(root: Vec3, along: Vec3, length: f32) -> Strand {
        let nodes = (length / 0.01).round() as usize;
        let points: Vec<Vec3> = (0..=nodes).map(|i| root + along * (0.01 * i as f32)).collect();
        Strand::from_polyline(&points).unwrap()
    }

    /// Three strands that stood up and hang, and longer and shorter ones in their place.
    #[test]
    fn longer_and_shorter_hair_hangs_as_the_hair_before() {
        let roots = [0.0, 0.02, 0.04].map(|x| Vec3::X * x);
        let planted = roots.map(|root| strand(root, Vec3::Z, 0.1));
        let fell = planted.each_ref().map(|planted| {
            let mut hangs = planted.clone();
            let turn = Quat::from_rotation_x(core::f32::consts::FRAC_PI_2);
            let turned = planted.orientations().iter().map(|q| turn * *q).collect();
            let points = planted.positions().iter().map(|p| {
                let root = planted.positions()[0];
                root + turn * (*p - root)
            });
            hangs.replace(
                points.collect(),
                turned,
                planted.rest_lengths().to_vec(),
                planted.root_frame(),
            );
            (hangs, Bonds::of(planted))
        });
        let fall = Fall::new(&planted, &fell);
        for length in [0.05, 0.1, 0.17] {
            let others = roots.map(|root| strand(root, Vec3::Z, length));
            let carried = fall.carried(&others).unwrap();
            for ((carried, _), root) in carried.iter().zip(roots) {
                let tip = *carried.positions().last().unwrap();
                assert!(tip.distance(root - Vec3::Y * length) < 1e-5, "{tip} at {length} m");
                assert!(
                    carried.peak_strain() < 1e-4 && carried.root_frame() == planted[0].root_frame()
                );
            }
        }
        let elsewhere = roots.map(|root| strand(root + Vec3::Y * 0.01, Vec3::Z, 0.1));
        assert!(fall.carried(&elsewhere).is_none());
        assert!(fall.carried(&[]).is_none());
    }
}

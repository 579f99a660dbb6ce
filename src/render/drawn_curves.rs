//! Curves of drawn strands as they are now, computed on the processor: for tools that write them.

use super::{
    curve::{ring_share, strand_point},
    drawn_strand::DrawnStrand,
    present::{Present, PresentHair},
    solids::{Ball, DrawnSolid, arrange, gather},
};
use crate::{
    base::setting::Settings,
    forces::contact::{HairCollider, Obstacles},
    hair::look::HairLook,
};
use bevy::{ecs::system::SystemParam, prelude::*};

/// From which share of its length on a strand tapers: cut hair keeps its width up to there. As in `ribbon.wgsl`.
const BLUNT: f32 = 0.9;

/// The curve of one drawn strand.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct DrawnCurve {
    /// Its nodes in the hair's frame (m), root first.
    pub(crate) points: Vec<Vec3>,
    /// The diameter at each (m).
    pub(crate) widths: Vec<f32>,
    /// Whether it is simulated.
    pub(crate) is_guide: bool,
}

/// Curves of all drawn strands of a hair.
#[derive(SystemParam)]
pub(crate) struct DrawnCurves<'w, 's> {
    present: PresentHair<'w, 's>,
    places: Query<'w, 's, (&'static GlobalTransform, Option<&'static Obstacles>)>,
    colliders: Query<'w, 's, (Entity, &'static HairCollider, &'static GlobalTransform)>,
    looks: Settings<'w, 's, HairLook>,
}

impl DrawnCurves<'_, '_> {
    /// Guides by their own nodes, then followers by as many as they are drawn with, out of the solids near them. Empty
    /// where there is no guide.
    pub(crate) fn of(&self, hair: Entity) -> Vec<DrawnCurve> {
        let present = self.present.of(hair, |packed, _| packed?.laid_out(), false);
        let Some(present) = present else { return Vec::new() };
        let (look, settings) = (self.looks.of(hair), &present.settings);
        let solids = self.solids(hair, &present);
        let curve = |strand: &DrawnStrand| {
            let guide = strand.is_guide.then(|| present.guide(strand.guides[0]).nodes);
            let along: Vec<f32> = match guide {
                Some(nodes) => {
                    let last = nodes.len() - 1;
                    (0..=last).map(|i| i as f32 / last as f32).collect()
                }
                None => {
                    let count = settings.segments;
                    (0..=count).map(|ring| ring_share(ring, count)).collect()
                }
            };
            let at =
                |t: f32| strand_point(strand, |i| present.guide(i), t, settings, &solids).position;
            let points = match guide {
                Some(nodes) => nodes.to_vec(),
                None => along.iter().map(|t| at(*t)).collect(),
            };
            let own = if strand.is_guide { 1.0 } else { strand.width };
            let width = |t: &f32| {
                let thin = ((t - BLUNT) / (1.0 - BLUNT)).clamp(0.0, 1.0);
                let thin = thin * thin * (3.0 - 2.0 * thin);
                look.width * own * (1.0 + (look.taper - 1.0) * thin)
            };
            let widths = along.iter().map(width).collect();
            DrawnCurve { points, widths, is_guide: strand.is_guide }
        };
        present.strands.iter().map(curve).collect()
    }

    fn solids(&self, hair: Entity, present: &Present<'_>) -> Vec<DrawnSolid> {
        let Ok((place, obstacles)) = self.places.get(hair) else { return Vec::new() };
        let nodes = || present.guides.iter().flat_map(|(strand, ..)| strand.positions());
        let (low, high) = (nodes().copied().reduce(Vec3::min), nodes().copied().reduce(Vec3::max));
        let (low, high) = (low.unwrap_or_default(), high.unwrap_or_default());
        // Followers leave the box of their guides by no more than its size.
        let inside = (low.midpoint(high), high - low);
        let of = |(entity, of, at): (Entity, &HairCollider, &GlobalTransform)| {
            Ball::around(entity, of, at)
        };
        let mut balls: Vec<Ball> = self.colliders.iter().filter_map(of).collect();
        balls.sort_by(|a, b| b.radius.total_cmp(&a.radius));
        let mut solids = Vec::new();
        gather(&mut solids, &balls, inside, place, &self.colliders, obstacles);
        arrange(&mut solids);
        solids
    }
}

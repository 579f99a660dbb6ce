//! Resampling a hairdo for another groom.

use super::{Hairdo, HairdoError, StyledStrand};
use crate::{
    base::grid::KdTree,
    hair::strand::return_to_cpu,
    keratin::bond::{BondKind, JointBonds},
    solver::rod::frame::{darboux, full},
    water::moisture::node_lengths,
};
use bevy::prelude::*;

/// The largest bend of a resampled joint, sin(θ/2): 150°. Beyond 180° it would bend to the other
/// side.
pub(super) const MAX_BEND: f32 = 0.966;

impl Hairdo {
    /// Puts the hairdo on the hair of another groom, at rest; all strands, or in case of an error
    /// none. As [`Hairdo::apply`], but the hair may have other strands, with more or fewer nodes.
    ///
    /// With as many strands, each takes the style of the one with its index; else of the one with
    /// the nearest root. Along a strand everything is mapped by the share of its length. Curvature
    /// is kept, not the angles of joints: a curl has the same radius on fewer or more nodes, and on
    /// longer hair more turns. Ties hold it as far from the root. Water is kept per length. Lengths, roots and the scalp's frames are
    /// the new groom's.
    ///
    /// # Limits
    /// Directions are kept as they are in the hair's frame: both heads have to face the same way and
    /// be of about the same size and shape, because strands are not bent around the new head. A
    /// joint bends by at most 150°; curls tighter than the new segments allow get wider. Details
    /// finer than a segment are smoothed. Each strand takes the style of one other: from few strands
    /// to many, neighbours get the same.
    ///
    /// # Errors
    /// When `hair` is no hair or has invalid numbers, or this hairdo has no strands.
    pub fn apply_resampled(&self, world: &mut World, hair: Entity) -> Result<(), HairdoError> {
        let hair = self.its_hair(world, hair)?;
        return_to_cpu(world, hair);
        self.resampled_for(&Self::of(world, hair)?)?.apply(world, hair)
    }

    /// Which strand's style one of `count` others takes, by its index and root: of as many that of the same index, else
    /// that of the nearest root.
    pub(super) fn sources(&self, count: usize) -> impl Fn(usize, Vec3) -> usize + use<> {
        let by_index = self.strands.len() == count;
        let roots = self.strands.iter().map(|strand| strand.positions[0]).zip(0..);
        let nearest = KdTree::new(roots.filter(|_| !by_index));
        move |index, root| match by_index {
            true => index,
            false => nearest.nearest::<1>(root).next().map_or(0, |(i, _)| i as usize),
        }
    }

    /// The hairdo resampled for the groom of `other`: what [`Hairdo::apply_resampled`] applies.
    ///
    /// # Errors
    /// When this hairdo has no strands and the other has.
    pub fn resampled_for(&self, other: &Self) -> Result<Self, HairdoError> {
        if self.strands.is_empty() && !other.strands.is_empty() {
            return Err(HairdoError::Bald);
        }
        let of = self.sources(other.strands.len());
        let strands = other
            .strands
            .iter()
            .enumerate()
            .map(|(i, layout)| self.strands[of(i, layout.positions[0])].resampled(layout));
        let (strands, preset) = (strands.collect(), other.preset.clone());
        let (look, dye) = (self.look.clone(), self.dye.clone());
        let (ties, followers) = (self.ties.clone(), other.followers.clone());
        Self { strands, cuticle: self.cuticle, look, dye, preset, ties, followers }.checked()
    }
}

impl StyledStrand {
    /// The style of `self` with root, lengths and number of nodes of `layout`.
    pub(super) fn resampled(&self, layout: &Self) -> Self {
        let lengths = &layout.rest_lengths;
        if (&self.rest_lengths, self.root_frame) == (lengths, layout.root_frame) {
            let mut same = Self { cut: layout.cut, ..self.clone() };
            let moved = layout.positions[0] - self.positions[0];
            if moved != Vec3::ZERO {
                same.positions.iter_mut().for_each(|p| *p += moved);
            }
            return same;
        }
        let along = Along::new(&self.rest_lengths, lengths);
        let resample_shapes =
            |shapes: Vec<Vec3>| along.resample_shapes(self.root_frame, &shapes, layout.root_frame);

        let mut turn = layout.root_frame;
        let mut place = layout.positions[0];
        let (mut positions, mut orientations) = (vec![place], Vec::new());
        for (shape, length) in resample_shapes(self.shape().collect()).into_iter().zip(lengths) {
            turn = (turn * full(shape)).normalize();
            place += turn * Vec3::Z * *length;
            orientations.push(turn);
            positions.push(place);
        }

        let mut joints = vec![JointBonds::default(); lengths.len()];
        for kind in BondKind::ALL {
            let shapes = resample_shapes(self.remembered(kind).collect());
            let rates: Vec<f64> =
                self.joints.iter().map(|j| f64::from(j.rates[kind as usize])).collect();
            for (j, (joint, shape)) in joints.iter_mut().zip(shapes).enumerate() {
                joint.shapes[kind as usize] = shape;
                joint.rates[kind as usize] = along.at_node(&rates, j).clamp(0.0, 1.0) as f32;
            }
        }
        let own: Vec<f64> = node_lengths(&self.rest_lengths).map(f64::from).collect();
        let water = |water: &[f64]| -> Vec<f64> {
            let density: Vec<f64> = water.iter().zip(&own).map(|(v, l)| v / l).collect();
            let nodes = node_lengths(lengths).enumerate().filter(|_| !density.is_empty());
            nodes.map(|(j, l)| along.at_node(&density, j) * f64::from(l)).collect()
        };
        Self {
            positions,
            orientations,
            rest_lengths: lengths.clone(),
            root_frame: layout.root_frame,
            joints,
            film: water(&self.film),
            bound: water(&self.bound),
            hold: self.hold_for(lengths),
            cut: layout.cut,
        }
    }
}

/// Arc lengths along an old and a new strand, both in the old one's lengths.
pub(super) struct Along {
    old_nodes: Vec<f32>,
    old_middles: Vec<f32>,
    new_nodes: Vec<f32>,
    new_middles: Vec<f32>,
    /// New length over old.
    scale: f32,
}

impl Along {
    pub(super) fn new(old: &[f32], new: &[f32]) -> Self {
        let scale = new.iter().sum::<f32>() / old.iter().sum::<f32>();
        let measure = |lengths: &[f32], scale: f32| {
            let mut at = 0.0;
            let (mut nodes, mut middles) = (vec![0.0], Vec::new());
            for length in lengths {
                middles.push((at + 0.5 * length) / scale);
                at += length;
                nodes.push(at / scale);
            }
            (nodes, middles)
        };
        let (old_nodes, old_middles) = measure(old, 1.0);
        let (new_nodes, new_middles) = measure(new, scale);
        Self { old_nodes, old_middles, new_nodes, new_middles, scale }
    }

    /// Shapes of the new joints. Edge orientations are those at the edges' middles, so a joint
    /// bends by the curvature between two of them. |Im Ω| = sin(θ/2) is half the edge over the
    /// radius of the circle through the nodes: Ω per length, unlike the angle, keeps that radius
    /// exactly.
    pub(super) fn resample_shapes(
        &self,
        old_root: Quat,
        shapes: &[Vec3],
        new_root: Quat,
    ) -> Vec<Vec3> {
        let first = shapes.first().copied().unwrap_or_default();
        let onward = self.turn(shapes, self.old_middles[0], self.new_middles[0]);
        let first = darboux(new_root, old_root * full(first) * full(onward)).xyz();
        let others = self.new_middles.windows(2).map(|m| self.turn(shapes, m[0], m[1]));
        core::iter::once(first).chain(others).collect()
    }

    /// Ω integrated between two arc lengths; constant before the first joint and after the last.
    fn turn(&self, shapes: &[Vec3], from: f32, to: f32) -> Vec3 {
        if to < from {
            return -self.turn(shapes, to, from);
        }
        let last = self.old_middles.len() - 1;
        let pairs = self.old_middles.windows(2).enumerate();
        let sum: Vec3 = pairs
            .map(|(i, m)| {
                let begin = if i == 0 { from } else { from.max(m[0]) };
                let end = if i + 1 == last { to } else { to.min(m[1]) };
                shapes[i + 1] * ((end - begin).max(0.0) / (m[1] - m[0]))
            })
            .sum();
        (sum * self.scale).clamp_length_max(MAX_BEND)
    }

    /// Interpolates `values` of the old nodes at a new one; constant after the last.
    fn at_node(&self, values: &[f64], new: usize) -> f64 {
        let place = self.new_nodes[new];
        let after = self.old_nodes.partition_point(|node| *node <= place);
        let (before, after) = (after.saturating_sub(1), after.min(values.len() - 1));
        if before >= after {
            return values[after];
        }
        let (a, b) = (self.old_nodes[before], self.old_nodes[after]);
        let share = f64::from((place - a) / (b - a));
        values[before] + (values[after] - values[before]) * share
    }
}

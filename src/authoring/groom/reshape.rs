//! Grooms made of other grooms: scaled, turned upright, cleaned, resampled, thinned.

use super::{
    Groom, GroomError, GroomLosses, GroomSettings, GroomStrand, RootBones, UpAxis, intake::evenly,
    losses::GroomPlace,
};
use crate::base::setting::ValueRange;
use bevy::{
    math::{Affine3A, DVec3},
    prelude::*,
};
use core::ops::Range;

const SCALE: ValueRange = GroomSettings::SCALE.named("a groom's scale");
const NODES: ValueRange = GroomSettings::NODES.named("nodes to resample to");
const SHORTEST: ValueRange = GroomSettings::SHORTEST_SEGMENT.named("the shortest segment (m)");
const OVER: ValueRange =
    ValueRange::new("the length of a curl (m)", 1e-6..=1e6, "give the length of hair in one turn");
const CURL: ValueRange = ValueRange::new("a share of the curl", 0.0..=10.0, "1 is as it is");
const EVERY: ValueRange = GroomSettings::KEEP_EVERY.named("keep every k-th strand, k");

impl Groom {
    /// The groom `factor` times as large, widths included.
    ///
    /// # Errors
    /// When the factor is not between 1e-9 and 1e9, or a node becomes non-finite.
    pub fn scaled(mut self, factor: f32) -> Result<Self, GroomError> {
        SCALE.check(factor)?;
        if factor == 1.0 {
            return self.checked();
        }
        self.points.iter_mut().for_each(|p| *p *= factor);
        self.widths.iter_mut().for_each(|w| *w *= factor);
        self.checked()
    }

    /// The groom turned so that what was `up` is +Y.
    pub fn with_up(mut self, up: UpAxis) -> Self {
        if up != UpAxis::Y {
            self.points.iter_mut().for_each(|p| *p = up.to_y_up(*p));
        }
        self
    }

    /// The groom moved by `offset` (m).
    ///
    /// # Errors
    /// When a node becomes non-finite.
    pub fn moved(mut self, offset: Vec3) -> Result<Self, GroomError> {
        self.points.iter_mut().for_each(|p| *p += offset);
        self.checked()
    }

    /// The groom in another space; widths scale with it.
    ///
    /// # Errors
    /// When a node becomes non-finite.
    pub(crate) fn mapped(mut self, space: &Affine3A) -> Result<Self, GroomError> {
        let scale = space.matrix3.determinant().abs().cbrt();
        self.points.iter_mut().for_each(|p| *p = space.transform_point3(*p));
        self.widths.iter_mut().for_each(|w| *w *= scale);
        self.checked()
    }

    /// Every strand with `nodes` nodes evenly spaced along it (2…4096). Root and tip stay
    /// exactly where they are; widths and colours are blended. Corners between nodes are cut, so
    /// strands get shorter the fewer nodes they have.
    ///
    /// # Errors
    /// When `nodes` is out of range, or there would be more nodes than 32 bits can count.
    pub fn resampled(&self, nodes: usize) -> Result<Self, GroomError> {
        NODES.check(nodes)?;
        self.resampled_by(|_| nodes)
    }

    /// The same with a number of nodes for each strand that depends on its length (m).
    pub(super) fn resampled_by(&self, nodes: impl Fn(f32) -> usize) -> Result<Self, GroomError> {
        let mut made = self.emptied();
        let mut along = Vec::new();
        for (i, strand) in self.strands().enumerate() {
            let length = arc_lengths(strand.points, &mut along);
            let count = nodes(length as f32).max(2);
            for k in 0..count {
                let at = place(&along, length * k as f64 / (count - 1) as f64);
                made.push_blend(&strand, if k + 1 == count { (along.len() - 2, 1.0) } else { at });
            }
            made.end_strand(self, i)?;
        }
        Ok(made)
    }

    /// Whether [`Self::merged`] would surely change nothing.
    pub(super) fn is_merged(&self, shortest: f32) -> bool {
        let least = (shortest * shortest * 1.001).max(f32::MIN_POSITIVE);
        let is_far = |strand: GroomStrand<'_>| {
            let near = strand.points.windows(2).map(|p| p[0].distance_squared(p[1]));
            // Without a branch for each: that is read as fast as it comes.
            near.fold(true, |is_far, square| is_far & (square >= least))
        };
        self.strands().all(is_far)
    }

    /// Every strand without nodes nearer than `shortest` (m) to the one before; the tip stays.
    /// Strands without any segment left are removed. Also returns the counts.
    ///
    /// # Errors
    /// When `shortest` is negative or not finite.
    pub fn merged(&self, shortest: f32) -> Result<(Self, GroomLosses), GroomError> {
        SHORTEST.check(shortest)?;
        let mut losses = GroomLosses::default();
        let mut made = self.emptied();
        made.points.reserve(self.points.len());
        let mut kept: Vec<usize> = Vec::new();
        for (i, strand) in self.strands().enumerate() {
            let points = strand.points;
            let far = |a: usize, b: usize| {
                let apart = points[a].distance(points[b]);
                apart >= shortest && apart > 0.0
            };
            let tip = points.len() - 1;
            kept.clear();
            kept.push(0);
            for i in 1..tip {
                if far(i, kept[kept.len() - 1]) {
                    kept.push(i);
                }
            }
            while kept.len() > 1 && !far(tip, kept[kept.len() - 1]) {
                kept.pop();
            }
            if !far(tip, kept[kept.len() - 1]) {
                losses.short_strands.add(GroomPlace::Strand(i));
                continue;
            }
            kept.push(tip);
            let merged = points.len() - kept.len();
            if merged > 0 {
                let node = kept.iter().zip(0..).take_while(|(kept, k)| **kept == *k).count();
                losses.merged_nodes.add_many(merged, GroomPlace::Node { strand: i, node });
            }
            kept.iter().for_each(|i| made.push_node(&strand, *i));
            made.end_strand(self, i)?;
        }
        Ok((made, losses))
    }

    /// The groom with another curl: each strand's bends around its middle line count `shares` times. 0 is the middle line,
    /// 1 as it is, 2 twice as curly. Strands keep their lengths, so that a curl that is taken out hangs lower; roots
    /// stay. The middle line goes along the mean direction of `over` metres of a strand, at best one turn of its curl or
    /// wave: with less, wide curls stay, with more, the fall over the head straightens, too. 0.04 suits most.
    ///
    /// ```
    /// # use bevy_keratin::{prelude::*, authoring::groom::*, authoring::plant::ImageMap};
    /// /// Straight where the map is black, as the artist made it where it is white.
    /// fn relaxed(groom: &Groom, map: &ImageMap) -> Result<Groom, GroomError> {
    ///     let shares = groom.strands().map(|strand| strand.uv.map_or(1.0, |uv| map.at(uv)));
    ///     groom.with_curl(0.04, &shares.collect::<Vec<_>>())
    /// }
    /// ```
    ///
    /// # Errors
    /// When there are not as many shares as strands, one is outside 0 to 10, or `over` is not above 0.
    pub fn with_curl(&self, over: f32, shares: &[f32]) -> Result<Self, GroomError> {
        OVER.check(over)?;
        let (found, expected) = (shares.len(), self.len());
        if found != expected {
            return Err(GroomError::Length { what: "curl", found, expected });
        }
        let mut made = self.clone();
        let (mut along, mut ways) = (Vec::new(), Vec::new());
        for (i, (strand, share)) in self.strands().zip(shares).enumerate() {
            CURL.check(*share)?;
            let length = arc_lengths(strand.points, &mut along);
            if *share == 1.0 || length == 0.0 {
                continue;
            }
            let way = |p: &[Vec3]| p[1].as_dvec3() - p[0].as_dvec3();
            ways.clear();
            ways.extend(strand.points.windows(2).map(way));
            let window = f64::from(over).min(length);
            let first = self.nodes_of(i).start;
            let mut at = strand.points[0].as_dvec3();
            for (k, way) in ways.iter().enumerate() {
                let size = way.length();
                // A whole window, also at the ends.
                let begin = (0.5 * (along[k] + along[k + 1] - window)).clamp(0.0, length - window);
                let between = |at| point_at(strand.points, place(&along, at));
                let mean = (between(begin + window) - between(begin)) / window;
                let own = way.normalize_or_zero();
                let turned = mean + (own - mean) * f64::from(*share);
                at += turned.try_normalize().unwrap_or(own) * size;
                made.points[first + k + 1] = at.as_vec3();
            }
        }
        made.checked()
    }

    /// Every `k`-th strand, the first one included.
    ///
    /// # Errors
    /// When `k` is 0.
    pub fn thinned(&self, k: usize) -> Result<Self, GroomError> {
        EVERY.check(k)?;
        Ok(self.picked((0..self.len()).step_by(k)))
    }

    /// At most `count` strands, taken evenly from their order.
    pub fn limited(&self, count: usize) -> Self {
        self.picked(evenly((0..self.len()).collect(), count))
    }

    /// The strands of these indices; those that are not there are left out.
    pub fn picked(&self, strands: impl IntoIterator<Item = usize>) -> Self {
        let mut made = self.emptied();
        for i in strands {
            let Some(strand) = self.strand(i) else {
                continue;
            };
            (0..strand.points.len()).for_each(|k| made.push_node(&strand, k));
            // A subset cannot have too many nodes, unless strands are repeated.
            if made.end_strand(self, i).is_err() {
                break;
            }
        }
        made
    }

    /// One strand.
    pub fn strand(&self, index: usize) -> Option<GroomStrand<'_>> {
        (index < self.len()).then(|| self.strand_at(index))
    }

    pub(super) fn nodes_of(&self, strand: usize) -> Range<usize> {
        let start = strand.checked_sub(1).map_or(0, |before| self.ends[before] as usize);
        start..self.ends[strand] as usize
    }

    /// An empty groom with capacity for as many strands.
    fn emptied(&self) -> Self {
        let bones = RootBones { names: self.bones.names.clone(), ..default() };
        let (ends, all_groups) = (Vec::with_capacity(self.len()).into(), self.all_groups.clone());
        Self { ends, all_groups, bones, ..default() }
    }

    fn push_node(&mut self, of: &GroomStrand<'_>, i: usize) {
        self.points.push(of.points[i]);
        self.widths.extend(of.widths.map(|w| w[i]));
        self.colors.extend(of.colors.map(|c| c[i]));
    }

    /// A node at the share `t` of segment `i`.
    fn push_blend(&mut self, of: &GroomStrand<'_>, (i, t): (usize, f32)) {
        let blend = |a: Vec3, b: Vec3| if t >= 1.0 { b } else { a.lerp(b, t) };
        self.points.push(blend(of.points[i], of.points[i + 1]));
        self.widths.extend(of.widths.map(|w| w[i] + (w[i + 1] - w[i]) * t));
        self.colors.extend(of.colors.map(|c| c[i] * (1.0 - t) + c[i + 1] * t));
    }

    /// Ends a strand that was strand `i` of another groom.
    fn end_strand(&mut self, of: &Self, i: usize) -> Result<(), GroomError> {
        let found = self.points.len();
        self.ends.push(u32::try_from(found).map_err(|_| GroomError::TooMany { found })?);
        self.uvs.extend(of.uvs.get(i));
        self.guides.extend(of.guides.get(i));
        self.stiffness.extend(of.stiffness.get(i));
        self.damping.extend(of.damping.get(i));
        self.groups.extend(of.groups.get(i));
        self.bones.strands.extend(of.bones.strands.get(i));
        Ok(())
    }
}

/// Lengths from the root up to each node, and up to the tip.
pub(super) fn arc_lengths(points: &[Vec3], along: &mut Vec<f64>) -> f64 {
    let mut length = 0.0;
    along.clear();
    along.push(0.0);
    along.extend(points.windows(2).map(|p| {
        length += p[0].as_dvec3().distance(p[1].as_dvec3());
        length
    }));
    length
}

/// The place at a parameter of a segment.
fn point_at(points: &[Vec3], (segment, t): (usize, f32)) -> DVec3 {
    points[segment].as_dvec3().lerp(points[segment + 1].as_dvec3(), t.into())
}

/// The segment at a distance along a strand, and the parameter within it.
pub(super) fn place(along: &[f64], distance: f64) -> (usize, f32) {
    let after = along.partition_point(|a| *a <= distance).clamp(1, along.len() - 1);
    let (from, to) = (along[after - 1], along[after]);
    let share = if to > from { ((distance - from) / (to - from)).clamp(0.0, 1.0) } else { 0.0 };
    (after - 1, share as f32)
}

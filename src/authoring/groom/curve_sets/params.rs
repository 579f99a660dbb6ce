//! Optional numbers of curve sets: one for all, one a curve, a point or an anchor.

use super::curves::{Curve, Curves, Numbers};
use core::ops::Range;

/// Attributes that Unreal Engine names.
pub const WIDTH: &str = "groom_width";
pub const COLOR: &str = "groom_color";
pub const ROOT_UV: &str = "groom_root_uv";
pub const GUIDE: &str = "groom_guide";
pub const GROUP: &str = "groom_group_id";
pub const GROUP_NAME: &str = "groom_group_name";
/// Our own.
pub const STIFFNESS: &str = "groom_stiffness";
pub const DAMPING: &str = "groom_damping";

/// The numbers of one property, N to an element.
pub struct Param<V, const N: usize> {
    values: V,
    indices: Option<V>,
    /// How many the file has to an element; what is missing is 1.
    given: usize,
    scope: Scope,
}

/// What has an element of its own. Recognised by their number: Blender does not write it into Alembic.
#[derive(Clone, Copy)]
enum Scope {
    Set,
    Curve,
    Point,
    Anchor,
    /// All points but the outermost two: ends of segments of an open cubic curve.
    Inner,
}

impl<V: Numbers, const N: usize> Param<V, N> {
    /// Numbers, `given` to an element, of these curves.
    ///
    /// # Errors
    /// What is wrong with them.
    pub fn of(
        values: V,
        indices: Option<V>,
        given: usize,
        curves: &Curves,
    ) -> Result<Self, String> {
        let elements = values.len() / given;
        let is_inside = |i: f64| (0.0..elements as f64).contains(&i);
        if indices.is_some_and(|of| !(0..of.len()).all(|i| is_inside(of.get(i)))) {
            return Err(format!("an index beyond its {elements} values"));
        }
        let found = indices.map_or(elements, |indices| indices.len());
        let sum = |of: fn(Curve) -> usize| curves.iter().map(of).sum::<usize>();
        let (all, points) = (curves.len(), sum(|curve| curve.count));
        let scope = match found {
            found if found == points => Scope::Point,
            found if found == all => Scope::Curve,
            1 => Scope::Set,
            found if found == sum(|curve| curve.anchors) => Scope::Anchor,
            found if found + 2 * all == points && curves.iter().all(|c| c.count > 2) => {
                Scope::Inner
            }
            _ => return Err(format!("{found} values, expected 1, {all} or {points}")),
        };
        Ok(Self { values, indices, given, scope })
    }

    /// At a node of a curve.
    pub fn at(&self, curve: Curve, node: usize) -> [f32; N] {
        match self.scope {
            Scope::Set => self.element(0),
            Scope::Curve => self.element(curve.index),
            Scope::Point => self.element(curve.first_point + node),
            Scope::Inner => {
                let first = curve.first_point - 2 * curve.index;
                self.element(first + node.clamp(1, curve.count - 2) - 1)
            }
            Scope::Anchor => {
                let anchor = curve.first_anchor + node / 3;
                let (from, to) = (self.element(anchor), self.element(anchor + 1));
                match node % 3 {
                    0 => from,
                    t => core::array::from_fn(|k| from[k] + (to[k] - from[k]) * t as f32 / 3.0),
                }
            }
        }
    }

    fn element(&self, i: usize) -> [f32; N] {
        // `as` saturates, and indices are checked.
        let i = self.indices.map_or(i, |indices| indices.get(i) as usize);
        let number = |k: usize| self.values.get(self.given * i + k) as f32;
        core::array::from_fn(|k| if k < self.given { number(k) } else { 1.0 })
    }
}

/// An optional array of a groom, filled set by set.
pub struct Column<const N: usize> {
    values: Vec<[f32; N]>,
    /// Where sets did not have it.
    gaps: Vec<Range<usize>>,
    len: usize,
}

impl<const N: usize> Column<N> {
    pub const EMPTY: Self = Self { values: Vec::new(), gaps: Vec::new(), len: 0 };

    pub fn add(&mut self, count: usize, values: Option<impl Iterator<Item = [f32; N]>>) {
        let end = self.len + count;
        match values {
            Some(values) => {
                self.values.resize(self.len, [0.0; N]);
                self.values.extend(values.take(count));
            }
            None => match self.gaps.last_mut() {
                Some(last) if last.end == self.len => last.end = end,
                _ => self.gaps.push(self.len..end),
            },
        }
        self.len = end;
    }

    /// The array, empty if no set had it; sets that did not have `otherwise`, or the mean of the others.
    pub fn filled(mut self, otherwise: Option<[f32; N]>) -> Vec<[f32; N]> {
        if self.values.is_empty() {
            return self.values;
        }
        self.values.resize(self.len, [0.0; N]);
        if let Some(otherwise) = otherwise {
            self.gaps.into_iter().for_each(|gap| self.values[gap].fill(otherwise));
        } else if !self.gaps.is_empty() {
            let known = self.len - self.gaps.iter().map(ExactSizeIterator::len).sum::<usize>();
            let mut mean = [0.0; N];
            for (value, k) in self.values.iter().flat_map(|value| value.iter().zip(0..)) {
                mean[k] += if value.is_finite() { f64::from(*value) / known as f64 } else { 0.0 };
            }
            for gap in self.gaps {
                self.values[gap].fill(mean.map(|mean| mean as f32));
            }
        }
        self.values
    }
}

/// V counts from the bottom of an image in Alembic and USD, from the top in Bevy's meshes.
pub fn from_the_top([u, v]: [f32; 2]) -> [f32; 2] {
    [u, 1.0 - v]
}

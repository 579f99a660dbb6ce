//! Interpolation of two hairdos.

use super::{Hairdo, HairdoError, StyledStrand};
use crate::{
    base::setting::ValueRange,
    keratin::bond::{BondKind, Cuticle, JointBonds},
    solver::rod::frame::full,
};
use bevy::prelude::*;

const BLEND_RANGE: ValueRange =
    ValueRange::new("Hairdo::blend's t", 0.0..=1.0, "0 is the first hairdo, 1 the second");

impl Hairdo {
    /// Interpolates two hairdos of the same groom: exactly `a` at `t` = 0, `b` at 1.
    ///
    /// Strands are blended by shape, joint by joint, and laid out from the root, which keeps their
    /// lengths, where blended positions would shrink them. Remembered shapes are weighted by the
    /// rates of their bonds. Pigments, bleach and dyes are blended by absorption,
    /// [`HairLook::dye`](crate::hair::look::HairLook::dye) in linear light. Where only one has a cuticle
    /// or a look of its own, that of the nearer hairdo is used, as are its preset and what holds its strands.
    ///
    /// # Errors
    /// When the hairdos differ in strands or nodes, or `t` is outside 0…1.
    pub fn blend(a: &Self, b: &Self, t: f32) -> Result<Self, HairdoError> {
        let t = BLEND_RANGE.check(t)?;
        b.check_fit(a.strands.iter().map(|strand| strand.positions.len()))?;
        if t == 0.0 || t == 1.0 {
            return Ok(if t == 0.0 { a } else { b }.clone());
        }
        let strands = a.strands.iter().zip(&b.strands).map(|(a, b)| a.toward(b, t)).collect();
        let cuticle = match (a.cuticle, b.cuticle) {
            (Some(a), Some(b)) => Some(Cuticle {
                damage: a.damage.lerp(b.damage, t),
                softening: a.softening.lerp(b.softening, t),
            }),
            (a, b) => {
                if t < 0.5 {
                    a
                } else {
                    b
                }
            }
        };
        let nearer = if t < 0.5 { a } else { b };
        let look = match (&a.look, &b.look) {
            (Some(a), Some(b)) => Some(a.blend(b, t)),
            _ => nearer.look.clone(),
        };
        let (dye, preset) = (a.dye.blend(&b.dye, t), nearer.preset.clone());
        let (ties, followers) = (nearer.ties.clone(), nearer.followers.clone());
        Self { strands, cuticle, look, dye, preset, ties, followers }.checked()
    }
}

impl StyledStrand {
    fn toward(&self, other: &Self, t: f32) -> Self {
        let root_frame = self.root_frame.slerp(other.root_frame, t).normalize();
        let mut place = self.positions[0].lerp(other.positions[0], t);
        let mut turn = root_frame;
        let (mut positions, mut orientations) = (vec![place], Vec::new());
        for (i, (a, b)) in self.shape().zip(other.shape()).enumerate() {
            turn = (turn * full(between(a, b, t))).normalize();
            let ((along_a, length_a), (along_b, length_b)) = (self.edge(i), other.edge(i));
            let along = along_a.lerp(along_b, t).try_normalize().unwrap_or(Vec3::Z);
            place += turn * along * length_a.lerp(length_b, t);
            orientations.push(turn);
            positions.push(place);
        }
        let nearer = if t < 0.5 { self } else { other };
        let rest = self.rest_lengths.iter().zip(&other.rest_lengths);
        let joints = self.joints.iter().zip(&other.joints);
        Self {
            positions,
            orientations,
            root_frame,
            rest_lengths: rest.map(|(a, b)| a.lerp(*b, t)).collect(),
            joints: joints.map(|(a, b)| joint(a, b, t)).collect(),
            film: water(&self.film, &other.film, t),
            bound: water(&self.bound, &other.bound, t),
            hold: nearer.hold.clone(),
            cut: nearer.cut,
        }
    }

    /// Direction and length of an edge, as seen from its own frame: not exactly that frame's e3 and
    /// the rest length, since a solved rod is slightly strained.
    fn edge(&self, i: usize) -> (Vec3, f32) {
        let edge = self.positions[i + 1] - self.positions[i];
        (self.orientations[i].inverse() * edge.normalize_or(Vec3::Z), edge.length())
    }
}

/// Interpolates two shapes by the shorter rotation.
fn between(a: Vec3, b: Vec3, t: f32) -> Vec3 {
    if a == b {
        return a;
    }
    let turn = full(a).slerp(full(b), t);
    turn.xyz() * 1_f32.copysign(turn.w)
}

fn joint(a: &JointBonds, b: &JointBonds, t: f32) -> JointBonds {
    let mut joint = *a;
    for kind in 0..BondKind::COUNT {
        let rate = a.rates[kind].lerp(b.rates[kind], t);
        let share = if rate > 0.0 { (t * b.rates[kind] / rate).min(1.0) } else { t };
        joint.rates[kind] = rate.clamp(0.0, 1.0);
        joint.shapes[kind] = between(a.shapes[kind], b.shapes[kind], share);
    }
    joint
}

/// Water of each node; a strand without any is empty.
fn water(a: &[f64], b: &[f64], t: f32) -> Vec<f64> {
    let at = |water: &[f64], i| water.get(i).copied().unwrap_or(0.0);
    let nodes = a.len().max(b.len());
    (0..nodes).map(|i| at(a, i) * f64::from(1.0 - t) + at(b, i) * f64::from(t)).collect()
}

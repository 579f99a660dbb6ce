//! Where a preset grows, which way it is combed there and how long it is.

use super::{
    hairline::{Hairline, smooth},
    preset::HairPreset,
    scalp::{Scalp, piecewise},
};
use bevy::{math::ops::atan2, prelude::*};

impl HairPreset {
    /// Whether strands follow [`direction`](Self::direction).
    pub(super) fn is_combed(self) -> bool {
        !matches!(self, Self::Short | Self::Coily | Self::Fur)
    }

    /// Whether it has a parting.
    #[cfg_attr(not(feature = "render"), allow(dead_code, reason = "only drawn strands ask"))]
    pub(super) fn is_parted(self) -> bool {
        self.is_combed() && !matches!(self, Self::Undercut | Self::Beard)
    }

    /// Whether it grows on all of a mesh, not behind a hairline.
    pub(crate) fn is_everywhere(self) -> bool {
        self == Self::Fur
    }

    /// The share of full density at a place, 0…1.
    pub(super) fn density(self, scalp: &Scalp, place: Vec3) -> f32 {
        match self {
            Self::Fur => 1.0,
            Self::Beard => smooth(scalp.behind_beard_line(place) / 6e-3),
            _ => scalp.density(place),
        }
    }

    /// How far behind the line at which it begins a place is (m); negative in front of it.
    pub(super) fn behind_line(self, scalp: &Scalp, place: Vec3) -> f32 {
        match self {
            // Where there is no hairline all is far behind it.
            Self::Fur => 1.0,
            Self::Beard => scalp.behind_beard_line(place),
            _ => scalp.behind_hairline(place),
        }
    }

    /// How hair begins at the hairline of its drawn strands.
    pub fn hairline(self) -> Hairline {
        let base = Hairline::default();
        match self {
            Self::Short => Hairline { least_length: 0.25, length_over: 12e-3, ..base },
            Self::Coily => {
                Hairline { least_length: 0.15, density_over: 12e-3, baby_length: 12e-3, ..base }
            }
            // Short pieces of curls would look chopped.
            Self::Curly => {
                Hairline { least_length: 0.7, baby_hair: 0.15, baby_length: 12e-3, ..base }
            }
            Self::Bob | Self::Fringe => Hairline { least_length: 0.6, ..base },
            Self::Undercut | Self::Pixie => Hairline { baby_length: 12e-3, ..base },
            Self::Locs => Hairline { least_length: 0.8, density_over: 8e-3, ..base },
            Self::Beard => Hairline {
                density_over: 9e-3,
                length_over: 14e-3,
                least_length: 0.3,
                baby_hair: 0.1,
                baby_length: 8e-3,
                ..base
            },
            _ => base,
        }
    }

    /// Where the parting is, to the right in heights of the head.
    fn parting(self) -> f32 {
        match self {
            Self::Bob => -0.22,
            Self::Wavy => -0.12,
            Self::Curly => 0.2,
            Self::Pixie => 0.3,
            _ => 0.0,
        }
    }

    /// How far to the right of the parting a place is (m).
    pub(super) fn aside(self, scalp: &Scalp, place: Vec3) -> f32 {
        let [right, _, front] = scalp.axes();
        let off = (place - scalp.center) / scalp.height;
        // A natural parting is a zigzag of 3 mm.
        let zigzag = ((off.dot(front) * 7.0).rem_euclid(2.0) - 1.0).abs() - 0.5;
        (off.dot(right) - self.parting() - 0.05 * zigzag) * scalp.height
    }

    /// The way it is combed: away from the parting; in front to the back as well, so that the face is
    /// free.
    pub(super) fn direction(self, scalp: &Scalp, place: Vec3) -> Vec3 {
        let [right, up, front] = scalp.axes();
        let off = (place - scalp.center) / scalp.height;
        let (aside, forward, high) = (off.dot(right), off.dot(front), off.dot(up));
        match self {
            Self::Fringe if in_fringe(aside, forward) => {
                return front + right * (1.6 * aside) - up * 0.2;
            }
            Self::Undercut => {
                // To the right on top, from its edge at the left on; down at the sides.
                let top = on_top(aside, high);
                return right * top - front * (0.5 - 0.3 * top) - up * (1.0 - top);
            }
            Self::Pixie => {
                // In front over the forehead to the long side, behind and at the sides down.
                let before = smooth((forward + 0.1) / 0.5) * smooth((high - 0.3) / 0.3);
                let side = if self.aside(scalp, place) < 0.0 { -1.0 } else { 1.0 };
                let swept = right * side + front * 0.35;
                let down = -up - front * 0.25 + right * (0.4 * aside);
                return swept * before + down * (1.0 - before);
            }
            Self::Beard => {
                // A moustache is combed aside, off the mouth.
                let (side, moustache) = (aside.signum(), above_mouth(aside, high));
                let sideways = 0.5 * aside + 1.1 * side * moustache;
                return right * sideways + front * 0.1 - up * (1.0 - 0.5 * moustache);
            }
            _ => {}
        }
        let side = if self.aside(scalp, place) < 0.0 { -1.0 } else { 1.0 };
        // Behind the crown there is no parting; before it, down would be into the face.
        let across = (0.6 + 2.0 * (forward + 0.2)).clamp(0.0, 1.0);
        let down = (0.5 - forward).clamp(0.0, 0.6);
        let back = right * (side * across) - front * (0.35 + 1.4 * forward.max(0.0)) - up * down;
        if self != Self::Fringe {
            return back;
        }
        // Beside the fringe down over the temples.
        let before = smooth(forward / 0.4);
        let beside = right * (0.5 * side) + front * 0.1 - up * 0.9;
        back * (1.0 - before) + beside * before
    }

    /// Length of a sideburn as a share of the preset's.
    fn sideburn(self) -> f32 {
        match self {
            Self::Short | Self::Undercut | Self::Pixie | Self::Beard | Self::Fur => 1.0,
            Self::Coily => 0.35,
            _ => 0.25,
        }
    }

    /// Length at a place as a share of the preset's.
    pub(super) fn length_share(self, scalp: &Scalp, place: Vec3) -> f32 {
        let least = self.sideburn();
        let before_ear = least + (1.0 - least) * scalp.above_sideburn(place);
        before_ear * self.length_by_cut(scalp, place)
    }

    /// The same without sideburns.
    fn length_by_cut(self, scalp: &Scalp, place: Vec3) -> f32 {
        let [right, up, front] = scalp.axes();
        let off = (place - scalp.center) / scalp.height;
        let (aside, forward, high) = (off.dot(right), off.dot(front), off.dot(up));
        match self {
            // Shorter at the sides and the nape.
            Self::Short => 0.28 + 0.72 * smooth(high / 0.85),
            // Behind the crown shorter, or it would hang over the clipped back.
            Self::Undercut => {
                0.06 + 0.94 * on_top(aside, high) * (0.35 + 0.65 * smooth((forward + 0.6) / 0.5))
            }
            Self::Pixie => 0.2 + 0.8 * smooth((high + 0.1) / 0.95),
            // Down to the brows, along the head.
            Self::Fringe if in_fringe(aside, forward) => {
                let angle = atan2(high, forward) - BROW;
                (angle * FRINGE_LENGTH).clamp(0.15, 0.5)
            }
            // The moustache is shorter.
            Self::Beard => {
                0.45 + 0.55 * smooth((-0.42 - high) / 0.3) - 0.1 * above_mouth(aside, high)
            }
            _ => 1.0,
        }
    }
}

/// The share of an undercut's length at a place in heights of the head.
fn on_top(aside: f32, high: f32) -> f32 {
    smooth((high - 0.5) / 0.14) * smooth((aside + 0.42) / 0.1)
}

/// The share of a moustache at a place in heights of the head.
fn above_mouth(aside: f32, high: f32) -> f32 {
    smooth((high + 0.6) / 0.06) * smooth((0.34 - aside.abs()) / 0.1)
}

/// How high the brows are above the middle of the head (rad).
const BROW: f32 = 0.16;
/// Share of the length for each radian from the brows up: 0.11 m around the forehead.
const FRINGE_LENGTH: f32 = 0.37;

/// Whether hair at a place, in heights of the head, hangs over the forehead: a triangle that begins
/// before the crown.
fn in_fringe(aside: f32, forward: f32) -> bool {
    forward > 0.22 && aside.abs() < 0.24 + 1.1 * (forward - 0.22)
}

/// The upper edge of a beard: elevation (°) over the angle from the face (°), both at the middle of the
/// head: below the nose, over the cheek to the sideburn before the ear.
const CHEEK_LINE: [(f32, f32); 8] = [
    (0.0, -27.0),
    (15.0, -28.0),
    (24.0, -31.0),
    (40.0, -26.0),
    (54.0, -15.0),
    (64.0, -4.0),
    (70.0, 2.0),
    (180.0, 2.0),
];
/// The lower edge, under the chin and the jaw.
const NECK_LINE: [(f32, f32); 4] = [(0.0, -66.0), (35.0, -64.0), (65.0, -57.0), (180.0, -45.0)];
/// How far back it grows (°): before the ear.
const EAR: f32 = 84.0;
/// The lips: how high they are (°), and half of their height and width (°).
const LIPS: (f32, f32, f32) = (-36.5, 5.0, 15.0);

/// Below the nose and around the lips hair begins within so much shorter a way than on the cheeks, up to this angle from
/// the face (°): a moustache has no room for more.
const EDGE_OF_LIPS: f32 = 3.0;
const EDGE_OF_NOSE: f32 = 2.0;
const BESIDE_NOSE: f32 = 24.0;

/// A sideburn's lower end and height (°), and the angle from the face at which it ends (°).
const SIDEBURN: (f32, f32) = (-3.0, 8.0);
const BEHIND_SIDEBURN: f32 = 92.0;

impl Scalp {
    /// How far up from a sideburn's lower end to where it is the head's hair a place is, 0…1.
    fn above_sideburn(&self, place: Vec3) -> f32 {
        let (around, elevation) = self.angles(place);
        if around > BEHIND_SIDEBURN { 1.0 } else { smooth((elevation - SIDEBURN.0) / SIDEBURN.1) }
    }

    /// How far within the edge of a beard a place is (m, approximately); negative outside.
    pub(super) fn behind_beard_line(&self, place: Vec3) -> f32 {
        let (around, elevation) = self.angles(place);
        let lips = ((elevation - LIPS.0) / LIPS.1).hypot(around / LIPS.2) - 1.0;
        let beside = smooth((around - BESIDE_NOSE) / BESIDE_NOSE);
        let steep = EDGE_OF_NOSE + (1.0 - EDGE_OF_NOSE) * beside;
        let within = ((piecewise(&CHEEK_LINE, around) - elevation) * steep)
            .min(elevation - piecewise(&NECK_LINE, around))
            .min(EAR - around)
            .min(lips * LIPS.1 * EDGE_OF_LIPS);
        within.to_radians() * place.distance(self.center)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_moustache_is_full_between_nose_and_lips() {
        let scalp = Scalp::default();
        let behind = |elevation: f32| {
            let up = elevation.to_radians();
            scalp.behind_beard_line(Vec3::new(0.0, up.sin(), up.cos()) * 0.1)
        };
        assert!(behind(-29.5) > 7e-3, "{}", behind(-29.5));
        assert!(behind(-25.0) < 0.0 && behind(-33.0) < 0.0 && behind(-40.0) < 0.0);
    }
}

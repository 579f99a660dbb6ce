//! Which way a character looks: found from its bones and its shape.

use super::part::{Cue, MeshPart};
use bevy::prelude::*;

/// What shows which way a character looks, see [`HairWorn`](super::HairWorn).
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Default, Clone, PartialEq)]
pub enum FacingFrom {
    /// Nothing did: it is assumed to look along −Z, Bevy's forward.
    #[default]
    Assumed,
    /// [`WearHair::facing`](super::WearHair::facing) or [`WearHair::scalp`](super::WearHair::scalp).
    Given,
    /// Bones of eyes, or else of jaw, nose and mouth, before the bone of the head.
    Eyes,
    /// Toes before feet, or feet that reach farther before the ankle than behind it.
    Feet,
    /// The shape of the head: nose and chin reach farther than the nape.
    Nose,
}

/// The least share of an offset that is level, to show a direction.
const LEVEL: f32 = 0.2;
/// How much farther nose and chin reach than the nape at least, in heights of the head.
const NOSE: f32 = 0.1;
/// How far the middle of a foot is before its ankle at least, in lengths of the foot.
const FOOT: f32 = 0.08;
/// How near an axis a direction is that is taken for it, as a cosine.
const ALONG: f32 = 0.86;

/// The direction in which a character looks, in the wearer's space, from its bones.
pub(super) fn by_bones(parts: &[MeshPart]) -> Option<(Dir3, FacingFrom)> {
    let eyes = [Cue::Eye, Cue::Face].into_iter().find_map(|cue| before_head(parts, cue));
    let feet = || toes(parts).or_else(|| feet(parts));
    eyes.map(|way| (way, FacingFrom::Eyes)).or_else(|| Some((feet()?, FacingFrom::Feet)))
}

/// Where bones are when the mesh is bound, in the wearer's space.
fn bones(parts: &[MeshPart], is: impl Fn(&MeshPart, usize) -> bool) -> Vec<Vec3> {
    let mut seen: Vec<Entity> = Vec::new();
    let mut places = Vec::new();
    for part in parts {
        let Some(skin) = &part.skin else { continue };
        for j in 0..skin.joints.len().min(skin.poses.len()) {
            if is(part, j) && !seen.contains(&skin.joints[j]) {
                seen.push(skin.joints[j]);
                places.push(part.bound_joint(j));
            }
        }
    }
    places.retain(|place| place.is_finite());
    places
}

fn cue(part: &MeshPart, joint: usize) -> Cue {
    part.skin.as_ref().and_then(|skin| skin.cues.get(joint)).copied().unwrap_or_default()
}

/// Where the bones of eyes are, in the wearer's space.
pub(super) fn eyes(parts: &[MeshPart]) -> Vec<Vec3> {
    bones(parts, |part, j| cue(part, j) == Cue::Eye)
}

fn mean(places: &[Vec3]) -> Option<Vec3> {
    (!places.is_empty()).then(|| places.iter().sum::<Vec3>() / places.len() as f32)
}

fn before_head(parts: &[MeshPart], of: Cue) -> Option<Dir3> {
    let head = bones(parts, |part, j| part.skin.as_ref().is_some_and(|s| s.head == Some(j)));
    let face = bones(parts, |part, j| cue(part, j) == of);
    level(mean(&face)? - mean(&head)?)
}

fn toes(parts: &[MeshPart]) -> Option<Dir3> {
    let of = |of: Cue| mean(&bones(parts, |part, j| cue(part, j) == of));
    level(of(Cue::Toe)? - of(Cue::Foot)?)
}

/// The sum over both feet of the middle of what they move, before the bone.
fn feet(parts: &[MeshPart]) -> Option<Dir3> {
    let (mut sum, mut length) = (Vec3::ZERO, 0.0);
    for part in parts {
        let Some(skin) = &part.skin else { continue };
        for j in (0..skin.cues.len()).filter(|j| skin.cues[*j] == Cue::Foot) {
            let moved = part.moved_by(j).filter(|p| p.is_finite());
            let none = (Vec3::INFINITY, Vec3::NEG_INFINITY);
            let (low, high) = moved.fold(none, |(a, b), p| (a.min(p), b.max(p)));
            if low.x <= high.x && j < skin.poses.len() {
                sum += (0.5 * (low + high) - part.bound_joint(j)).with_y(0.0);
                length += (high - low).with_y(0.0).max_element();
            }
        }
    }
    (sum.length() > FOOT * length).then(|| along(sum)).flatten()
}

/// The direction of an offset that is level enough.
fn level(off: Vec3) -> Option<Dir3> {
    let flat = off.with_y(0.0);
    (flat.length() > LEVEL * off.length()).then(|| along(flat)).flatten()
}

/// The direction in which the head's lower half reaches farther than opposite: given its skin, and its middle
/// and height.
pub(super) fn by_shape(points: &[Vec3], middle: Vec3, height: f32) -> Option<Dir3> {
    let none = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let face = (-0.9 * height)..(-0.1 * height);
    let lower = points.iter().map(|p| *p - middle).filter(|p| face.contains(&p.y));
    let (low, high) = lower.fold(none, |(a, b), p| (a.min(p), b.max(p)));
    let farther = (high + low).with_y(0.0);
    let is_clear = farther.is_finite() && farther.length() > NOSE * height;
    is_clear.then(|| along(farther)).flatten()
}

/// The direction of a level offset; the axis where it is near one.
fn along(off: Vec3) -> Option<Dir3> {
    let way = Dir3::new(off).ok()?;
    let axes = [Dir3::Z, Dir3::NEG_Z, Dir3::X, Dir3::NEG_X];
    Some(axes.into_iter().find(|axis| axis.dot(*way) > ALONG).unwrap_or(way))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn offsets_near_an_axis_are_along_it() {
        assert_eq!(level(Vec3::new(0.01, 0.1, -0.1)), Some(Dir3::NEG_Z));
        assert_eq!(level(Vec3::new(0.01, 0.2, -0.01)), None, "hardly level");
        assert_eq!(level(Vec3::NAN), None);
        let between = level(Vec3::new(0.1, 0.0, 0.1)).unwrap();
        assert!(between.x > 0.7 && between.z > 0.7);
    }

    #[test]
    fn a_nose_is_before_the_nape() {
        let ball = |p: Vec3| p.normalize() * 0.1;
        let mut points: Vec<Vec3> = (0..1000)
            .map(|i| ball(Vec3::new((i % 10) as f32, (i / 10 % 10) as f32, (i / 100) as f32) - 4.5))
            .collect();
        assert_eq!(by_shape(&points, Vec3::ZERO, 0.1), None);
        points.push(Vec3::new(0.0, -0.03, 0.125));
        assert_eq!(by_shape(&points, Vec3::ZERO, 0.1), Some(Dir3::Z));
    }
}

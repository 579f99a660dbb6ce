//! Strands of reconstructions and their databases (`.data`), read.
//!
//! A count of strands (i32), then for each a count of points (i32) and as many points (3 × f32), root first.
//! All little-endian, without a mark. The layout of Paris et al., Hair Photobooth, SIGGRAPH 2008, and of
//! USC-HairSalon by Hu et al., Single-View Hair Modeling Using a Hairstyle Database, SIGGRAPH 2015, whose
//! strands are in metres with Y up; those of 1 point or none are places where no hair grows.

use super::{
    Groom, GroomError, GroomFileError, GroomLosses,
    bytes::{Bytes, some_strands, value},
    intake::Intake,
    losses::GroomPlace,
};
use bevy::prelude::*;

/// More strands or points are taken for another format.
const MOST_STRANDS: i32 = 1 << 27;
const MOST_POINTS: i32 = 1 << 16;
/// Coordinates of points are smaller.
const FARTHEST: f32 = 1e6;

/// Whether the beginning looks like one of a `.data` file, which has no mark.
pub(super) fn looks_like(file: &[u8]) -> bool {
    let bytes = Bytes(file);
    let count = |at| bytes.u32(at, "").map(u32::cast_signed);
    if !count(0).is_ok_and(|strands| (1..MOST_STRANDS).contains(&strands)) {
        return false;
    }
    // Strands without points are among the others, and a few tell the format.
    let (mut at, mut points) = (4, 0);
    while let Ok(nodes) = count(at)
        && points < 100
    {
        if !(0..=MOST_POINTS).contains(&nodes) {
            return false;
        }
        let left = (bytes.len() - at - 4) / 12;
        let here = bytes.groups(at + 4, left.min(nodes as u64), "", Vec3::from_array);
        let is_place = |p: &Vec3| p.is_finite() && p.abs().max_element() < FARTHEST;
        if !here.is_ok_and(|here| here.iter().filter(|p| is_place(p)).count() * 2 >= here.len()) {
            return false;
        }
        points += nodes;
        at += 4 + 12 * nodes as u64;
    }
    points > 0
}

/// A groom from the bytes of a `.data` file, in the file's own unit and axes, and what was left out.
///
/// Strands of fewer than two points or with a number that is not finite are left out and counted, and bytes
/// after the end are counted.
///
/// # Errors
/// When a count is negative, the file is too short for its counts, or no strand is left.
pub fn read(file: &[u8]) -> Result<(Groom, GroomLosses), GroomFileError> {
    intake(file).map(|intake| (intake.groom, intake.losses))
}

pub(super) fn intake(file: &[u8]) -> Result<Intake, GroomFileError> {
    let bytes = Bytes(file);
    let count = |at, what| match bytes.u32(at, what)?.cast_signed() {
        negative @ ..0 => value(at, what, negative, "0 or more", "export the file again"),
        count => Ok(count as u64),
    };
    let strands = count(0, "the count of strands")?;
    some_strands(0, strands)?;
    bytes.array(4, strands, 4, "counts of points")?;
    let (mut groom, mut losses, mut at) = (Groom::default(), GroomLosses::default(), 4);
    for _ in 0..strands {
        let nodes = count(at, "a strand's count of points")?;
        groom.points.extend(bytes.groups(at + 4, nodes, "a strand's points", Vec3::from_array)?);
        let found = groom.points.len();
        groom.ends.push(u32::try_from(found).map_err(|_| GroomError::TooMany { found })?);
        at += 4 + 12 * nodes;
    }
    if let rest @ 1.. = bytes.len() - at {
        losses.unread_bytes.add_many(rest as usize, GroomPlace::Byte(at));
    }
    Ok(Intake::cleaned(groom, losses)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(counts: &[i32]) -> Vec<u8> {
        let mut file = (counts.len() as i32).to_le_bytes().to_vec();
        for (i, count) in counts.iter().enumerate() {
            file.extend(count.to_le_bytes());
            let points = (0..*count).flat_map(|k| [i as f32 * 0.01, 1.7 + k as f32 * 0.01, 0.0]);
            file.extend(points.flat_map(f32::to_le_bytes));
        }
        file
    }

    #[test]
    fn strands_are_read_and_bald_places_counted() {
        let mut data = file(&[3, 1, 0, 4]);
        assert!(looks_like(&data));
        let (groom, losses) = read(&data).unwrap();
        assert_eq!(groom.strands().map(|s| s.points.len()).collect::<Vec<_>>(), [3, 4]);
        assert_eq!(losses.short_strands.count, 2);
        data.push(0);
        assert_eq!(read(&data).unwrap().1.unread_bytes.count, 1);
    }

    #[test]
    fn files_cut_short_are_errors_and_others_are_not_taken_for_it() {
        let data = file(&[3, 1, 0, 4]);
        for end in 0..data.len() {
            let error = read(&data[..end]).unwrap_err().to_string();
            assert!(error.starts_with("byte ") && error.contains("expected"), "{error}");
            assert!(end < 20 || looks_like(&data[..end]));
        }
        let negative = [&1i32.to_le_bytes()[..], &(-1i32).to_le_bytes()].concat();
        assert!(read(&negative).unwrap_err().to_string().contains("is -1, expected 0 or more"));
        let dump: Vec<u8> = (1..90).flat_map(|i| (i as f32 * 0.1).to_le_bytes()).collect();
        for other in [&dump[..], b"what ever it may be", &[0; 64], &[1; 64], &negative] {
            assert!(!looks_like(other));
        }
    }
}

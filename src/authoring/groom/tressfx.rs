//! TressFX files (`.tfx`), versions 3 and 4.
//!
//! A header, then arrays at the offsets given there; 0 means that an array is absent. All strands
//! have the same number of nodes. All little-endian. The versions differ in the layout of the
//! header, and version 4 has a fourth number with each position: 0 for a fixed node.
//!
//! | | version 3 | version 4 |
//! |---|---|---|
//! | header (bytes) | 296 | 160 |
//! | positions | 3 × f32 | 4 × f32 |
//! | offsets from byte | 144 | 12 |

use super::{
    Groom, GroomFileError, GroomLosses,
    bytes::{Bytes, some_strands, value},
    intake::Intake,
    losses::GroomPlace,
};
use bevy::prelude::*;

/// Offsets of a version's header.
struct Layout {
    header: u64,
    positions: u64,
    uvs: u64,
    thickness: u64,
    colours: u64,
    vertex_uvs: u64,
    guide_indices: Option<u64>,
}

const V3: Layout = Layout {
    header: 296,
    positions: 144,
    thickness: 148,
    uvs: 152,
    colours: 156,
    guide_indices: Some(160),
    vertex_uvs: 164,
};
const V4: Layout = Layout {
    header: 160,
    positions: 12,
    uvs: 16,
    thickness: 24,
    colours: 28,
    vertex_uvs: 20,
    guide_indices: None,
};

/// A groom from the bytes of a `.tfx` file, in the file's own unit and axes, and what was left out.
///
/// A strand's thickness becomes the diameter of all its nodes. Places of nodes on the texture and
/// version 3's indices of guides are not read. Which nodes are fixed is not kept: roots are. Strands with a
/// number that is not finite or a thickness that is negative are left out and counted.
///
/// # Errors
/// When the version is neither 3 nor 4, the header contradicts the file's length, or there are no strands.
pub fn read(file: &[u8]) -> Result<(Groom, GroomLosses), GroomFileError> {
    intake(file).map(|intake| (intake.groom, intake.losses))
}

pub(super) fn intake(file: &[u8]) -> Result<Intake, GroomFileError> {
    let bytes = Bytes(file);
    let version = bytes.f32(0, "version")?;
    let layout = match version {
        v if (3.0..4.0).contains(&v) => V3,
        v if (4.0..5.0).contains(&v) => V4,
        _ => {
            let hint = "check that this is a .tfx file of TressFX 3 or 4";
            return value(0, "the version", version, "3.x or 4.x", hint);
        }
    };
    bytes.array(0, layout.header, 1, "header")?;
    let strands = u64::from(bytes.u32(4, "strand count")?);
    some_strands(4, strands)?;
    let each = u64::from(bytes.u32(8, "node count of a strand")?);
    if each < 2 {
        return value(8, "the node count of a strand", each, "2 or more", "export longer strands");
    }
    // Cannot overflow: both have 32 bits.
    let nodes = strands * each;
    if nodes > u64::from(u32::MAX) {
        let expected = format!("at most {} with {strands} strands", u64::from(u32::MAX) / strands);
        return value(8, "the node count of a strand", each, expected, "split the groom");
    }
    let array = |at: u64| -> Result<Option<u64>, GroomFileError> {
        match u64::from(bytes.u32(at, "offset")?) {
            0 => Ok(None),
            inside if inside < layout.header => {
                let expected = format!("0 or {} and above", layout.header);
                value(at, "an array's offset", inside, expected, "export the file again")
            }
            offset => Ok(Some(offset)),
        }
    };

    let Some(offset) = array(layout.positions)? else {
        let hint = "export the file with positions";
        return value(layout.positions, "the positions' offset", 0, layout.header, hint);
    };
    let mut losses = GroomLosses::default();
    let points = match layout.header {
        160 => {
            let fixed = |i: u64, w: f32| w == 0.0 && !i.is_multiple_of(each);
            let points = bytes.groups(offset, nodes, "a position", Vec4::from_array)?;
            for (i, _) in (0..).zip(&points).filter(|(i, p)| fixed(*i, p.w)) {
                losses.freed_nodes.add_node((i / each) as usize, (i % each) as usize);
            }
            points.iter().map(|p| p.truncate()).collect()
        }
        _ => bytes.groups(offset, nodes, "a position", Vec3::from_array)?,
    };
    let uvs = match array(layout.uvs)? {
        Some(offset) => bytes.groups(offset, strands, "a strand's UV", Vec2::from_array)?,
        None => Vec::new(),
    };
    let thickness = match array(layout.thickness)? {
        Some(offset) => bytes.groups(offset, strands, "a strand's thickness", |[t]| t)?,
        None => Vec::new(),
    };
    let widths = thickness.iter().flat_map(|t| (0..each).map(|_| *t)).collect();
    let colour = |c: [f32; 4]| LinearRgba::from_f32_array(c);
    let colors = match array(layout.colours)? {
        Some(offset) => bytes.groups(offset, nodes, "a colour", colour)?,
        None => Vec::new(),
    };
    // A groom cannot hold these, but a file that is truncated there is broken all the same.
    if let Some(offset) = array(layout.vertex_uvs)? {
        bytes.array(offset, nodes, 8, "UVs of nodes")?;
        losses.unread_arrays.add(GroomPlace::Part("UVs of nodes".to_owned()));
    }
    if let Some(offset) = layout.guide_indices.map(array).transpose()?.flatten() {
        bytes.array(offset, strands, 4, "indices of guides")?;
        losses.unread_arrays.add(GroomPlace::Part("indices of guides".to_owned()));
    }
    let ends = (1..=strands).map(|i| (i * each) as u32).collect();
    Ok(Intake::cleaned(Groom { points, ends, widths, colors, uvs }, losses)?)
}

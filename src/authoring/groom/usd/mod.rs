//! USD files with curves, read: `.usda`, `.usdc`, `.usdz` (feature `usd`).
//!
//! All curve sets of a stage become one groom, in the order of the prims and with the transforms above them
//! applied; the earliest sample of what is animated counts, and a [`GroomCache`](super::GroomCache) has all. The file
//! says its unit and axis: `metersPerUnit` and `upAxis`, without which USD takes centimetres and Y.
//!
//! | curves | become |
//! |---|---|
//! | linear, Catmull-Rom, Hermite | their points, joined, from the first to the last |
//! | Bezier | anchors, and two nodes between each two on the curve |
//! | B-spline | as many nodes as points, on the curve; of Blender, whose points lie on the strand, the points |
//! | `NurbsCurves` | as many nodes as points, even in the parameter; without knots from end to end |
//! | periodic | opened at the first point |
//!
//! | numbers | where |
//! |---|---|
//! | diameters | `groom_width`, else `widths`; scaled with the transforms |
//! | UVs of roots | `groom_root_uv`, else `surface_uv_coordinate`, else `st`; V counts from the bottom there, from the top in a [`Groom`] |
//! | colours | `groom_color`, else `displayColor`, unless it is one for all |
//! | guides | `groom_guide`: see [`Groom::with_guides`] |
//! | groups | `groom_group_id` and `groom_group_name`; else each set of several is one: see [`Groom::groups`] |
//! | stiffness, damping | `groom_stiffness`, `groom_damping`, our own: see [`Groom::with_stiffness`] |
//!
//! All but `widths` are primvars. Each may be one for the set, one a curve, one a point or one at each end of a
//! segment (varying); sets that have none where others do take the mean of those (zero for UVs, 1 for stiffness).
//!
//! References, payloads and sublayers are followed within the file and within a package; other files are not read.

mod array;
mod claims;
mod error;
mod files;
mod scene;
mod transform;

#[cfg(test)]
mod tests;

use super::{Groom, GroomCacheError, GroomFileError, GroomLosses, UpAxis, intake::Intake};
use error::{failed, wrong};
use files::Files;
use openusd::usd::Stage;
use scene::Scene;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// A groom from the bytes of a `.usda`, `.usdc` or `.usdz` file, in the file's own unit and axes, and what was left
/// out. [`Groom::from_file`] applies unit and axis.
///
/// Invisible prims, those of purpose `proxy` and those in them are left out and counted; those of purpose `guide`
/// too, unless they have the attribute `groom_guide`. So are meshes, sets without curves, further samples, arrays of
/// which a groom has none, and other files. Strands with a number that is not finite or a width that is negative are
/// left out and counted.
///
/// ```
/// # use bevy_keratin::authoring::groom::usd; use bevy::prelude::*;
/// let file = r#"#usda 1.0
/// def BasisCurves "Hair"
/// {
///     uniform token type = "linear"
///     int[] curveVertexCounts = [2]
///     point3f[] points = [(0, 0, 0), (0, 10, 0)]
/// }
/// "#;
/// let (groom, losses) = usd::read(file.as_bytes()).unwrap();
/// assert_eq!(groom.points(), [Vec3::ZERO, Vec3::Y * 10.0]);
/// assert!(losses.is_empty());
/// ```
///
/// # Errors
/// When the file is broken, points and counts of a set contradict each other, its basis is unknown, or no strand is
/// left.
pub fn read(file: &[u8]) -> Result<(Groom, GroomLosses), GroomFileError> {
    intake(file).map(|intake| (intake.groom, intake.losses))
}

pub(super) fn intake(file: &[u8]) -> Result<Intake, GroomFileError> {
    let ((unit, up), sets) = with_scene(file, |mut scene| {
        scene.walk()?;
        Ok::<_, GroomFileError>((scene.unit_and_up()?, scene.sets))
    })?;
    if sets.is_empty() {
        let found = format!("without curves ({})", sets.losses);
        let hint = "export hair curves or particle hair with it, visible";
        return Err(wrong("the USD file", found, "BasisCurves or NurbsCurves", hint));
    }
    let mut intake = sets.finish()?;
    (intake.scale, intake.up) = (unit, up);
    Ok(intake)
}

/// Calls `take` for each time at which curves have samples of points or transforms: with the count of all, the
/// time (s), and the groom without anything but nodes, whatever numbers they are.
pub(super) fn each_frame(
    file: &[u8],
    mut take: impl FnMut(u64, f64, Groom) -> Result<(), GroomCacheError>,
) -> Result<(), GroomCacheError> {
    with_scene(file, |mut scene| {
        scene.walk()?;
        let (times, rate) = (scene.times()?, scene.rate()?);
        for time in &times {
            let seconds = if time.is_earliest_time() { 0.0 } else { time.value() / rate };
            take(times.len() as u64, seconds, scene.nodes(*time)?)?;
        }
        Ok(())
    })
}

/// Metres per unit and the axis that is up, as far as the file says.
pub(super) fn unit_and_up(file: &[u8]) -> Result<(Option<f32>, Option<UpAxis>), GroomFileError> {
    with_scene(file, |scene| scene.unit_and_up())
}

/// Opens a file that does not claim what it does not have.
fn with_scene<T, E: From<GroomFileError>>(
    file: &[u8],
    read: impl FnOnce(Scene) -> Result<T, E>,
) -> Result<T, E> {
    // Some editors begin a file with a mark.
    let file = file.strip_prefix(b"\xef\xbb\xbf").unwrap_or(file);
    let files = Files::of(file)?;
    files.all.iter().try_for_each(|(_, layer)| claims::check(layer))?;
    // What the check does not know of may panic in the library.
    let done = catch_unwind(AssertUnwindSafe(|| {
        let stage = Stage::builder().resolver(files.resolver()).open(&files.root);
        let stage = stage.map_err(|error| failed(format!("{error:#}")))?;
        read(Scene::of(&stage, file.len())?)
    }));
    done.unwrap_or_else(|panic| {
        let text = panic.downcast_ref::<String>().map(String::as_str);
        let text = text.or(panic.downcast_ref::<&str>().copied());
        Err(failed(text.unwrap_or("a panic").to_owned()).into())
    })
}

//! Transforms of prims: `xformOpOrder` and the operations that it names.

use super::array::Array;
use crate::authoring::groom::curve_sets::Numbers;
use bevy::math::{DAffine3, DMat3, DQuat, DVec3};
use openusd::sdf::Value;

pub const ORDER: &str = "xformOpOrder";
const RESET: &str = "!resetXformStack!";
pub const INVERTED: &str = "!invert!";

/// The space of a prim, by the names of its operations, outermost first, and their values.
///
/// # Errors
/// What is wrong with an operation: its name, what was found and what was expected.
pub fn space_of<E: From<Wrong>>(
    above: DAffine3,
    order: &[String],
    mut value: impl FnMut(&str) -> Result<Option<Value>, E>,
) -> Result<DAffine3, E> {
    // What is before a reset does not count.
    let reset = order.iter().rposition(|name| name == RESET);
    let operations = &order[reset.map_or(0, |reset| reset + 1)..];
    let mut space = if reset.is_some() { DAffine3::IDENTITY } else { above };
    for name in operations {
        let (name, is_inverted) = match name.strip_prefix(INVERTED) {
            Some(name) => (name, true),
            None => (name.as_str(), false),
        };
        let Some(value) = value(name)? else {
            continue;
        };
        let local = operation(name, value)?;
        space *= if is_inverted { local.inverse() } else { local };
    }
    Ok(space)
}

/// An operation that cannot be.
pub struct Wrong {
    pub name: String,
    pub found: String,
    pub expected: &'static str,
}

fn operation(name: &str, value: Value) -> Result<DAffine3, Wrong> {
    let kind = name.strip_prefix("xformOp:").unwrap_or(name).split(':').next().unwrap_or_default();
    let wrong = |found: &str, expected| {
        Err(Wrong { name: name.to_owned(), found: found.to_owned(), expected })
    };
    if let Some(matrix) = matrix_or_turn(kind, &value) {
        return Ok(matrix);
    }
    let found: &'static str = (&value).into();
    let Some(numbers) = Array::of(value) else {
        return wrong(found, "numbers of a scale, translation, rotation or matrix");
    };
    let count = (&numbers).len();
    let vector = || match count {
        3 => Ok(DVec3::from_array([0, 1, 2].map(|k| (&numbers).get(k)))),
        _ => wrong(found, "three numbers").map(|_: DAffine3| DVec3::ZERO),
    };
    let number = || match count {
        1 => Ok((&numbers).get(0)),
        _ => wrong(found, "one number").map(|_: DAffine3| 0.0),
    };
    let turn = |axis: DVec3, degrees: f64| DQuat::from_axis_angle(axis, degrees.to_radians());
    if let Some(axes) = kind.strip_prefix("rotate") {
        let axis = |name: u8| match name {
            b'X' => Some((DVec3::X, 0)),
            b'Y' => Some((DVec3::Y, 1)),
            b'Z' => Some((DVec3::Z, 2)),
            _ => None,
        };
        let quat = match axes.as_bytes() {
            [name] if axis(*name).is_some() => {
                turn(axis(*name).map_or(DVec3::X, |(axis, _)| axis), number()?)
            }
            // The axis named first turns first.
            names @ [_, _, _] if names.iter().all(|name| axis(*name).is_some()) => {
                let angles = vector()?;
                let turns = names.iter().filter_map(|name| axis(*name));
                turns.fold(DQuat::IDENTITY, |q, (axis, k)| turn(axis, angles[k]) * q)
            }
            _ => return wrong(kind, "rotateX, Y, Z or three of them"),
        };
        return Ok(DAffine3::from_quat(quat));
    }
    Ok(match kind {
        "translate" => DAffine3::from_translation(vector()?),
        "translateX" => DAffine3::from_translation(DVec3::X * number()?),
        "translateY" => DAffine3::from_translation(DVec3::Y * number()?),
        "translateZ" => DAffine3::from_translation(DVec3::Z * number()?),
        "scale" => DAffine3::from_scale(vector()?),
        "scaleX" => DAffine3::from_scale(DVec3::new(number()?, 1.0, 1.0)),
        "scaleY" => DAffine3::from_scale(DVec3::new(1.0, number()?, 1.0)),
        "scaleZ" => DAffine3::from_scale(DVec3::new(1.0, 1.0, number()?)),
        _ => return wrong(kind, "a scale, translate, rotate, orient or transform"),
    })
}

/// Operations whose values are no lists of numbers.
fn matrix_or_turn(kind: &str, value: &Value) -> Option<DAffine3> {
    let turned = |w: f64, x: f64, y: f64, z: f64| {
        let quat = DQuat::from_xyzw(x, y, z, w);
        DAffine3::from_quat(if quat.length() > 0.0 { quat.normalize() } else { DQuat::IDENTITY })
    };
    Some(match (kind, value) {
        ("transform", Value::Matrix4d(matrix)) => {
            // Row vectors: rows are the images of the axes.
            let row = |k: usize| DVec3::new(matrix.0[k], matrix.0[k + 1], matrix.0[k + 2]);
            let axes = DMat3::from_cols(row(0), row(4), row(8));
            DAffine3::from_mat3_translation(axes, row(12))
        }
        ("orient", Value::Quatf(q)) => turned(q.w.into(), q.x.into(), q.y.into(), q.z.into()),
        ("orient", Value::Quatd(q)) => turned(q.w, q.x, q.y, q.z),
        ("orient", Value::Quath(q)) => turned(q.w.into(), q.x.into(), q.y.into(), q.z.into()),
        _ => return None,
    })
}

//! What sleep compares the present with, taken down and put back.

use super::systems::{Conditions, SeenCollider, SleepSnapshot};
use crate::{
    base::tape::Tape,
    solver::rod::{
        obstacle::Solid,
        shape::{Placed, Shape},
    },
};
use bevy::prelude::*;

impl SleepSnapshot {
    /// Of settings it holds whether they are the `present` ones.
    pub(crate) fn record(&mut self, tape: &mut Tape<'_>, present: Option<Conditions>) {
        let mut is_same = self.conditions.is_some() && self.conditions == present;
        tape.flags([&mut is_same]);
        if let Tape::Read(_) = tape {
            self.conditions = present.filter(|_| is_same);
        }
        self.pose.record(tape);
        let count = tape.count(self.solids.len(), size_of::<f32>());
        self.solids.resize_with(count, || SeenCollider {
            solid: Solid::HalfSpace { normal: Vec3::Y, point: Vec3::ZERO },
            friction: 0.0,
            rotation: Quat::IDENTITY,
        });
        for SeenCollider { solid, friction, rotation } in &mut self.solids {
            record_solid(solid, tape);
            tape.value(friction);
            tape.value(rotation);
        }
    }
}

/// A solid; hulls and baked distances without their shape, which stays that which is known.
fn record_solid(solid: &mut Solid, tape: &mut Tape<'_>) {
    let mut kind = match solid {
        Solid::HalfSpace { .. } => 0u8,
        Solid::Capsule { .. } => 1,
        Solid::Cylinder { .. } => 2,
        Solid::Placed(_) => 3,
    };
    let before = kind;
    tape.value(&mut kind);
    if kind != before {
        *solid = match kind {
            1 => Solid::Capsule { a: Vec3::ZERO, b: Vec3::ZERO, radius: 0.0 },
            2 => {
                Solid::Cylinder { center: Vec3::ZERO, axis: Vec3::Y, radius: 0.0, half_height: 0.0 }
            }
            3 => Solid::Placed(Placed {
                shape: Shape::Ellipsoid { radii: Vec3::ZERO },
                center: Vec3::ZERO,
                axes: Mat3::IDENTITY,
                scale: 1.0,
            }),
            _ => Solid::HalfSpace { normal: Vec3::Y, point: Vec3::ZERO },
        };
    }
    match solid {
        Solid::HalfSpace { normal, point } => tape.values([normal, point]),
        Solid::Capsule { a, b, radius } => {
            tape.values([a, b]);
            tape.value(radius);
        }
        Solid::Cylinder { center, axis, radius, half_height } => {
            tape.values([center, axis]);
            tape.values([radius, half_height]);
        }
        Solid::Placed(Placed { shape, center, axes, scale }) => {
            tape.value(center);
            tape.value(axes);
            tape.value(scale);
            record_shape(shape, tape);
        }
    }
}

fn record_shape(shape: &mut Shape, tape: &mut Tape<'_>) {
    let mut kind = match shape {
        Shape::Cuboid { .. } => 0u8,
        Shape::Ellipsoid { .. } => 1,
        Shape::Hull(_) | Shape::Grid(_) => 2,
        Shape::Hat { holds: false, .. } => 3,
        Shape::Hat { holds: true, .. } => 4,
    };
    let before = kind;
    tape.value(&mut kind);
    match kind {
        _ if kind == before => {}
        0 => *shape = Shape::Cuboid { half: Vec3::ZERO, rounding: 0.0 },
        1 => *shape = Shape::Ellipsoid { radii: Vec3::ZERO },
        3 | 4 => *shape = Shape::Hat { radii: Vec3::ZERO, rim: 0.0, holds: kind == 4 },
        _ => {}
    }
    match shape {
        Shape::Cuboid { half, rounding } if kind == 0 => {
            tape.value(half);
            tape.value(rounding);
        }
        Shape::Ellipsoid { radii } if kind == 1 => tape.value(radii),
        Shape::Hat { radii, rim, .. } if kind >= 3 => {
            tape.value(radii);
            tape.value(rim);
        }
        _ => {}
    }
}

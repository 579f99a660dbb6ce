//! Avian's colliders as obstacles for hair (feature `avian`).

use super::{ColliderShape, HairCollider};
use crate::{
    fault::{FaultKind, HairFault},
    schedule::{HairStep, HairSystems, HairTick},
};
use avian3d::{
    parry::shape::{SharedShape, TypedShape},
    prelude::{Collider, ColliderDisabled},
};
use bevy::{math::Isometry3d, prelude::*};

/// Keeps hair out of the avian [`Collider`] of the same entity, with or without a rigid body.
///
/// Balls, capsules, cylinders, half spaces and compounds of these become [`HairCollider`]s on children
/// that follow the collider: its shape in the next tick when that changes, the body in every tick.
/// They go when the collider, its body or this component does, or while the collider carries
/// [`ColliderDisabled`]. What hair does not know is told once as
/// [`FaultKind::Collider`](crate::FaultKind::Collider). As for any hair collider an uneven scale counts as its mean.
/// Hair pushes no bodies.
///
/// ```
/// # use avian3d::prelude::*; use bevy::prelude::*; use bevy_keratin::prelude::*;
/// # fn setup(mut commands: Commands) {
/// commands.spawn((RigidBody::Kinematic, Collider::capsule(0.2, 0.5), AvianHairCollider::default()));
/// # }
/// ```
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq)]
#[require(Unknown)]
pub struct AvianHairCollider {
    /// Coulomb friction of hair on it, whatever bodies feel: [`HairCollider::friction`].
    pub friction: f32,
}

impl Default for AvianHairCollider {
    fn default() -> Self {
        Self { friction: HairCollider::default().friction }
    }
}

/// An avian shape that hair does not know: which, what was expected and what to use instead.
#[derive(thiserror::Error, Reflect, Clone, Debug, PartialEq)]
#[reflect(Clone, PartialEq)]
#[error(
    "hair cannot touch avian's {found}, expected a ball, capsule, cylinder, half space or a \
     compound of these: {hint}"
)]
pub struct AvianShapeError {
    /// The shape.
    pub found: &'static str,
    /// What to use instead.
    pub hint: &'static str,
}

/// What of a collider hair does not know, and has been told.
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq)]
struct Unknown(Option<AvianShapeError>);

/// A child that stands for the collider of its parent, or for a part of it.
#[derive(Component, Reflect, Clone, Debug, Default)]
#[reflect(Component, Default, Clone)]
struct AvianPart;

pub(super) fn plugin(app: &mut App) {
    app.register_type::<AvianHairCollider>()
        .register_type::<Unknown>()
        .register_type::<AvianShapeError>()
        .register_type::<AvianPart>()
        .add_systems(
            HairTick,
            follow_colliders.after(HairSystems::First).before(HairSystems::Roots),
        );
}

/// Makes the parts of every body what its collider is now.
fn follow_colliders(
    step: Res<HairStep>,
    mut bodies: Query<
        (Entity, &Collider, &AvianHairCollider, &mut Unknown, Option<&Children>),
        Without<ColliderDisabled>,
    >,
    mut parts: Query<
        (Entity, Option<&ChildOf>, &mut HairCollider, &mut Transform),
        With<AvianPart>,
    >,
    mut faults: MessageWriter<HairFault>,
    mut commands: Commands,
) {
    if step.index != 0 {
        return;
    }
    for (part, body, ..) in &parts {
        if body.is_none_or(|body| !bodies.contains(body.parent())) {
            commands.entity(part).despawn();
        }
    }
    for (body, collider, &AvianHairCollider { friction }, mut unknown, children) in &mut bodies {
        let mut shapes = Vec::new();
        let why = gather(collider.shape(), Isometry3d::IDENTITY, &mut shapes).err();
        if unknown.set_if_neq(Unknown(why.clone()))
            && let Some(why) = why
        {
            faults.write(
                HairFault::caused(FaultKind::Collider, why, "hair goes through it").of(body),
            );
        }
        let mut wanted = shapes
            .into_iter()
            .map(|(shape, at)| (HairCollider { shape, friction }, Transform::from_isometry(at)));
        for child in children.into_iter().flat_map(|all| all.iter()) {
            let Ok((part, _, mut collider, mut place)) = parts.get_mut(child) else { continue };
            match wanted.next() {
                Some((wanted, at)) => {
                    collider.set_if_neq(wanted);
                    place.set_if_neq(at);
                }
                None => commands.entity(part).despawn(),
            }
        }
        for (collider, at) in wanted {
            commands.spawn((AvianPart, collider, at, ChildOf(body)));
        }
    }
}

/// The shapes that make up `shape`, seen from its collider. Unknown ones are left out; the first of
/// them is the error.
fn gather(
    shape: &SharedShape,
    at: Isometry3d,
    into: &mut Vec<(ColliderShape, Isometry3d)>,
) -> Result<(), AvianShapeError> {
    let unknown = |found, hint| Err(AvianShapeError { found, hint });
    let known = match shape.as_typed_shape() {
        TypedShape::Ball(ball) => (ColliderShape::Sphere(Sphere::new(ball.radius)), at),
        TypedShape::Capsule(capsule) => {
            let [a, b] = [capsule.segment.a, capsule.segment.b];
            let turn = Dir3::new(b - a).map_or(Quat::IDENTITY, |axis| {
                // Along Y already, whichever end is up: no half turn.
                Quat::from_rotation_arc(Vec3::Y, axis * axis.y.signum())
            });
            let shape = Capsule3d::new(capsule.radius, a.distance(b));
            (ColliderShape::Capsule(shape), at * Isometry3d::new(a.midpoint(b), turn))
        }
        TypedShape::Cylinder(c) => {
            (ColliderShape::Cylinder(Cylinder::new(c.radius, 2.0 * c.half_height)), at)
        }
        TypedShape::HalfSpace(half) => match Dir3::new(half.normal) {
            Ok(normal) => (ColliderShape::Plane(InfinitePlane3d { normal }), at),
            Err(_) => return unknown("half space without normal", "give it the way out of it"),
        },
        TypedShape::Compound(compound) => {
            let parts = compound.shapes().iter().map(|(pose, shape)| {
                let pose = Isometry3d::new(pose.translation, pose.rotation);
                gather(shape, at * pose, into)
            });
            // All of them, whatever one of them is.
            return parts.fold(Ok(()), Result::and);
        }
        TypedShape::Cuboid(_) | TypedShape::RoundCuboid(_) => {
            return unknown(
                "cuboid",
                "a half space does for floors and walls, capsules or a cylinder for furniture",
            );
        }
        TypedShape::Cone(_) | TypedShape::RoundCone(_) => {
            return unknown("cone", "use a capsule or a cylinder");
        }
        TypedShape::RoundCylinder(_) => return unknown("round cylinder", "use a plain one"),
        TypedShape::ConvexPolyhedron(_) | TypedShape::RoundConvexPolyhedron(_) => {
            return unknown("convex hull", FIT);
        }
        TypedShape::TriMesh(_) => return unknown("triangle mesh", FIT),
        TypedShape::HeightField(_) | TypedShape::Voxels(_) => {
            return unknown("terrain", "use a half space where hair comes near it");
        }
        TypedShape::Segment(_)
        | TypedShape::Triangle(_)
        | TypedShape::RoundTriangle(_)
        | TypedShape::Polyline(_) => return unknown("line or triangle", "use a thin capsule"),
        TypedShape::Custom(_) => return unknown("custom shape", FIT),
    };
    into.push(known);
    Ok(())
}

const FIT: &str = "use a compound of capsules, or groom::fit_joint_capsules for a character's skin";

//! Avian's colliders as obstacles for hair (feature `avian`).

use super::{Bake, ColliderShape, ConvexHull, DistanceGrid, HairCollider, Openings};
use crate::base::{
    fault::{FaultKind, HairFault},
    schedule::{HairStep, HairSystems, HairTick},
    setting::{self, Ranged, setting},
};
use avian3d::{
    parry::shape::{Cone, SharedShape, TriMesh, TypedShape},
    prelude::{Collider, ColliderDisabled},
};
use bevy::{math::Isometry3d, prelude::*};
use std::sync::Arc;

setting! {
    /// Keeps hair out of the avian [`Collider`] of the same entity, with or without a rigid body.
    ///
    /// Balls, capsules, cylinders, cones, half spaces, cuboids, convex hulls, triangle meshes and compounds of
    /// these become [`HairCollider`]s on children that follow the collider: its shape in the next tick when
    /// that changes, the body in every tick. A triangle mesh is baked in the first tick that finds it,
    /// which makes that tick slow; one with large openings has no inside and is a fault.
    /// They are removed with the collider, its body or this component, and while the collider has
    /// [`ColliderDisabled`]. Unsupported shapes are reported once as
    /// [`FaultKind::Collider`](crate::FaultKind::Collider). A non-uniform scale acts as
    /// on any hair collider. Hair does not push bodies.
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
        /// Coulomb friction of hair on it, independent of the body's: [`HairCollider::friction`].
        pub friction: f32 = 0.3, in FRICTION: 0.0..=100.0, safe 0.0..=2.0, "hair has 0.2 to 0.4";
        /// Number of cells along the longest side of a triangle mesh: parts thinner than two cells
        /// are lost.
        pub cells: u32 = 48, in CELLS: 4.0..=200.0, "the memory grows with its cube";
    }
}

/// An unsupported avian shape: which, what was expected and what to use instead.
#[derive(thiserror::Error, Reflect, Clone, Debug, PartialEq)]
#[reflect(Clone, PartialEq)]
#[error(
    "hair cannot touch avian's {found}, expected a ball, capsule, cylinder, cone, half space, cuboid, \
     convex hull, closed triangle mesh or a compound of these: {hint}"
)]
pub struct AvianShapeError {
    /// The shape.
    pub found: &'static str,
    /// What is wrong with it, or what to use instead.
    pub hint: String,
}

/// The unsupported shape of a collider that has been reported.
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq)]
#[require(Baked)]
struct Unknown(Option<AvianShapeError>);

/// Shapes baked from a collider's hulls and triangle meshes, with this resolution.
#[derive(Component, Reflect, Clone, Default)]
#[reflect(Component, Default, Clone)]
struct Baked {
    cells: u32,
    #[reflect(ignore)]
    shapes: Vec<BakedShape>,
}

#[derive(Clone)]
struct BakedShape {
    of: SharedShape,
    made: Result<ColliderShape, String>,
    /// Whether it was used in this tick.
    is_used: bool,
}

impl Baked {
    /// The shape that `make` gives, from the cache if it was made before.
    fn get(
        &mut self,
        of: &SharedShape,
        make: impl FnOnce(f32) -> Result<ColliderShape, String>,
    ) -> Result<ColliderShape, String> {
        if let Some(known) = self.shapes.iter_mut().find(|known| Arc::ptr_eq(&known.of.0, &of.0)) {
            known.is_used = true;
            return known.made.clone();
        }
        let made = make(self.cells as f32);
        self.shapes.push(BakedShape { of: of.clone(), made: made.clone(), is_used: true });
        made
    }
}

/// The hull of points.
fn hull(points: &[Vec3]) -> Result<ColliderShape, String> {
    ConvexHull::new(points).map(ColliderShape::Hull).map_err(|error| error.to_string())
}

/// The inside of a mesh as a grid with `cells` cells along its longest side.
fn bake(mesh: &TriMesh, cells: f32) -> Result<ColliderShape, String> {
    let vertices = mesh.vertices();
    let bounds = |(low, high): (Vec3, Vec3), p: &Vec3| (low.min(*p), high.max(*p));
    let (low, high) = vertices.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), bounds);
    let how = Bake { cell: (high - low).max_element() / cells, openings: Openings::Fill };
    let grid = DistanceGrid::bake_with(vertices, mesh.indices(), &how);
    grid.map(ColliderShape::Grid).map_err(|error| error.to_string())
}

/// A child that stands for the collider of its parent, or for a part of it.
#[derive(Component, Reflect, Clone, Debug, Default)]
#[reflect(Component, Default, Clone)]
struct AvianPart;

pub(super) fn plugin(app: &mut App) {
    setting::component::<AvianHairCollider>(app);
    app.register_type::<Unknown>()
        .register_type::<Baked>()
        .register_type::<AvianShapeError>()
        .register_type::<AvianPart>()
        .add_systems(
            HairTick,
            follow_colliders.after(HairSystems::First).before(HairSystems::Roots),
        );
}

/// Updates the child colliders of every body to its present collider.
fn follow_colliders(
    step: Res<HairStep>,
    mut bodies: Query<
        (Entity, &Collider, &AvianHairCollider, &mut Unknown, &mut Baked, Option<&Children>),
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
    for (body, collider, settings, mut unknown, mut baked, children) in &mut bodies {
        let AvianHairCollider { friction, cells } = settings.clamped();
        let baked = baked.bypass_change_detection();
        if baked.cells != cells {
            *baked = Baked { cells, ..default() };
        }
        let mut shapes = Vec::new();
        let why = gather(collider.shape(), Isometry3d::IDENTITY, baked, &mut shapes).err();
        baked.shapes.retain_mut(|shape| core::mem::take(&mut shape.is_used));
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
    baked: &mut Baked,
    into: &mut Vec<(ColliderShape, Isometry3d)>,
) -> Result<(), AvianShapeError> {
    let unknown = |found, hint: &str| Err(AvianShapeError { found, hint: hint.to_owned() });
    let made = |found, made: Result<ColliderShape, String>| match made {
        Ok(shape) => Ok((shape, at)),
        Err(hint) => Err(AvianShapeError { found, hint }),
    };
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
            Err(_) => return unknown("half space without normal", "give it its outward normal"),
        },
        TypedShape::Compound(compound) => {
            let parts = compound.shapes().iter().map(|(pose, shape)| {
                let pose = Isometry3d::new(pose.translation, pose.rotation);
                gather(shape, at * pose, baked, into)
            });
            // Gathers all of them even if one is unsupported.
            return parts.fold(Ok(()), Result::and);
        }
        TypedShape::Cuboid(c) => {
            let cuboid = Cuboid { half_size: c.half_extents };
            (ColliderShape::Cuboid { cuboid, rounding: 0.0 }, at)
        }
        TypedShape::RoundCuboid(round) => {
            let rounding = round.border_radius;
            let cuboid = Cuboid { half_size: round.inner_shape.half_extents + rounding };
            (ColliderShape::Cuboid { cuboid, rounding }, at)
        }
        TypedShape::Cone(cone) => made("cone", baked.get(shape, |_| hull(&around(cone))))?,
        TypedShape::RoundCone(_) => return unknown("round cone", "use a plain one"),
        TypedShape::RoundCylinder(_) => return unknown("round cylinder", "use a plain one"),
        TypedShape::ConvexPolyhedron(convex) => {
            made("convex hull", baked.get(shape, |_| hull(convex.points())))?
        }
        TypedShape::RoundConvexPolyhedron(_) => {
            return unknown("round convex hull", "use a plain one");
        }
        TypedShape::TriMesh(mesh) => {
            made("triangle mesh", baked.get(shape, |cells| bake(mesh, cells)))?
        }
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

/// Corners around a cone.
fn around(cone: &Cone) -> Vec<Vec3> {
    const SIDES: usize = 24;
    let side = core::f32::consts::TAU / SIDES as f32;
    let radius = cone.radius / (0.5 * side).cos();
    let foot = |k: usize| {
        let (sine, cosine) = (side * k as f32).sin_cos();
        Vec3::new(radius * cosine, -cone.half_height, radius * sine)
    };
    (0..SIDES).map(foot).chain([Vec3::Y * cone.half_height]).collect()
}

const FIT: &str =
    "use a compound of capsules, or collider_fit::fit_joint_capsules for a character's skin";

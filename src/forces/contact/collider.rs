//! Colliders and their shapes.

use super::{ConvexHull, DistanceGrid, bake::HullError};
use crate::{
    base::{
        setting::{InvalidValue, Ranged, ValueRange, Violations, setting},
        stretch::{Stretch, Stretched},
    },
    hair::strand::TickPose,
};
use bevy::prelude::*;

setting! {
    /// A solid that hair cannot enter: head, shoulders, floor, pillow. Placed by its transform, which
    /// may move, turn and scale it; axes of capsule and cylinder are along Y, a plane's solid side is
    /// against its normal.
    ///
    /// Scaled unevenly a ball is an ellipsoid, a capsule is longer or shorter with ends as round as before,
    /// and the edges of a box are as round as the smallest scale makes them; distances to a grid are to first
    /// order. What cannot be as drawn, a capsule or cylinder squashed across or anything sheared, is
    /// reported with the scale that it has instead.
    ///
    /// ```
    /// # use bevy_keratin::prelude::*; use bevy::prelude::*;
    /// # fn setup(mut commands: Commands) {
    /// commands.spawn((HairCollider::sphere(0.09).unwrap(), Transform::from_xyz(0.0, 1.6, 0.0)));
    /// # }
    /// ```
    #[derive(Component, Reflect, Clone, Debug, PartialEq)]
    #[reflect(Component, Default, Clone, PartialEq)]
    #[require(Transform, TickPose, Stretch<Self>)]
    pub struct HairCollider {
        /// Its shape, in the units of its transform.
        pub shape: ColliderShape = ColliderShape::Sphere(Sphere { radius: 0.09 })
            => Ranged::clamp_values;
        /// Coulomb friction of hair on it; 0.4 when wet.
        pub friction: f32 = 0.3, in FRICTION: 0.0..=100.0, safe 0.0..=2.0, "hair has 0.2 to 0.4";
    }
}

/// The shapes of a [`HairCollider`]: Bevy's primitives and what is made of points and meshes. A
/// grid is the most expensive for nodes near it: it is sampled lane by lane.
#[derive(Reflect, Clone, Debug, PartialEq)]
#[reflect(Clone, PartialEq)]
pub enum ColliderShape {
    /// A ball.
    Sphere(Sphere),
    /// A capsule along Y.
    Capsule(Capsule3d),
    /// The half-space below a plane through the origin.
    Plane(InfinitePlane3d),
    /// A solid cylinder along Y.
    Cylinder(Cylinder),
    /// A box, optionally with rounded edges.
    Cuboid {
        /// Its size, edges included.
        cuboid: Cuboid,
        /// Radius of its edges (m): at most half of its shortest side.
        rounding: f32,
    },
    /// An ellipsoid along the axes. Distances are exact to a millionth of its size.
    Ellipsoid {
        /// Half its axes (m): the longest at most 100 times the shortest.
        radii: Vec3,
    },
    /// The convex hull of points.
    Hull(ConvexHull),
    /// Any shape, baked.
    Grid(DistanceGrid),
    /// A hat, which holds hair that grows under it and keeps all else out: an ellipsoid along the axes above a plane
    /// across Y.
    Hat {
        /// Half the axes of the ellipsoid (m): the longest at most 100 times the shortest.
        radii: Vec3,
        /// Where the rim is along Y (m): below it is no hat.
        rim: f32,
        /// Whether hair of its wearer is not drawn above the rim.
        hides: bool,
    },
}

impl ColliderShape {
    /// The range of the length of a plane's normal.
    pub const NORMAL: ValueRange = ValueRange::new(
        "ColliderShape::normal's length",
        0.999..=1.001,
        "Dir3::new gives a direction",
    );
    /// The range of a radius.
    pub const RADIUS: ValueRange =
        ValueRange::new("ColliderShape::radius (m)", 1e-5..=1e5, "a head has 0.09");
    /// The range of each half side of a box.
    pub const HALF_SIZE: ValueRange =
        ValueRange::new("ColliderShape::half_size (m)", 1e-5..=1e5, "a pillow has 0.3, 0.1, 0.2");
    /// The range of the radius of a box' edges.
    pub const ROUNDING: ValueRange =
        ValueRange::new("ColliderShape::rounding (m)", 0.0..=1e5, "0 makes edges sharp");
    /// The range of the height of a hat's rim.
    pub const RIM: ValueRange =
        ValueRange::new("ColliderShape::rim (m)", -1e5..=1e5, "0 is the middle of the ellipsoid");
    /// Largest ratio of an ellipsoid's longest to its shortest axis.
    const MAX_RATIO: f32 = 100.0;
    /// The range of half the length between a capsule's centres, or half a cylinder's height.
    pub const HALF_LENGTH: ValueRange =
        ValueRange::new("ColliderShape::half_length (m)", 0.0..=1e5, "0 makes it a point");
}

impl Ranged for ColliderShape {
    fn clamp_values(&mut self, violations: &mut Violations) {
        let (radius, half_length) = match self {
            Self::Sphere(s) => (&mut s.radius, None),
            Self::Capsule(c) => (&mut c.radius, Some(&mut c.half_length)),
            Self::Cylinder(c) => (&mut c.radius, Some(&mut c.half_height)),
            Self::Hull(_) | Self::Grid(_) => return,
            // `Dir3` keeps its length, but reflection writes into it.
            Self::Plane(InfinitePlane3d { normal }) => {
                Self::NORMAL.clamp(&mut normal.length(), || 1.0, violations);
                *normal = Dir3::new(**normal).unwrap_or(Dir3::Y);
                return;
            }
            Self::Cuboid { cuboid, rounding } => {
                for side in cuboid.half_size.as_mut() {
                    Self::HALF_SIZE.clamp(side, || 0.1, violations);
                }
                let inner = 0.0..=cuboid.half_size.min_element();
                let hint = "at most half of the shortest side; 0 makes edges sharp";
                let range = ValueRange::new(Self::ROUNDING.what, inner, hint);
                range.clamp(rounding, || 0.0, violations);
                return;
            }
            Self::Ellipsoid { radii } | Self::Hat { radii, .. } => {
                for radius in radii.as_mut() {
                    Self::RADIUS.clamp(radius, || 0.09, violations);
                }
                let within = radii.max_element() / Self::MAX_RATIO..=*Self::RADIUS.valid.end();
                let hint = "the longest axis is at most 100 times the shortest";
                let range = ValueRange::new(Self::RADIUS.what, within, hint);
                for radius in radii.as_mut() {
                    range.clamp(radius, || 0.09, violations);
                }
                if let Self::Hat { rim, .. } = self {
                    Self::RIM.clamp(rim, || 0.0, violations);
                }
                return;
            }
        };
        Self::RADIUS.clamp(radius, || 0.09, violations);
        if let Some(half_length) = half_length {
            Self::HALF_LENGTH.clamp(half_length, || 0.0, violations);
        }
    }
}

impl HairCollider {
    /// A ball of `radius` (m).
    ///
    /// # Errors
    /// When the radius is not positive and finite.
    pub fn sphere(radius: f32) -> Result<Self, InvalidValue> {
        Self::from(ColliderShape::Sphere(Sphere::new(radius))).checked()
    }

    /// A capsule along Y: `radius` and `length` between the centres of its ends (m).
    ///
    /// # Errors
    /// When the radius is not positive or the length negative.
    pub fn capsule(radius: f32, length: f32) -> Result<Self, InvalidValue> {
        Self::from(ColliderShape::Capsule(Capsule3d::new(radius, length))).checked()
    }

    /// A cylinder along Y: `radius` and `height` (m).
    ///
    /// # Errors
    /// When the radius is not positive or the height negative.
    pub fn cylinder(radius: f32, height: f32) -> Result<Self, InvalidValue> {
        Self::from(ColliderShape::Cylinder(Cylinder::new(radius, height))).checked()
    }

    /// The half-space below a plane with this normal.
    pub fn plane(normal: Dir3) -> Self {
        ColliderShape::Plane(InfinitePlane3d::new(normal)).into()
    }

    /// A box of this size (m).
    ///
    /// # Errors
    /// When a side is not positive and finite.
    pub fn cuboid(size: Vec3) -> Result<Self, InvalidValue> {
        Self::rounded_cuboid(size, 0.0)
    }

    /// A box of this size with edges of this radius (m).
    ///
    /// # Errors
    /// When a side is not positive, the radius negative or more than half of the shortest side, or a
    /// value not finite.
    pub fn rounded_cuboid(size: Vec3, rounding: f32) -> Result<Self, InvalidValue> {
        let cuboid = Cuboid { half_size: 0.5 * size };
        Self::from(ColliderShape::Cuboid { cuboid, rounding }).checked()
    }

    /// An ellipsoid of these half axes (m).
    ///
    /// # Errors
    /// When one is not positive and finite, or the longest more than 100 times the shortest.
    pub fn ellipsoid(radii: Vec3) -> Result<Self, InvalidValue> {
        Self::from(ColliderShape::Ellipsoid { radii }).checked()
    }

    /// A hat that holds hair under it: an ellipsoid of these half axes (m), with its rim at a height along Y (m), below
    /// which hair hangs out. Spawn it as a child of the head or its bone, and despawn it to take it off.
    ///
    /// It holds hair that has a root under it, whatever either is a child of. To such hair it comes from above within
    /// 0.4 s, however suddenly it is there; drawn strands are under it at once. Other hair and drops stay outside, and so
    /// does this hair once the hat is in a hand. It is smooth: its friction is 0.
    ///
    /// # Errors
    /// As [`ellipsoid`](Self::ellipsoid), and when the rim's height is not finite or beyond 100 km.
    pub fn inside(radii: Vec3, rim: f32) -> Result<Self, InvalidValue> {
        let hat = ColliderShape::Hat { radii, rim, hides: false };
        Self { friction: 0.0, ..Self::from(hat) }.checked()
    }

    /// The same hat, above whose rim hair of its wearer is not drawn: for helmets, whose walls are no ellipsoids. Does
    /// nothing to other shapes.
    pub fn hiding(mut self) -> Self {
        if let ColliderShape::Hat { hides, .. } = &mut self.shape {
            *hides = true;
        }
        self
    }

    /// The convex hull of points (m): [`ConvexHull::new`].
    ///
    /// # Errors
    /// When points are not finite or span no volume.
    pub fn hull(points: &[Vec3]) -> Result<Self, HullError> {
        Ok(ColliderShape::Hull(ConvexHull::new(points)?).into())
    }

    /// A baked grid: [`DistanceGrid::bake`].
    pub fn grid(grid: DistanceGrid) -> Self {
        ColliderShape::Grid(grid).into()
    }

    /// The same collider with another friction.
    ///
    /// # Errors
    /// When it is negative or not finite.
    pub fn with_friction(self, friction: f32) -> Result<Self, InvalidValue> {
        Self { friction, ..self }.checked()
    }
}

impl From<ColliderShape> for HairCollider {
    fn from(shape: ColliderShape) -> Self {
        Self { shape, ..default() }
    }
}

impl Stretched for HairCollider {
    fn suitable(&self, factors: Vec3) -> Vec3 {
        let across = (factors.x * factors.z).sqrt();
        let of_radii = |radii: Vec3| {
            let scaled = radii * factors;
            scaled.max(Vec3::splat(scaled.max_element() / ColliderShape::MAX_RATIO)) / radii
        };
        match &self.shape {
            ColliderShape::Sphere(s) => of_radii(Vec3::splat(s.radius)),
            ColliderShape::Ellipsoid { radii } | ColliderShape::Hat { radii, .. } => {
                of_radii(*radii)
            }
            // At least as long as it is thick.
            ColliderShape::Capsule(Capsule3d { radius, half_length }) => {
                let along = factors.y.max(across * radius / (radius + half_length));
                Vec3::new(across, along, across)
            }
            ColliderShape::Cylinder(_) => Vec3::new(across, factors.y, across),
            ColliderShape::Plane(_)
            | ColliderShape::Cuboid { .. }
            | ColliderShape::Hull(_)
            | ColliderShape::Grid(_) => factors,
        }
    }

    fn stretched(self, by: Vec3) -> Self {
        let shape = match self.shape {
            ColliderShape::Sphere(s) => ColliderShape::Ellipsoid { radii: s.radius * by },
            ColliderShape::Ellipsoid { radii } => ColliderShape::Ellipsoid { radii: radii * by },
            ColliderShape::Hat { radii, rim, hides } => {
                ColliderShape::Hat { radii: radii * by, rim: rim * by.y, hides }
            }
            ColliderShape::Capsule(Capsule3d { radius, half_length }) => {
                let end = (radius + half_length) * by.y;
                let radius = radius * by.x;
                let half_length = (end - radius).max(0.0);
                ColliderShape::Capsule(Capsule3d { radius, half_length })
            }
            ColliderShape::Cylinder(Cylinder { radius, half_height }) => {
                let (radius, half_height) = (radius * by.x, half_height * by.y);
                ColliderShape::Cylinder(Cylinder { radius, half_height })
            }
            ColliderShape::Plane(InfinitePlane3d { normal }) => {
                let normal = Dir3::new(*normal / by).unwrap_or(normal);
                ColliderShape::Plane(InfinitePlane3d { normal })
            }
            ColliderShape::Cuboid { cuboid, rounding } => ColliderShape::Cuboid {
                cuboid: Cuboid { half_size: cuboid.half_size * by },
                rounding: rounding * by.min_element(),
            },
            ColliderShape::Hull(hull) => ColliderShape::Hull(hull.stretched(by)),
            ColliderShape::Grid(grid) => ColliderShape::Grid(grid.stretched(by)),
        };
        Self { shape, ..self }
    }
}

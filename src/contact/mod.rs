//! What hair touches: colliders, and other strands.

#[cfg(feature = "avian")]
mod avian;
mod coarse;
mod lanes;
pub mod model;
mod neighbours;
mod systems;

#[cfg(feature = "avian")]
pub use avian::{AvianHairCollider, AvianShapeError};
pub use systems::ContactPlugin;
pub(crate) use {
    lanes::WetRow,
    model::{Bridged, Film},
    systems::{HairReach, seen_from, with_balls},
};

use crate::{
    rod::obstacle::Obstacle,
    setting::{InvalidValue, Ranged, ValueRange, Violations, setting},
    strand::TickPose,
};
use bevy::prelude::*;

setting! {
    /// A solid that hair cannot enter: head, shoulders, floor, pillow. Placed by its transform; axes of
    /// capsule and cylinder are along Y, a plane's solid side is against its normal.
    ///
    /// ```
    /// # use bevy_keratin::prelude::*; use bevy::prelude::*;
    /// # fn setup(mut commands: Commands) {
    /// commands.spawn((HairCollider::sphere(0.09).unwrap(), Transform::from_xyz(0.0, 1.6, 0.0)));
    /// # }
    /// ```
    #[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Component, Default, Clone, PartialEq)]
    #[require(Transform, TickPose)]
    pub struct HairCollider {
        /// Its shape, in the units of its transform.
        pub shape: ColliderShape = ColliderShape::Sphere(Sphere { radius: 0.09 })
            => Ranged::clamp_values;
        /// Coulomb friction of hair on it; 0.4 when wet.
        pub friction: f32 = 0.3, in FRICTION: 0.0..=100.0, safe 0.0..=2.0, "hair has 0.2 to 0.4";
    }
}

/// The shapes of a [`HairCollider`], Bevy's primitives.
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
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
}

impl ColliderShape {
    /// The range of a radius.
    pub const RADIUS: ValueRange =
        ValueRange::new("ColliderShape::radius (m)", 1e-5..=1e5, "a head has 0.09");
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
            Self::Plane(_) => return,
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

setting! {
    /// How strands keep apart: equation 18 of \[B\]. Component of a [`Hair`](crate::Hair); where absent,
    /// [`HairDefault<LockContact>`](crate::HairDefault) holds.
    ///
    /// A simulated strand stands for a lock of hair, so the radius is the lock's.
    #[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Component, Default, Clone, PartialEq)]
    pub struct LockContact {
        /// r, the radius of a strand; also the distance kept from colliders. 0 turns contact between
        /// strands off.
        pub radius: f32 = 1e-3, "m" in RADIUS: 0.0..=1.0, safe 0.0..=0.01, "1e-3 is a thin lock";
        /// α, the acceleration of strands whose axes meet. Safe to about 8 r/Δt²; 0 turns contact
        /// between strands off.
        pub strength: f32 = 20.0, "m/s²" in STRENGTH: 0.0..=1e6, safe 0.0..=1e3,
            "20 parts locks gently";
    }
}

/// The colliders as one hair sees them in this substep, in its frame. Written by `Interaction`, read
/// by `Projection`.
#[derive(Component, Reflect, Clone, Debug, Default)]
#[reflect(Component, Default, Clone)]
pub struct Obstacles {
    /// The solids.
    #[reflect(ignore)]
    pub solids: Vec<Obstacle>,
    /// The colliders that it may touch in this tick.
    #[reflect(ignore)]
    near: Vec<Entity>,
}

/// The pairs of strands of one hair that may touch.
#[derive(Component, Reflect, Clone, Debug, Default)]
#[reflect(Component, Default, Clone)]
pub struct LockNeighbours {
    #[reflect(ignore)]
    lists: neighbours::Neighbours,
    /// The strands that take part in this tick, and whether the carried ones do.
    #[reflect(ignore)]
    members: (Vec<Entity>, bool),
    /// Whether it has been told that strands are too fine.
    #[reflect(ignore)]
    is_told: bool,
}

impl Film {
    /// The bridges between strands that touch at a distance of axes of `reach` (m), as long as lists
    /// of neighbours know them.
    pub(crate) fn between(reach: f32) -> Self {
        Self { reach, longest: neighbours::LONGEST_BRIDGE * reach }
    }
}

impl LockNeighbours {
    /// How many nodes the lists are for.
    pub(crate) fn nodes(&self) -> usize {
        self.lists.nodes()
    }

    /// Asks for lists that know bridges of water this long (m), from the next ones on.
    pub(crate) fn set_extra_margin(&mut self, longest: f32) {
        self.lists.set_extra_margin(longest);
    }

    /// The bridges of water at every node, where contact has seen them last. `wet` has a row for each,
    /// in the order of the hair's strands.
    pub(crate) fn bridges(
        &mut self,
        wet: &mut Vec<WetRow>,
        film: Film,
    ) -> impl Iterator<Item = Bridged> {
        self.lists.bridges(wet, film)
    }

    /// How many pairs of node and edge are watched, rounded up to groups of eight for each node.
    pub fn pairs(&self) -> usize {
        self.lists.pairs()
    }
}

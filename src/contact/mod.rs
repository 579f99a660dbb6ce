//! What hair touches: colliders, and other strands.

#[cfg(feature = "avian")]
mod avian;
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
    systems::seen_from,
};

use crate::{
    rod::obstacle::Obstacle,
    setting::{Bound, HairSetting, InvalidValue, Notes},
    strand::TickPose,
};
use bevy::prelude::*;

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
    pub shape: ColliderShape,
    /// Coulomb friction of hair on it. Default 0.3 (dry hair; wet 0.4), safe 0…2.
    pub friction: f32,
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

impl Default for HairCollider {
    fn default() -> Self {
        Self { shape: ColliderShape::Sphere(Sphere::new(0.09)), friction: 0.3 }
    }
}

const RADIUS: Bound = Bound::new("a collider's radius (m)", 1e-5, 1e5, "a head has 0.09");
const LENGTH: Bound = Bound::new("a collider's half length (m)", 0.0, 1e5, "0 makes it a point");
const FRICTION: Bound = Bound::new("HairCollider::friction", 0.0, 100.0, "hair has 0.2 to 0.4");

impl HairCollider {
    /// A ball of `radius` (m).
    ///
    /// # Errors
    /// When the radius is not positive and finite.
    pub fn sphere(radius: f32) -> Result<Self, InvalidValue> {
        RADIUS.check(radius)?;
        Ok(ColliderShape::Sphere(Sphere::new(radius)).into())
    }

    /// A capsule along Y: `radius` and `length` between the centres of its ends (m).
    ///
    /// # Errors
    /// When the radius is not positive or the length negative.
    pub fn capsule(radius: f32, length: f32) -> Result<Self, InvalidValue> {
        RADIUS.check(radius)?;
        LENGTH.check(length * 0.5)?;
        Ok(ColliderShape::Capsule(Capsule3d::new(radius, length)).into())
    }

    /// A cylinder along Y: `radius` and `height` (m).
    ///
    /// # Errors
    /// When the radius is not positive or the height negative.
    pub fn cylinder(radius: f32, height: f32) -> Result<Self, InvalidValue> {
        RADIUS.check(radius)?;
        LENGTH.check(height * 0.5)?;
        Ok(ColliderShape::Cylinder(Cylinder::new(radius, height)).into())
    }

    /// The half-space below a plane with this normal.
    pub fn plane(normal: Dir3) -> Self {
        ColliderShape::Plane(InfinitePlane3d::new(normal)).into()
    }

    /// The same collider with another friction, taken to the nearest valid value.
    pub fn with_friction(mut self, friction: f32) -> Self {
        self.friction = FRICTION.mend(friction, 0.3, &Notes::default());
        self
    }

    /// The collider with every value in its valid range.
    pub(crate) fn valid(&self) -> Self {
        self.mended(&Notes::default())
    }

    fn mended(&self, notes: &Notes) -> Self {
        let radius = |r| RADIUS.mend(r, 0.09, notes);
        let half = |h| LENGTH.mend(h, 0.0, notes);
        let shape = match self.shape {
            ColliderShape::Sphere(s) => ColliderShape::Sphere(Sphere::new(radius(s.radius))),
            ColliderShape::Capsule(c) => ColliderShape::Capsule(Capsule3d {
                radius: radius(c.radius),
                half_length: half(c.half_length),
            }),
            ColliderShape::Plane(p) => ColliderShape::Plane(p),
            ColliderShape::Cylinder(c) => ColliderShape::Cylinder(Cylinder {
                radius: radius(c.radius),
                half_height: half(c.half_height),
            }),
        };
        Self { shape, friction: FRICTION.mend(self.friction, 0.3, notes) }
    }
}

impl From<ColliderShape> for HairCollider {
    fn from(shape: ColliderShape) -> Self {
        Self { shape, friction: 0.3 }
    }
}

/// How strands keep apart: equation 18 of \[B\]. Component of a [`Hair`](crate::Hair); where absent,
/// [`HairDefault<LockContact>`](crate::HairDefault) holds.
///
/// A simulated strand stands for a lock of hair, so the radius is the lock's.
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct LockContact {
    /// r, the radius of a strand (m); also the distance kept from colliders. Default 1e-3,
    /// safe 0…0.01; 0 turns contact between strands off.
    pub radius: f32,
    /// α, the acceleration of strands whose axes meet (m/s²). Default 20, safe 0 to about 8 r/Δt²;
    /// 0 turns contact between strands off.
    pub strength: f32,
}

impl Default for LockContact {
    fn default() -> Self {
        Self { radius: 1e-3, strength: 20.0 }
    }
}

const LOCK_RADIUS: Bound = Bound::new("LockContact::radius (m)", 0.0, 1.0, "1e-3 is a thin lock");
const LOCK_STRENGTH: Bound =
    Bound::new("LockContact::strength (m/s²)", 0.0, 1e6, "20 parts locks gently");

impl HairSetting for LockContact {
    fn mended(&self, notes: &Notes) -> Self {
        let d = Self::default();
        Self {
            radius: LOCK_RADIUS.mend(self.radius, d.radius, notes),
            strength: LOCK_STRENGTH.mend(self.strength, d.strength, notes),
        }
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
}

impl Obstacles {
    /// The same for a step over the last `substeps` substeps: surfaces go as much farther.
    pub(crate) fn over(&self, substeps: u32) -> Vec<Obstacle> {
        let mut solids = self.solids.clone();
        for motion in solids.iter_mut().filter_map(|solid| solid.motion.as_mut()) {
            let once = *motion;
            (1..substeps).for_each(|_| *motion = once * *motion);
        }
        solids
    }
}

/// The pairs of strands of one hair that may touch.
#[derive(Component, Reflect, Clone, Debug, Default)]
#[reflect(Component, Default, Clone)]
pub struct LockNeighbours(#[reflect(ignore)] neighbours::Neighbours);

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
        self.0.nodes()
    }

    /// Asks for lists that know bridges of water this long (m), from the next ones on.
    pub(crate) fn look_beyond(&mut self, longest: f32) {
        self.0.look_beyond(longest);
    }

    /// The bridges of water at every node, where contact has seen them last. `wet` has a row for each,
    /// in the order of the hair's strands.
    pub(crate) fn bridges(
        &mut self,
        wet: &mut Vec<WetRow>,
        film: Film,
    ) -> impl Iterator<Item = Bridged> {
        self.0.bridges(wet, film)
    }

    /// How many pairs of node and edge are watched, rounded up to groups of eight for each node.
    pub fn pairs(&self) -> usize {
        self.0.pairs()
    }
}

//! Planting: hair for a mesh that has none, by rule.
//!
//! [`Planting`] says how dense, how long, which way and how curly; [`PlantingMaps`] says where more
//! or less of it; [`Planting::plant`] makes a [`Groom`] of it and says on which triangle each strand
//! grows. The same settings, mesh and seed give the same bits.
//!
//! ```
//! # use bevy_keratin::plant::*; use bevy::prelude::*;
//! let head = Sphere::new(0.09).mesh().build();
//! let upper = |place: &RootPlace| if place.position.y > 0.03 { 1.0 } else { 0.0 };
//! let fringe = Planting { density: 5e3, length: 0.06, ..default() };
//! let planted = fringe.plant_with(&head, &PlantingMaps::new().density(&upper)).unwrap();
//! assert!(planted.groom.len() > 80);
//! ```

mod error;
mod grow;
mod map;
mod preset;
mod scalp;
mod scatter;
mod shell;
mod surface;

pub use error::PlantError;
pub use map::{ImageMap, MapChannel, PlantingMaps, RootPlace, vertex_color};
pub use preset::{HairPreset, PresetSettings};
pub use scalp::Scalp;

use crate::groom::Groom;
use crate::setting::{Bound, InvalidValue};
use bevy::prelude::*;
use core::f32::consts::TAU;
use surface::Surface;

/// Strands per square metre on a human head: 223 per cm², the mean of 175 to 300 (BioNumbers
/// 116431).
pub const HUMAN_DENSITY: f32 = 223e4;

/// The most strands that one planting gives.
pub const MAX_ROOTS: usize = 1_000_000;

/// How hair is planted on a mesh. Lengths are in the mesh's own unit, metres as a rule.
///
/// ```
/// # use bevy_keratin::plant::*; use bevy::prelude::*;
/// let scalp = Sphere::new(0.1).mesh().build();
/// // 0.2 guides per cm², 12 cm long, in curls as wide as a pencil
/// let planting = Planting {
///     density: 0.2e4,
///     length: 0.12,
///     nodes: 40,
///     curl: Some(Curl { radius: 4e-3, pitch: 15e-3, ..default() }),
///     ..default()
/// };
/// let planted = planting.plant(&scalp).unwrap();
/// assert_eq!(planted.roots.len(), planted.groom.len());
/// assert!((240..260).contains(&planted.roots.len()));
/// ```
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Default, Clone, PartialEq)]
pub struct Planting {
    /// Strands per area (1/m²; 10,000 are one per cm²). Default 10,000, which suits guides; a human
    /// has [`HUMAN_DENSITY`]. Safe 1…3e6.
    pub density: f32,
    /// The same seed gives the same strands.
    pub seed: u64,
    /// Nodes of each strand, root and tip included, equally spaced along it. Default 12, safe 2…256;
    /// at least four for each turn of a curl.
    pub nodes: u32,
    /// Length along the strand (m). Default 0.2, safe 0.005…2.
    pub length: f32,
    /// How much shorter than that a strand may be, a share. Default 0.1, safe 0…0.9.
    pub length_variation: f32,
    /// Which way strands are combed. Default [`Comb::Out`].
    pub comb: Comb,
    /// How far strands lean from the surface's normal the way they are combed (rad). Default 0,
    /// safe 0…1.4; never flat, so that they leave the scalp. Hair on a head leans by about 1.
    pub lean: f32,
    /// How far a strand's own direction may be off (rad). Default 0.08, safe 0…1.
    pub jitter: f32,
    /// Curls. Default `None`: straight.
    pub curl: Option<Curl>,
    /// Locks, whose tips draw together. Default `None`.
    pub clump: Option<Clump>,
    /// How strands turn and lie down over the mesh. Default `None`: each grows straight on.
    pub fall: Option<Fall>,
    /// Where strands are cut. Default `None`.
    pub cut: Option<Cut>,
}

impl Default for Planting {
    fn default() -> Self {
        Self {
            density: 1e4,
            seed: 0,
            nodes: 12,
            length: 0.2,
            length_variation: 0.1,
            comb: Comb::Out,
            lean: 0.0,
            jitter: 0.08,
            curl: None,
            clump: None,
            fall: None,
            cut: None,
        }
    }
}

/// Which way strands are combed: the direction in which they [lean](Planting::lean). A direction map
/// ([`PlantingMaps::direction`]) goes before it.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Default, Clone, PartialEq)]
pub enum Comb {
    /// Not at all: straight out of the surface.
    #[default]
    Out,
    /// All one way; only the part along the surface counts.
    Along(Vec3),
    /// Around a crown.
    Whorl {
        /// Its centre (m).
        center: Vec3,
        /// Angle (rad) between the way straight away from the centre, at 0, and the comb's, against
        /// the clock as seen from outside: ±π/2 goes around, π towards it.
        turn: f32,
    },
    /// Away from a plane through the hair, on both sides of it.
    Parted {
        /// A point of the plane (m).
        at: Vec3,
        /// The plane's normal; its length weighs against `along`.
        across: Vec3,
        /// What is added on both sides, such as a little to the back.
        along: Vec3,
    },
}

/// A helix around the way a strand grows.
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Default, Clone, PartialEq)]
pub struct Curl {
    /// Radius of the helix (m). Default 5 mm, safe 0.5…50 mm. Near the root it grows from nothing.
    pub radius: f32,
    /// Length along the helix's axis of one turn (m). Default 25 mm, safe 1…500 mm. Together they
    /// bend the strand with a radius of curvature of radius + (pitch/2π)²/radius.
    pub pitch: f32,
    /// By how much radius and pitch may differ from strand to strand, a share. Default 0.1,
    /// safe 0…0.9.
    pub variation: f32,
    /// Which strands turn together. Default [`CurlPhase::PerClump`].
    pub phase: CurlPhase,
}

impl Default for Curl {
    fn default() -> Self {
        Self { radius: 5e-3, pitch: 25e-3, variation: 0.1, phase: CurlPhase::default() }
    }
}

impl Curl {
    /// Length of hair in one turn (m).
    pub fn turn_length(&self) -> f32 {
        (self.pitch * self.pitch + TAU * TAU * self.radius * self.radius).sqrt()
    }

    /// The radius of a strand's bend (m): what measurements of hair give.
    pub fn curvature_radius(&self) -> f32 {
        let slope = self.pitch / TAU;
        self.radius + slope * slope / self.radius
    }
}

/// Which strands' curls begin at the same angle and turn the same way.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Default, Clone, PartialEq)]
pub enum CurlPhase {
    /// All: waves run across the whole hair.
    Same,
    /// Those of a [`Clump`]; without clumps each its own.
    #[default]
    PerClump,
    /// Each its own.
    PerStrand,
}

/// Locks: strands draw together toward their tips around one of them.
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Default, Clone, PartialEq)]
pub struct Clump {
    /// How far apart the locks' middles are at the scalp (m). Default 12 mm, safe 1…100 mm.
    pub spacing: f32,
    /// Share of the way to the lock's middle that tips go. Default 0.5, safe 0…0.95.
    pub strength: f32,
}

impl Default for Clump {
    fn default() -> Self {
        Self { spacing: 12e-3, strength: 0.5 }
    }
}

/// How strands turn toward a direction as they grow, as hair does that is heavy or combed down. They
/// keep off the mesh on their way, at rest already.
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Default, Clone, PartialEq)]
pub struct Fall {
    /// Where they turn. Default down.
    pub toward: Vec3,
    /// Over what length they turn there (m). Default 0.03, safe 0.002…10.
    pub over: f32,
    /// How far off the mesh they stay (m). Default 4 mm, safe 0…0.1.
    pub clearance: f32,
    /// How much farther off those stay that grow higher up, and so lie on top (m per m of height
    /// above the lowest root). Default 0.06, safe 0…1.
    pub layering: f32,
}

impl Default for Fall {
    fn default() -> Self {
        Self { toward: Vec3::NEG_Y, over: 0.03, clearance: 4e-3, layering: 0.06 }
    }
}

/// A plane at which strands are cut.
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Default, Clone, PartialEq)]
pub struct Cut {
    /// A point of the plane (m).
    pub at: Vec3,
    /// Toward the side where hair stays. Default up.
    pub normal: Vec3,
    /// The least length that is left, also of strands that grow beyond the plane (m). Default 0.02.
    pub least: f32,
}

impl Default for Cut {
    fn default() -> Self {
        Self { at: Vec3::ZERO, normal: Vec3::Y, least: 0.02 }
    }
}

/// Where on a mesh a strand grows, to find the place again when the mesh is skinned: the triangle's
/// vertices with the root's share of each. Shares are ≥ 0 and sum to 1.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Default, Clone, PartialEq)]
pub struct RootOnMesh {
    /// Indices of the triangle's vertices.
    pub vertices: [u32; 3],
    /// Barycentric weights of these vertices.
    pub weights: Vec3,
}

/// What planting gives.
#[derive(Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Default, Clone, PartialEq)]
pub struct Planted {
    /// The strands, in the mesh's space; with UVs if the mesh has them.
    pub groom: Groom,
    /// Where each strand grows, in the groom's order.
    pub roots: Vec<RootOnMesh>,
}

const DENSITY: Bound = Bound::new(
    "Planting::density (1/m²)",
    1e-6,
    1e12,
    "guides have 10000, a human 2230000; give what is per cm² times 10000",
);
const NODES: Bound = Bound::new("Planting::nodes", 2.0, 4096.0, "12 suit straight hair");
const LENGTH: Bound = Bound::new("Planting::length (m)", 1e-5, 1e4, "0.2 reaches the shoulders");
const SHORTER: Bound = Bound::new("Planting::length_variation", 0.0, 0.95, "0.1 is natural");
const LEAN: Bound = Bound::new(
    "Planting::lean (rad)",
    0.0,
    1.45,
    "0 stands on the surface; flatter than 1.45 strands would run into it",
);
const JITTER: Bound = Bound::new("Planting::jitter (rad)", 0.0, 1.5, "0.08 is combed, 0.5 wild");
const RADIUS: Bound = Bound::new("Curl::radius (m)", 1e-6, 1e3, "0.005 is a finger's curl");
const PITCH: Bound = Bound::new("Curl::pitch (m)", 1e-6, 1e3, "0.025 is a finger's curl");
const VARIATION: Bound = Bound::new("Curl::variation", 0.0, 0.9, "0.1 is natural");
const SPACING: Bound = Bound::new("Clump::spacing (m)", 1e-5, 1e3, "locks are 0.012 apart");
const STRENGTH: Bound = Bound::new("Clump::strength", 0.0, 0.95, "0.5 shows locks");
const OVER: Bound = Bound::new("Fall::over (m)", 1e-4, 1e6, "0.03 is soft hair");
const CLEARANCE: Bound = Bound::new("Fall::clearance (m)", 0.0, 1e3, "0.004 lies on the scalp");
const LAYERING: Bound = Bound::new("Fall::layering", 0.0, 10.0, "0.06 is full hair");
const LEAST: Bound =
    Bound::new("Cut::least (m)", 1e-5, 1e4, "0.02 is a centimetre of stubble or two");
const TURN: Bound = Bound::new("Comb::Whorl::turn (rad)", -1e3, 1e3, "0 is away, π/2 around");
const WAY: Bound = Bound::new(
    "the length of a direction or place in Planting",
    1e-6,
    1e6,
    "give finite vectors, directions longer than 0",
);

impl Planting {
    /// Plants hair all over `mesh`, whose triangles may be a list or a strip, indexed or not.
    /// Directions follow its normals, where it has some.
    ///
    /// Spacing is even: density is met within a per cent, and no two roots are nearer than half the
    /// mean spacing 1/√density. Where surfaces lie on each other within that, the latter goes first.
    ///
    /// # Errors
    /// When a setting is out of its range, the mesh has no triangles with an area or vertices that
    /// are not finite, there would be more than [`MAX_ROOTS`] strands, or the curl has fewer than
    /// four nodes a turn.
    pub fn plant(&self, mesh: &Mesh) -> Result<Planted, PlantError> {
        self.plant_with(mesh, &PlantingMaps::new())
    }

    /// Plants hair with density, length or direction that differ from place to place.
    ///
    /// # Errors
    /// Those of [`plant`](Self::plant); also when the density map leaves no room for a single strand.
    pub fn plant_with(&self, mesh: &Mesh, maps: &PlantingMaps) -> Result<Planted, PlantError> {
        self.check()?;
        let surface = Surface::of(mesh)?;
        self.check_reach(&surface)?;
        let roots = scatter::scatter(&surface, self.density, self.seed, maps)?;
        let lines = grow::grow(self, maps, &surface, &roots);
        let mut planted = Planted::default();
        let (mut kept, mut uvs) = (Vec::with_capacity(lines.len()), Vec::new());
        for (root, line) in roots.iter().zip(lines) {
            // The length map leaves places bald, too.
            let Some(line) = line else {
                continue;
            };
            kept.push(line);
            uvs.extend(root.place.uv);
            planted.roots.push(RootOnMesh {
                vertices: surface.triangles[root.triangle as usize],
                weights: root.weights,
            });
        }
        if kept.is_empty() {
            return Err(PlantError::NoRoots { area: surface.area() as f32, density: self.density });
        }
        planted.groom = Groom::from_polylines(kept)?.with_uvs(uvs)?;
        Ok(planted)
    }

    fn check(&self) -> Result<(), PlantError> {
        DENSITY.check(self.density)?;
        NODES.check(self.nodes as f32)?;
        LENGTH.check(self.length)?;
        SHORTER.check(self.length_variation)?;
        LEAN.check(self.lean)?;
        JITTER.check(self.jitter)?;
        let place = |v: Vec3| WAY.check(v.length().max(1.0)).map(drop);
        let way = |v: Vec3| WAY.check(v.length()).map(drop);
        match self.comb {
            Comb::Out => {}
            Comb::Along(along) => way(along)?,
            Comb::Whorl { center, turn } => {
                place(center)?;
                TURN.check(turn)?;
            }
            Comb::Parted { at, across, along } => {
                place(at)?;
                way(across)?;
                place(along)?;
            }
        }
        if let Some(clump) = self.clump {
            SPACING.check(clump.spacing)?;
            STRENGTH.check(clump.strength)?;
        }
        if let Some(fall) = self.fall {
            way(fall.toward)?;
            OVER.check(fall.over)?;
            CLEARANCE.check(fall.clearance)?;
            LAYERING.check(fall.layering)?;
        }
        if let Some(cut) = self.cut {
            place(cut.at)?;
            way(cut.normal)?;
            LEAST.check(cut.least)?;
        }
        self.curl.map_or(Ok(()), |curl| self.check_curl(&curl))
    }

    fn check_curl(&self, curl: &Curl) -> Result<(), PlantError> {
        RADIUS.check(curl.radius)?;
        PITCH.check(curl.pitch)?;
        VARIATION.check(curl.variation)?;
        let turns = self.length / curl.turn_length();
        let expected = (4.0 * turns).ceil() + 1.0;
        if (self.nodes as f32) < expected {
            return Err(PlantError::CoarseCurl {
                nodes: self.nodes,
                turns,
                expected: expected as u32,
            });
        }
        Ok(())
    }

    /// Nodes must be told apart in single precision, however far the mesh is from its origin.
    fn check_reach(&self, surface: &Surface) -> Result<(), PlantError> {
        let segment = self.length / (self.nodes - 1) as f32;
        let most = segment * 1e5;
        let (vertex, found) = surface.farthest();
        if found > most {
            return Err(PlantError::TooFar { vertex, found, most });
        }
        Ok(())
    }
}

impl From<InvalidValue> for PlantError {
    fn from(value: InvalidValue) -> Self {
        Self::Setting(value)
    }
}

//! Settings of planting.

use crate::base::setting::{Ranged, ValueRange, Violations, setting};
use bevy::prelude::*;
use core::f32::consts::TAU;

/// Strands per square metre on a human head: 223 per cm², the mean of 175 to 300 (BioNumbers
/// 116431).
pub const HUMAN_DENSITY: f32 = 223e4;

/// The maximum number of strands of one planting.
pub const MAX_ROOTS: usize = 1_000_000;

setting! {
    /// How hair is planted on a mesh. Lengths are in the mesh's own unit, metres as a rule.
    ///
    /// ```
    /// # use bevy_keratin::authoring::plant::*; use bevy::prelude::*;
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
        /// Strands per area; 10,000 are one per cm² and suit guides, a human has [`HUMAN_DENSITY`].
        pub density: f32 = 1e4, "1/m²" in DENSITY: 1e-6..=1e12, safe 1.0..=3e6,
            "guides have 10000, a human 2230000; multiply values per cm² by 10000";
        /// The same seed gives the same strands.
        pub seed: u64 = 0;
        /// Nodes of each strand, root and tip included, equally spaced along it; at least four for
        /// each turn of a curl.
        pub nodes: u32 = 12, in NODES: 2.0..=4096.0, safe 2.0..=256.0, "12 suit straight hair";
        /// Length along the strand.
        pub length: f32 = 0.2, "m" in LENGTH: 1e-5..=1e4, safe 0.005..=2.0,
            "0.2 reaches the shoulders";
        /// How much shorter than that a strand may be, a share.
        pub length_variation: f32 = 0.1, in LENGTH_VARIATION: 0.0..=0.95, safe 0.0..=0.9,
            "0.1 is natural";
        /// Which way strands are combed.
        pub comb: CombPattern = CombPattern::Out => Ranged::clamp_values;
        /// Angle by which strands lean from the surface's normal in the direction of the comb;
        /// limited, so that they leave the scalp. Hair on a head leans by about 1.
        pub lean: f32 = 0.0, "rad" in LEAN: 0.0..=1.45, safe 0.0..=1.4,
            "0 stands on the surface; flatter than 1.45 strands would run into it";
        /// Random deviation of a strand's direction.
        pub jitter: f32 = 0.08, "rad" in JITTER: 0.0..=1.5, safe 0.0..=1.0,
            "0.08 is combed, 0.5 wild";
        /// Curls; `None` is straight.
        pub curl: Option<Curl> = None => Ranged::clamp_values;
        /// Locks, whose tips converge.
        pub clump: Option<Clump> = None => Ranged::clamp_values;
        /// How strands bend and lie down over the mesh; with `None` each grows straight.
        pub drape: Option<Drape> = None => Ranged::clamp_values;
        /// Where strands are cut.
        pub cut: Option<Cut> = None => Ranged::clamp_values;
    }
}

impl Planting {
    /// How far a [`Cut`] moves down, as a share of the change of length.
    const CUT_SHIFT: f32 = 0.5;
    /// The minimum number of segments of a shortened strand.
    const MIN_SEGMENTS: f32 = 6.0;

    /// The same with strands `times` as long, in segments of the same length. A cut moves by half
    /// of the change of length.
    #[must_use]
    pub fn lengthened(self, times: f32) -> Self {
        let segments = self.nodes.saturating_sub(1) as f32;
        let fewest = segments.min(Self::MIN_SEGMENTS);
        let longer = self.length * (times - 1.0) * Self::CUT_SHIFT;
        let cut = self.cut.map(|cut| Cut {
            at: cut.at - cut.normal.normalize_or_zero() * longer,
            least: cut.least * times,
            ..cut
        });
        let nodes = (segments * times).ceil().max(fewest) as u32 + 1;
        Self { length: self.length * times, nodes, cut, ..self }
    }
}

/// Which way strands are combed: the direction in which they [lean](Planting::lean). A direction
/// map ([`PlantingMaps::direction`](super::PlantingMaps::direction)) takes precedence.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Default, Clone, PartialEq)]
pub enum CombPattern {
    /// Not at all: straight out of the surface.
    #[default]
    Out,
    /// One direction everywhere; only the component along the surface counts.
    Along(Vec3),
    /// Around a crown.
    Whorl {
        /// Its centre (m).
        center: Vec3,
        /// Angle (rad) from the direction straight away from the centre to the comb's,
        /// counter-clockwise as seen from outside: ±π/2 goes around, π towards it.
        turn: f32,
    },
    /// Away from a plane through the hair, on both sides of it.
    Parted {
        /// A point of the plane (m).
        at: Vec3,
        /// The plane's normal; its length is its weight relative to `along`.
        across: Vec3,
        /// A direction that is added on both sides, such as a little to the back.
        along: Vec3,
    },
}

impl Ranged for CombPattern {
    fn clamp_values(&mut self, violations: &mut Violations) {
        const TURN: ValueRange =
            ValueRange::new("CombPattern::Whorl::turn (rad)", -1e3..=1e3, "0 is away, π/2 around");
        match self {
            Self::Out => {}
            Self::Along(along) => direction("CombPattern::Along", along, violations),
            Self::Whorl { center, turn } => {
                place("CombPattern::Whorl::center (m)", center, violations);
                TURN.clamp(turn, || 0.0, violations);
            }
            Self::Parted { at, across, along } => {
                place("CombPattern::Parted::at (m)", at, violations);
                direction("CombPattern::Parted::across", across, violations);
                place("CombPattern::Parted::along", along, violations);
            }
        }
    }
}

fn place(what: &'static str, at: &mut Vec3, violations: &mut Violations) {
    Cut::AT.named(what).clamp(at, || Vec3::ZERO, violations);
}

/// Checks that a direction is longer than 0.
fn direction(what: &'static str, way: &mut Vec3, violations: &mut Violations) {
    let range = ValueRange::new(what, 1e-6..=1e6, "give a finite vector that is longer than 0");
    if let Err(wrong) = range.check(way.length()) {
        violations.push(wrong);
        *way = Vec3::NEG_Y;
    }
}

setting! {
    /// A helix around the axis of a strand.
    #[derive(Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Default, Clone, PartialEq)]
    pub struct Curl {
        /// Radius of the helix. It starts at 0 at the root.
        pub radius: f32 = 5e-3, "m" in RADIUS: 1e-6..=1e3, safe 0.5e-3..=0.05,
            "0.005 is a finger's curl";
        /// Length along the helix's axis of one turn. Together they bend the strand with a radius of
        /// curvature of radius + (pitch/2π)²/radius.
        pub pitch: f32 = 25e-3, "m" in PITCH: 1e-6..=1e3, safe 1e-3..=0.5,
            "0.025 is a finger's curl";
        /// By how much radius and pitch may differ from strand to strand, a share.
        pub variation: f32 = 0.1, in VARIATION: 0.0..=0.9, "0.1 is natural";
        /// How uneven turns are along a strand: they come up to this share of a turn sooner or later than even ones, and are
        /// up to this share wider or narrower. Strands that share their phase share it.
        pub drift: f32 = 0.0, in DRIFT: 0.0..=0.5, "0.25 is a wave that has grown, 0 one that was wound";
        /// How flat the helix is: 1 is a wave in a plane, along the scalp within 40°.
        pub flatness: f32 = 0.0, in FLATNESS: 0.0..=1.0, "0.7 is a wave, 0 a curl";
        /// Which strands share their phase.
        pub phase: CurlPhase = CurlPhase::PerClump;
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

setting! {
    /// Locks: strands draw together toward their tips around one of them.
    #[derive(Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Default, Clone, PartialEq)]
    pub struct Clump {
        /// How far apart the locks' middles are at the scalp.
        pub spacing: f32 = 12e-3, "m" in SPACING: 1e-5..=1e3, safe 1e-3..=0.1,
            "locks are 0.012 apart";
        /// How far tips converge on the lock's middle, as a share of the distance.
        pub strength: f32 = 0.5, in STRENGTH: 0.0..=0.95, "0.5 shows locks";
    }
}

setting! {
    /// How strands bend toward a direction as they grow, like heavy hair or hair combed down. Their
    /// rest shape already avoids the mesh.
    #[derive(Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Default, Clone, PartialEq)]
    pub struct Drape {
        /// The direction.
        pub toward: Vec3 = Vec3::NEG_Y => |way, violations| direction("Drape::toward", way, violations);
        /// Length over which they bend there.
        pub over: f32 = 0.03, "m" in OVER: 1e-4..=1e6, safe 0.002..=10.0, "0.03 is soft hair";
        /// How far off the mesh they stay.
        pub clearance: f32 = 4e-3, "m" in CLEARANCE: 0.0..=1e3, safe 0.0..=0.1,
            "0.004 lies on the scalp";
        /// Additional clearance of strands that grow higher up and so lie on top: m per m of height
        /// above the lowest root.
        pub layering: f32 = 0.06, in LAYERING: 0.0..=10.0, safe 0.0..=1.0, "0.06 is full hair";
    }
}

setting! {
    /// A plane at which strands are cut.
    #[derive(Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Default, Clone, PartialEq)]
    pub struct Cut {
        /// A point of the plane.
        pub at: Vec3 = Vec3::ZERO, "m" in AT: -1e6..=1e6, "give a finite place";
        /// Toward the side where hair stays.
        pub normal: Vec3 = Vec3::Y => |way, violations| direction("Cut::normal", way, violations);
        /// Minimum length that is left, also of strands that grow beyond the plane.
        pub least: f32 = 0.02, "m" in LEAST: 1e-5..=1e4, safe 1e-3..=1.0,
            "0.02 is a centimetre of stubble or two";
    }
}

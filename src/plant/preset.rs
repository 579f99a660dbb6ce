//! Presets: complete recipes for hair from straight to coily and from short to long.

use super::{
    error::PlantError,
    hairline::Hairline,
    map::{PlantingMaps, RootPlace},
    planting::Planted,
    recipe::{Clump, CombPattern, Curl, CurlPhase, Cut, Drape, HUMAN_DENSITY, Planting},
    scalp::Scalp,
};
#[cfg(feature = "render")]
use crate::render::{HairFollowers, HairLook, Melanin};
use crate::{
    AirDrag, HairSolver, HairStiffness, HairWetting, LockContact, Settling, Sweeps,
    look::WornPreset, setting::Ranged,
};
use bevy::prelude::*;

/// A preset of hair: planting, stiffness and look.
///
/// Shapes follow measurements where there are some. The radius of a hair's bends is 57 ± 22 mm on
/// tresses of straight hair and 22 ± 18 mm on curly ones (J. Cosmet. Sci. 64:26);
/// [`Curl::curvature_radius`] gives that number for each preset. Densities are those of guides:
/// drawn followers stand for the 223 strands per cm² of a human (BioNumbers 116431).
///
/// ```
/// # use bevy_keratin::{prelude::*, plant::*}; use bevy::prelude::*;
/// # fn setup(mut commands: Commands) -> Result {
/// let head = Sphere::new(0.1).mesh().build();
/// let planted = HairPreset::Wavy.plant(&head, &Scalp::default())?;
/// let hair = commands.spawn((Hair, HairPreset::Wavy.settings())).id();
/// for strand in planted.groom.strands() {
///     commands.spawn((StrandOf(hair), Strand::from_polyline(strand.points)?));
/// }
/// # Ok(())
/// # }
/// ```
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[reflect(Default, Clone, PartialEq, Hash)]
pub enum HairPreset {
    /// Shoulder-long, parted in the middle, nearly straight: bends of 54 mm radius.
    #[default]
    Straight,
    /// Shoulder-long in loose waves: bends of 21 mm radius, as measured on curly tresses.
    Wavy,
    /// Ringlets of 14 mm across: bends of 9 mm radius.
    Curly,
    /// Tight coils of 7 mm across that stand out in a round shape.
    Coily,
    /// Cut close at the sides and the nape, 6 cm on top.
    Short,
    /// Straight to the jaw and cut off there.
    Bob,
    /// Straight down the back.
    Long,
    /// Short fur of 15 mm, combed from front to back and down, that covers a whole mesh: it has no
    /// hairline. Cheap guides, 50 per dm², and twice as many drawn strands as on a head.
    Fur,
}

/// The settings of a [`HairPreset`], a bundle for the [`Hair`](crate::Hair) entity.
#[derive(Bundle, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Default, Clone, PartialEq)]
pub struct PresetSettings {
    /// How stiff it is.
    pub stiffness: HairStiffness,
    /// How it swings.
    pub drag: AirDrag,
    /// How it is solved.
    pub solver: HairSolver,
    /// How sweeps solve it.
    pub sweeps: Sweeps,
    /// How its strands keep apart.
    pub contact: LockContact,
    /// How it wets, with as many fibres in a strand as grow around a guide.
    pub wetting: HairWetting,
    /// It settles before it is first drawn.
    pub settling: Settling,
    /// How it looks.
    #[cfg(feature = "render")]
    pub look: HairLook,
    /// The strands drawn between the guides.
    #[cfg(feature = "render")]
    pub followers: HairFollowers,
}

impl HairPreset {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Straight,
        Self::Wavy,
        Self::Curly,
        Self::Coily,
        Self::Short,
        Self::Bob,
        Self::Long,
        Self::Fur,
    ];

    /// Its name, as in [`WornPreset`].
    pub fn name(self) -> String {
        format!("{self:?}")
    }

    /// The preset of this name, `None` where there is none.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|preset| preset.name() == name)
    }

    /// Plants it on a head's mesh, which may have neck and shoulders for hair to lie on. Settings
    /// are in metres: the mesh has to be life-size.
    ///
    /// # Errors
    /// When the mesh cannot be planted; see [`Planting::plant`].
    pub fn plant(self, mesh: &Mesh, scalp: &Scalp) -> Result<Planted, PlantError> {
        self.plant_as(&self.planting(scalp), mesh, scalp)
    }

    /// Plants a changed recipe, with the preset's hairline, parting and lengths by place.
    ///
    /// ```
    /// # use bevy_keratin::plant::*; use bevy::prelude::*;
    /// # let (head, scalp) = (Sphere::new(0.1).mesh().build(), Scalp::default());
    /// let bob = HairPreset::Bob;
    /// let fewer = Planting { density: 0.15e4, ..bob.planting(&scalp) };
    /// let planted = bob.plant_as(&fewer, &head, &scalp).unwrap();
    /// let all = bob.plant(&head, &scalp).unwrap();
    /// assert!(2 * planted.groom.len() < all.groom.len());
    /// ```
    ///
    /// # Errors
    /// Those of [`Planting::plant`].
    pub fn plant_as(
        self,
        planting: &Planting,
        mesh: &Mesh,
        scalp: &Scalp,
    ) -> Result<Planted, PlantError> {
        self.plant_where(planting, mesh, scalp, &|_| 1.0)
    }

    /// The same with the density multiplied by `share`.
    pub(crate) fn plant_where(
        self,
        planting: &Planting,
        mesh: &Mesh,
        scalp: &Scalp,
        share: &dyn Fn(&RootPlace) -> f32,
    ) -> Result<Planted, PlantError> {
        let scalp = &scalp.checked()?;
        let on_scalp = |at: Vec3| if self.is_everywhere() { 1.0 } else { scalp.density(at) };
        let density = |place: &RootPlace| on_scalp(place.position) * share(place);
        let length = |place: &RootPlace| self.length_share(scalp, place.position);
        let direction = |place: &RootPlace| self.direction(scalp, place.position);
        let mut maps = PlantingMaps::new().density(&density).length(&length);
        if self.is_parted() {
            maps = maps.direction(&direction);
        }
        planting.plant_with(mesh, &maps)
    }
}

impl WornPreset {
    /// Hair of a preset as it is.
    pub fn of(preset: HairPreset) -> Self {
        Self { name: preset.name(), ..Self::default() }
    }

    /// Which preset it is; `None` where none of that name is known.
    pub fn preset(&self) -> Option<HairPreset> {
        HairPreset::named(&self.name)
    }
}

impl HairPreset {
    pub(super) fn is_parted(self) -> bool {
        !matches!(self, Self::Short | Self::Coily | Self::Fur)
    }

    /// Whether it grows on all of a mesh, not behind a hairline.
    pub(crate) fn is_everywhere(self) -> bool {
        self == Self::Fur
    }

    /// The hairline of its drawn strands.
    pub fn hairline(self) -> Hairline {
        let base = Hairline::default();
        match self {
            Self::Short => Hairline { least_length: 0.25, length_over: 12e-3, ..base },
            Self::Coily => {
                Hairline { least_length: 0.15, density_over: 12e-3, baby_length: 12e-3, ..base }
            }
            Self::Bob => Hairline { least_length: 0.6, ..base },
            _ => base,
        }
    }

    /// How far to the right of the parting a place is (m).
    pub(super) fn aside(self, scalp: &Scalp, place: Vec3) -> f32 {
        let [right, _, front] = scalp.axes();
        let off = (place - scalp.center) / scalp.height;
        // A natural parting is a zigzag of 3 mm.
        let zigzag = ((off.dot(front) * 7.0).rem_euclid(2.0) - 1.0).abs() - 0.5;
        let parting = if self == Self::Bob { -0.22 } else { 0.0 } + 0.05 * zigzag;
        (off.dot(right) - parting) * scalp.height
    }

    /// Combing direction: away from the parting, in front to the back as well to keep the face
    /// free.
    pub(super) fn direction(self, scalp: &Scalp, place: Vec3) -> Vec3 {
        let [right, _, front] = scalp.axes();
        let off = (place - scalp.center) / scalp.height;
        let forward = off.dot(front);
        let side = if self.aside(scalp, place) < 0.0 { -1.0 } else { 1.0 };
        // Behind the crown there is no parting; in front of it, down would be into the face.
        let across = (0.6 + 2.0 * (forward + 0.2)).clamp(0.0, 1.0);
        let down = (0.5 - forward).clamp(0.0, 0.6);
        right * (side * across) - front * (0.35 + 1.4 * forward.max(0.0)) - *scalp.up * down
    }

    /// Share of the length: shorter at the sides and the nape.
    pub(super) fn length_share(self, scalp: &Scalp, place: Vec3) -> f32 {
        if self != Self::Short {
            return 1.0;
        }
        let off = (place - scalp.center) / scalp.height;
        let height = (off.dot(*scalp.up) / 0.85).clamp(0.0, 1.0);
        0.28 + 0.72 * height * height * (3.0 - 2.0 * height)
    }

    /// Its planting settings, to be changed before [`Planting::plant_with`].
    pub fn planting(self, scalp: &Scalp) -> Planting {
        let [right, up, front] = scalp.axes();
        let crown = scalp.place(0.05, 0.9, -0.35);
        let drape =
            Drape { toward: -up - front * 0.15, over: 0.035, clearance: 5e-3, layering: 0.07 };
        let parted = CombPattern::Parted { at: scalp.center, across: right, along: -front * 0.4 };
        let base = Planting {
            density: 0.35e4,
            nodes: 20,
            length: 0.3,
            length_variation: 0.1,
            comb: parted,
            lean: 1.2,
            jitter: 0.06,
            clump: Some(Clump { spacing: 25e-3, strength: 0.25 }),
            drape: Some(drape),
            ..default()
        };
        let curl = |radius, pitch, phase| Some(Curl { radius, pitch, variation: 0.12, phase });
        match self {
            Self::Straight => {
                Planting { nodes: 24, curl: curl(1.4e-3, 54e-3, CurlPhase::PerClump), ..base }
            }
            Self::Wavy => Planting {
                density: 0.33e4,
                length: 0.33,
                nodes: 28,
                curl: curl(6e-3, 60e-3, CurlPhase::PerClump),
                clump: Some(Clump { spacing: 22e-3, strength: 0.35 }),
                drape: Some(Drape { layering: 0.12, ..drape }),
                ..base
            },
            Self::Curly => Planting {
                density: 0.21e4,
                length: 0.34,
                nodes: 48,
                lean: 0.9,
                curl: curl(7e-3, 26e-3, CurlPhase::PerStrand),
                clump: None,
                drape: Some(Drape { over: 0.05, layering: 0.2, ..drape }),
                ..base
            },
            Self::Coily => Planting {
                density: 0.58e4,
                length: 0.17,
                length_variation: 0.15,
                nodes: 36,
                comb: CombPattern::Out,
                lean: 0.0,
                jitter: 0.25,
                curl: curl(3.5e-3, 9e-3, CurlPhase::PerStrand),
                clump: None,
                drape: None,
                ..base
            },
            Self::Short => Planting {
                density: 0.8e4,
                length: 0.065,
                length_variation: 0.2,
                nodes: 10,
                comb: CombPattern::Whorl { center: crown, turn: 0.5 },
                lean: 1.2,
                jitter: 0.12,
                clump: Some(Clump { spacing: 14e-3, strength: 0.25 }),
                drape: Some(Drape { over: 0.09, clearance: 4e-3, layering: 0.03, ..drape }),
                ..base
            },
            Self::Bob => Planting {
                length: 0.32,
                length_variation: 0.04,
                nodes: 18,
                drape: Some(Drape { layering: 0.09, ..drape }),
                // Higher in front, where hair hangs lower, so that all ends in one line.
                cut: Some(Cut {
                    at: scalp.place(0.0, -0.9, 0.0),
                    normal: up - front * 0.25,
                    least: 0.03,
                }),
                clump: Some(Clump { spacing: 25e-3, strength: 0.15 }),
                ..base
            },
            Self::Long => Planting { density: 0.3e4, length: 0.5, nodes: 28, ..base },
            Self::Fur => Planting {
                density: 0.5e4,
                length: 0.015,
                length_variation: 0.25,
                nodes: 4,
                comb: CombPattern::Along(-front - up * 0.5),
                lean: 0.95,
                jitter: 0.15,
                clump: Some(Clump { spacing: 12e-3, strength: 0.3 }),
                drape: None,
                ..base
            },
        }
    }

    /// The settings for the [`Hair`](crate::Hair) entity.
    pub fn settings(self) -> PresetSettings {
        // A single fibre has 0.045 m; locks are stiffer.
        let bending_length = match self {
            Self::Straight | Self::Bob => 0.08,
            Self::Long => 0.075,
            Self::Wavy => 0.09,
            Self::Curly => 0.085,
            Self::Coily => 0.2,
            Self::Short => 0.12,
            Self::Fur => 0.05,
        };
        // Strands of fur are too short to cross each other.
        let contact = match self {
            Self::Fur => LockContact { strength: 0.0, ..default() },
            _ => LockContact::default(),
        };
        let fibres = HUMAN_DENSITY / self.planting(&Scalp::default()).density;
        PresetSettings {
            stiffness: HairStiffness { bending_length, ..default() },
            drag: AirDrag { rate: 3.0 },
            solver: HairSolver::default(),
            sweeps: Sweeps { internal_damping: 4.0, ..default() },
            contact,
            wetting: HairWetting { fibres, ..default() },
            settling: Settling::default(),
            #[cfg(feature = "render")]
            look: self.look(),
            #[cfg(feature = "render")]
            followers: self.followers(),
        }
    }

    #[cfg(feature = "render")]
    fn look(self) -> HairLook {
        let base = HairLook { width: 0.18e-3, ..default() };
        match self {
            Self::Straight => HairLook { melanin: Melanin::DARK_BROWN, ..base },
            Self::Wavy => HairLook { melanin: Melanin::AUBURN, ..base },
            Self::Curly => HairLook { melanin: Melanin::BROWN, roughness: 0.45, ..base },
            Self::Coily => HairLook {
                melanin: Melanin::BLACK,
                roughness: 0.55,
                gloss: 0.4,
                width: 0.2e-3,
                ..base
            },
            Self::Short => HairLook { melanin: Melanin::DARK_BROWN, gloss: 0.6, ..base },
            Self::Bob => HairLook { melanin: Melanin::BLACK, roughness: 0.32, ..base },
            Self::Long => HairLook { melanin: Melanin::BLOND, variation: 0.25, ..base },
            Self::Fur => HairLook {
                melanin: Melanin::AUBURN,
                variation: 0.3,
                roughness: 0.45,
                width: 0.12e-3,
                ..base
            },
        }
    }

    #[cfg(feature = "render")]
    fn followers(self) -> HairFollowers {
        let base = HairFollowers {
            segments: 24,
            stray: 0.012,
            clump: 0.0,
            frizz: 0.2e-3,
            ..HairFollowers::new(40_000)
        };
        match self {
            Self::Straight => HairFollowers { locks: Vec3::new(0.25, 0.35, 0.3), ..base },
            Self::Wavy => HairFollowers {
                segments: 40,
                locks: Vec3::new(0.3, 0.5, 0.5),
                lock_shape: 0.9,
                lock_phase: 0.04,
                frizz: 0.4e-3,
                flyaways: 0.02,
                parting: 2.5,
                ..base
            },
            // Blending neighbouring curls would straighten them: each follows its nearest guide.
            Self::Curly => HairFollowers {
                segments: 64,
                locks: Vec3::new(0.2, 0.75, 0.6),
                lock_shape: 0.7,
                lock_phase: 0.12,
                frizz: 0.5e-3,
                flyaways: 0.025,
                parting: 1.0,
                phase_variation: 0.008,
                stray: 0.02,
                ..base
            },
            Self::Coily => HairFollowers {
                segments: 52,
                locks: Vec3::new(0.1, 0.7, 0.6),
                lock_spacing: Vec3::new(0.03, 0.008, 0.004),
                lock_shape: 0.7,
                lock_phase: 0.12,
                lock_length_variation: 0.12,
                frizz: 0.6e-3,
                flyaways: 0.03,
                parting: 1.0,
                phase_variation: 0.02,
                stray: 0.05,
                ..base
            },
            Self::Short => HairFollowers {
                segments: 12,
                locks: Vec3::new(0.3, 0.35, 0.2),
                lock_spacing: Vec3::new(0.014, 0.007, 0.0035),
                flyaways: 0.01,
                flyaway_reach: 8e-3,
                ..base
            },
            Self::Bob => HairFollowers {
                locks: Vec3::new(0.15, 0.25, 0.2),
                lock_length_variation: 0.01,
                stray: 0.006,
                frizz: 0.12e-3,
                flyaways: 0.008,
                length_variation: 0.02,
                ..base
            },
            Self::Long => HairFollowers {
                locks: Vec3::new(0.3, 0.5, 0.4),
                lock_length_variation: 0.1,
                flyaways: 0.02,
                length_variation: 0.2,
                ..base
            },
            Self::Fur => HairFollowers {
                count: 80_000,
                segments: 6,
                locks: Vec3::new(0.2, 0.3, 0.2),
                lock_spacing: Vec3::new(0.012, 0.006, 0.003),
                frizz: 0.1e-3,
                stray: 1e-3,
                length_variation: 0.3,
                ..base
            },
        }
    }
}

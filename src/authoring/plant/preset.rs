//! Presets: complete recipes for hair from straight to coily and from short to long.

use super::{
    error::PlantError,
    map::{PlantingMaps, RootPlace},
    planting::Planted,
    recipe::{Clump, CombPattern, Curl, CurlPhase, Cut, Drape, HUMAN_DENSITY, Planting},
    scalp::Scalp,
};
#[cfg(feature = "render")]
use crate::render::{HairFollowers, HairLook};
use crate::{
    base::setting::Ranged,
    forces::{contact::StrandContact, environment::AirDrag},
    hair::look::WornPreset,
    simulation::settle::Settling,
    solver::rod::{HairSolver, HairStiffness, Sweeps},
    water::HairWetting,
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
/// # use bevy_keratin::{prelude::*, authoring::plant::*}; use bevy::prelude::*;
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
    /// Shoulder-long, parted in the middle, nearly straight: bends of 79 mm radius.
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
    /// Chin-long with a fringe: hair in front hangs over the forehead, cut off above the brows.
    Fringe,
    /// Cut close at the sides and the nape, and 14 cm on top, all combed to the right.
    Undercut,
    /// Short and layered, a long side of it swept over the forehead, the nape close.
    Pixie,
    /// Locs as thick as a little finger, to the shoulders.
    Locs,
    /// A full beard of 3 cm with moustache and sideburns. It grows on the lower face only; hair on the
    /// head is another hair.
    Beard,
    /// Short fur of 15 mm, combed from front to back and down, that covers all of any mesh: it has no
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
    pub contact: StrandContact,
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
    pub const ALL: [Self; 13] = [
        Self::Straight,
        Self::Wavy,
        Self::Curly,
        Self::Coily,
        Self::Short,
        Self::Bob,
        Self::Long,
        Self::Fringe,
        Self::Undercut,
        Self::Pixie,
        Self::Locs,
        Self::Beard,
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
    /// # use bevy_keratin::authoring::plant::*; use bevy::prelude::*;
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
        let density = |place: &RootPlace| self.density(scalp, place.position) * share(place);
        let length = |place: &RootPlace| self.length_share(scalp, place.position);
        let direction = |place: &RootPlace| self.direction(scalp, place.position);
        let mut maps = PlantingMaps::new().density(&density).length(&length);
        if self.is_combed() {
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
    /// How it is planted; to be changed before [`Planting::plant_with`].
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
            // Each guide bends by itself: together they would shine in bands.
            Self::Straight => {
                Planting { nodes: 24, curl: curl(0.95e-3, 54e-3, CurlPhase::PerStrand), ..base }
            }
            Self::Wavy => Planting {
                density: 0.33e4,
                length: 0.33,
                nodes: 28,
                curl: curl(6e-3, 60e-3, CurlPhase::PerClump),
                // Waves that several guides share: one guide's would look like spots.
                clump: Some(Clump { spacing: 45e-3, strength: 0.2 }),
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
                // Higher in front, where the way down is longer: it hangs in one line.
                cut: Some(Cut {
                    at: scalp.place(0.0, -0.9, 0.0),
                    normal: up - front * 0.25,
                    least: 0.03,
                }),
                clump: Some(Clump { spacing: 25e-3, strength: 0.15 }),
                ..base
            },
            Self::Long => Planting { density: 0.3e4, length: 0.5, nodes: 28, ..base },
            Self::Fringe => Planting {
                length: 0.3,
                length_variation: 0.05,
                nodes: 22,
                // Curved in at the chin.
                cut: Some(Cut { at: scalp.place(0.0, -1.05, 0.0), normal: up, least: 0.03 }),
                clump: Some(Clump { spacing: 25e-3, strength: 0.2 }),
                ..base
            },
            Self::Undercut => Planting {
                density: 0.6e4,
                length: 0.14,
                length_variation: 0.15,
                nodes: 12,
                lean: 1.3,
                jitter: 0.08,
                clump: Some(Clump { spacing: 18e-3, strength: 0.35 }),
                drape: Some(Drape { over: 0.03, clearance: 4e-3, layering: 0.03, ..drape }),
                ..base
            },
            Self::Pixie => Planting {
                density: 0.65e4,
                length: 0.11,
                length_variation: 0.3,
                nodes: 11,
                lean: 1.2,
                jitter: 0.16,
                clump: Some(Clump { spacing: 16e-3, strength: 0.4 }),
                drape: Some(Drape { clearance: 4e-3, layering: 0.025, ..drape }),
                ..base
            },
            Self::Locs => Planting {
                density: 0.3e4,
                length: 0.3,
                length_variation: 0.2,
                nodes: 20,
                lean: 1.0,
                jitter: 0.2,
                curl: curl(2.5e-3, 70e-3, CurlPhase::PerStrand),
                clump: None,
                drape: Some(Drape { clearance: 7e-3, layering: 0.14, ..drape }),
                ..base
            },
            Self::Beard => Planting {
                density: 0.9e4,
                length: 0.03,
                length_variation: 0.25,
                nodes: 6,
                lean: 0.9,
                jitter: 0.2,
                curl: curl(1.5e-3, 24e-3, CurlPhase::PerStrand),
                clump: Some(Clump { spacing: 9e-3, strength: 0.35 }),
                drape: Some(Drape { over: 0.03, clearance: 3e-3, layering: 0.0, ..drape }),
                ..base
            },
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
            Self::Straight | Self::Bob | Self::Fringe => 0.08,
            Self::Long => 0.075,
            Self::Wavy => 0.09,
            Self::Curly => 0.085,
            Self::Coily => 0.2,
            Self::Short => 0.12,
            Self::Undercut | Self::Pixie => 0.07,
            // Felted hair is stiff.
            Self::Locs => 0.11,
            Self::Beard => 0.06,
            Self::Fur => 0.05,
        };
        // Strands of fur are too short to cross each other.
        let contact = match self {
            Self::Fur => StrandContact { strength: 0.0, ..default() },
            Self::Locs => StrandContact { radius: 3e-3, ..default() },
            _ => StrandContact::default(),
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
}

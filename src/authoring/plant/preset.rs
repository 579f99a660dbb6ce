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
    forces::contact::{ContactMethod, StrandContact},
    hair::look::WornPreset,
    simulation::settle::Settling,
    solver::rod::HairStiffness,
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

/// The settings of a [`HairPreset`], a bundle for the [`Hair`](crate::Hair) entity: only what is the preset's own.
/// How air drags, how strands are solved and all else is that of all hair ([`HairDefault`](crate::HairDefault)).
#[derive(Bundle, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Default, Clone, PartialEq)]
pub struct PresetSettings {
    /// How stiff it is.
    pub stiffness: HairStiffness,
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
        self.plant_where(planting, [mesh, mesh], scalp, &|_| 1.0)
    }

    /// The same with the density multiplied by `share`, of hair that lies on `beside`, of which the mesh is a part.
    pub(crate) fn plant_where(
        self,
        planting: &Planting,
        [mesh, beside]: [&Mesh; 2],
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
        let beside = (!core::ptr::eq(mesh, beside)).then_some(beside);
        planting.plant_beside(mesh, beside, &maps)
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

/// How guides of each preset are planted: density (1/m²), length (m), its variation, lean and jitter (rad); nodes; a
/// curl's radius and pitch (m); a clump's spacing (m) and strength; a drape's length and clearance (m), and layering. No
/// curl, clump or drape where all are 0.
type Guides = ([f32; 5], u32, [f32; 2], [f32; 2], [f32; 3]);
const GUIDES: [Guides; 13] = [
    // Each guide bends by itself: together they would shine in bands.
    ([0.35e4, 0.3, 0.1, 1.2, 0.06], 24, [0.95e-3, 54e-3], [25e-3, 0.25], [0.035, 5e-3, 0.07]), // Straight
    // Waves that a few guides share: one guide's would look like spots, those of many like bands.
    ([0.33e4, 0.33, 0.1, 1.2, 0.06], 28, [7e-3, 60e-3], [25e-3, 0.3], [0.035, 5e-3, 0.12]), // Wavy
    ([0.21e4, 0.34, 0.2, 0.9, 0.06], 48, [7e-3, 26e-3], [0.0, 0.0], [0.05, 5e-3, 0.2]),     // Curly
    ([0.58e4, 0.17, 0.15, 0.0, 0.25], 36, [3.5e-3, 9e-3], [0.0, 0.0], [0.0, 0.0, 0.0]),     // Coily
    ([0.8e4, 0.065, 0.2, 1.2, 0.12], 10, [0.0, 0.0], [14e-3, 0.25], [0.09, 4e-3, 0.03]),    // Short
    ([0.35e4, 0.32, 0.04, 1.2, 0.06], 18, [0.0, 0.0], [25e-3, 0.15], [0.035, 5e-3, 0.09]),  // Bob
    ([0.3e4, 0.5, 0.1, 1.2, 0.06], 28, [0.0, 0.0], [25e-3, 0.25], [0.035, 5e-3, 0.07]),     // Long
    ([0.35e4, 0.3, 0.05, 1.2, 0.06], 22, [0.0, 0.0], [25e-3, 0.2], [0.035, 5e-3, 0.07]), // Fringe
    ([0.6e4, 0.14, 0.15, 1.3, 0.08], 12, [0.0, 0.0], [18e-3, 0.35], [0.03, 4e-3, 0.03]), // Undercut
    ([0.65e4, 0.11, 0.3, 1.2, 0.16], 11, [0.0, 0.0], [16e-3, 0.4], [0.035, 4e-3, 0.025]), // Pixie
    ([0.3e4, 0.3, 0.2, 1.0, 0.2], 20, [2.5e-3, 70e-3], [0.0, 0.0], [0.035, 7e-3, 0.14]), // Locs
    ([0.9e4, 0.03, 0.25, 0.9, 0.2], 6, [1.5e-3, 24e-3], [9e-3, 0.35], [0.03, 3e-3, 0.0]), // Beard
    ([0.5e4, 0.015, 0.25, 0.95, 0.15], 4, [0.0, 0.0], [12e-3, 0.3], [0.0, 0.0, 0.0]),    // Fur
];

impl HairPreset {
    /// How it is planted; to be changed before [`Planting::plant_with`].
    pub fn planting(self, scalp: &Scalp) -> Planting {
        let [right, up, front] = scalp.axes();
        let (guide, nodes, [radius, pitch], [spacing, strength], drape) = GUIDES[self as usize];
        let [density, length, length_variation, lean, jitter] = guide;
        let [over, clearance, layering] = drape;
        let phase = match self {
            Self::Wavy => CurlPhase::PerClump,
            _ => CurlPhase::PerStrand,
        };
        let [variation, drift, flatness] = match self {
            Self::Wavy => [0.12, 0.25, 0.6],
            // Curls as alike as wound ones would hang in columns.
            Self::Curly => [0.3, 0.3, 0.0],
            _ => [0.12, 0.0, 0.0],
        };
        let comb = match self {
            Self::Coily => CombPattern::Out,
            Self::Short => CombPattern::Whorl { center: scalp.place(0.05, 0.9, -0.35), turn: 0.5 },
            Self::Fur => CombPattern::Along(-front - up * 0.5),
            _ => CombPattern::Parted { at: scalp.center, across: right, along: -front * 0.4 },
        };
        let cut = |high, normal| Cut { at: scalp.place(0.0, high, 0.0), normal, least: 0.03 };
        Planting {
            density,
            nodes,
            length,
            length_variation,
            comb,
            lean,
            jitter,
            curl: (radius > 0.0).then_some(Curl {
                radius,
                pitch,
                variation,
                phase,
                drift,
                flatness,
            }),
            clump: (spacing > 0.0).then_some(Clump { spacing, strength }),
            drape: (over > 0.0).then_some(Drape {
                toward: -up - front * 0.15,
                over,
                clearance,
                layering,
            }),
            cut: match self {
                // Higher in front, where the way down is longer: it hangs in one line.
                Self::Bob => Some(cut(-0.9, up - front * 0.25)),
                // Curved in at the chin.
                Self::Fringe => Some(cut(-1.05, up)),
                _ => None,
            },
            ..default()
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
            Self::Locs => {
                StrandContact { radius: 3e-3, method: ContactMethod::Mutual, ..default() }
            }
            _ => StrandContact { method: ContactMethod::Mutual, ..default() },
        };
        let fibres = HUMAN_DENSITY / self.planting(&Scalp::default()).density;
        PresetSettings {
            stiffness: HairStiffness { bending_length, ..default() },
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

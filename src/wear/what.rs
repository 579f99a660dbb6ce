//! What is worn, by whom, and what is told of it.

use super::error::WearError;
#[cfg(feature = "save")]
use crate::save::Hairdo;
use crate::{
    groom::{Groom, GroomGuides},
    plant::{HairPreset, Hairline, Scalp},
};
use bevy::prelude::*;

/// Puts hair on a character. Component of any entity with a mesh, or of one that has a character
/// below it, such as the root of a glTF scene; the scene may still be loading.
///
/// ```
/// # use bevy_keratin::{plant::HairPreset, prelude::*}; use bevy::prelude::*;
/// # fn wear(mut commands: Commands, character: Entity, groom: Handle<Groom>) {
/// // On the head, found by its bone's name:
/// commands.entity(character).insert(WearHair::new(HairPreset::Curly));
/// // Another bone, and a character that looks along +Z, as glTF's do:
/// commands.entity(character).insert(WearHair::new(HairPreset::Bob).on("skull").facing(Dir3::Z));
/// // What an artist made for this character:
/// commands.entity(character).insert(WearHair::new(groom));
/// // Bald again:
/// commands.entity(character).remove::<WearHair>();
/// # }
/// ```
///
/// The hair is a [`Hair`](crate::Hair) entity of its own, below the bone (or the mesh where there is none), with
/// [`WornHair`]; [`HairWorn`] tells which. Its settings are the preset's, and a
/// [`Wetting`](crate::Wetting) that counts as many fibres as grow there; to change them, wait for it:
///
/// ```
/// # use bevy_keratin::{plant::HairPreset, prelude::*}; use bevy::prelude::*;
/// # fn wear(commands: &mut Commands, character: Entity) {
/// commands
///     .entity(character)
///     .insert(WearHair::new(HairPreset::Wavy))
///     .observe(|worn: On<HairWorn>, mut commands: Commands| {
///         commands.entity(worn.hair).insert(AirDrag { rate: 5.0 });
///     });
/// # }
/// ```
///
/// Hair is made off the main thread, in the frame's [`PreUpdate`] it is put on. Whenever this
/// component changes the hair is made anew, and the old one stays until the new one is there. What
/// cannot be worn is told once, as a [`HairFault`](crate::HairFault) and by [`HairNotWorn`]; the
/// wearer keeps the hair that it has.
///
/// The character may be of any size from that of a doll to that of a giant: presets are of life size
/// on heads of life size, 8 to 16 cm from the middle between the ears to the crown, and as many times
/// larger or smaller on others. The mesh is taken as it is bound to its skeleton, unmorphed.
#[derive(Component, Reflect, Clone, Debug, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct WearHair {
    /// What is worn.
    pub hair: HairSource,
    /// The name of the bone, or of the mesh, that it is worn on. Default `None`: the entity's own
    /// mesh, else the bone whose name ends with the word head (`Head`, `mixamorig:Head`,
    /// `J_Bip_C_Head`), else the only mesh there is.
    pub on: Option<String>,
    /// Where the face looks, in this entity's space; its part along Y is not heeded, Y is up. Default
    /// −Z, Bevy's forward; characters of glTF files look along +Z unless they are converted.
    pub facing: Dir3,
    /// Draws the strands' places and differences: the same seed gives the same hair. Default 0.
    pub seed: u64,
    /// Where a preset's hairline is, in this entity's space, with the character as it is bound to its
    /// skeleton. Its front goes before [`facing`](Self::facing). Default `None`: found from the
    /// head's shape.
    pub scalp: Option<Scalp>,
    /// How a preset's hair begins at the hairline. Default `None`: as
    /// [`HairPreset::hairline`] says.
    pub hairline: Option<Hairline>,
    /// Where a groom's origin is, and how it is turned and scaled, in this entity's space. Default
    /// the identity: it was made around the character as it stands there.
    pub place: Transform,
    /// Whether colliders are fitted to head and body: balls within the head, capsules for the joints
    /// that hair reaches. A character that has [`HairCollider`](crate::HairCollider)s of its own
    /// keeps to those. Default `true`.
    pub colliders: bool,
    /// How the hair is styled: put on at once, or resampled where it is of other strands. What is
    /// saved from hair that was worn fits the same [`hair`](Self::hair) and [`seed`](Self::seed) on the
    /// same character strand by strand. Default `None`.
    #[cfg(feature = "save")]
    pub hairdo: Option<Hairdo>,
}

impl Default for WearHair {
    fn default() -> Self {
        Self {
            hair: HairSource::default(),
            on: None,
            facing: Dir3::NEG_Z,
            seed: 0,
            scalp: None,
            hairline: None,
            place: Transform::IDENTITY,
            colliders: true,
            #[cfg(feature = "save")]
            hairdo: None,
        }
    }
}

impl WearHair {
    /// Hair of a preset or a groom, on the head.
    pub fn new(hair: impl Into<HairSource>) -> Self {
        Self { hair: hair.into(), ..default() }
    }

    /// The same on the bone or mesh of this name.
    pub fn on(mut self, name: impl Into<String>) -> Self {
        self.on = Some(name.into());
        self
    }

    /// The same on a face that looks this way.
    pub fn facing(mut self, way: Dir3) -> Self {
        self.facing = way;
        self
    }

    /// The same styled like this.
    #[cfg(feature = "save")]
    pub fn styled(mut self, hairdo: Hairdo) -> Self {
        self.hairdo = Some(hairdo);
        self
    }
}

/// Hair that can be worn.
#[derive(Reflect, Clone, Debug, PartialEq)]
#[reflect(Default, Clone, PartialEq)]
pub enum HairSource {
    /// Planted by rule.
    Preset(HairPreset),
    /// Made by an artist; waits until it is loaded and is worn anew when it is reloaded.
    Groom {
        /// The groom.
        groom: Handle<Groom>,
        /// Which of its strands are simulated, and how finely.
        guides: GroomGuides,
    },
}

impl Default for HairSource {
    fn default() -> Self {
        Self::Preset(HairPreset::default())
    }
}

impl From<HairPreset> for HairSource {
    fn from(preset: HairPreset) -> Self {
        Self::Preset(preset)
    }
}

impl From<Handle<Groom>> for HairSource {
    fn from(groom: Handle<Groom>) -> Self {
        Self::Groom { groom, guides: GroomGuides::default() }
    }
}

/// What a worn [`Hair`](crate::Hair) is and who wears it. Component of the hair, written when it is
/// put on.
#[derive(Component, Reflect, Clone, Debug, PartialEq)]
#[reflect(Component, Clone, PartialEq)]
pub struct WornHair {
    /// The entity with the [`WearHair`].
    pub wearer: Entity,
    /// What it has grown from.
    pub hair: HairSource,
}

impl WornHair {
    /// Which preset it is; `None` for a groom.
    pub fn preset(&self) -> Option<HairPreset> {
        match self.hair {
            HairSource::Preset(preset) => Some(preset),
            HairSource::Groom { .. } => None,
        }
    }
}

/// Triggered on an entity with [`WearHair`] once its hair is there: when it is first worn, and
/// whenever it was swapped.
#[derive(EntityEvent, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Clone, PartialEq)]
pub struct HairWorn {
    /// The wearer.
    pub entity: Entity,
    /// The hair.
    pub hair: Entity,
}

/// Triggered on an entity with [`WearHair`] whose hair cannot be worn; told as a
/// [`HairFault`](crate::HairFault) too.
#[derive(EntityEvent, Clone, Debug, PartialEq)]
pub struct HairNotWorn {
    /// The wearer, with the hair that it had.
    pub entity: Entity,
    /// Why.
    pub error: WearError,
}

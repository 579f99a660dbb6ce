//! The components and events of worn hair.

use super::{error::WearError, facing::FacingFrom};
#[cfg(feature = "save")]
use crate::hairdo::save::{Hairdo, HairdoError};
use crate::{
    authoring::{
        groom::{Groom, GroomGuides},
        plant::{HairPreset, Hairline, Scalp},
        recipe::HairRecipe,
    },
    hair::look::{HairDye, HairLook},
    hairdo::style::HairStyle,
};
use bevy::{
    app::MainScheduleOrder,
    ecs::{lifecycle::HookContext, world::DeferredWorld},
    prelude::*,
};
use core::time::Duration;

/// Puts hair on a character. Component of any entity with a mesh, or of one that has a character
/// below it, such as the root of a glTF scene; the scene may still be loading.
///
/// ```
/// # use bevy_keratin::prelude::*; use bevy::prelude::*;
/// # fn wear(mut commands: Commands, character: Entity, groom: Handle<Groom>, recipe: Handle<HairRecipe>) {
/// // On the head, found by its bone's name:
/// commands.entity(character).insert(WearHair::new(HairPreset::Curly));
/// // On another bone, on the mesh of this name, in place of the hair that the character came with:
/// let bob = WearHair::new(HairPreset::Bob).on("skull").on_mesh("Face").hiding_old_hair();
/// commands.entity(character).insert(bob);
/// // A preset with settings of a file, which is followed when it changes:
/// commands.entity(character).insert(WearHair::of_recipe(recipe));
/// // What an artist made for this character:
/// commands.entity(character).insert(WearHair::new(groom));
/// // A beard beside it, of another colour:
/// let beard = HairBeside::new(HairPreset::Beard).dyed(HairDye::pink());
/// commands.entity(character).insert(WearHair::new(HairPreset::Short).and(beard));
/// // Bald again:
/// commands.entity(character).remove::<WearHair>();
/// # }
/// ```
///
/// The hair is a [`Hair`](crate::Hair) entity of its own, below the bone (or the mesh where there
/// is none), with [`WornBy`](crate::WornBy), [`WornAs`] and [`WornPreset`](crate::WornPreset); [`HairWorn`] has its entity, and
/// [`WornHair`](crate::WornHair) on the wearer. So is each that is worn [beside](Self::beside) it; all come at once, on one
/// set of colliders. Unless it is styled it has settled then, as
/// [`SettleSettings`](crate::SettleSettings) say, on the character as it is bound to its skeleton. Its settings are the preset's, and a
/// [`HairWetting`](crate::HairWetting) with the number of fibres that grow there. Others are put on the wearer,
/// before or after; all hair that it wears takes them over, this one and those to come:
///
/// ```
/// # use bevy_keratin::prelude::*; use bevy::prelude::*;
/// # fn wear(commands: &mut Commands, character: Entity) {
/// let wear = WearHair::new(HairPreset::Wavy);
/// commands.entity(character).insert((wear, AirDrag { rate: 5.0 }, HairLod::default()));
/// # }
/// ```
///
/// Hair is made and settles off the main thread, paused or not, and is put on in [`PreUpdate`], or in the tick of
/// [`at`](Self::at). Whenever this component changes the hair is made again, and the old one is drawn until the new
/// one is ready; another [`look`](Self::look), [`dye`](Self::dye) or [`style`](Self::style) is applied to the worn
/// hair. Hair that grows from the same roots, as with another [`length`](Self::length), takes over how the old one lay
/// and settles before the eyes: a slider shows each value that it is made for while it is dragged. The same hair for
/// many alike is made once. Of hairs that are worn beside each other those that have not changed are kept. What a game
/// has put on the wearer stays; what it has put on the old hair itself goes with it, and so do water, treatments and
/// ties.
/// Hair that cannot be worn is reported once, as a [`HairFault`](crate::HairFault) and by
/// [`HairNotWorn`]; the wearer keeps the hair that it has.
///
/// The character may be of any size from that of a doll to that of a giant: presets have life size
/// on heads of life size, 8 to 16 cm from the middle between the ears to the crown, and are scaled
/// in proportion on others. The mesh is taken as it is bound to its skeleton, unmorphed.
///
/// When its meshes are edited, by a character creator or skinning on the CPU, roots follow in the same frame, and
/// colliders are fitted again off the main thread. On a mesh of other triangles the hair is made again.
#[derive(Component, Reflect, Clone, Debug, PartialEq)]
#[component(on_insert = tell_if_nothing_wears)]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct WearHair {
    /// What is worn.
    pub hair: HairSource,
    /// What is worn beside it on the same head, such as a beard: see [`and`](Self::and). Their order means nothing; a
    /// preset that is there twice is a [`WearError::Twice`]. Default none.
    pub beside: Vec<HairBeside>,
    /// The name of the bone, or of the mesh, that it is worn on. Default `None`: the entity's own
    /// mesh, else the bone whose name ends with the word head (`Head`, `mixamorig:Head`,
    /// `J_Bip_C_Head`) or is Rigify's (`DEF-spine.006`), else the only mesh there is: on the joint
    /// that moves its highest vertex.
    pub on: Option<String>,
    /// The name of the mesh that it grows on, or of the node that its parts are below. Default `None`: the
    /// skin of the head. Of the meshes that are shown and move with the head, what lies over another, like old
    /// hair and hats, and what lies within, like eyes and teeth, is left out; the rest is skin, all parts of it.
    /// Names decide only what is nearly even. The choice is logged.
    pub mesh: Option<String>,
    /// Whether hair that the character came with is hidden while this is worn: meshes that lie over the
    /// scalp, and are not named like hats or glasses. Default `false`. Without the feature `render` nothing is
    /// hidden.
    pub hides_old_hair: bool,
    /// The direction in which the face looks, in this entity's space; Y is up and the component
    /// along Y is ignored. Default `None`: found, and reported in [`HairWorn`], from the bones of eyes, toes and
    /// feet, else from the shape of the head. Where nothing shows it, it is −Z, Bevy's forward, which is logged.
    pub facing: Option<Dir3>,
    /// Seed of the strands' places and variations: the same seed gives the same hair. Default 0.
    pub seed: u64,
    /// How long a preset's hair is, as a multiple of its own length. Default 1, range that of
    /// [`WornPreset::LENGTH`](crate::WornPreset::LENGTH).
    pub length: f32,
    /// How it looks. Default `None`: as the hairdo, the preset or the groom has it; on hair that is worn
    /// already, as it looks now.
    pub look: Option<HairLook>,
    /// Bleach and dye. Default `None`: as the hairdo has it, else none.
    pub dye: Option<HairDye>,
    /// Whether and how its style is tracked: see [`HairStyle`]. Default
    /// `Some(HairStyle::default())`; without a style, as on an unstyled preset, it costs nothing.
    pub style: Option<HairStyle>,
    /// Where a preset's hairline is, in this entity's space, with the character as it is bound to its
    /// skeleton. Its front overrides [`facing`](Self::facing). Default `None`: found from the head's
    /// shape.
    pub scalp: Option<Scalp>,
    /// How a preset's hair begins at the hairline. Default `None`: [`HairPreset::hairline`].
    pub hairline: Option<Hairline>,
    /// Where a groom's origin is, and how it is turned and scaled, in this entity's space. Default
    /// the identity: it was made around the character as it stands there.
    pub place: Transform,
    /// Whether colliders are fitted to head and body: balls for the head, capsules or balls for the joints
    /// that hair reaches. [`HairCollider`](crate::HairCollider)s of the game's own replace those of the bone
    /// that they are on or below: one on a hand the hand's, one on the head or its jaw all of the head's; on a mesh
    /// without a skin, those of the mesh. One on the character's root replaces none, and so does a hat
    /// ([`HairCollider::inside`](crate::HairCollider::inside)). Hairs
    /// beside each other share them; another `WearHair` brings its own. Default `true`.
    pub colliders: bool,
    /// When it is put on, by [`Time<Fixed>::elapsed`](Time::elapsed): before the tick that reaches this; the game
    /// waits for it there where it is not ready. So the same ticks move it on any machine, as lockstep, rollback and
    /// replays need. Hair takes a second or two to be made, in which nobody waits; a mesh or groom that is still
    /// loading is not waited for. Default `None`: as soon as it is ready, at once with time standing still.
    ///
    /// ```
    /// # use bevy_keratin::prelude::*; use bevy::prelude::*; use std::time::Duration;
    /// fn join(mut commands: Commands, time: Res<Time<Fixed>>) {
    ///     let later = time.elapsed() + Duration::from_secs(3);
    ///     commands.spawn((Transform::default(), WearHair::new(HairPreset::Bob).at(later)));
    /// }
    /// ```
    pub at: Option<Duration>,
    /// How the hair is styled: put on at once, or resampled where it is of other strands. A hairdo
    /// saved from worn hair fits the same [`hair`](Self::hair), [`seed`](Self::seed) and
    /// [`length`](Self::length) on the same character strand by strand:
    /// `WearHair::try_from(hairdo)` sets them. Default `None`.
    #[cfg(feature = "save")]
    pub hairdo: Option<Hairdo>,
}

impl Default for WearHair {
    fn default() -> Self {
        Self {
            hair: HairSource::default(),
            beside: Vec::new(),
            on: None,
            mesh: None,
            hides_old_hair: false,
            facing: None,
            seed: 0,
            length: 1.0,
            look: None,
            dye: None,
            style: Some(HairStyle::default()),
            scalp: None,
            hairline: None,
            place: Transform::IDENTITY,
            colliders: true,
            at: None,
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

    /// Hair of a [`HairRecipe`], a preset changed by a file.
    pub fn of_recipe(recipe: Handle<HairRecipe>) -> Self {
        Self::new(HairSource::Recipe(recipe))
    }

    /// The same with another hair beside it: a preset, a groom, or a [`HairBeside`] with its own length and colour.
    ///
    /// ```
    /// # use bevy_keratin::prelude::*;
    /// let wear = WearHair::new(HairPreset::Undercut).and(HairPreset::Beard);
    /// ```
    pub fn and(mut self, hair: impl Into<HairBeside>) -> Self {
        self.beside.push(hair.into());
        self
    }

    /// The same on the bone or mesh of this name.
    pub fn on(mut self, name: impl Into<String>) -> Self {
        self.on = Some(name.into());
        self
    }

    /// The same on the mesh of this name, or on all parts below the node of this name.
    pub fn on_mesh(mut self, name: impl Into<String>) -> Self {
        self.mesh = Some(name.into());
        self
    }

    /// The same in place of the hair that the character came with.
    pub fn hiding_old_hair(mut self) -> Self {
        self.hides_old_hair = true;
        self
    }

    /// The same on a face that looks in this direction.
    pub fn facing(mut self, direction: Dir3) -> Self {
        self.facing = Some(direction);
        self
    }

    /// The same with a length of `times` the preset's.
    pub fn long(mut self, times: f32) -> Self {
        self.length = times;
        self
    }

    /// The same bleached and dyed.
    pub fn dyed(mut self, dye: HairDye) -> Self {
        self.dye = Some(dye);
        self
    }

    /// The same, put on before the tick in which `Time<Fixed>::elapsed` reaches this.
    pub fn at(mut self, time: Duration) -> Self {
        self.at = Some(time);
        self
    }

    /// The same styled like this.
    #[cfg(feature = "save")]
    pub fn styled(mut self, hairdo: Hairdo) -> Self {
        self.hairdo = Some(hairdo);
        self
    }

    /// What each of its hairs is.
    pub(super) fn sources(&self) -> impl Iterator<Item = &HairSource> {
        core::iter::once(&self.hair).chain(self.beside.iter().map(|other| &other.hair))
    }

    /// Each of its hairs, as if it was worn alone.
    pub(super) fn each(&self) -> impl Iterator<Item = Self> + use<> {
        let first = Self { beside: Vec::new(), ..self.clone() };
        let alone = |other: &HairBeside| {
            let other = other.clone();
            Self {
                hair: other.hair,
                seed: other.seed,
                length: other.length,
                look: other.look,
                dye: other.dye,
                style: other.style,
                hairline: other.hairline,
                place: other.place,
                #[cfg(feature = "save")]
                hairdo: other.hairdo,
                ..first.clone()
            }
        };
        let others: Vec<_> = self.beside.iter().map(alone).collect();
        core::iter::once(first).chain(others)
    }

    /// The one of which these are [`each`](Self::each).
    pub(super) fn of_each(mut all: impl Iterator<Item = Self>) -> Option<Self> {
        let first = all.next()?;
        Some(Self { beside: all.map(HairBeside::from).collect(), ..first })
    }

    /// # Errors
    /// [`WearError::Twice`] where two would grow from the same roots.
    pub(super) fn check_beside(&self) -> Result<(), WearError> {
        let all: Vec<_> = self.each().collect();
        let is_same = |a: &Self, b: &Self| match (&a.hair, &b.hair) {
            (HairSource::Preset(a), HairSource::Preset(b)) => a == b,
            (HairSource::Recipe(a), HairSource::Recipe(b)) => a == b,
            (HairSource::Groom { groom: of, .. }, HairSource::Groom { groom, .. }) => {
                of == groom && a.place == b.place
            }
            _ => false,
        };
        let twice = (1..all.len()).find(|&i| all[..i].iter().any(|other| is_same(other, &all[i])));
        let Some(i) = twice else { return Ok(()) };
        let hair = match &all[i].hair {
            HairSource::Preset(preset) => format!("the preset {preset:?}"),
            HairSource::Groom { groom, .. } => groom
                .path()
                .map_or_else(|| "a groom".to_owned(), |path| format!("the groom {path}")),
            HairSource::Recipe(recipe) => recipe
                .path()
                .map_or_else(|| "a recipe".to_owned(), |path| format!("the recipe {path}")),
        };
        Err(WearError::Twice { hair })
    }

    /// Without what worn hair can take, and its time.
    pub(super) fn bare(&self) -> Self {
        let each = self.each();
        let bare = each.map(|hair| Self { look: None, dye: None, style: None, at: None, ..hair });
        Self::of_each(bare).unwrap_or_default()
    }

    /// Whether they differ only in what worn hair can take.
    pub(super) fn is_same_hair(&self, other: &Self) -> bool {
        self.bare() == other.bare()
    }

    /// Whether they are the same presets, or grooms, on the same head, perhaps of another length, seed or hairline.
    pub(super) fn is_variation(&self, other: &Self) -> bool {
        let kind = |wear: &Self| {
            let each = wear.bare().each().map(|mut hair| {
                if let HairSource::Groom { groom, guides } = &mut hair.hair {
                    (*groom, *guides) = default();
                }
                Self { length: 1.0, seed: 0, hairline: None, ..hair }
            });
            each.collect::<Vec<_>>()
        };
        kind(self) == kind(other)
    }

    /// This hair with the look, dye and style of another of as many.
    pub(super) fn looking_like(self, other: &Self) -> Self {
        let pairs = self.each().zip(other.each());
        let each = pairs.map(|(own, other)| {
            let Self { look, dye, style, .. } = other;
            Self { look, dye, style, ..own }
        });
        Self::of_each(each).unwrap_or(self)
    }
}

/// A hairdo as it was saved: the preset that it was made on, with seed and length, styled by it.
///
/// # Errors
/// [`HairdoError::NoPreset`] when it was made on something else, or on a preset that is not known.
#[cfg(feature = "save")]
impl TryFrom<Hairdo> for WearHair {
    type Error = HairdoError;

    fn try_from(hairdo: Hairdo) -> Result<Self, HairdoError> {
        let of = hairdo.preset().ok_or(HairdoError::NoPreset)?;
        let preset = of.preset().ok_or(HairdoError::NoPreset)?;
        let (seed, length) = (of.seed, of.length);
        Ok(Self { seed, length, ..Self::new(preset) }.styled(hairdo))
    }
}

/// A hair that is worn beside another by one [`WearHair`], such as a beard: with its own length, colour and style, on
/// the same head and colliders.
///
/// ```
/// # use bevy_keratin::prelude::*;
/// let stubble = HairBeside::new(HairPreset::Beard).long(0.5);
/// let wear = WearHair::new(HairPreset::Short).and(stubble);
/// ```
#[derive(Reflect, Clone, Debug, PartialEq)]
#[reflect(Default, Clone, PartialEq)]
pub struct HairBeside {
    /// As [`WearHair::hair`].
    pub hair: HairSource,
    /// As [`WearHair::seed`].
    pub seed: u64,
    /// As [`WearHair::length`].
    pub length: f32,
    /// As [`WearHair::look`].
    pub look: Option<HairLook>,
    /// As [`WearHair::dye`].
    pub dye: Option<HairDye>,
    /// As [`WearHair::style`].
    pub style: Option<HairStyle>,
    /// As [`WearHair::hairline`].
    pub hairline: Option<Hairline>,
    /// As [`WearHair::place`].
    pub place: Transform,
    /// As [`WearHair::hairdo`].
    #[cfg(feature = "save")]
    pub hairdo: Option<Hairdo>,
}

impl Default for HairBeside {
    fn default() -> Self {
        WearHair::default().into()
    }
}

/// What a wear says of its first hair.
impl From<WearHair> for HairBeside {
    fn from(wear: WearHair) -> Self {
        Self {
            hair: wear.hair,
            seed: wear.seed,
            length: wear.length,
            look: wear.look,
            dye: wear.dye,
            style: wear.style,
            hairline: wear.hairline,
            place: wear.place,
            #[cfg(feature = "save")]
            hairdo: wear.hairdo,
        }
    }
}

impl From<HairPreset> for HairBeside {
    fn from(preset: HairPreset) -> Self {
        Self::new(preset)
    }
}

impl From<Handle<Groom>> for HairBeside {
    fn from(groom: Handle<Groom>) -> Self {
        Self::new(groom)
    }
}

/// As [`WearHair::try_from`].
#[cfg(feature = "save")]
impl TryFrom<Hairdo> for HairBeside {
    type Error = HairdoError;

    fn try_from(hairdo: Hairdo) -> Result<Self, HairdoError> {
        WearHair::try_from(hairdo).map(Self::from)
    }
}

impl HairBeside {
    /// Hair of a preset or a groom.
    pub fn new(hair: impl Into<HairSource>) -> Self {
        WearHair::new(hair).into()
    }

    /// The same with a length of `times` the preset's.
    pub fn long(mut self, times: f32) -> Self {
        self.length = times;
        self
    }

    /// The same bleached and dyed.
    pub fn dyed(mut self, dye: HairDye) -> Self {
        self.dye = Some(dye);
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
    /// Planted by a preset.
    Preset(HairPreset),
    /// A groom asset; waits until it is loaded, and follows reloads.
    Groom {
        /// The groom.
        groom: Handle<Groom>,
        /// Which of its strands are simulated, and how finely.
        guides: GroomGuides,
    },
    /// Planted by a [`HairRecipe`] asset; waits until it is loaded, and follows reloads.
    Recipe(Handle<HairRecipe>),
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

/// In an app that puts hair on, or has said why it does not.
#[derive(Resource, Default)]
pub(super) struct KnowsOfWearing;

/// Whether it was said that nothing does.
#[derive(Resource, Default)]
struct ToldNothingWears;

/// Without plugins no system runs that could say so.
fn tell_if_nothing_wears(mut world: DeferredWorld, context: HookContext) {
    // Not in the world of a scene asset, which is no app.
    let is_app = world.contains_resource::<MainScheduleOrder>();
    if !is_app
        || world.contains_resource::<KnowsOfWearing>()
        || world.contains_resource::<ToldNothingWears>()
    {
        return;
    }
    world.commands().init_resource::<ToldNothingWears>();
    tracing::warn!(
        "hair, entity {}: WearHair does nothing without HairPlugins: app.add_plugins(HairPlugins::default())",
        context.entity
    );
}

/// What a worn [`Hair`](crate::Hair) was made from. Component of the hair, written when it is spawned; its
/// [`WornBy`](crate::WornBy) has the wearer. A wearer that has none yet but is named by such hair wears it: one that was cloned with
/// its character, or loaded from a scene.
#[derive(Component, Reflect, Clone, Debug, PartialEq)]
#[reflect(Component, Clone, PartialEq)]
pub struct WornAs {
    /// The component that it was made from; of several hairs, as if this one was worn alone.
    pub wear: WearHair,
    /// Which of the hairs of that component it is.
    pub(super) which: usize,
    /// The meshes that its colliders were fitted to.
    #[entities]
    pub(super) parts: Vec<Entity>,
}

impl WornAs {
    /// Which preset it is; `None` for a groom or a recipe.
    pub fn preset(&self) -> Option<HairPreset> {
        match self.wear.hair {
            HairSource::Preset(preset) => Some(preset),
            HairSource::Groom { .. } | HairSource::Recipe(_) => None,
        }
    }
}

/// Triggered on an entity with [`WearHair`] once its hair is spawned, at first and after each change: once for all hairs
/// of the component.
#[derive(EntityEvent, Reflect, Clone, Debug, PartialEq)]
#[reflect(Clone, PartialEq)]
pub struct HairWorn {
    /// The wearer.
    pub entity: Entity,
    /// The hair.
    pub hair: Entity,
    /// Those beside it, in the order of [`WearHair::beside`].
    pub beside: Vec<Entity>,
    /// The mesh that it grows on, that with most of the head where there are several:
    /// [`RootsOnMesh`](crate::authoring::attach::RootsOnMesh) names all.
    pub mesh: Entity,
    /// Where the face looks, in the wearer's space.
    pub facing: Dir3,
    /// What shows that.
    pub facing_from: FacingFrom,
}

/// Triggered on an entity with [`WearHair`] whose hair cannot be made; also reported as a
/// [`HairFault`](crate::HairFault).
#[derive(EntityEvent, Reflect, Clone, Debug, PartialEq)]
#[reflect(Clone, PartialEq, from_reflect = false)]
pub struct HairNotWorn {
    /// The wearer, with the hair that it had.
    pub entity: Entity,
    /// Why.
    #[reflect(ignore)]
    pub error: WearError,
}

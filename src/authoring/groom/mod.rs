//! Grooms: hair as an artist made it, before it is simulated.
//!
//! A [`Groom`] holds strands as polylines, root first, in metres. It comes from a file, from game
//! code ([`Groom::from_polylines`]) or is planted on a mesh.

pub mod alembic;
mod bones;
mod bytes;
mod cache;
mod cache_file;
mod curve_sets;
#[cfg(feature = "render")]
mod drawn;
mod foreign;
mod format;
pub mod gltf;
mod grown_hair;
mod guides;
mod intake;
mod loader;
mod losses;
pub mod ply;
mod reshape;
mod roots;
pub mod salon;
mod settings;
mod shared;
mod size;
mod strays;
pub mod tressfx;
mod up_axis;
#[cfg(feature = "usd")]
pub mod usd;
pub mod yuksel;

pub use bones::{BonesFile, RootBones, StrandBones};
pub use bytes::GroomFileError;
pub use cache::{GroomCache, GroomCacheError, PlayGroomCache, RecordGroomCache};
pub use cache_file::GroomCacheLoader;
pub use format::GroomFormat;
pub use loader::{GroomLoadError, GroomLoader, GroomPlugin};
pub use losses::{GroomLoss, GroomLosses, GroomPlace};

pub(crate) use grown_hair::GrownStrands;
pub use grown_hair::{GroomGuides, GroomedHair};
pub use roots::RootEnd;
pub use settings::GroomSettings;
pub use size::OddSize;
pub use up_axis::UpAxis;

use crate::{base::setting::InvalidValue, solver::rod::StrandMaterial};
use bevy::prelude::*;
use shared::Shared;

/// Many strands as polylines, root first (m), optionally with widths, colours, UVs of the roots,
/// marks of guides and bones that roots follow. An asset; immutable, so that its arrays are always consistent,
/// and a clone shares them.
#[derive(Asset, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(opaque, Default, Clone, PartialEq)]
pub struct Groom {
    points: Shared<Vec3>,
    ends: Shared<u32>,
    widths: Shared<f32>,
    colors: Shared<LinearRgba>,
    uvs: Shared<Vec2>,
    guides: Shared<bool>,
    stiffness: Shared<f32>,
    damping: Shared<f32>,
    /// Indices into `all_groups`, or beyond them.
    groups: Shared<u32>,
    all_groups: Shared<GroomGroup>,
    bones: RootBones,
}

/// A group of strands, as files have them: hair of one name or number, such as a fringe, a beard or the left half of a
/// head. By [`Groom::with_groups`].
#[derive(Reflect, Clone, Debug, Default, PartialEq, Eq)]
#[reflect(Default, Clone, PartialEq)]
pub struct GroomGroup {
    /// Its number in the file, in Alembic and USD `groom_group_id`; 0 where there is none.
    pub id: i32,
    /// Its name, in Alembic and USD `groom_group_name`, else that of the curves.
    pub name: String,
    /// Where its curves are in the file, such as `/groom/Head/Fringe/Fringe`; empty where the format has no names.
    pub path: String,
}

impl GroomGroup {
    /// What the hair grows on by the names of the file, as the add-on for Blender writes them:
    /// `/groom/HEAD/HAIR/HAIR`; `None` by another path.
    pub fn head(&self) -> Option<&str> {
        let mut names = self.path.strip_prefix("/groom/")?.split('/');
        let head = names.next()?;
        (names.count() == 2).then_some(head)
    }
}

/// One strand of a [`Groom`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroomStrand<'a> {
    /// Its nodes (m), root first.
    pub points: &'a [Vec3],
    /// Diameter at each node (m), if given.
    pub widths: Option<&'a [f32]>,
    /// Colour at each node, if given.
    pub colors: Option<&'a [LinearRgba]>,
    /// Where the root is on the scalp's texture, if given.
    pub uv: Option<Vec2>,
    /// Whether it is marked as a guide: see [`Groom::with_guides`].
    pub is_guide: bool,
    /// How stiff it is, if given: see [`Groom::with_stiffness`].
    pub stiffness: Option<f32>,
    /// How damped it is, if given: see [`Groom::with_damping`].
    pub damping: Option<f32>,
    /// The group that it is in, if there are any.
    pub group: Option<&'a GroomGroup>,
}

/// Why data cannot be a [`Groom`].
#[derive(thiserror::Error, Reflect, Clone, Debug, PartialEq)]
#[reflect(Clone, PartialEq)]
pub enum GroomError {
    /// A strand with fewer than two nodes.
    #[error("strand {strand} has {found} nodes, expected 2 or more: leave it out")]
    TooFewNodes {
        /// Its index.
        strand: usize,
        /// How many nodes it has.
        found: usize,
    },
    /// A node that is not finite.
    #[error("node {node} of strand {strand} is not finite: remove it or repair the source")]
    NonFinite {
        /// The strand's index.
        strand: usize,
        /// The node's index from the root.
        node: usize,
    },
    /// An invalid width, colour or UV.
    #[error(
        "{what} {at} of strand {strand} is {found}, expected {expected}: repair or leave it out"
    )]
    OutOfRange {
        /// Which number, with its unit.
        what: &'static str,
        /// The strand's index.
        strand: usize,
        /// The node's index from the root; 0 for values of the whole strand.
        at: usize,
        /// What was found.
        found: f32,
        /// The allowed values.
        expected: &'static str,
    },
    /// An array whose length does not match the nodes or strands.
    #[error("{what} has {found} elements, expected {expected} or none")]
    Length {
        /// Which array.
        what: &'static str,
        /// How many it has.
        found: usize,
        /// How many it should have.
        expected: usize,
    },
    /// More nodes than an index of 32 bits can count.
    #[error("the groom has {found} nodes, expected at most {}: thin it first", u32::MAX)]
    TooMany {
        /// How many there are.
        found: usize,
    },
    /// A strand longer than a file format can hold.
    #[error("strand {strand} has {found} nodes, expected at most 65536: resample it first")]
    TooManyNodes {
        /// Its index.
        strand: usize,
        /// How many nodes it has.
        found: usize,
    },
    /// No strand at all.
    #[error(
        "the groom has no strands, expected 1 or more: check whether all were left out as \
         short, or its scale is too small"
    )]
    Empty,
    /// An entity that neither is hair nor wears any.
    #[error("the entity is no Hair and wears none, expected one of these: ask after HairWorn")]
    NoHair,
    /// Every strand was left out.
    #[error("no strand is left, expected 1 or more: {losses}; repair the source")]
    AllLeftOut {
        /// What was left out.
        losses: String,
    },
    /// A broken file that is to be read strictly.
    #[error(
        "{broken}, expected none: repair the source, or set GroomSettings::strict to false to do \
         without them"
    )]
    Strict {
        /// What would be left out.
        broken: String,
    },
    /// Ends of strands that are not in ascending order.
    #[error("strand {strand} ends at node {found}, expected {expected}: make it by from_polylines")]
    Ends {
        /// Its index.
        strand: usize,
        /// Where it ends.
        found: usize,
        /// Where it may end.
        expected: &'static str,
    },
    /// A number that a method of [`Groom`] refuses.
    #[error(transparent)]
    Value(#[from] InvalidValue),
}

impl Groom {
    const WIDTH: &str = "width (m)";
    const COLOUR: &str = "colour";
    const UV: &str = "UV";
    const STIFFNESS: &str = "stiffness";
    const DAMPING: &str = "damping";

    /// A groom of these polylines (m), root first.
    ///
    /// ```
    /// # use bevy_keratin::authoring::groom::Groom; use bevy::prelude::*;
    /// let lines = (0..10).map(|i| Vec3::X * i as f32 * 0.01).map(|root| [root, root + Vec3::Y * 0.1]);
    /// assert_eq!(Groom::from_polylines(lines).unwrap().len(), 10);
    /// ```
    ///
    /// # Errors
    /// When a strand has fewer than two nodes or a node that is not finite.
    pub fn from_polylines<L: IntoIterator<Item = Vec3>>(
        strands: impl IntoIterator<Item = L>,
    ) -> Result<Self, GroomError> {
        let mut groom = Self::default();
        for line in strands {
            groom.points.extend(line);
            let found = groom.points.len();
            groom.ends.push(u32::try_from(found).map_err(|_| GroomError::TooMany { found })?);
        }
        groom.checked()
    }

    /// A groom as a file has it, not yet checked.
    fn raw(
        points: Vec<Vec3>,
        ends: Vec<u32>,
        widths: Vec<f32>,
        colors: Vec<LinearRgba>,
        uvs: Vec<Vec2>,
    ) -> Self {
        let (points, ends, widths) = (points.into(), ends.into(), widths.into());
        Self { points, ends, widths, colors: colors.into(), uvs: uvs.into(), ..default() }
    }

    /// The groom with a diameter (m) for each node, strand after strand.
    ///
    /// # Errors
    /// When there are not as many as nodes, or one is negative or not finite.
    pub fn with_widths(mut self, widths: Vec<f32>) -> Result<Self, GroomError> {
        self.widths = widths.into();
        self.checked()
    }

    /// The groom with a colour for each node, strand after strand.
    ///
    /// # Errors
    /// When there are not as many as nodes, or one is not finite.
    pub fn with_colors(mut self, colors: Vec<LinearRgba>) -> Result<Self, GroomError> {
        self.colors = colors.into();
        self.checked()
    }

    /// The groom with a place on the scalp's texture for each strand.
    ///
    /// # Errors
    /// When there are not as many as strands, or one is not finite.
    pub fn with_uvs(mut self, uvs: Vec<Vec2>) -> Result<Self, GroomError> {
        self.uvs = uvs.into();
        self.checked()
    }

    /// The groom with a mark for each strand whether it is a guide: [`Groom::guides`] chooses among marked
    /// strands only, where there are any, and all others follow them. Some files have such marks.
    ///
    /// # Errors
    /// When there are not as many as strands.
    pub fn with_guides(mut self, guides: Vec<bool>) -> Result<Self, GroomError> {
        self.guides = guides.into();
        self.checked()
    }

    /// The groom with a stiffness for each strand, as a share of that of its hair: strands that are simulated get
    /// [`StrandMaterial`], all others follow them. Alembic and USD have it as the attribute `groom_stiffness`.
    ///
    /// ```
    /// # use bevy_keratin::{prelude::*, authoring::groom::*};
    /// /// A fringe that is half as stiff as the other groups.
    /// fn soft_fringe(groom: Groom) -> Result<Groom, GroomError> {
    ///     let share = |strand: GroomStrand| match strand.group.map(|group| group.name.as_str()) {
    ///         Some("fringe") => 0.5,
    ///         _ => 1.0,
    ///     };
    ///     let shares = groom.strands().map(share).collect();
    ///     groom.with_stiffness(shares)
    /// }
    /// ```
    ///
    /// # Errors
    /// When there are not as many as strands, or one is outside [`StrandMaterial::STIFFNESS`].
    pub fn with_stiffness(mut self, shares: Vec<f32>) -> Result<Self, GroomError> {
        self.stiffness = shares.into();
        self.checked()
    }

    /// The groom with a damping for each strand, as a share of that of its hair, which strands that are simulated get as
    /// [`StrandMaterial::damping`]. Alembic and USD have it as the attribute `groom_damping`.
    ///
    /// # Errors
    /// When there are not as many as strands, or one is outside [`StrandMaterial::DAMPING`].
    pub fn with_damping(mut self, shares: Vec<f32>) -> Result<Self, GroomError> {
        self.damping = shares.into();
        self.checked()
    }

    /// The groom with groups, and for each strand the index of its own; an index that none has is no group.
    ///
    /// # Errors
    /// When there are not as many indices as strands.
    pub fn with_groups(
        mut self,
        groups: Vec<GroomGroup>,
        of_strands: Vec<u32>,
    ) -> Result<Self, GroomError> {
        (self.all_groups, self.groups) = (groups.into(), of_strands.into());
        self.checked()
    }

    /// The groups of its strands, in the order of the file; none where the file has none. [`GroomStrand::group`] says
    /// which a strand is in.
    pub fn groups(&self) -> &[GroomGroup] {
        &self.all_groups
    }

    /// The groom with the bones that its roots follow: hair grown from it gets
    /// [`RootsOnBones`](crate::authoring::attach::RootsOnBones).
    ///
    /// # Errors
    /// When there are not as many as strands, or one names a bone that is not there or has a negative weight.
    pub fn with_bones(mut self, bones: RootBones) -> Result<Self, GroomError> {
        self.bones = bones;
        self.checked()
    }

    /// The bones that the roots follow, if there are any.
    pub fn bones(&self) -> Option<&RootBones> {
        Some(&self.bones).filter(|bones| !bones.strands.is_empty())
    }

    fn checked(self) -> Result<Self, GroomError> {
        self.check().map(|()| self)
    }

    /// Validates it: grooms also come from files.
    fn check(&self) -> Result<(), GroomError> {
        self.check_ends()?;
        let fits = |what, found: usize, expected: usize| {
            let fits = found == 0 || found == expected;
            fits.then_some(()).ok_or(GroomError::Length { what, found, expected })
        };
        fits("widths", self.widths.len(), self.points.len())?;
        fits("colors", self.colors.len(), self.points.len())?;
        fits("uvs", self.uvs.len(), self.len())?;
        fits("guides", self.guides.len(), self.len())?;
        fits("stiffness", self.stiffness.len(), self.len())?;
        fits("damping", self.damping.len(), self.len())?;
        fits("groups", self.groups.len(), self.len())?;
        fits("bones", self.bones.strands.len(), self.len())?;
        self.check_bones()?;
        self.strands().enumerate().try_for_each(|(i, strand)| strand.check(i))
    }

    fn check_bones(&self) -> Result<(), GroomError> {
        let count = self.bones.names.len();
        for (strand, bones) in self.bones.strands.iter().enumerate() {
            let wrong = |what, at, found, expected| {
                Err(GroomError::OutOfRange { what, strand, at, found, expected })
            };
            if let Some(at) = bones.weights.iter().position(|w| !(w.is_finite() && *w >= 0.0)) {
                let expected = "a finite weight, 0 or more";
                return wrong("bone's weight", at, bones.weights[at], expected);
            }
            if let Some((bone, _)) = bones.used().find(|(bone, _)| usize::from(*bone) >= count) {
                return wrong("bone", 0, bone.into(), "an index of a name");
            }
        }
        Ok(())
    }

    /// Every strand begins where the one before ends, and the last ends with the nodes.
    fn check_ends(&self) -> Result<(), GroomError> {
        let (mut start, all) = (0, self.points.len());
        for (strand, &end) in self.ends.iter().enumerate() {
            let found = end as usize;
            if found < start || found > all {
                let expected = "behind the one before, and within the nodes";
                return Err(GroomError::Ends { strand, found, expected });
            }
            start = found;
        }
        let fits = start == all;
        let expected = self.ends.last().map_or(0, |end| *end as usize);
        fits.then_some(()).ok_or(GroomError::Length { what: "nodes", found: all, expected })
    }

    /// How many strands there are.
    pub fn len(&self) -> usize {
        self.ends.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.ends.is_empty()
    }

    /// The nodes of all strands (m), one strand after the other.
    pub fn points(&self) -> &[Vec3] {
        &self.points
    }

    /// The strands in their order.
    pub fn strands(&self) -> impl ExactSizeIterator<Item = GroomStrand<'_>> {
        (0..self.len()).map(|i| self.strand_at(i))
    }

    fn strand_at(&self, i: usize) -> GroomStrand<'_> {
        let nodes = self.nodes_of(i);
        GroomStrand {
            points: &self.points[nodes.clone()],
            widths: self.widths.get(nodes.clone()).filter(|_| !self.widths.is_empty()),
            colors: self.colors.get(nodes).filter(|_| !self.colors.is_empty()),
            uv: self.uvs.get(i).copied(),
            is_guide: self.guides.get(i) == Some(&true),
            stiffness: self.stiffness.get(i).copied(),
            damping: self.damping.get(i).copied(),
            group: self.groups.get(i).and_then(|group| self.all_groups.get(*group as usize)),
        }
    }
}

impl GroomStrand<'_> {
    /// What it is beside others when it is simulated; `None` where the groom says nothing of it.
    pub(crate) fn material(&self) -> Option<StrandMaterial> {
        let (stiffness, damping) = (self.stiffness.unwrap_or(1.0), self.damping.unwrap_or(1.0));
        let is_given = self.stiffness.is_some() || self.damping.is_some();
        is_given.then_some(StrandMaterial { stiffness, damping })
    }

    /// Length along its nodes (m).
    pub fn length(&self) -> f32 {
        self.points.windows(2).map(|p| p[0].distance(p[1])).sum()
    }

    fn check(&self, strand: usize) -> Result<(), GroomError> {
        let found = self.points.len();
        if found < 2 {
            return Err(GroomError::TooFewNodes { strand, found });
        }
        if let Some(node) = self.points.iter().position(|p| !p.is_finite()) {
            return Err(GroomError::NonFinite { strand, node });
        }
        let wrong = |what, at, found, expected| {
            Err(GroomError::OutOfRange { what, strand, at, found, expected })
        };
        let width = |w: &f32| w.is_finite() && *w >= 0.0;
        let widths = self.widths.unwrap_or_default();
        if let Some(at) = widths.iter().position(|w| !width(w)) {
            return wrong(Groom::WIDTH, at, widths[at], "a finite diameter, 0 or more");
        }
        let parts = self.colors.unwrap_or_default().iter().map(|c| c.to_f32_array());
        for (at, parts) in parts.enumerate() {
            if let Some(part) = parts.into_iter().find(|part| !part.is_finite()) {
                return wrong(Groom::COLOUR, at, part, "finite numbers");
            }
        }
        if let Some(share) = self.stiffness
            && StrandMaterial::STIFFNESS.check(share).is_err()
        {
            return wrong(Groom::STIFFNESS, 0, share, "a share of 0.01 to 100");
        }
        if let Some(share) = self.damping
            && StrandMaterial::DAMPING.check(share).is_err()
        {
            return wrong(Groom::DAMPING, 0, share, "a share of 0 to 100");
        }
        let uv = self.uv.unwrap_or_default().to_array();
        match uv.into_iter().find(|part| !part.is_finite()) {
            Some(part) => wrong(Groom::UV, 0, part, "finite numbers"),
            None => Ok(()),
        }
    }
}

//! Why hair cannot be worn.

use crate::{
    authoring::{groom::GroomError, plant::PlantError},
    base::setting::InvalidValue,
    hair::strand::StrandError,
};
use bevy::prelude::*;

/// Why a [`WearHair`](super::WearHair) puts no hair on its entity: what was found, what was expected
/// and how to fix it. Reported as [`FaultKind::Wear`](crate::FaultKind::Wear).
#[derive(thiserror::Error, Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum WearError {
    /// Nothing below the wearer has a mesh, after ten seconds.
    #[error(
        "WearHair's entity has no mesh, and none appeared below it within {SEARCH_TIME} s: put it on a \
         mesh, or on the root of a character"
    )]
    NoMesh,
    /// An asset of the wearer, such as its scene, that could not be loaded, so that there is no mesh.
    #[error(
        "WearHair's entity has no mesh, because {path} was not loaded: mend its path, or the file ({reason})"
    )]
    NoScene {
        /// The asset's path.
        path: String,
        /// What the asset server says.
        reason: String,
    },
    /// No bone or mesh of the given name.
    #[error("nothing is named {name:?} below WearHair's entity; there are {there}")]
    NoBone {
        /// The name.
        name: String,
        /// The names that are there.
        there: String,
    },
    /// No name was given, and no bone is called head.
    #[error("no bone is named head: name it with WearHair::on; there are {there}")]
    NoHead {
        /// The names that are there.
        there: String,
    },
    /// A bone that neither moves skin nor has a mesh below it.
    #[error(
        "{name:?} moves no skin and has no mesh below it: name the bone that moves the head's skin"
    )]
    NoSkin {
        /// Its name.
        name: String,
    },
    /// No mesh of the given name moves with the head.
    #[error(
        "no mesh that moves with the head is named {name:?}, nor is the node above one: name one of {there}"
    )]
    NoMeshNamed {
        /// The name.
        name: String,
        /// The names of those that do.
        there: String,
    },
    /// An asset that could not be loaded.
    #[error("the {what} was not loaded: {reason}")]
    NotLoaded {
        /// Which.
        what: &'static str,
        /// What the asset server says.
        reason: String,
    },
    /// A skin whose joints are not those of its vertices.
    #[error(
        "the skin has {joints} joints, {poses} inverse bind poses and a vertex of joint {found}: \
         give it the joints and poses of its own skeleton"
    )]
    Joints {
        /// How many joints there are.
        joints: usize,
        /// How many inverse bind poses.
        poses: usize,
        /// The highest joint that a vertex names.
        found: usize,
    },
    /// Places of bones or meshes that are not finite, or have no size.
    #[error(
        "the transforms between WearHair's entity and its mesh are not finite or have no size: \
         give them a scale other than 0"
    )]
    Pose,
    /// A face that looks straight up or down, or nowhere.
    #[error("WearHair::facing is {found}, expected a direction that is not up or down")]
    Facing {
        /// Its value.
        found: Vec3,
    },
    /// A head of implausible size.
    #[error(
        "the head is {found} m from the middle between the ears to the crown, expected {} to {} m: \
         scale the character, or set the position of its head with WearHair::scalp",
        HEAD_SIZES.start(), HEAD_SIZES.end()
    )]
    HeadSize {
        /// The height (m).
        found: f32,
    },
    /// Another entity's preset is worn on this bone or mesh.
    #[error(
        "the head's bone or mesh wears a preset of {by} already: remove that WearHair, or wear both by one, \
         as WearHair::new(HairPreset::Short).and(HairPreset::Beard)"
    )]
    Taken {
        /// The other wearer.
        by: Entity,
    },
    /// Two hairs of one component that would grow from the same roots: a preset twice, or a groom at the same place.
    #[error(
        "{hair} is in WearHair twice: leave it out of WearHair::beside, or give a groom another place there"
    )]
    Twice {
        /// Which.
        hair: String,
    },
    /// A groom too far from the character's mesh.
    #[error(
        "half of the groom's strands grow farther than {found} m from the mesh, expected less than \
         {most} m: {}",
        match scale {
            Some(scale) => format!(
                "at {scale} times its size it fits, as if it were in another unit: multiply GroomSettings::scale, \
                 or the scale of WearHair::place, by {scale}"
            ),
            None => "set its origin with WearHair::place".to_owned(),
        }
    )]
    Beside {
        /// The median distance (m, scaled to a life-size head).
        found: f32,
        /// The limit (m).
        most: f32,
        /// By which scale of its lengths the groom would be on the mesh, where another unit explains it.
        scale: Option<f32>,
    },
    /// An error of planting.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// An error of the groom.
    #[error(transparent)]
    Groom(#[from] GroomError),
    /// A setting out of its range.
    #[error(transparent)]
    Setting(#[from] InvalidValue),
    /// An invalid strand.
    #[error(transparent)]
    Strand(#[from] StrandError),
}

/// How long to wait for a missing mesh before reporting it (s).
pub(super) const SEARCH_TIME: f32 = 10.0;

/// Heights of heads on which hair can be simulated (m).
pub(super) const HEAD_SIZES: core::ops::RangeInclusive<f32> = 1e-3..=100.0;

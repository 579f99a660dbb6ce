//! Faults: what went wrong and was contained, told once, as messages and in the log.

use crate::{setting::InvalidValue, strand::StrandError};
use bevy::prelude::*;

/// Something that was wrong and has been contained. Written once per occurrence, so that game code
/// can react; also logged as a warning.
#[derive(Message, Reflect, Clone, Debug, PartialEq)]
#[reflect(Clone, PartialEq)]
pub struct HairFault {
    /// The hair, strand, collider, blower or rod concerned; [`Entity::PLACEHOLDER`] for resources.
    pub entity: Entity,
    /// What was wrong.
    pub fault: Fault,
}

/// The kinds of [`HairFault`].
#[derive(thiserror::Error, Reflect, Clone, Debug, PartialEq)]
#[reflect(Clone, PartialEq)]
pub enum Fault {
    /// A setting outside its range is used as the nearest valid value.
    #[error("{0}; the nearest valid value is used")]
    Setting(#[from] InvalidValue),
    /// A strand left the finite numbers and was put back to the state of the substep before.
    #[error("the strand became non-finite and was put back to its last finite state, at rest")]
    PutBack,
    /// A strand's stored state was not finite and its pose was rebuilt from root, lengths and bonds.
    #[error("the strand's state was not finite; its rest pose was rebuilt from root and bonds")]
    Rebuilt,
    /// A strand points to a hair that does not exist or carries no `Hair`: it is left out.
    #[error("the strand belongs to no hair: spawn it with StrandOf(hair), hair carrying Hair")]
    NoHair,
    /// A strand that cannot be simulated at all.
    #[error(transparent)]
    Strand(#[from] StrandError),
    /// A transform that cannot be inverted, or is not finite: the last valid one is used.
    #[error("the transform is not finite or has no inverse: the last valid pose is used")]
    Transform,
    /// Gravity that is not finite counts as none.
    #[error("HairGravity is not finite: no gravity is used until it is")]
    Gravity,
    /// An avian collider, or a part of one, that hair does not know: hair goes through it.
    #[cfg(feature = "avian")]
    #[error("{0}; hair goes through it")]
    Avian(#[from] crate::contact::AvianShapeError),
    /// Roots that cannot be tied to their mesh: the strands stay as they are.
    #[cfg(feature = "groom")]
    #[error("{0}; those strands do not follow the mesh")]
    Roots(#[from] crate::groom::RootsError),
    /// A groom that no strands can be grown from.
    #[cfg(feature = "groom")]
    #[error("the hair's groom cannot be used: {0}")]
    Groom(crate::groom::GroomError),
    /// A groom whose file could not be loaded.
    #[cfg(feature = "groom")]
    #[error("the hair's groom was not loaded: {error}")]
    GroomNotLoaded {
        /// What the asset server says.
        error: String,
    },
    /// A hairdo that the hair cannot wear.
    #[cfg(feature = "save")]
    #[error("{0}; the hair keeps the hairdo that it has")]
    Hairdo(#[from] crate::hairdo::HairdoError),
    /// A request that names something that is not there.
    #[error("the treatment's target is neither a Hair nor a strand")]
    NoTarget,
}

pub(crate) fn plugin(app: &mut App) {
    app.add_message::<HairFault>().register_type::<HairFault>().add_systems(Last, log_faults);
}

fn log_faults(mut faults: MessageReader<HairFault>) {
    for HairFault { entity, fault } in faults.read() {
        tracing::warn!("hair, entity {entity}: {fault}");
    }
}

//! Where hair comes from: [`groom`]s from files, presets that are [`plant`]ed on a mesh, [`recipe`]s
//! of both in files, roots that [`attach`] to it, colliders fitted to it ([`collider_fit`]), and [`wear`], all of it in one component.

pub mod attach;
pub mod collider_fit;
pub mod groom;
pub mod plant;
pub mod recipe;
pub mod wear;

/// The room's share of [the prelude](crate::prelude).
pub mod prelude {
    pub use crate::authoring::attach::RootsOnBones;
    pub use crate::authoring::groom::{
        BonesFile, Groom, GroomCache, GroomCacheError, GroomError, GroomFileError, GroomGroup,
        GroomGuides, GroomLoss, GroomLosses, GroomPlace, GroomSettings, GroomedHair,
        PlayGroomCache, RecordGroomCache, RootBones, RootEnd, StrandBones, UpAxis,
    };
    pub use crate::authoring::plant::{HairPreset, Hairline, Scalp};
    pub use crate::authoring::recipe::{FollowRecipe, HairRecipe, RecipeError};
    #[cfg(feature = "render")]
    pub use crate::authoring::wear::ScalpShade;
    pub use crate::authoring::wear::{
        FacingFrom, HairBeside, HairNotWorn, HairSource, HairWorn, WearError, WearHair, WornAs,
    };
}

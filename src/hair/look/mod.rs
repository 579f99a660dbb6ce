//! The look of hair as plain data: pigments, bleach and dye, and the preset it was grown from.
//!
//! The feature `render` draws it; it is saved with a hairdo either way.
//!
//! | file | what |
//! |---|---|
//! | `pigment` | melanin and colours, and what light they absorb |
//! | `dye` | bleach and dye along strands and by strand |
//! | `streaks` | which strands are in streaks |
//! | `appearance` | the look: pigments, sheen, thickness |
//! | `origin` | the preset that hair was grown from |

mod appearance;
mod dye;
mod origin;
mod pigment;
mod streaks;

pub use appearance::{HairLook, HairShading};
pub use dye::{DyeLayer, HairDye, MAX_LAYERS};
pub use origin::WornPreset;
pub use pigment::{HairColor, Melanin};
pub use streaks::Streaks;

use crate::hair::worn;
use bevy::prelude::*;

/// Registers the settings of looks.
#[derive(Clone, Copy, Debug, Default)]
pub struct LookPlugin;

impl Plugin for LookPlugin {
    fn build(&self, app: &mut App) {
        worn::setting::<HairLook>(app);
        worn::setting::<HairDye>(app);
        app.register_type::<WornPreset>();
    }
}

//! What hair looks like, as plain data: pigments, bleach and dye, and which preset it has grown from.
//!
//! It is drawn by the room `render`, if there is one, and travels with a hairdo either way.
//!
//! | file | what |
//! |---|---|
//! | `pigment` | melanin and colours, and what light they absorb |
//! | `dye` | bleach and dye along strands and by strand |
//! | `streaks` | which strands are in streaks |
//! | `appearance` | all that a look consists of |
//! | `origin` | where hair comes from |

mod appearance;
mod dye;
mod origin;
mod pigment;
mod streaks;

pub use appearance::{HairLook, HairShading};
pub use dye::{DyeLayer, HairDye, MOST_LAYERS};
pub use origin::WornPreset;
pub use pigment::{HairColor, Melanin};
pub use streaks::Streaks;

use crate::setting;
use bevy::prelude::*;

/// Registers looks.
#[derive(Clone, Copy, Debug, Default)]
pub struct LookPlugin;

impl Plugin for LookPlugin {
    fn build(&self, app: &mut App) {
        setting::plugin::<HairLook>(app);
        setting::plugin::<HairDye>(app);
        app.register_type::<WornPreset>();
    }
}

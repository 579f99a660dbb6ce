//! Wearing: hair on a character by one component.
//!
//! [`WearHair`] sets what is worn, a preset or a groom, and where: on an entity's own mesh, or on
//! the head of a character below it, found by the name of a bone. It waits for a scene that still
//! loads, makes the hair on the async compute task pool, ties its roots, fits colliders to head and
//! body, bones with colliders of their own left out, lets it settle, and spawns it as a [`Hair`](crate::Hair) of its
//! own. [`HairWorn`] is triggered when it is there, [`HairNotWorn`] when it cannot be. Change the
//! component and the hair is swapped, once the new one is ready; remove it and the hair is removed. Several hairs of one
//! component, such as a beard beside hair, are made together on one set of colliders, and come and go at once.
//!
//! | step | where |
//! |---|---|
//! | finding bone and mesh | `target` |
//! | which meshes are the head's skin | `skin` |
//! | where the face looks | `facing` |
//! | where the head is, and how large | `head` |
//! | mesh and hair in one space: the face toward −Z, the head's middle at the origin, life size | `space` |
//! | planting, roots, colliders, rest: a pure function | `make` |
//! | how hair lies that takes the place of other | `fall` |
//! | making it once for all who get the same | `alike` |
//! | colliders for capes and collars | `garments` |
//! | hats for hats and helmets | `helmets` |
//! | which asset is to blame for a missing mesh | `missing` |
//! | hiding the hair that a character came with | `old_hair` |
//! | shading the skin under the hair | `shade`, `shell` |

mod alike;
mod error;
mod facing;
mod fall;
mod garments;
mod head;
mod helmets;
mod landmarks;
mod make;
mod missing;
#[cfg(feature = "render")]
mod old_hair;
mod part;
#[cfg(feature = "render")]
mod shade;
#[cfg(feature = "render")]
mod shell;
mod skin;
mod space;
mod systems;
mod target;
mod what;

pub use error::WearError;
pub use facing::FacingFrom;
#[cfg(feature = "render")]
pub use shade::ScalpShade;
pub use what::{HairBeside, HairNotWorn, HairSource, HairWorn, WearHair, WornAs};

use crate::{
    authoring::attach::MadeAgain,
    base::schedule::{HairFrame, HairSystems, HairTick, first_substep},
    hair::{
        strand::lacks_strands,
        worn::{PassedOn, Wearer},
    },
};
use bevy::prelude::*;

/// Puts hair on entities with [`WearHair`].
#[derive(Clone, Copy, Debug, Default)]
pub struct WearPlugin;

impl Plugin for WearPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<what::KnowsOfWearing>();
        if lacks_strands::<Self>(app) {
            return;
        }
        #[cfg(feature = "render")]
        app.register_type::<old_hair::HiddenForHair>();
        app.init_resource::<alike::Makings>()
            .register_type::<WearHair>()
            .register_type::<HairSource>()
            .register_type::<HairBeside>()
            .register_type::<WornAs>()
            .register_type::<target::Fitted>()
            .register_type::<FacingFrom>()
            .register_type::<HairWorn>()
            .register_type::<HairNotWorn>()
            .register_required_components::<WearHair, systems::Wearing>()
            .register_required_components::<WearHair, Wearer>()
            .register_required_components::<WornAs, MadeAgain>()
            .add_observer(systems::leave)
            .add_systems(
                HairFrame,
                (
                    systems::take_off,
                    systems::find_worn,
                    systems::detect_changes,
                    systems::find_heads,
                    systems::start,
                    systems::put_on,
                    systems::fit_again,
                    helmets::wear_helmets,
                )
                    .chain()
                    .before(PassedOn),
            )
            .add_systems(
                HairTick,
                systems::put_on_due
                    .before(HairSystems::First)
                    .before(HairSystems::Roots)
                    .run_if(first_substep.and_then(systems::any_with_time)),
            );
        #[cfg(feature = "render")]
        app.configure_sets(HairFrame, shade::ShadeSystems.after(systems::fit_again));
        #[cfg(feature = "render")]
        shade::plugin(app);
    }
}

//! What cameras and lights see of drawn hair: components of Bevy's on a hair or its wearer.

use super::{HairBeadSystems, HairBuffers, HairRenderSystems, depth};
use crate::hair::{
    strand::{DrawnFrames, Hair},
    worn::{CopyOf, Passed, WornHair, pass_on},
};
use bevy::{
    camera::visibility::{NoFrustumCulling, RenderLayers, VisibilitySystems},
    light::{NotShadowCaster, NotShadowReceiver},
    prelude::*,
};

/// On a hair that is hidden because its wearer is: its visibility before.
#[derive(Component, Reflect, Clone, Copy, Debug)]
#[reflect(Component, Clone)]
pub(super) struct HiddenWithWearer(Visibility);

/// In this order: from wearers to their hair, from hair to what is drawn of it, and on to the draw of its depth.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Flags {
    ToHair,
    ToDrawn,
}

pub(super) fn plugin(app: &mut App) {
    app.register_type::<HiddenWithWearer>()
        .configure_sets(
            PostUpdate,
            (
                // Drops on hair are seen as it is.
                Flags::ToHair.after(DrawnFrames).before(HairBeadSystems).before(HairRenderSystems),
                Flags::ToDrawn
                    .after(Flags::ToHair)
                    .after(super::draw::pack)
                    .before(depth::follow)
                    .before(VisibilitySystems::VisibilityPropagate),
            ),
        )
        .add_systems(PostUpdate, hide_with_wearer.in_set(Flags::ToHair));
    flag::<RenderLayers>(app);
    flag::<NoFrustumCulling>(app);
    flag::<NotShadowCaster>(app);
    flag::<NotShadowReceiver>(app);
}

fn flag<T: Passed>(app: &mut App) {
    app.register_type::<CopyOf<T>>().add_systems(
        PostUpdate,
        (
            pass_on::<T, WornHair>.in_set(Flags::ToHair),
            pass_on::<T, HairBuffers>.in_set(Flags::ToDrawn),
        ),
    );
}

/// Hair is below a bone, and not always below its wearer, whose visibility it would inherit.
fn hide_with_wearer(
    wearers: Query<
        (Entity, &Visibility, &WornHair),
        (Or<(Changed<Visibility>, Changed<WornHair>)>, Without<Hair>),
    >,
    mut hairs: Query<(&mut Visibility, Option<&HiddenWithWearer>), With<Hair>>,
    parents: Query<&ChildOf>,
    mut commands: Commands,
) {
    for (wearer, wanted, worn) in &wearers {
        for hair in worn.iter().filter(|hair| !parents.iter_ancestors(*hair).any(|at| at == wearer))
        {
            let Ok((mut visibility, hidden)) = hairs.get_mut(hair) else { continue };
            match (wanted, hidden) {
                (Visibility::Hidden, None) => {
                    commands.entity(hair).try_insert(HiddenWithWearer(*visibility));
                    *visibility = Visibility::Hidden;
                }
                (Visibility::Inherited | Visibility::Visible, Some(HiddenWithWearer(before))) => {
                    commands.entity(hair).try_remove::<HiddenWithWearer>();
                    *visibility = *before;
                }
                _ => {}
            }
        }
    }
}

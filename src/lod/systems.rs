//! Levels are chosen at the start of a tick; the systems that move hair ask what they are.

use super::{
    Follower, Guides, HairLod, LodLevel, PresentLod, ScreenShare,
    carry::{move_followers, sync_follower_sleep},
    choose::{choose_guides, let_go},
    model,
};
use crate::{
    schedule::{HairSystems, HairTick, SubstepLimits, first_substep},
    setting::{self, Ranged},
    strand::{Hair, Strand},
};
use bevy::prelude::*;

/// Levels of detail of the simulation.
pub struct LodPlugin;

impl Plugin for LodPlugin {
    fn build(&self, app: &mut App) {
        setting::component::<HairLod>(app);
        app.register_type::<LodLevel>()
            .register_type::<ScreenShare>()
            .register_type::<PresentLod>()
            .register_type::<Follower>()
            .register_type::<Guides>()
            .register_required_components::<Strand, Follower>()
            .register_required_components::<HairLod, Guides>()
            .add_observer(forget)
            .add_observer(let_go)
            .add_systems(
                HairTick,
                (
                    (choose, choose_guides)
                        .chain()
                        .in_set(HairSystems::LevelOfDetail)
                        .run_if(first_substep),
                    sync_follower_sleep.in_set(HairSystems::FollowerSleep).run_if(first_substep),
                    move_followers.in_set(HairSystems::Followers),
                ),
            );
    }
}

/// Without levels hair is simulated in full.
fn forget(left: On<Remove, HairLod>, mut hairs: Query<(&mut PresentLod, &mut SubstepLimits)>) {
    if let Ok((mut present, mut limits)) = hairs.get_mut(left.entity) {
        (*present, *limits) = default();
    }
}

fn choose(
    mut hairs: Query<(&HairLod, &ScreenShare, &mut PresentLod, &mut SubstepLimits), With<Hair>>,
) {
    for (lod, share, mut present, mut limits) in &mut hairs {
        let lod = lod.clamped();
        let level = model::choose(&lod.levels, lod.hysteresis, present.level, share.0);
        let settings = level.checked_sub(1).and_then(|i| lod.levels.get(i));
        present.set_if_neq(PresentLod {
            level,
            strands: settings.map(|l| l.strands),
            carried: present.carried,
        });
        let limits_of =
            |l: &LodLevel| SubstepLimits { substeps: l.substeps, iterations: l.iterations };
        limits.set_if_neq(settings.map_or_else(SubstepLimits::default, limits_of));
    }
}

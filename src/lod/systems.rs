//! Levels are chosen at the start of a tick; the systems that move hair ask what they are.

use super::{
    Carried, Guides, HairLod, LodLevel, PresentLod, ScreenShare,
    guides::{carry, choose_guides, let_go, lull},
    model,
};
use crate::{
    rod,
    setting::{HairSetting, Notes},
    spring,
    strand::{self, Hair, Strand},
    tick::{HairStep, HairSystems, HairTick},
};
use bevy::{ecs::system::SystemParam, prelude::*};

/// Levels of detail of the simulation.
pub struct LodPlugin;

impl Plugin for LodPlugin {
    fn build(&self, app: &mut App) {
        app.register_type::<HairLod>()
            .register_type::<LodLevel>()
            .register_type::<ScreenShare>()
            .register_type::<PresentLod>()
            .register_type::<Carried>()
            .register_type::<Guides>()
            .register_required_components::<Strand, Carried>()
            .register_required_components::<HairLod, Guides>()
            .add_observer(forget)
            .add_observer(let_go)
            .add_systems(PreUpdate, crate::setting::report_changed::<HairLod>)
            .add_systems(
                HairTick,
                (choose, choose_guides)
                    .chain()
                    .in_set(HairSystems::Roots)
                    .after(strand::move_poses)
                    .before(strand::carry_strands)
                    .run_if(|step: Res<HairStep>| step.index == 0),
            )
            .add_systems(
                HairTick,
                lull.in_set(HairSystems::Roots)
                    .after(choose_guides)
                    .before(strand::carry_strands)
                    .run_if(|step: Res<HairStep>| step.index == 0),
            )
            .add_systems(
                HairTick,
                carry
                    .in_set(HairSystems::Projection)
                    .after(rod::project)
                    .after(spring::step_springs),
            );
    }
}

/// Without levels hair is simulated in full.
fn forget(left: On<Remove, HairLod>, mut hairs: Query<&mut PresentLod>) {
    if let Ok(mut present) = hairs.get_mut(left.entity) {
        *present = PresentLod::default();
    }
}

fn choose(mut hairs: Query<(&HairLod, &ScreenShare, &mut PresentLod), With<Hair>>) {
    for (lod, share, mut present) in &mut hairs {
        let lod = lod.mended(&Notes::default());
        let level = model::choose(&lod.levels, lod.hysteresis, present.level, share.0);
        let settings = level.checked_sub(1).and_then(|i| lod.levels.get(i));
        present.set_if_neq(PresentLod {
            level,
            iterations: settings.map(|l| l.iterations),
            substeps: settings.map(|l| l.substeps),
            strands: settings.map(|l| l.strands),
            carried: present.carried,
        });
    }
}

/// The substep as each hair takes it.
#[derive(SystemParam)]
pub(crate) struct HairSteps<'w, 's> {
    step: Res<'w, HairStep>,
    levels: Query<'w, 's, &'static PresentLod>,
}

/// One hair's substep.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stride {
    /// How long it is (s).
    pub(crate) dt: f32,
    /// How many substeps it stands for.
    pub(crate) substeps: u32,
    most_iterations: Option<u32>,
}

impl HairSteps<'_, '_> {
    /// The substep that `hair` takes now, or `None` while it waits for a longer one.
    pub(crate) fn of(&self, hair: Entity) -> Option<Stride> {
        let HairStep { dt, index, count } = *self.step;
        let Ok(level) = self.levels.get(hair) else {
            return Some(Stride { dt, substeps: 1, most_iterations: None });
        };
        let substeps = model::taken(index, count, level.substeps.unwrap_or(1))?;
        Some(Stride { dt: dt * substeps as f32, substeps, most_iterations: level.iterations })
    }
}

impl Stride {
    /// So many iterations of `full`.
    pub(crate) fn iterations(&self, full: u32) -> u32 {
        self.most_iterations.map_or(full, |most| most.min(full))
    }
}

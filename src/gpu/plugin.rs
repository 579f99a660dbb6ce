//! All of it in an app.

use super::{
    compile, frame,
    hair::GpuHair,
    hand_back::{collect, return_now},
    journal::write_journals,
    probe::{HairProbe, HairProbed, probe},
    residence::{HairGpu, HairResidence, SimulateOn, Unsupported, WhyCpu},
    tick::{ask, decide, follow, treat},
};
use crate::{
    base::{
        schedule::{HairSystems, HairTick, first_substep},
        setting,
    },
    hair::{
        strand::{Hair, ReturnToCpu, keep_required, lacks_strands},
        worn,
    },
    keratin::treatment::HairTreatment,
    simulation::sleep,
    water::SoakHair,
};
use bevy::prelude::*;

/// Simulates hair on the GPU where [`SimulateOn`] asks for it. Part of
/// [`HairPlugins`](crate::HairPlugins) with the feature `gpu`.
#[derive(Clone, Copy, Debug, Default)]
pub struct HairGpuPlugin;

impl Plugin for HairGpuPlugin {
    fn build(&self, app: &mut App) {
        if lacks_strands::<Self>(app) {
            return;
        }
        worn::setting::<SimulateOn>(app);
        sleep::watch_on_gpu(app);
        setting::resource::<HairGpu>(app);
        keep_required::<Hair, HairResidence>(app);
        // Present also in an app that is never finished, or without the plugins that own the messages.
        app.init_resource::<compile::Compiled>()
            .add_message::<SoakHair>()
            .add_message::<HairTreatment>();
        app.insert_resource(ReturnToCpu(|world, hair| {
            return_now(world, hair, WhyCpu::Unsupported(Unsupported::Requested));
        }))
        .register_type::<HairResidence>()
        .register_type::<WhyCpu>()
        .register_type::<Unsupported>()
        .register_required_components::<Hair, HairResidence>()
        .add_observer(ask)
        .add_observer(|left: On<Remove, Hair>, mut commands: Commands| {
            let hair = left.entity;
            commands.queue(move |world: &mut World| {
                return_now(world, hair, WhyCpu::Unsupported(Unsupported::Strands));
            });
        })
        .register_type::<HairProbe>()
        .register_type::<HairProbed>()
        .add_systems(
            PreUpdate,
            (
                collect.run_if(any_with_component::<GpuHair>),
                probe.run_if(any_with_component::<HairProbe>),
            )
                .chain(),
        )
        .add_systems(
            HairTick,
            (
                decide
                    .pipe(follow)
                    .in_set(HairSystems::Roots)
                    .before(HairSystems::StrandHistory)
                    .run_if(first_substep)
                    // It is before all parts; systems of a game that are in none do not mind it.
                    .ambiguous_with_all(),
                treat.in_set(HairSystems::Treatments),
                // Before anything moves strands.
                write_journals.in_set(HairSystems::RestShape),
            ),
        );
    }

    /// In `finish`, because all render plugins have been added by then, in any order.
    fn finish(&self, app: &mut App) {
        if !app.world().contains_resource::<compile::Compiled>() {
            return;
        }
        compile::plugin(app);
        frame::plugin(app);
    }
}

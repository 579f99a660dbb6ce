//! All plugins of the group, by name.

use bevy::app::PluginGroupBuilder;
use bevy_keratin::{
    authoring::{
        attach::AttachPlugin, collider_fit::ColliderFitPlugin, groom::GroomPlugin,
        plant::PlantPlugin, wear::WearPlugin,
    },
    base::schedule::TickPlugin,
    debug::ReportPlugin,
    forces::{contact::ContactPlugin, environment::EnvironmentPlugin},
    gpu::HairGpuPlugin,
    hair::{look::LookPlugin, strand::StrandPlugin},
    hairdo::{
        cut::CutPlugin, rollback::RollbackPlugin, save::SavePlugin, style::StylePlugin,
        tie::TiePlugin,
    },
    keratin::{bond::BondPlugin, treatment::TreatmentPlugin},
    render::HairRenderPlugin,
    simulation::{
        lod::LodPlugin,
        settle::SettlePlugin,
        sleep::SleepPlugin,
        solve::{RodPlugin, SpringPlugin},
    },
    water::WaterPlugin,
};

/// Disables a plugin.
pub type Switch = fn(PluginGroupBuilder) -> PluginGroupBuilder;

macro_rules! switches {
    ($($Plugin:ident),* $(,)?) => {
        [$((stringify!($Plugin), |group| group.disable::<$Plugin>())),*]
    };
}

/// All of the group.
pub const ALL: [(&str, Switch); 26] = switches![
    TickPlugin,
    StrandPlugin,
    BondPlugin,
    EnvironmentPlugin,
    ContactPlugin,
    TreatmentPlugin,
    WaterPlugin,
    RodPlugin,
    SpringPlugin,
    SettlePlugin,
    SleepPlugin,
    LodPlugin,
    StylePlugin,
    TiePlugin,
    CutPlugin,
    RollbackPlugin,
    LookPlugin,
    ReportPlugin,
    HairRenderPlugin,
    HairGpuPlugin,
    SavePlugin,
    GroomPlugin,
    PlantPlugin,
    ColliderFitPlugin,
    AttachPlugin,
    WearPlugin,
];

/// What all others build on.
pub const BASIS: [&str; 3] = ["TickPlugin", "StrandPlugin", "BondPlugin"];

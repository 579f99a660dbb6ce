//! Hair on the GPU: the switch, and where it is.

use bevy::{ecs::system::SystemParam, prelude::*};
use bevy_egui::egui::Ui;
use bevy_keratin::{
    gpu::{HairResidence, SimulateOn, fetch_strands},
    prelude::*,
};

/// The switch, and what tells where hair is.
#[derive(SystemParam)]
pub struct Residence<'w, 's> {
    asked: ResMut<'w, HairDefault<SimulateOn>>,
    device: ResMut<'w, HairGpu>,
    hairs: Query<'w, 's, &'static HairResidence, With<Hair>>,
}

impl Residence<'_, '_> {
    pub fn show(&mut self, ui: &mut Ui) {
        let mut wants = **self.asked == SimulateOn::Gpu;
        if ui.checkbox(&mut wants, "simulate there").changed() {
            **self.asked = if wants { SimulateOn::Gpu } else { SimulateOn::Cpu };
        }
        let mut software = self.device.software;
        if ui.checkbox(&mut software, "software counts as one").changed() {
            self.device.software = software;
        }
        for residence in &self.hairs {
            ui.small(match residence {
                HairResidence::Gpu => "It is there.".into(),
                HairResidence::Returning(why) => format!("It comes back: {why}."),
                HairResidence::Cpu(why) => format!("It is on the CPU: {why}."),
            });
        }
    }
}

/// Plots and stories look at strands, which hair on the device does not keep: ten times a second they are
/// brought up to date.
pub fn fetch(world: &mut World, mut ticks: Local<u32>) {
    *ticks += 1;
    if !ticks.is_multiple_of(6) {
        return;
    }
    let mut hairs = world.query_filtered::<(Entity, &HairResidence), With<Hair>>();
    let there = hairs.iter(world).filter(|(_, at)| **at == HairResidence::Gpu);
    let there: Vec<Entity> = there.map(|(hair, _)| hair).collect();
    there.into_iter().for_each(|hair| _ = fetch_strands(world, hair));
}

//! The panel: choosing and playing scenes, and all that can be changed while they run.

use crate::{
    dials::{Hand, Settings},
    orbit::Orbit,
    plots::{Measured, PlotsPlugin, PlotsShown},
    scenes::{Director, Scene, SceneKind},
    spare::Spared,
    story::{Restart, Step, moments, toggle},
    tools,
    wardrobe::{Hairdos, Order},
    worn::{self, Shake, Shown},
};
use bevy::prelude::*;
use bevy_egui::{
    EguiContexts, EguiPlugin, EguiPrimaryContextPass,
    egui::{self, CollapsingHeader, Slider, Ui, UiBuilder},
};

/// How wide the panel is (points).
pub const WIDTH: f32 = 270.0;
/// How wide the plots are, and from which width of the window on they are shown unasked (points).
pub const PLOTS: f32 = 310.0;
pub const WIDE: f32 = 1100.0;

pub struct PanelPlugin;

impl Plugin for PanelPlugin {
    fn build(&self, app: &mut App) {
        app.add_plugins((EguiPlugin::default(), PlotsPlugin))
            .init_resource::<tools::Tools>()
            .add_systems(Update, (tools::give_back, tools::apply).chain())
            .add_systems(EguiPrimaryContextPass, show);
    }
}

fn show(
    mut contexts: EguiContexts,
    mut player: Player,
    mut settings: Settings,
    measured: Res<Measured>,
    mut hand: Local<Hand>,
    mut idle_frames: Local<u32>,
    mut orbits: Query<&mut Orbit>,
    mut wardrobe: Wardrobe,
    (plots, spared): (Res<PlotsShown>, Option<Res<Spared>>),
    #[cfg(feature = "gpu")] mut residence: crate::device::Residence,
) -> Result {
    let ctx = contexts.ctx_mut()?;
    // Drawn in software a frame may last longer than a click may by default.
    ctx.options_mut(|options| options.input_options.max_click_duration = 5.0);
    let area = ctx.viewport_rect();
    let layer = UiBuilder::new().layer_id(egui::LayerId::background()).max_rect(area);
    let mut root = Ui::new(ctx.clone(), "salon".into(), layer);
    egui::Panel::left("panel").exact_size(WIDTH).resizable(false).show(&mut root, |ui| {
        egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            ui.spacing_mut().slider_width = 90.0;
            player.show(ui, &mut settings.orders);
            if let Some(spared) = &spared {
                ui.small(egui::RichText::new(spared.to_string()).italics());
                ui.separator();
            }
            section(ui, "Bond rates", true, |ui| settings.treatments(ui, &mut hand, &measured));
            section(ui, "Hairdo", false, |ui| {
                wardrobe.show(ui, &mut settings.orders);
            });
            section(ui, "Colours", true, |ui| settings.view(ui));
            section(ui, "Hair", false, |ui| settings.hair(ui));
            section(ui, "Air", false, |ui| settings.air(ui));
            section(ui, "Water", false, |ui| settings.water(ui));
            section(ui, "Blower and rod", false, |ui| settings.tools(ui));
            section(ui, "Solver", false, |ui| settings.solver(ui));
            #[cfg(feature = "gpu")]
            section(ui, "Graphics device", false, |ui| residence.show(ui));
            section(ui, "Looks", false, |ui| settings.look(ui));
            ui.add_space(6.0);
            if ui.button("Everything as in the paper").clicked() {
                settings.restore();
            }
            ui.small("Mouse: drag turns, right drag moves, wheel zooms.");
            ui.small("Keys: space plays, R restarts, right arrow steps.");
        });
    });
    release_focus(ctx, &mut idle_frames);
    // The action in the middle of what is left free.
    let right = if plots.0 { PLOTS } else { 0.0 };
    let shift = 0.5 * (WIDTH - right) / area.height().max(1.0);
    for mut orbit in &mut orbits {
        if orbit.shift != shift {
            orbit.shift = shift;
        }
    }
    Ok(())
}

/// A button or slider that was clicked keeps the keyboard, and the keys of the story with it. Shortly
/// after the click it lets go; a number that is being typed does not.
fn release_focus(ctx: &egui::Context, idle_frames: &mut u32) {
    *idle_frames =
        if ctx.input(|i| i.pointer.any_down()) { 0 } else { idle_frames.saturating_add(1) };
    if *idle_frames == 2 && !ctx.text_edit_focused() {
        ctx.memory_mut(|memory| {
            if let Some(id) = memory.focused() {
                memory.surrender_focus(id);
            }
        });
    }
}

fn section(ui: &mut Ui, title: &str, open: bool, add: impl FnOnce(&mut Ui)) {
    CollapsingHeader::new(title).default_open(open).show(ui, add);
}

/// What saves, loads and undoes.
#[derive(bevy::ecs::system::SystemParam)]
pub struct Wardrobe<'w, 's> {
    hairdos: Res<'w, Hairdos>,
    path: Local<'s, Option<String>>,
}

impl Wardrobe<'_, '_> {
    fn show(&mut self, ui: &mut Ui, orders: &mut MessageWriter<Order>) {
        let path = self.path.get_or_insert_with(|| "hairdo.keratin".into());
        ui.add(egui::TextEdit::singleline(path).hint_text("file").desired_width(f32::INFINITY));
        ui.horizontal(|ui| {
            if ui.button("Save").clicked() {
                orders.write(Order::Save(path.clone().into()));
            }
            if ui.button("Load").clicked() {
                orders.write(Order::Load(path.clone().into()));
            }
            if ui.add_enabled(self.hairdos.can_undo(), egui::Button::new("Undo")).clicked() {
                orders.write(Order::Undo);
            }
            if ui.add_enabled(self.hairdos.can_redo(), egui::Button::new("Redo")).clicked() {
                orders.write(Order::Redo);
            }
        });
        if !self.hairdos.reported.is_empty() {
            ui.small(&self.hairdos.reported);
        }
    }
}

/// What chooses and plays.
#[derive(bevy::ecs::system::SystemParam)]
pub struct Player<'w> {
    scene: Res<'w, Scene>,
    shown: Res<'w, Shown>,
    director: Res<'w, Director>,
    time: ResMut<'w, Time<Virtual>>,
    restarts: MessageWriter<'w, Restart>,
    steps: MessageWriter<'w, Step>,
    shakes: MessageWriter<'w, Shake>,
}

impl Player<'_> {
    fn show(&mut self, ui: &mut Ui, orders: &mut MessageWriter<Order>) {
        ui.add_space(4.0);
        let shown = *self.shown;
        let mut wanted = shown;
        ui.label("A story of bonds");
        ui.horizontal_wrapped(|ui| {
            for kind in SceneKind::ALL {
                let is_on = matches!(shown, Shown::Scene(scene) if scene.kind == kind);
                if ui.selectable_label(is_on, kind.name()).clicked() {
                    wanted = Shown::Scene(Scene { kind, variant: kind.variants()[0] });
                }
            }
        });
        ui.label("or a head of hair");
        ui.horizontal_wrapped(|ui| {
            for preset in worn::PRESETS {
                let name = preset.name().to_lowercase();
                if ui.selectable_label(shown == Shown::Preset(preset), name).clicked() {
                    wanted = Shown::Preset(preset);
                }
            }
        });
        // Below what is picked, so that nothing of that moves.
        if let Shown::Scene(scene) = &mut wanted {
            ui.horizontal_wrapped(|ui| {
                ui.small("variant");
                for variant in scene.kind.variants() {
                    ui.selectable_value(&mut scene.variant, *variant, *variant);
                }
            });
        } else {
            ui.small("Wet it, dry it, blow on it, dye it.");
        }
        ui.horizontal(|ui| {
            let label = if self.time.is_paused() { "▶ Play" } else { "⏸ Pause" };
            if ui.button(label).clicked() {
                toggle(&mut self.time);
            }
            if ui.button("Step").on_hover_text("one tick of 1/60 s").clicked() {
                self.steps.write(Step);
            }
            if ui.button("Reset").clicked() || wanted != shown {
                orders.write(Order::Remember);
                self.restarts.write(Restart(wanted));
            }
            if matches!(shown, Shown::Preset(_)) && ui.button("Shake").clicked() {
                self.shakes.write(Shake);
            }
        });
        let mut speed = self.time.relative_speed();
        if ui.add(Slider::new(&mut speed, 0.1..=4.0).logarithmic(true).text("speed")).changed() {
            self.time.set_relative_speed(speed);
        }
        if matches!(shown, Shown::Scene(_)) {
            self.story(ui);
        }
        ui.separator();
    }

    /// The moments of the story, the present one marked.
    fn story(&self, ui: &mut Ui) {
        let now = self.director.seconds;
        let frame = self.director.frame;
        let end = self.scene.kind.frames();
        let share = frame as f32 / end as f32;
        let seconds = end as f32 / 60.0;
        let text = match frame > end {
            true => format!("{now:.1} s; the story ended at {seconds:.1} s"),
            false => format!("{now:.1} of {seconds:.1} s (frame {frame} of {end})"),
        };
        ui.add(egui::ProgressBar::new(share.min(1.0)).text(egui::RichText::new(text).small()));
        let moments = moments(*self.scene);
        let present = moments.iter().rposition(|(from, _)| *from <= now).unwrap_or(0);
        for (i, (from, words)) in moments.iter().enumerate() {
            let line = egui::RichText::new(format!("{from:>4.1} s  {words}")).small();
            ui.label(if i == present { line.strong() } else { line.weak() });
        }
    }
}

//! The panel's sliders: treatments, the hair's own values, air, solver, tools and looks.

use crate::{
    overlay::HairGizmos,
    plots::{Measured, colour, name},
    scenes::{Strewn, Treated},
    tools::{self, Tools},
    wardrobe::Order,
};
use bevy::{ecs::system::SystemParam, prelude::*};
use bevy_egui::egui::{self, Color32, Slider, Ui};
use bevy_keratin::{
    Shower, SolverMethod,
    base::setting::{HairSetting, ValueRange},
    prelude::*,
    render::{HairFollowers, HairLook, HairShading, HairView, Melanin, heat},
};
use core::ops::RangeInclusive;

/// Everything that sliders change.
#[derive(SystemParam)]
pub struct Settings<'w, 's> {
    stiffness: ResMut<'w, HairDefault<HairStiffness>>,
    influence: ResMut<'w, HairDefault<BondInfluence>>,
    cuticle: ResMut<'w, HairDefault<Cuticle>>,
    contact: ResMut<'w, HairDefault<StrandContact>>,
    drag: ResMut<'w, HairDefault<AirDrag>>,
    solver: ResMut<'w, HairDefault<HairSolver>>,
    gravity: ResMut<'w, HairGravity>,
    substeps: ResMut<'w, HairSubsteps>,
    view: ResMut<'w, HairDefault<HairView>>,
    look: ResMut<'w, HairDefault<HairLook>>,
    followers: ResMut<'w, HairDefault<HairFollowers>>,
    tools: ResMut<'w, Tools>,
    wetting: ResMut<'w, HairDefault<HairWetting>>,
    water: Water<'w, 's>,
    gizmos: ResMut<'w, GizmoConfigStore>,
    lights: Query<'w, 's, &'static mut SpotLight>,
    blowers: Query<'w, 's, (Entity, &'static Blower, &'static Transform)>,
    hairs: Query<'w, 's, (Entity, &'static Strands), With<Treated>>,
    strands: Query<'w, 's, &'static Strand>,
    treat: MessageWriter<'w, HairTreatment>,
    /// Shared by all of the panel: a system may have but one of these.
    pub orders: MessageWriter<'w, Order>,
    commands: Commands<'w, 's>,
}

/// What of the world's water sliders change and show.
#[derive(SystemParam)]
pub struct Water<'w, 's> {
    climate: ResMut<'w, HairClimate>,
    process: ResMut<'w, HairProcessTime>,
    strewn: ResMut<'w, Strewn>,
    ledger: Res<'w, WaterLedger>,
    droplets: Query<'w, 's, (), With<Droplet>>,
    soak: MessageWriter<'w, SoakHair>,
}

/// How the next treatment is given.
#[derive(Clone, Copy, Debug, Default)]
pub struct Hand {
    seconds: f32,
    only: bool,
    first: usize,
    last: usize,
}

/// Edits a copy: what has not changed must not look changed.
fn edit<T: HairSetting + PartialEq>(
    setting: &mut HairDefault<T>,
    ui: impl FnOnce(&mut T),
) -> Option<T> {
    let mut value = setting.0.clone();
    ui(&mut value);
    (value != setting.0).then_some(value)
}

/// A slider over what is safe.
fn slide(ui: &mut Ui, value: &mut f32, range: ValueRange, text: &str) -> bool {
    slide_over(ui, value, range.safe, text)
}

fn slide_over(ui: &mut Ui, value: &mut f32, range: RangeInclusive<f32>, text: &str) -> bool {
    let wide = *range.end() > 500.0;
    ui.add(Slider::new(value, range).text(text).logarithmic(wide).max_decimals(3)).changed()
}

/// The same for a count.
fn slide_count(ui: &mut Ui, value: &mut u32, range: ValueRange, text: &str) {
    let (low, high) = (*range.safe.start() as u32, *range.safe.end() as u32);
    ui.add(Slider::new(value, low..=high).text(text).logarithmic(high > 500));
}

/// The same with a value in m and a slider in mm.
fn slide_mm(ui: &mut Ui, value: &mut f32, range: ValueRange, text: &str) -> bool {
    let mut mm = *value * 1e3;
    let changed = slide_over(ui, &mut mm, range.safe.start() * 1e3..=range.safe.end() * 1e3, text);
    if changed {
        *value = mm * 1e-3;
    }
    changed
}

macro_rules! edited {
    ($setting:expr, $ui:expr) => {
        if let Some(value) = edit($setting.bypass_change_detection(), $ui) {
            $setting.0 = value;
        }
    };
}

impl Settings<'_, '_> {
    /// Everything as the paper has it.
    pub fn restore(&mut self) {
        *self.stiffness = default();
        *self.influence = default();
        *self.cuticle = default();
        *self.contact = default();
        *self.drag = default();
        *self.solver = default();
        *self.gravity = default();
        *self.substeps = default();
        *self.wetting = default();
        *self.water.climate = default();
        *self.water.process = default();
        *self.tools = default();
    }

    /// Buttons and sliders that ask the tick for changes of bond rates.
    pub fn treatments(&mut self, ui: &mut Ui, hand: &mut Hand, measured: &Measured) {
        let Ok((hair, members)) = self.hairs.single() else { return };
        let joints = members.iter().find_map(|s| self.strands.get(s).ok()).map_or(0, Strand::edges);
        let mut asked = None;
        let kinds: [(&str, &str, fn(Entity) -> HairTreatment); 6] = [
            ("Wet", "cuts hydrogen bonds", HairTreatment::wet),
            ("Dry", "hydrogen bonds close in the present shape", HairTreatment::dry),
            ("Shampoo", "cuts hydrogen and ionic bonds", HairTreatment::shampoo),
            (
                "Lotion",
                "cuts hydrogen, ionic and a fifth of the disulfide bonds",
                HairTreatment::lotion,
            ),
            ("Neutraliser", "ionic and disulfide bonds close", HairTreatment::neutraliser),
            (
                "Set everything",
                "the present shape becomes the hair's own",
                HairTreatment::set_everything,
            ),
        ];
        ui.horizontal_wrapped(|ui| {
            for (label, what, treat) in kinds {
                if ui.button(label).on_hover_text(what).clicked() {
                    self.orders.write(Order::Remember);
                    asked = Some(treat(hair));
                }
            }
        });
        slide(ui, &mut hand.seconds, HairTreatment::SECONDS, "takes (s)");
        ui.horizontal(|ui| {
            ui.checkbox(&mut hand.only, "only joints");
            let last = joints.saturating_sub(1);
            hand.last = if hand.only { hand.last.min(last) } else { last };
            hand.first = hand.first.min(hand.last);
            ui.add_enabled(hand.only, egui::DragValue::new(&mut hand.first).range(0..=hand.last));
            ui.label("to");
            ui.add_enabled(
                hand.only,
                egui::DragValue::new(&mut hand.last).range(hand.first..=last),
            );
        });
        ui.label("Mean rates; drag to set them:");
        for kind in BondKind::ALL {
            let mut rate = measured.rates[kind as usize] as f32;
            let text = egui::RichText::new(name(kind)).color(colour(kind));
            let slider =
                Slider::new(&mut rate, HairTreatment::RATES.safe).text(text).max_decimals(2);
            // The backbone is never cut.
            let response = ui.add_enabled(kind != BondKind::Peptide, slider);
            // A drag is one step to undo.
            if response.drag_started() || response.changed() && !response.dragged() {
                self.orders.write(Order::Remember);
            }
            if response.changed() {
                asked = HairTreatment::set(hair, kind, rate).ok();
            }
        }
        if let Some(treat) = asked {
            let treat = treat.over(hand.seconds);
            self.treat.write(if hand.only {
                treat.joints(hand.first..hand.last + 1)
            } else {
                treat
            });
        }
    }

    pub fn hair(&mut self, ui: &mut Ui) {
        edited!(self.stiffness, |s: &mut HairStiffness| {
            slide_mm(ui, &mut s.bending_length, HairStiffness::BENDING_LENGTH, "bend length (mm)");
            slide(ui, &mut s.damping, HairStiffness::DAMPING, "damping (s)");
        });
        ui.label("Influence of each kind of bond:");
        edited!(self.influence, |f: &mut BondInfluence| {
            slide(ui, &mut f.hydrogen, BondInfluence::HYDROGEN, name(BondKind::Hydrogen));
            slide(ui, &mut f.ionic, BondInfluence::IONIC, name(BondKind::Ionic));
            slide(ui, &mut f.disulfide, BondInfluence::DISULFIDE, name(BondKind::Disulfide));
            slide(ui, &mut f.peptide, BondInfluence::PEPTIDE, name(BondKind::Peptide));
        });
        edited!(self.cuticle, |c: &mut Cuticle| {
            slide(ui, &mut c.damage, Cuticle::DAMAGE, "cuticle lost (1/m)");
        });
        edited!(self.contact, |c: &mut StrandContact| {
            slide_mm(ui, &mut c.radius, StrandContact::RADIUS, "lock radius (mm)");
        });
    }

    pub fn air(&mut self, ui: &mut Ui) {
        let mut down = -self.gravity.y;
        if slide_over(ui, &mut down, 0.0..=20.0, "gravity (m/s²)") {
            self.gravity.y = -down;
        }
        edited!(self.drag, |d: &mut AirDrag| {
            slide(ui, &mut d.rate, AirDrag::RATE, "drag (1/s)");
        });
    }

    /// Droplets, how hair takes water up, and the air that takes it away.
    pub fn water(&mut self, ui: &mut Ui) {
        let Water { climate, process, strewn, ledger, droplets, soak } = &mut self.water;
        if let Ok((hair, _)) = self.hairs.single() {
            ui.horizontal(|ui| {
                for (label, wetness) in [("Drench", 2.0), ("Towel", 0.3), ("Dry", 0.0)] {
                    if ui.button(label).clicked() {
                        self.orders.write(Order::Remember);
                        soak.write(SoakHair { target: hair, wetness });
                    }
                }
            });
        }
        ui.small(format!(
            "{} droplets; {:.1} ml of {:.1} ml are left",
            droplets.iter().len(),
            (ledger.held * 1e6).max(0.0),
            ledger.water_in * 1e6
        ));
        let mut wanted = **strewn;
        ui.add(Slider::new(&mut wanted.count, 0..=1000).text("droplets"));
        slide_mm(ui, &mut wanted.radius, Shower::DROP_RADIUS, "their radius (mm)");
        strewn.set_if_neq(wanted);
        edited!(self.wetting, |w: &mut HairWetting| {
            slide(ui, &mut w.adhesion, HairWetting::ADHESION, "adhesion (m/s²)");
            slide(ui, &mut w.cohesion, HairWetting::COHESION, "film's pull (m/s²)");
            slide(ui, &mut w.film_drag, HairWetting::FILM_DRAG, "film's drag (1/s)");
            slide(ui, &mut w.uptake, HairWetting::UPTAKE, "uptake (1/s)");
            slide(ui, &mut w.evaporation, HairWetting::EVAPORATION, "evaporation");
            slide(ui, &mut w.sliding, HairWetting::SLIDING, "sliding (s)");
        });
        let mut air = **climate;
        slide(ui, &mut air.celsius, HairClimate::CELSIUS, "air (°C)");
        slide(ui, &mut air.humidity, HairClimate::HUMIDITY, "humidity");
        climate.set_if_neq(air);
        let mut faster = process.0;
        let slider = Slider::new(&mut faster, HairProcessTime::RANGE.safe).logarithmic(true);
        if ui.add(slider.text("× life's speed").max_decimals(0)).changed() {
            process.0 = faster;
        }
    }

    pub fn solver(&mut self, ui: &mut Ui) {
        edited!(self.solver, |s: &mut HairSolver| {
            let mut direct = s.method == SolverMethod::Direct;
            ui.checkbox(&mut direct, "direct solver");
            s.method = if direct { SolverMethod::Direct } else { SolverMethod::Sweeps };
            slide_count(ui, &mut s.limiter_steps, HairSolver::LIMITER_STEPS, "limiter steps");
            slide(ui, &mut s.substep, HairSolver::SUBSTEP, "longest substep of dry hair");
        });
        let mut auto = *self.substeps == HairSubsteps::Auto;
        let now = self.substeps.count(1.0 / 60.0);
        if ui.checkbox(&mut auto, "substeps near 1/360 s").changed() {
            *self.substeps = if auto { HairSubsteps::Auto } else { HairSubsteps::Fixed(now) };
        }
        let mut count = now;
        ui.add_enabled_ui(!auto, |ui| {
            slide_count(ui, &mut count, HairSubsteps::RANGE, "substeps a tick");
        });
        if count != now {
            *self.substeps = HairSubsteps::Fixed(count);
        }
    }

    pub fn tools(&mut self, ui: &mut Ui) {
        let there = self.blowers.iter().next().map(|(_, b, t)| (*b, t.translation));
        let mut on = there.is_some();
        if ui.checkbox(&mut on, "blower").changed() {
            self.orders.write(Order::Remember);
            if on {
                self.commands.spawn(tools::blower());
                // Its values are the user's from the start.
                self.tools.set_changed();
            } else {
                self.blowers.iter().for_each(|(e, ..)| self.commands.entity(e).despawn());
            }
        }
        let (blower, place) = there.unwrap_or((Blower::default(), tools::BLOWER_PLACE));
        let mut wanted = *self.tools;
        let mut strength = wanted.strength.unwrap_or(blower.strength);
        if slide(ui, &mut strength, Blower::STRENGTH, "strength (m/s²)") {
            wanted.strength = Some(strength);
        }
        let mut drying = wanted.drying.unwrap_or(blower.drying);
        if slide(ui, &mut drying, Blower::DRYING, "drying (s/m)") {
            wanted.drying = Some(drying);
        }
        let mut place = wanted.place.unwrap_or(place);
        let mut moved = slide_over(ui, &mut place.x, -0.4..=0.4, "x (m)");
        moved |= slide_over(ui, &mut place.y, 0.02..=0.6, "y (m)");
        moved |= slide_over(ui, &mut place.z, -0.4..=0.4, "z (m)");
        if moved {
            wanted.place = Some(place);
        }
        let mut radius = wanted.radius.unwrap_or(PermRod::default().radius);
        if slide_mm(ui, &mut radius, PermRod::RADIUS, "rod radius (mm)") {
            wanted.radius = Some(radius);
        }
        self.tools.set_if_neq(wanted);
    }

    /// What of the hair is shown, one thing at a time, and the scale of its colours, as in the paper's
    /// figure 5.
    pub fn view(&mut self, ui: &mut Ui) {
        let mut view = self.view.0;
        ui.horizontal_wrapped(|ui| {
            ui.selectable_value(&mut view, HairView::Natural, "natural");
            ui.selectable_value(&mut view, HairView::Guides, "guides");
            ui.selectable_value(&mut view, HairView::Strain, "stretch");
            ui.selectable_value(&mut view, HairView::Moisture, "water");
        });
        ui.small("or the rate of bonds:");
        ui.horizontal_wrapped(|ui| {
            for kind in BondKind::ALL {
                ui.selectable_value(&mut view, HairView::Bond(kind), name(kind));
            }
        });
        // Always a row, so that nothing below moves.
        match view {
            HairView::Bond(_) => scale(ui, "0 cut", "1 closed"),
            HairView::Strain => scale(ui, "0 %", "5 %"),
            HairView::Moisture => scale(ui, "dry", "soaked"),
            _ => _ = ui.small("as it looks"),
        }
        let mut lines = self.gizmos.config::<HairGizmos>().0.enabled;
        if ui.checkbox(&mut lines, "colliders, wind, rods as lines").changed() {
            self.gizmos.config_mut::<HairGizmos>().0.enabled = lines;
        }
        if view != self.view.0 {
            self.view.0 = view;
        }
    }

    pub fn look(&mut self, ui: &mut Ui) {
        edited!(self.followers, |f: &mut HairFollowers| {
            slide_count(ui, &mut f.count, HairFollowers::COUNT, "followers");
            slide(ui, &mut f.stray, HairFollowers::STRAY, "stray");
            slide(ui, &mut f.clump, HairFollowers::CLUMP, "clump");
        });
        edited!(self.look, |l: &mut HairLook| {
            slide_mm(ui, &mut l.width, HairLook::WIDTH, "width (mm)");
            ui.horizontal_wrapped(|ui| {
                let colours = [
                    ("black", Melanin::BLACK),
                    ("dark brown", Melanin::DARK_BROWN),
                    ("brown", Melanin::BROWN),
                    ("auburn", Melanin::AUBURN),
                    ("red", Melanin::RED),
                    ("blond", Melanin::BLOND),
                    ("platinum", Melanin::PLATINUM),
                    ("white", Melanin::new(0.0, 0.0)),
                ];
                for (label, melanin) in colours {
                    ui.selectable_value(&mut l.melanin, melanin, label);
                }
            });
            slide(ui, &mut l.melanin.eumelanin, Melanin::EUMELANIN, "eumelanin");
            slide(ui, &mut l.melanin.pheomelanin, Melanin::PHEOMELANIN, "pheomelanin");
            slide(ui, &mut l.roughness, HairLook::ROUGHNESS, "roughness");
            slide(ui, &mut l.gloss, HairLook::GLOSS, "gloss");
            slide(ui, &mut l.grey, HairLook::GREY, "grey");
            slide(ui, &mut l.shadow_density, HairLook::SHADOW_DENSITY, "shadow density");
            ui.horizontal(|ui| {
                ui.label("model");
                ui.selectable_value(&mut l.shading, HairShading::Fibre, "fibre");
                ui.selectable_value(&mut l.shading, HairShading::KajiyaKay, "Kajiya–Kay");
            });
        });
        // The key light is the first.
        if let Some(mut key) = self.lights.iter_mut().next() {
            let mut shadows = key.shadow_maps_enabled;
            if ui.checkbox(&mut shadows, "shadows").changed() {
                key.shadow_maps_enabled = shadows;
            }
        }
    }
}

/// The colours from 0 to 1.
fn scale(ui: &mut Ui, low: &str, high: &str) {
    ui.horizontal(|ui| {
        ui.small(low);
        let (rect, _) = ui.allocate_exact_size(egui::vec2(120.0, 10.0), egui::Sense::hover());
        let steps = 24;
        for i in 0..steps {
            let share = |i: i32| i as f32 / steps as f32;
            let [r, g, b, _] = heat(share(i)).to_srgba().to_u8_array();
            let x = rect.x_range();
            let piece = egui::Rect::from_x_y_ranges(
                egui::lerp(x.min..=x.max, share(i))..=egui::lerp(x.min..=x.max, share(i + 1)),
                rect.y_range(),
            );
            ui.painter().rect_filled(piece, 0.0, Color32::from_rgb(r, g, b));
        }
        ui.small(high);
    });
}

//! What is measured while the scene runs, and its curves over time.

use crate::{
    panel,
    scenes::{Director, Treated, measure},
};
use bevy::prelude::*;
use bevy_egui::egui::{self, Color32};
use bevy_egui::{EguiContexts, EguiPrimaryContextPass};
use bevy_keratin::prelude::*;
use egui_plot::{HLine, Line, LineStyle, Plot};

/// Frames between samples: ten a second.
const EVERY: u32 = 6;
/// Samples kept: ten minutes. Older ones make room.
const MOST: usize = 6000;

/// Mean bond rates and kept share, now and over time.
#[derive(Resource, Clone, Debug, Default)]
pub struct Measured {
    /// The mean rate of each kind, by [`BondKind`].
    pub rates: [f64; BondKind::COUNT],
    /// The share of the held shape that is there; `None` before it is held.
    pub kept: Option<f64>,
    /// The largest strain of a segment since the scene began.
    pub strain: f32,
    frame: u32,
    samples: Vec<Sample>,
}

#[derive(Clone, Copy, Debug)]
struct Sample {
    seconds: f64,
    rates: [f64; BondKind::COUNT],
    kept: Option<f64>,
}

/// Whether the plots are unfolded.
#[derive(Resource, Clone, Copy, Debug, Default)]
pub struct PlotsShown(pub bool);

pub struct PlotsPlugin;

impl Plugin for PlotsPlugin {
    fn build(&self, app: &mut App) {
        app.init_resource::<Measured>()
            .init_resource::<PlotsShown>()
            .add_systems(Update, measure_now)
            .add_systems(EguiPrimaryContextPass, show);
    }
}

fn measure_now(
    mut measured: ResMut<Measured>,
    director: Res<Director>,
    peak: Res<measure::StrainPeak>,
    hairs: Query<&Strands, With<Treated>>,
    strands: Query<(&Strand, &Bonds)>,
) {
    if director.frame < measured.frame {
        *measured = default();
    }
    let Ok(members) = hairs.single() else { return };
    let strands = || members.iter().filter_map(|s| strands.get(s).ok());
    let mut sums = [0.0; BondKind::COUNT];
    let mut joints = 0;
    for joint in strands().flat_map(|(_, bonds)| &bonds.joints) {
        joints += 1;
        sums.iter_mut().zip(joint.rates).for_each(|(sum, rate)| *sum += f64::from(rate));
    }
    // Before the first tick there are no bonds yet: they will all be closed.
    measured.rates = sums.map(|sum| if joints == 0 { 1.0 } else { sum / f64::from(joints) });
    measured.strain = peak.0;
    measured.kept = (!director.held.is_empty())
        .then(|| measure::kept_now(&director, strands().map(|(strand, _)| strand)))
        .filter(|kept| kept.is_finite());
    if director.frame > 0
        && (measured.samples.is_empty() || director.frame >= measured.frame + EVERY)
    {
        measured.frame = director.frame;
        let Measured { rates, kept, .. } = *measured;
        let seconds = f64::from(director.seconds);
        if measured.samples.len() >= MOST {
            measured.samples.drain(..MOST / 2);
        }
        measured.samples.push(Sample { seconds, rates, kept });
    }
}

/// A colour for each kind, by [`BondKind`].
const COLOURS: [Color32; BondKind::COUNT] = [
    Color32::from_rgb(90, 170, 255),
    Color32::from_rgb(120, 220, 130),
    Color32::from_rgb(255, 200, 80),
    Color32::from_rgb(240, 120, 130),
];
const KEPT: Color32 = Color32::from_rgb(235, 235, 240);

/// The kinds' names.
pub fn name(kind: BondKind) -> &'static str {
    match kind {
        BondKind::Hydrogen => "hydrogen",
        BondKind::Ionic => "ionic",
        BondKind::Disulfide => "disulfide",
        BondKind::Peptide => "peptide",
    }
}

/// The kind's colour in plots.
pub fn colour(kind: BondKind) -> Color32 {
    COLOURS[kind as usize]
}

fn show(
    mut contexts: EguiContexts,
    measured: Res<Measured>,
    mut shown: ResMut<PlotsShown>,
) -> Result {
    let ctx = contexts.ctx_mut()?;
    let is_wide = ctx.viewport_rect().width() >= panel::WIDE;
    let window = egui::Window::new("Over time")
        .anchor(egui::Align2::RIGHT_TOP, [-10.0, 10.0])
        .resizable(false)
        .default_open(is_wide)
        .default_width(panel::PLOTS - 20.0)
        .show(ctx, |ui| {
            ui.label("Mean bond rate (0 cut, 1 closed)");
            let lines: Vec<Line> =
                BondKind::ALL.into_iter().map(|k| rate_line(&measured, k)).collect();
            plot("rates").show(ui, |ui| {
                lines.into_iter().for_each(|line| ui.line(line));
            });
            ui.horizontal(|ui| {
                for kind in BondKind::ALL {
                    ui.small(egui::RichText::new(name(kind)).color(colour(kind)));
                }
            });
            ui.add_space(6.0);
            ui.horizontal(|ui| {
                ui.label("Shape kept").on_hover_text(
                    "How much of the shape that the hair was held in is there now, over all joints: \
                     1 all, 0 none, less than 0 bent the other way.",
                );
                let kept = measured.kept.map_or("not held yet".into(), |k| {
                    format!("{:.0} % of what was held", 100.0 * k)
                });
                ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                    ui.strong(kept);
                });
            });
            let points: Vec<[f64; 2]> =
                measured.samples.iter().filter_map(|s| Some([s.seconds, s.kept?])).collect();
            let start = measured.samples.first().map_or(0.0, |s| s.seconds);
            let now = measured.samples.last().map_or(1.0, |s| s.seconds);
            plot("kept").include_x(start).include_x(now).include_y(-0.2).show(ui, |ui| {
                ui.hline(HLine::new("", 0.0).color(Color32::from_gray(90)));
                ui.line(Line::new("kept", points).color(KEPT).width(2.0));
            });
            ui.small("time (s)");
            ui.small(format!("largest stretch so far {:.2} %", 100.0 * measured.strain));
        });
    // Folded there is nothing inside.
    shown.0 = window.is_some_and(|window| window.inner.is_some());
    Ok(())
}

fn rate_line(measured: &Measured, kind: BondKind) -> Line<'static> {
    let points: Vec<[f64; 2]> =
        measured.samples.iter().map(|s| [s.seconds, s.rates[kind as usize]]).collect();
    // Kinds lie on one another at 1: dashes let all be seen.
    let style = match kind {
        BondKind::Hydrogen | BondKind::Disulfide => LineStyle::Solid,
        BondKind::Ionic => LineStyle::dashed_loose(),
        BondKind::Peptide => LineStyle::dotted_loose(),
    };
    Line::new(name(kind), points).color(colour(kind)).width(2.0).style(style)
}

fn plot(id: &'static str) -> Plot<'static> {
    Plot::new(id)
        .height(130.0)
        .allow_drag(false)
        .allow_zoom(false)
        .allow_scroll(false)
        .allow_boxed_zoom(false)
        .include_y(0.0)
        .include_y(1.05)
        .y_axis_min_width(22.0)
}

//! Plots of rods' figures on theory's curves.

use crate::rows::Row;
use plotters::{
    coord::{Shift, ranged1d::ValueFormatter},
    prelude::*,
};
use std::{error::Error, path::Path};

type Result<T = ()> = std::result::Result<T, Box<dyn Error>>;
type Curve = Vec<(f64, f64)>;

const SIZE: (u32, u32) = (640, 400);
const STEPS: usize = 2000;

/// The heaviest of the upright rods.
const MOST_GAMMA: f64 = 21.0;

/// Segments and their colours.
const POINTS: [(usize, RGBColor); 4] = [
    (8, RGBColor(214, 96, 77)),
    (16, RGBColor(230, 159, 0)),
    (32, RGBColor(0, 114, 178)),
    (64, RGBColor(0, 158, 115)),
];

/// Integrates θ″ = −Γ (1 − s) f(θ) from the tip, where θ′ = 0, to the clamp; returns θ there, and how far the tip is
/// from the clamp along and across θ = 0.
fn from_tip(gamma: f64, tip: f64, f: fn(f64) -> f64) -> (f64, f64, f64) {
    let h = 1.0 / STEPS as f64;
    let (mut angle, mut rate, mut along, mut across) = (tip, 0.0, 0.0, 0.0);
    for i in 0..STEPS {
        // By the distance from the tip, in which θ′ has the other sign twice: the equation is the same.
        let s = i as f64 * h;
        let slope = |s: f64, angle: f64| -gamma * s * f(angle);
        let k1 = (rate, slope(s, angle));
        let k2 = (rate + 0.5 * h * k1.1, slope(s + 0.5 * h, angle + 0.5 * h * k1.0));
        let k3 = (rate + 0.5 * h * k2.1, slope(s + 0.5 * h, angle + 0.5 * h * k2.0));
        let k4 = (rate + h * k3.1, slope(s + h, angle + h * k3.0));
        let middle = angle + 0.5 * h * k2.0;
        along += h * middle.cos();
        across += h * middle.sin();
        angle += h / 6.0 * (k1.0 + 2.0 * k2.0 + 2.0 * k3.0 + k4.0);
        rate += h / 6.0 * (k1.1 + 2.0 * k2.1 + 2.0 * k3.1 + k4.1);
    }
    (angle, along, across)
}

/// Where `f`, of another sign at both ends, is zero.
fn zero(mut from: f64, mut to: f64, f: impl Fn(f64) -> f64) -> f64 {
    let sign = f(from) < 0.0;
    for _ in 0..80 {
        let middle = 0.5 * (from + to);
        if (f(middle) < 0.0) == sign { from = middle } else { to = middle }
    }
    0.5 * (from + to)
}

/// Sag and reach of level cantilevers by Γ.
fn cantilevers() -> [Curve; 2] {
    let (mut sags, mut reaches) = (Vec::new(), Vec::new());
    for i in 0..=80 {
        let gamma = 10.0_f64.powf(-1.0 + 4.0 * f64::from(i) / 80.0);
        // By the angle from plumb, the tip's as a power of ten: of heavy rods it is tiny.
        let plumb = |x: f64| from_tip(-gamma, 10.0_f64.powf(x), f64::sin);
        let level = std::f64::consts::FRAC_PI_2;
        let mut most = -40.0;
        while plumb(most).0 < level {
            most += 0.1;
        }
        let (_, along, across) = plumb(zero(most - 0.1, most, |x| plumb(x).0 - level));
        sags.push((gamma, along));
        reaches.push((gamma, across));
    }
    [sags, reaches]
}

/// Height and way aside of the tip of upright rods that have buckled, by Γ.
fn buckled() -> [Curve; 2] {
    let (mut highs, mut asides) = (vec![(7.0, 1.0)], vec![(7.0, 0.0)]);
    for i in 1..=100 {
        let tip = 2.7 * f64::from(i) / 100.0;
        let gamma = zero(7.0, 40.0, |gamma| from_tip(gamma, tip, f64::sin).0);
        if gamma > MOST_GAMMA {
            break;
        }
        let (_, high, aside) = from_tip(gamma, tip, f64::sin);
        highs.push((gamma, high));
        asides.push((gamma, aside));
    }
    [highs, asides]
}

/// Axes, curves, and the rows' points, whose tests begin with one of the names.
fn draw<X>(
    path: &Path,
    (title, x_name, y_name): (&str, &str, &str),
    (x, y): (X, std::ops::Range<f64>),
    curves: &[Curve],
    points: &[(usize, f64, f64)],
    legend: SeriesLabelPosition,
) -> Result
where
    X: plotters::coord::ranged1d::AsRangedCoord<Value = f64>,
    X::CoordDescType: ValueFormatter<f64>,
{
    let area: DrawingArea<SVGBackend, Shift> = SVGBackend::new(path, SIZE).into_drawing_area();
    area.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&area)
        .caption(title, ("sans-serif", 17))
        .margin(12)
        .x_label_area_size(36)
        .y_label_area_size(52)
        .build_cartesian_2d(x, y)?;
    chart.configure_mesh().x_desc(x_name).y_desc(y_name).light_line_style(WHITE).draw()?;
    for curve in curves {
        chart.draw_series(LineSeries::new(curve.iter().copied(), BLACK.stroke_width(1)))?;
    }
    for (segments, colour) in POINTS {
        let own = points.iter().filter(|point| point.0 == segments);
        let size = 2 + segments.ilog2() as i32;
        chart
            .draw_series(
                own.map(|p| Circle::new((p.1, p.2), 9 - size / 2, colour.stroke_width(2))),
            )?
            .label(format!("{segments} segments"))
            .legend(move |(x, y)| Circle::new((x + 8, y), 4, colour.stroke_width(2)));
    }
    chart.configure_series_labels().position(legend).border_style(BLACK).draw()?;
    area.present()?;
    eprintln!("{}", path.display());
    Ok(())
}

/// Writes the plots of the book's chapter on rods.
pub fn write(rows: &[Row], folder: &Path) -> Result {
    std::fs::create_dir_all(folder)?;
    let points = |tests: &[&str], y: fn(&Row) -> f64| {
        let of = |row: &Row| Some((row.segments?, row.gamma?, y(row)));
        let is_one = |row: &&Row| tests.iter().any(|test| row.test.starts_with(test));
        rows.iter().filter(is_one).filter_map(of).collect::<Vec<_>>()
    };
    let level =
        ("Level hair under its own weight: how far its tip sags and reaches", "Γ", "share of L");
    let range = ((0.1..1000.0).log_scale(), 0.0..1.05);
    let got = |row: &Row| row.got;
    draw(
        &folder.join("rods-level.svg"),
        level,
        range,
        &cantilevers(),
        &points(&["A "], got),
        SeriesLabelPosition::MiddleRight,
    )?;
    let upright = ("Upright hair: how high its tip is, and how far aside", "Γ", "share of L");
    let beyond = points(&["C height", "C aside"], got);
    draw(
        &folder.join("rods-upright.svg"),
        upright,
        (7.0..MOST_GAMMA, -0.45..1.05),
        &buckled(),
        &beyond,
        SeriesLabelPosition::MiddleRight,
    )?;
    let onset =
        ("Onsets of buckling, as shares of theory's", "Γ, or twist in rad", "share of theory's");
    let one = vec![(5.0, 1.0), (250.0, 1.0)];
    let onsets = points(&["C upright", "E ", "G ", "H "], got);
    draw(
        &folder.join("rods-onsets.svg"),
        onset,
        ((5.0..250.0).log_scale(), 0.85..1.15),
        &[one],
        &onsets,
        SeriesLabelPosition::UpperLeft,
    )?;
    let slip = (
        "A tip on a plate that comes nearer: friction with which it slips",
        "way of the plate, share of L",
        "friction",
    );
    let slips = crate::rods::SLIPS.map(|[rise, mu]| (f64::from(rise), f64::from(mu)));
    draw(
        &folder.join("rods-slips.svg"),
        slip,
        (0.0..0.35, 0.0..0.4),
        &[slips.to_vec()],
        &points(&["K "], got),
        SeriesLabelPosition::MiddleRight,
    )
}

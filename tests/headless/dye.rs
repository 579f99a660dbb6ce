//! Pigments, bleach and dye: what fibres absorb, and the colour that a head shows of it.

use bevy::prelude::*;
use bevy_keratin::{base::setting::Ranged, hair::look::MAX_LAYERS, prelude::*};

#[test]
fn more_melanin_is_darker_and_pheomelanin_redder() {
    let of = |m: Melanin| HairColor::of(m.absorption());
    let luminance = |m: Melanin| {
        let HairColor { red, green, blue } = of(m);
        0.2126 * red + 0.7152 * green + 0.0722 * blue
    };
    assert!(luminance(Melanin::BLACK) < luminance(Melanin::DARK_BROWN));
    assert!(luminance(Melanin::DARK_BROWN) < luminance(Melanin::BROWN));
    assert!(luminance(Melanin::BROWN) < luminance(Melanin::BLOND));
    assert!(luminance(Melanin::BLOND) < luminance(Melanin::PLATINUM));
    assert_eq!(of(Melanin::new(0.0, 0.0)), HairColor::WHITE);
    let redness = |m: Melanin| of(m).red / of(m).green;
    assert!(redness(Melanin::RED) > 1.5 * redness(Melanin::BLOND));
}

#[test]
fn a_colour_is_that_of_its_absorption() {
    for color in [HairColor::PINK, HairColor::COBALT, HairColor::COPPER, HairColor::WHITE] {
        let again = HairColor::of(color.absorption());
        let apart = Vec3::new(again.red, again.green, again.blue)
            - Vec3::new(color.red, color.green, color.blue);
        assert!(apart.abs().max_element() < 1e-5, "{color:?} is {again:?}");
    }
    let broken = HairColor::new(f32::NAN, -1.0, f32::INFINITY).absorption();
    assert!(broken.is_finite() && broken.x == 0.0 && broken.y > 1.0 && broken.z == 0.0);
}

/// The colour that a head shows there.
fn color(dye: &HairDye, natural: Melanin, along: f32) -> Vec3 {
    let color = HairColor::of(dye.absorption(natural.absorption(), along, |_| true));
    Vec3::new(color.red, color.green, color.blue)
}

const PINK: Vec3 = Vec3::new(0.85, 0.14, 0.36);

#[test]
fn black_hair_becomes_pink_in_one_call_and_stays_black_without_bleach() {
    for natural in [Melanin::BLACK, Melanin::RED, Melanin::PLATINUM] {
        let pink = color(&HairDye::pink(), natural, 0.5);
        assert!(pink.distance(PINK) < 1e-5, "{natural:?} is {pink}");
    }
    let unbleached = HairDye::of(DyeLayer::of(HairColor::PINK));
    let black = color(&HairDye::default(), Melanin::BLACK, 0.5);
    assert!(color(&unbleached, Melanin::BLACK, 0.5).distance(black) < 3e-3);
}

#[test]
fn bleach_lifts_black_hair_through_brown_to_white() {
    let luma = |bleach: f32| {
        let dye = HairDye::of(DyeLayer::bleach(bleach));
        color(&dye, Melanin::BLACK, 0.5).element_sum()
    };
    let steps: Vec<f32> = (0..=20).map(|i| luma(0.05 * i as f32)).collect();
    assert!(steps.windows(2).all(|s| s[1] > s[0]), "{steps:?}");
    assert!((steps[20] - 3.0).abs() < 1e-5);
    // A share of the pigment is what hair of so little pigment has.
    let dye = HairDye::of(DyeLayer::bleach(0.96));
    let blond = color(&dye, Melanin::BLACK, 0.5);
    let natural = color(&HairDye::default(), Melanin::new(0.1, 0.0), 0.5);
    assert!(blond.distance(natural) < 1e-4);
}

#[test]
fn roots_leave_tips_and_tips_leave_roots() {
    let bare = |along| color(&HairDye::default(), Melanin::BROWN, along);
    let roots = HairDye::of(DyeLayer::bleached(HairColor::PINK).roots(0.3));
    let tips = HairDye::of(DyeLayer::bleached(HairColor::PINK).tips(0.3));
    assert!(color(&roots, Melanin::BROWN, 0.0).distance(PINK) < 1e-5);
    assert_eq!(color(&roots, Melanin::BROWN, 0.36), bare(0.36));
    assert_eq!(color(&roots, Melanin::BROWN, 1.0), bare(1.0));
    assert_eq!(color(&tips, Melanin::BROWN, 0.0), bare(0.0));
    assert!(color(&tips, Melanin::BROWN, 1.0).distance(PINK) < 1e-5);
    // Half of it at the border, however hard the edge.
    for fade in [0.02, 0.3] {
        let layer = DyeLayer { fade, ..DyeLayer::bleached(HairColor::PINK).roots(0.5) };
        assert!((layer.cover(0.5) - 0.5).abs() < 1e-5);
    }
    let hard = DyeLayer { fade: 0.0, ..DyeLayer::default().between(0.2, 0.4) };
    assert_eq!([0.19, 0.3, 0.41].map(|at| hard.cover(at)), [0.0, 1.0, 0.0]);
}

#[test]
fn layers_follow_each_other_and_streaks_are_asked_for() {
    let dye = HairDye::from_color(HairColor::COBALT)
        .with(DyeLayer::bleached(HairColor::PINK).in_streaks(0.2));
    let natural = Melanin::BLACK.absorption();
    let of = |streak: bool| HairColor::of(dye.absorption(natural, 0.5, |_| streak));
    assert!((of(true).red - 0.85).abs() < 1e-5, "the later goes over the earlier");
    assert!((of(false).red - HairColor::COBALT.red).abs() < 1e-5);
    let layers = vec![DyeLayer::default(); 6];
    let many = HairDye { layers };
    assert_eq!((many.violations().len(), many.clamped().layers.len()), (1, MAX_LAYERS));
}

/// Roots evenly over a dome of 10 cm radius.
fn dome(count: usize) -> Vec<Vec3> {
    let golden = core::f32::consts::PI * (3.0 - 5.0f32.sqrt());
    (0..count)
        .map(|i| {
            let y = 1.0 - (i as f32 + 0.5) / count as f32;
            let (sin, cos) = (golden * i as f32).sin_cos();
            Vec3::new((1.0 - y * y).sqrt() * cos, y, (1.0 - y * y).sqrt() * sin) * 0.1
        })
        .collect()
}

fn count(chosen: &[bool]) -> f32 {
    chosen.iter().filter(|c| **c).count() as f32 / chosen.len() as f32
}

#[test]
fn the_share_is_that_of_strands() {
    let places = dome(20_000);
    for width in [0.0, 8e-3, 20e-3] {
        for share in [0.0, 0.05, 0.3, 0.9, 1.0] {
            let chosen = Streaks { share, width, seed: 5 }.chosen(&places);
            assert!((count(&chosen) - share).abs() < 0.01, "{share} of {width} m wide");
        }
    }
    assert!(Streaks::default().chosen(&[]).is_empty());
}

#[test]
fn neighbours_are_dyed_together_within_a_streak() {
    let places = dome(20_000);
    let alike = |width: f32| {
        let chosen = Streaks { share: 0.5, width, seed: 1 }.chosen(&places);
        let pairs = (0..places.len()).step_by(37).flat_map(|i| {
            let near = |j: &usize| places[i].distance(places[*j]) < 2e-3 && *j != i;
            (0..places.len()).filter(near).map(move |j| (i, j)).collect::<Vec<_>>()
        });
        let same: Vec<bool> = pairs.map(|(i, j)| chosen[i] == chosen[j]).collect();
        count(&same)
    };
    let (single, streak) = (alike(0.0), alike(12e-3));
    println!("neighbours alike: {single} strand by strand, {streak} in streaks");
    assert!((single - 0.5).abs() < 0.05 && streak > 0.85);
}

#[test]
fn a_larger_share_has_all_strands_of_a_smaller_and_a_seed_others() {
    let places = dome(5000);
    let of = |share: f32, seed: u32| Streaks { share, width: 5e-3, seed }.chosen(&places);
    let (few, many) = (of(0.2, 3), of(0.6, 3));
    assert!(few.iter().zip(&many).all(|(few, many)| !few | many));
    assert_ne!(few, of(0.2, 4));
}

#[test]
fn broken_roots_are_strands_too() {
    let places = [Vec3::NAN, Vec3::INFINITY, Vec3::splat(1e30), Vec3::ZERO];
    let chosen = Streaks { share: 1.0, ..default() }.chosen(&places);
    assert_eq!(chosen, [true; 4]);
}

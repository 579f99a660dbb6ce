//! Grooms scaled, turned, cleaned, resampled, thinned; guides and heads.

use super::files::{Arrays, hair, tfx};
use bevy::prelude::*;
use bevy_keratin::authoring::groom::{Groom, GroomError, GroomSettings, UpAxis, yuksel};
use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};
use std::time::Instant;

fn length(points: &[Vec3]) -> f32 {
    points.windows(2).map(|p| p[0].distance(p[1])).sum()
}

fn helix(nodes: usize) -> Vec<Vec3> {
    let at = |k: usize| 6.0 * k as f32 / (nodes - 1) as f32;
    (0..nodes).map(at).map(|t| Vec3::new(t.cos(), 0.3 * t, t.sin()) * 0.05).collect()
}

#[test]
fn resampling_keeps_ends_and_length_and_spaces_evenly() {
    let fine = helix(200);
    let widths = (0..200).map(|i| i as f32).collect();
    let groom = Groom::from_polylines([fine.clone()]).unwrap().with_widths(widths).unwrap();
    for nodes in [2, 3, 16, 64, 777] {
        let coarse = groom.resampled(nodes).unwrap();
        let strand = coarse.strands().next().unwrap();
        assert_eq!(strand.points.len(), nodes);
        assert_eq!((strand.points[0], strand.points[nodes - 1]), (fine[0], fine[199]));
        // A chord for an arc of angle a is shorter by a²/24.
        let short = (6.0 / (nodes - 1) as f32).powi(2) / 24.0 + 1e-4;
        let lost = 1.0 - length(strand.points) / length(&fine);
        assert!((-1e-4..short).contains(&lost), "{nodes} nodes lose {lost}, may {short}");
        if nodes > 16 {
            let pieces: Vec<f32> = strand.points.windows(2).map(|p| p[0].distance(p[1])).collect();
            let (least, most) =
                pieces.iter().fold((1.0f32, 0.0f32), |(a, b), l| (a.min(*l), b.max(*l)));
            assert!(most / least < 1.01, "{least} to {most}");
        }
        let widths = strand.widths.unwrap();
        assert!((widths[nodes / 2] - 199.0 * (nodes / 2) as f32 / (nodes - 1) as f32).abs() < 0.01);
    }
    assert!(matches!(groom.resampled(1), Err(GroomError::Value(_))));
    let point = Groom::from_polylines([[Vec3::ONE; 3]]).unwrap();
    assert_eq!(point.resampled(5).unwrap().points(), [Vec3::ONE; 5]);
}

#[test]
fn short_segments_merge_and_root_and_tip_stay() {
    let y = |y: f32| Vec3::Y * y;
    // As in real files: two fixed roots 1e-7 m apart, a double node, and a tip hard by the last.
    let strand = vec![y(0.0), y(1e-7), y(0.1), y(0.1), y(0.2), y(0.3 - 1e-7), y(0.3)];
    let dot = vec![Vec3::X, Vec3::X + y(1e-7), Vec3::X + y(2e-7)];
    let back = vec![y(0.0), y(0.1), y(0.0)];
    let groom = Groom::from_polylines([strand, dot, back]).unwrap();
    let (merged, losses) = groom.merged(1e-5).unwrap();
    let strands: Vec<_> = merged.strands().map(|s| s.points.to_vec()).collect();
    assert_eq!(strands[0], [y(0.0), y(0.1), y(0.2), y(0.3)]);
    assert_eq!(strands[1], [y(0.0), y(0.1), y(0.0)]);
    assert_eq!((strands.len(), losses.short_strands.count, losses.merged_nodes.count), (2, 1, 3));
    let (same, losses) = merged.merged(1e-5).unwrap();
    assert!(same == merged && losses.is_empty());
    assert!(groom.merged(f32::NAN).is_err());
    // Nothing of no length is left even if nothing is asked for.
    let (merged, _) = groom.merged(0.0).unwrap();
    assert!(merged.strands().all(|s| s.points.windows(2).all(|p| p[0] != p[1])));
}

#[test]
fn axes_turn_without_mirroring() {
    for up in [UpAxis::X, UpAxis::Y, UpAxis::Z, UpAxis::NegX, UpAxis::NegY, UpAxis::NegZ] {
        let [x, y, z] = [Vec3::X, Vec3::Y, Vec3::Z].map(|v| up.to_y_up(v));
        assert_eq!(x.cross(y), z, "{up:?}");
    }
    assert_eq!(UpAxis::Z.to_y_up(Vec3::Z), Vec3::Y);
    assert_eq!(UpAxis::NegX.to_y_up(Vec3::NEG_X), Vec3::Y);
}

#[test]
fn settings_apply_in_order_and_refuse_nonsense() {
    let file = tfx(4.0, 10, 4, Arrays::ALL);
    let settings = GroomSettings {
        scale: Some(0.5),
        up: Some(UpAxis::Z),
        origin: Vec3::new(1.0, 0.0, 0.0),
        nodes: Some(7),
        keep_every: 2,
        limit: Some(3),
        ..default()
    };
    let (groom, losses) = Groom::from_file(&file, &settings).unwrap();
    assert_eq!((groom.len(), losses.thinned_strands.count), (3, 7));
    // Strands 0, 2, 6 of 0, 2, 4, 6, 8 at (i, i/4, z).
    let strand = groom.strands().nth(1).unwrap();
    assert_eq!(strand.points[0], Vec3::new(0.0, 0.0, -0.25));
    assert_eq!(strand.points[6], Vec3::new(0.0, 0.75, -0.25));
    assert_eq!(strand.widths.unwrap()[0], 0.5 * 2.01);
    for wrong in [
        GroomSettings { scale: Some(0.0), ..default() },
        GroomSettings { scale: Some(f32::NAN), ..default() },
        GroomSettings { keep_every: 0, ..default() },
        GroomSettings { limit: Some(0), ..default() },
        GroomSettings { nodes: Some(1), ..default() },
        GroomSettings { nodes: Some(usize::MAX), ..default() },
        GroomSettings { shortest_segment: -1.0, ..default() },
        GroomSettings { origin: Vec3::NAN, ..default() },
    ] {
        assert!(Groom::from_file(&file, &wrong).is_err(), "{wrong:?}");
    }
    // Units by the kind of file.
    let (groom, _) = Groom::from_file(&hair(&[2, 2], 2), &default()).unwrap();
    assert_eq!(groom.points()[2], Vec3::Y * 0.00254);
    let (groom, _) = Groom::from_file(&tfx(3.0, 2, 4, Arrays::default()), &default()).unwrap();
    assert_eq!(groom.points()[3], Vec3::Z * 0.015, "centimetres");
}

/// Roots scattered over a hemisphere of 9 cm around `centre`.
fn scalp(count: usize, centre: Vec3) -> Groom {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(5);
    let strands = (0..count).map(|_| {
        let up: f32 = random.random_range(0.0..1.0);
        let turn: f32 = random.random_range(0.0..core::f32::consts::TAU);
        let across = (1.0 - up * up).sqrt();
        let way = Vec3::new(across * turn.cos(), up, across * turn.sin());
        [centre + way * 0.09, centre + way * 0.19]
    });
    Groom::from_polylines(strands).unwrap()
}

fn smallest_gap(groom: &Groom, chosen: &[usize]) -> f32 {
    let roots: Vec<Vec3> = groom.roots().collect();
    let mut least = f32::MAX;
    for (k, i) in chosen.iter().enumerate() {
        for j in &chosen[..k] {
            least = least.min(roots[*i].distance(roots[*j]));
        }
    }
    least
}

#[test]
fn guides_are_spread_evenly() {
    let groom = scalp(20_000, Vec3::ZERO);
    let guides = groom.guides(300);
    let mut sorted = guides.clone();
    sorted.sort_unstable();
    sorted.dedup();
    assert_eq!(sorted.len(), 300);
    // 300 discs on 2π · 9² cm² of hemisphere, as dense as hexagons pack, have this diameter.
    let best = (2.0 * core::f32::consts::TAU * 0.09f32.powi(2) / (300.0 * 3f32.sqrt())).sqrt();
    let gap = smallest_gap(&groom, &guides);
    assert!(gap > 0.65 * best, "gap {gap} of {best}");
    let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
    let by_chance: Vec<usize> = (0..300).map(|_| random.random_range(0..20_000)).collect();
    assert!(gap > 10.0 * smallest_gap(&groom, &by_chance));
    assert_eq!(groom.guides(300), guides);
    assert_eq!(groom.guides(100), guides[..100]);
}

#[test]
fn guides_of_odd_grooms_are_all_there_and_differ() {
    let same = Groom::from_polylines(vec![[Vec3::ONE, Vec3::X]; 7]).unwrap();
    for (count, expected) in [(0, 0), (3, 3), (7, 7), (100, 7)] {
        let mut guides = same.guides(count);
        guides.sort_unstable();
        guides.dedup();
        assert_eq!(guides.len(), expected);
    }
    assert!(Groom::default().guides(10).is_empty());
}

#[test]
fn a_head_is_found_under_the_roots() {
    let centre = Vec3::new(0.1, 1.6, -0.2);
    let head = scalp(500, centre).fit_head().unwrap();
    assert!(Vec3::from(head.center).distance(centre) < 1e-4, "{head:?}");
    assert!((head.radius() - 0.09).abs() < 1e-4, "{head:?}");
    let flat = (0..100).map(|i| Vec3::new((i % 10) as f32, 0.0, (i / 10) as f32));
    let flat = Groom::from_polylines(flat.map(|r| [r, r + Vec3::Y])).unwrap();
    assert!(flat.fit_head().is_none());
    assert!(scalp(3, centre).fit_head().is_none());
    let same = Groom::from_polylines(vec![[Vec3::ONE, Vec3::X]; 7]).unwrap();
    assert!(same.fit_head().is_none());
}

#[test]
fn a_patch_gives_no_head_and_no_head_is_wider_than_its_groom() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(7);
    // Part of a head of 9 cm, as uneven as modelled scalps are, with hair that hangs.
    let mut patch = |sine: f32, hair: f32| {
        let strands: Vec<_> = (0..400)
            .map(|_| {
                let across: f32 = sine * random.random_range(0.0f32..1.0).sqrt();
                let turn: f32 = random.random_range(0.0..core::f32::consts::TAU);
                let way = Vec3::new(across * turn.cos(), (1.0 - across * across).sqrt(), 0.0)
                    .with_z(across * turn.sin());
                let root = way * 0.09 * random.random_range(0.97..1.03);
                [root, root + way * 0.3 * hair, root + way * 0.3 * hair + Vec3::NEG_Y * hair]
            })
            .collect();
        Groom::from_polylines(strands).unwrap()
    };
    // Its unevenness hides how a patch curves: at worst it gives a ball as small as itself.
    let ball = patch(0.25, 0.4).fit_head();
    assert!(ball.is_none_or(|b| b.radius() < 0.03), "{ball:?}");
    for sine in [0.02, 0.05, 0.1, 0.15] {
        assert_eq!(patch(sine, 0.4).fit_head().map(|b| b.radius()), None, "{sine}");
    }
    for (sine, hair) in [(0.5, 0.01), (0.9, 0.01), (0.99, 0.3), (0.7, 0.3)] {
        let groom = patch(sine, hair);
        let (low, high) = groom.extents().unwrap();
        if let Some(ball) = groom.fit_head() {
            assert!(2.0 * ball.radius() <= (high - low).max_element(), "{ball:?} of {sine}");
            assert!((ball.radius() - 0.09).abs() < 0.02, "{ball:?} of {sine}");
        }
    }
    assert!(patch(0.99, 0.1).fit_head().is_some());
}

#[test]
fn an_odd_size_is_reported_with_the_unit_that_fits() {
    let head = scalp(300, Vec3::ZERO);
    assert_eq!(head.odd_size(1.0), None);
    for unit in [0.01f32, 0.0254, 0.001] {
        // Taken as metres though it is in smaller units.
        let raw = head.clone().scaled(1.0 / unit).unwrap();
        let odd = raw.odd_size(1.0).expect("38 cm and more times a hundred");
        assert_eq!(odd.scale, unit, "{odd}");
        assert_eq!(raw.scaled(odd.scale).unwrap().odd_size(odd.scale), None);
    }
    // Metres taken as tenths of an inch.
    let odd = head.clone().scaled(0.00254).unwrap().odd_size(0.00254).unwrap();
    assert_eq!(odd.scale, 1.0);
    assert!(odd.to_string().contains("1 m a unit would fit"), "{odd}");
    // In no unit at all.
    let raw = head.scaled(1e6).unwrap();
    let odd = raw.odd_size(1.0).unwrap();
    let fitted = raw.scaled(odd.scale).unwrap();
    let (low, high) = fitted.extents().unwrap();
    assert!(((high - low).max_element() - 0.4).abs() < 0.02, "{odd}");
    assert_eq!(Groom::default().odd_size(1.0), None);
    let point = Groom::from_polylines([[Vec3::ONE; 2]]).unwrap();
    assert_eq!(point.odd_size(1.0), None, "no scale helps");
}

#[test]
fn numbers_that_hair_cannot_have_are_refused() {
    let groom = || Groom::from_polylines([[Vec3::ZERO, Vec3::Y], [Vec3::X, Vec3::ONE]]).unwrap();
    for wrong in [-0.1, f32::NAN, f32::INFINITY] {
        let error = groom().with_widths(vec![1e-4, 1e-4, 1e-4, wrong]).unwrap_err();
        let text = error.to_string();
        assert!(
            text.contains("width (m) 1 of strand 1 is") && text.contains("0 or more"),
            "{text}"
        );
    }
    assert!(groom().with_widths(vec![0.0; 4]).is_ok());
    let red = LinearRgba::rgb(f32::NAN, 0.0, 0.0);
    let error = groom().with_colors(vec![LinearRgba::WHITE, red, red, red]).unwrap_err();
    assert!(error.to_string().contains("colour 1 of strand 0 is NaN"), "{error}");
    let error = groom().with_uvs(vec![Vec2::ONE, Vec2::NAN]).unwrap_err();
    assert!(error.to_string().contains("UV 0 of strand 1 is NaN"), "{error}");
    // A scale that points survive but widths do not.
    let wide = groom().with_widths(vec![1e38; 4]).unwrap().scaled(1e9);
    assert!(matches!(wide, Err(GroomError::OutOfRange { strand: 0, at: 0, .. })), "{wide:?}");
}

#[test]
fn reflection_cannot_make_arrays_disagree() {
    let mut groom = Groom::from_polylines([[Vec3::ZERO, Vec3::Y]]).unwrap();
    assert!(groom.reflect_mut().as_opaque().is_ok());
}

#[test]
fn fifty_thousand_strands_load_in_seconds() {
    let line = |i: usize| (0..70).map(move |k| Vec3::new(i as f32, 0.0, k as f32) * 0.1);
    let groom = Groom::from_polylines((0..50_000).map(line)).unwrap();
    let file = yuksel::write(&groom).unwrap();
    let start = Instant::now();
    let settings = GroomSettings { nodes: Some(16), ..default() };
    let (loaded, _) = Groom::from_file(&file, &settings).unwrap();
    let read = start.elapsed();
    let start = Instant::now();
    let guides = loaded.guides(1000);
    println!("{} MB read in {read:?}, 1000 guides in {:?}", file.len() >> 20, start.elapsed());
    assert_eq!((loaded.len(), guides.len()), (50_000, 1000));
    assert!(read.as_secs_f32() < 10.0, "{read:?}");
    assert!(start.elapsed().as_secs_f32() < 10.0, "{:?}", start.elapsed());
}

/// A helix of radius r and pitch P whose bends count s times, along its whole length: of a tangent (cos a, sin a) along and
/// around its axis is left (cos a, s sin a), over its length.
#[test]
fn a_curl_changes_as_its_share_says() {
    let (radius, pitch, turns, nodes) = (5e-3_f32, 0.02_f32, 6.0_f32, 361);
    let angle = |k: usize| core::f32::consts::TAU * turns * k as f32 / (nodes - 1) as f32;
    let down = |k: usize| -pitch * turns * k as f32 / (nodes - 1) as f32;
    let point = |k: usize| {
        Vec3::new(radius * angle(k).cos(), down(k), radius * angle(k).sin()) + Vec3::X * 0.3
    };
    let line: Vec<Vec3> = (0..nodes).map(point).collect();
    let groom = Groom::from_polylines([line.clone(), line.clone()]).unwrap();
    let turn = length(&line) / turns;
    let (cos, sin) = (pitch / turn, core::f32::consts::TAU * radius / turn);
    for share in [0.0_f32, 0.5, 2.0] {
        let made = groom.with_curl(turn, &[share, 1.0]).unwrap();
        let both: Vec<_> = made.strands().map(|strand| strand.points.to_vec()).collect();
        assert_eq!(both[1], line, "1 is as it is, to the bit");
        let made = &both[0];
        assert_eq!(made[0], line[0], "the root stays");
        assert!((length(made) / length(&line) - 1.0).abs() < 1e-4, "the length stays");
        let over = (cos * cos + share * share * sin * sin).sqrt();
        // Where the window is not cut off by an end.
        let (from, to) = (60, 300);
        let fallen = (made[from].y - made[to].y) / (line[from].y - line[to].y);
        assert!((fallen * over - 1.0).abs() < 0.01, "{share}: falls {fallen}, for {}", 1.0 / over);
        let inner = &made[from..to];
        let axis = inner.iter().sum::<Vec3>() / inner.len() as f32;
        let off = inner.iter().map(|p| (p.xz() - axis.xz()).length()).sum::<f32>();
        let (found, expected) = (off / inner.len() as f32, radius * share / over);
        assert!((found - expected).abs() < 0.02 * radius, "{share}: radius {found} for {expected}");
    }
    // By the length of the strand at most, and none of a line.
    let straight = Groom::from_polylines([[Vec3::ZERO, Vec3::Y * 0.1, Vec3::Y * 0.2]]).unwrap();
    let made = straight.with_curl(10.0, &[3.0]).unwrap();
    assert!(made.points()[2].distance(Vec3::Y * 0.2) < 1e-6);
    let point = Groom::from_polylines([[Vec3::ONE; 3]]).unwrap();
    assert_eq!(point.with_curl(0.04, &[0.0]).unwrap().points(), [Vec3::ONE; 3]);
    for (over, shares) in [(0.0, &[1.0][..]), (f32::NAN, &[1.0]), (0.1, &[-1.0]), (0.1, &[1.0; 2])]
    {
        assert!(straight.with_curl(over, shares).is_err(), "{over} {shares:?}");
    }
}

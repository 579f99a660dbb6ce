//! Planting hair on meshes.
#![cfg(feature = "groom")]

use bevy::render::{mesh::RenderMesh, render_asset::RenderAsset};

use bevy::{
    asset::RenderAssetUsages,
    mesh::{Indices, PrimitiveTopology},
    prelude::*,
};
use bevy_keratin::{authoring::plant::*, prelude::*};
use core::f32::consts::{PI, TAU};
use proptest::prelude::*;

fn triangles(positions: Vec<[f32; 3]>, indices: Vec<u32>) -> Mesh {
    Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default())
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, positions)
        .with_inserted_indices(Indices::U32(indices))
}

/// A rectangle in the plane y = 0, looking up, with UVs from 0 to 1.
fn plane(x: f32, z: f32) -> Mesh {
    Plane3d::new(Vec3::Y, Vec2::new(x, z) * 0.5).mesh().build()
}

/// A square of 0.2 m whose triangles' edges go from 0.2 mm to 10 cm.
fn uneven() -> Mesh {
    let mut lines = vec![0.0_f32];
    let mut step = 2e-4_f32;
    while *lines.last().unwrap() < 0.2 {
        lines.push((lines.last().unwrap() + step).min(0.2));
        step *= 1.6;
    }
    let n = lines.len() as u32;
    let positions = lines.iter().flat_map(|z| lines.iter().map(|x| [*x, 0.0, *z])).collect();
    let quads = (0..n - 1).flat_map(|z| (0..n - 1).map(move |x| z * n + x));
    let indices = quads.flat_map(|a| [a, a + n, a + 1, a + 1, a + n, a + n + 1]).collect();
    triangles(positions, indices)
}

fn roots(planted: &Planted) -> Vec<Vec3> {
    planted.groom.strands().map(|s| s.points[0]).collect()
}

fn nearest_pair(places: &[Vec3]) -> f32 {
    let each = places.iter().enumerate();
    let square = each
        .flat_map(|(i, a)| places[..i].iter().map(move |b| a.distance_squared(*b)))
        .fold(f32::MAX, f32::min);
    square.sqrt()
}

fn straight(density: f32) -> Planting {
    Planting { density, length: 0.1, jitter: 0.0, length_variation: 0.0, ..default() }
}

fn positions(mesh: &Mesh) -> Vec<Vec3> {
    let values = mesh.attribute(Mesh::ATTRIBUTE_POSITION).unwrap().as_float3().unwrap();
    values.iter().copied().map(Vec3::from).collect()
}

#[test]
fn density_is_met_and_no_two_roots_crowd_on_plane_ball_and_uneven_mesh() {
    let ball = Sphere::new(0.1).mesh().ico(20).unwrap();
    for (name, mesh, area) in [
        ("plane", plane(0.4, 0.1), 0.04),
        ("ball", ball, 4.0 * PI * 0.01),
        ("uneven", uneven(), 0.04),
    ] {
        for density in [1e4, 1e5] {
            let planted = straight(density).plant(&mesh).unwrap();
            let found = planted.groom.len() as f32 / area;
            assert!((found / density - 1.0).abs() < 0.05, "{name}: {found} for {density}");
            let (spacing, nearest) = (density.sqrt().recip(), nearest_pair(&roots(&planted)));

            assert!(nearest >= 0.5 * spacing, "{name}: {nearest} at spacing {spacing}");
        }
    }
}

/// Even everywhere, not only in sum: counts of tiles spread far less than by chance, where the
/// standard deviation would be the root of the mean.
#[test]
fn spacing_is_even_all_over_an_uneven_mesh() {
    let planted = straight(1e5).plant(&uneven()).unwrap();
    let mut tiles = [0f32; 100];
    for root in roots(&planted) {
        let tile = (root / 0.02).as_ivec3().clamp(IVec3::ZERO, IVec3::splat(9));
        tiles[(tile.x + 10 * tile.z) as usize] += 1.0;
    }
    let mean = tiles.iter().sum::<f32>() / 100.0;
    let deviation = (tiles.iter().map(|t| (t - mean).powi(2)).sum::<f32>() / 100.0).sqrt();
    assert!((mean - 40.0).abs() < 2.0, "{mean}");
    assert!(deviation < 0.55 * mean.sqrt(), "{deviation} of {mean}");
}

#[test]
fn twenty_thousand_roots_are_planted_fast() {
    let start = std::time::Instant::now();
    let planted = straight(2e5).plant(&plane(0.5, 0.2)).unwrap();
    let took = start.elapsed();
    assert!((planted.groom.len() as f32 / 2e4 - 1.0).abs() < 0.01);
    // 0.3 s in a test build; others may share the machine.
    assert!(took.as_secs_f32() < 3.0, "{took:?}");
    println!("{took:?}");
}

#[test]
fn where_sheets_lie_on_each_other_distance_goes_before_density() {
    // Both sides of the same square, and once more on top.
    let (mut positions, mut indices) = (Vec::new(), Vec::new());
    for layer in 0..3u32 {
        for (x, z) in [(0.0, 0.0), (0.1, 0.0), (0.1, 0.1), (0.0, 0.1)] {
            positions.push([x, layer as f32 * 1e-4, z]);
        }
        let order = if layer == 1 { [0, 1, 2, 0, 2, 3] } else { [0, 2, 1, 0, 3, 2] };
        indices.extend(order.map(|i| i + 4 * layer));
    }
    let planted = straight(1e5).plant(&triangles(positions, indices)).unwrap();
    assert!(nearest_pair(&roots(&planted)) >= 0.5 * 1e5f32.sqrt().recip());
    assert!(planted.groom.len() > 1500);
}

#[test]
fn the_same_seed_gives_the_same_bits_and_another_seed_others() {
    let recipe = |seed| Planting {
        seed,
        density: 2e4,
        length: 0.15,
        nodes: 40,
        curl: Some(Curl::default()),
        clump: Some(Clump::default()),
        drape: Some(Drape::default()),
        ..default()
    };
    let ball = Sphere::new(0.1).mesh().ico(10).unwrap();
    let plant = |seed| recipe(seed).plant(&ball).unwrap();
    let bits = |planted: &Planted| -> Vec<u32> {
        planted.groom.points().iter().flat_map(|p| p.to_array()).map(f32::to_bits).collect()
    };
    let (once, again, other) = (plant(7), plant(7), plant(8));
    assert_eq!(bits(&once), bits(&again));
    assert_eq!(once, again);
    let places = roots(&once);
    let same = roots(&other).iter().filter(|p| places.contains(p)).count();
    assert_eq!(same, 0);
}

#[test]
fn roots_lie_on_the_triangles_they_name() {
    let mesh = Sphere::new(0.1).mesh().uv(24, 16);
    let corners = positions(&mesh);
    let planted = straight(2e4).plant(&mesh).unwrap();
    assert_eq!(planted.roots.len(), planted.groom.len());
    for (strand, root) in planted.groom.strands().zip(&planted.roots) {
        let weights = root.weights.to_array();
        let place: Vec3 =
            root.vertices.iter().zip(weights).map(|(v, w)| corners[*v as usize] * w).sum();
        assert!(place.distance(strand.points[0]) < 1e-6);
        assert!(root.weights.min_element() >= 0.0);
        assert!((root.weights.element_sum() - 1.0).abs() < 1e-6);
    }
}

#[test]
fn strands_have_the_texture_coordinates_of_their_roots() {
    let planted = straight(2e4).plant(&plane(0.2, 0.4)).unwrap();
    for strand in planted.groom.strands() {
        let (uv, root) = (strand.uv.unwrap(), strand.points[0]);
        let expected = Vec2::new(root.x / 0.2 + 0.5, root.z / 0.4 + 0.5);
        assert!(uv.distance(expected) < 1e-5, "{uv} at {root}");
    }
    let bare = uneven();
    assert!(straight(2e4).plant(&bare).unwrap().groom.strands().all(|s| s.uv.is_none()));
}

#[test]
fn masks_scale_density() {
    let mesh = plane(0.3, 0.3);
    let all = straight(5e4).plant(&mesh).unwrap().groom.len() as f32;
    let share = |map: &dyn Fn(&RootPlace) -> f32| {
        let maps = PlantingMaps::new().density(map);
        let planted = straight(5e4).plant_with(&mesh, &maps).unwrap();
        (planted.groom.len() as f32 / all, planted)
    };
    let grey = share(&|_| 0.5);
    assert!((grey.0 - 0.5).abs() < 0.025, "{}", grey.0);
    // Spacing has grown as well.
    let nearest = nearest_pair(&roots(&grey.1)) * (5e4f32 / 2.0).sqrt();
    assert!(nearest > 0.6, "{nearest}");

    let ramp = share(&|place| place.position.x / 0.3 + 0.5);
    assert!((ramp.0 - 0.5).abs() < 0.025, "{}", ramp.0);
    let outer = roots(&ramp.1).iter().filter(|r| r.x > 0.0).count() as f32;
    assert!((outer / ramp.1.groom.len() as f32 - 0.75).abs() < 0.04);
    let half = share(&|place| if place.position.z > 0.0 { 1.0 } else { 0.0 });
    assert!((half.0 - 0.5).abs() < 0.025, "{}", half.0);
    assert!(roots(&half.1).iter().all(|r| r.z > 0.0));
    // Odd values count as the nearest in 0…1, none as 0.
    let odd = share(&|place| if place.position.z > 0.0 { 7.0 } else { f32::NAN });
    assert!((odd.0 - 0.5).abs() < 0.025, "{}", odd.0);
}

#[test]
fn vertex_colours_and_images_are_masks() {
    let mesh = plane(0.3, 0.3);
    let all = straight(5e4).plant(&mesh).unwrap().groom.len() as f32;
    let grey = vec![[0.0, 0.5, 0.0, 1.0]; positions(&mesh).len()];
    let colored = mesh.clone().with_inserted_attribute(Mesh::ATTRIBUTE_COLOR, grey);
    let green = vertex_color(MapChannel::Green);
    let maps = PlantingMaps::new().density(&green);
    let planted = straight(5e4).plant_with(&colored, &maps).unwrap();
    assert!((planted.groom.len() as f32 / all - 0.5).abs() < 0.025);
    // A mesh without colours has nothing of the kind.
    let bald = straight(5e4).plant_with(&mesh, &maps).unwrap_err();
    assert!(matches!(bald, PlantError::NoRoots { .. }));

    // Hair in the group around the pixel in the upper left, v = 0.
    let mut values = vec![0.0; 64];
    for y in 0..4 {
        values[8 * y..8 * y + 4].fill(1.0);
    }
    let image = ImageMap::new(8, 8, values).unwrap();
    assert_eq!(image.at(Vec2::splat(0.25)), 1.0);
    assert_eq!(image.at(Vec2::splat(0.75)), 0.0);
    assert_eq!(image.at(Vec2::splat(1.25)), 1.0);
    assert!((image.at(Vec2::new(0.5, 0.25)) - 0.5).abs() < 1e-6);
    assert_eq!(image.at(Vec2::new(f32::NAN, 0.5)), 0.0);
    let painted = image.mask();
    let maps = PlantingMaps::new().density(&painted);
    let planted = straight(5e4).plant_with(&mesh, &maps).unwrap();
    assert!((planted.groom.len() as f32 / all - 0.25).abs() < 0.02);
    for strand in planted.groom.strands() {
        let uv = strand.uv.unwrap();
        let in_quarter = |x: f32| !(0.57..=0.93).contains(&x);
        assert!(in_quarter(uv.x) && in_quarter(uv.y), "{uv}");
    }
    let wrong = ImageMap::new(8, 8, vec![0.0; 63]).unwrap_err();
    assert_eq!(wrong, PlantError::MapSize { found: 63, width: 8, height: 8 });
}

#[test]
fn an_image_is_a_map_of_what_was_painted() {
    use bevy::render::render_resource::{Extent3d, TextureDimension, TextureFormat};
    let size = Extent3d { width: 2, height: 1, depth_or_array_layers: 1 };
    let pixels = vec![255, 128, 0, 255, 0, 128, 51, 255];
    let usage = RenderAssetUsages::default();
    let image =
        Image::new(size, TextureDimension::D2, pixels, TextureFormat::Rgba8UnormSrgb, usage);
    let at = |channel, u| ImageMap::from_image(&image, channel).unwrap().at(Vec2::new(u, 0.5));
    assert!((at(MapChannel::Red, 0.25) - 1.0).abs() < 1e-6);
    assert!((at(MapChannel::Green, 0.25) - 128.0 / 255.0).abs() < 1e-5);
    assert!((at(MapChannel::Blue, 0.75) - 0.2).abs() < 1e-5);
    let mut gone = image.clone();
    gone.data = None;
    let error = ImageMap::from_image(&gone, MapChannel::Red).unwrap_err();
    assert!(matches!(error, PlantError::Image { .. }), "{error}");
}

#[test]
fn strands_are_as_long_as_asked_and_evenly_divided() {
    let lengths = |planting: &Planting, mesh: &Mesh| -> Vec<f32> {
        let planted = planting.plant(mesh).unwrap();
        let strands = planted.groom.strands().map(|s| {
            let strand = Strand::from_polyline(s.points).unwrap();
            assert_eq!(strand.nodes(), planting.nodes as usize);
            let mean = strand.length() / strand.edges() as f32;
            for l in strand.rest_lengths() {
                assert!((l / mean - 1.0).abs() < 0.12, "{l} of {mean}");
            }
            strand.length()
        });
        strands.collect()
    };
    let mesh = plane(0.2, 0.2);
    for l in lengths(&straight(1e4), &mesh) {
        assert!((l - 0.1).abs() < 1e-4);
    }
    let varied = Planting { length_variation: 0.4, ..straight(1e4) };
    let varied = lengths(&varied, &mesh);
    let (least, most) = varied.iter().fold((1.0f32, 0.0f32), |(a, b), l| (a.min(*l), b.max(*l)));
    assert!((0.0599..0.064).contains(&least) && (0.096..0.1001).contains(&most), "{least} {most}");
    let curled = Planting {
        nodes: 80,
        curl: Some(Curl { radius: 4e-3, pitch: 12e-3, ..default() }),
        ..straight(1e4)
    };
    // Chords are a little shorter than arcs.
    for l in lengths(&curled, &mesh) {
        assert!((0.095..0.1001).contains(&l), "{l}");
    }
    let ball = Sphere::new(0.1).mesh().ico(10).unwrap();
    let fallen = Planting {
        clump: Some(Clump::default()),
        drape: Some(Drape::default()),
        length: 0.25,
        nodes: 20,
        ..straight(1e4)
    };
    for l in lengths(&fallen, &ball) {
        assert!((0.235..0.2501).contains(&l), "{l}");
    }
}

#[test]
fn curls_have_the_radius_and_pitch_asked_for() {
    let curl = Curl { radius: 5e-3, pitch: 20e-3, variation: 0.0, ..default() };
    let planting = Planting { nodes: 120, length: 0.2, curl: Some(curl), ..straight(2e3) };
    let planted = planting.plant(&plane(0.2, 0.2)).unwrap();
    let mut hands = [0; 2];
    for strand in planted.groom.strands() {
        let root = strand.points[0];
        let mut turned = 0.0;
        // Past the part that grows out of the root.
        let grown: Vec<Vec3> =
            strand.points.iter().map(|p| *p - root).filter(|p| p.y > curl.pitch).collect();
        for pair in grown.windows(2) {
            let (a, b) = (pair[0].xz(), pair[1].xz());
            assert!((a.length() / curl.radius - 1.0).abs() < 0.04, "{}", a.length());
            turned += a.angle_to(b);
        }
        hands[usize::from(turned > 0.0)] += 1;
        let risen = grown[grown.len() - 1].y - grown[0].y;
        let pitch = risen / (turned.abs() / TAU);
        assert!((pitch / curl.pitch - 1.0).abs() < 0.03, "{pitch}");
        // Nothing below the scalp.
        assert!(strand.points.iter().all(|p| p.y >= -1e-6));
    }
    assert!(hands.iter().all(|n| *n > planted.groom.len() / 4), "{hands:?}");
    assert!((curl.turn_length() - 0.037242).abs() < 1e-5);
    assert!((curl.curvature_radius() - 7.0264e-3).abs() < 1e-6);
}

#[test]
fn curls_turn_together_as_asked() {
    let phases = |phase, clump| {
        let curl = Curl { radius: 4e-3, pitch: 20e-3, variation: 0.0, phase, ..default() };
        let planting = Planting { nodes: 60, curl: Some(curl), clump, ..straight(4e3) };
        let planted = planting.plant(&plane(0.2, 0.2)).unwrap();
        let at = |points: &[Vec3]| {
            let off = points[40] - points[0];
            off.xz().to_angle()
        };
        planted.groom.strands().map(|s| at(s.points)).collect::<Vec<f32>>()
    };
    let spread = |angles: &[f32]| {
        let mean = angles.iter().map(|a| Vec2::from_angle(*a)).sum::<Vec2>() / angles.len() as f32;
        1.0 - mean.length()
    };
    assert!(spread(&phases(CurlPhase::Same, None)) < 1e-3);
    assert!(spread(&phases(CurlPhase::PerStrand, None)) > 0.6);
    // One lock over all, whose tips do not draw together.
    let lock = Some(Clump { spacing: 1.0, strength: 0.0 });
    assert!(spread(&phases(CurlPhase::PerClump, lock)) < 1e-3);
    assert!(spread(&phases(CurlPhase::PerStrand, lock)) > 0.6);
}

/// Where waves of a strand cross its axis (m along it), and by how much they leave the plane that they are in (m).
fn crossings(points: &[Vec3], way: Vec3) -> (Vec<f32>, f32, Vec3) {
    let off: Vec<Vec3> =
        points.iter().map(|p| (*p - points[0]).reject_from_normalized(way)).collect();
    let widest = off.iter().copied().max_by(|a, b| a.length().total_cmp(&b.length())).unwrap();
    let side = widest.normalize();
    let out = off.iter().map(|o| o.reject_from_normalized(side).length()).fold(0.0, f32::max);
    let along = |i: usize| (points[i] - points[0]).dot(way);
    let mut at = Vec::new();
    for i in 1..points.len() {
        let (a, b) = (off[i - 1].dot(side), off[i].dot(side));
        // The helix is as wide as asked for after half a turn.
        if a * b < 0.0 && along(i) > 0.04 {
            at.push(along(i - 1) + (along(i) - along(i - 1)) * a / (a - b));
        }
    }
    (at, out, side)
}

#[test]
fn waves_are_flat_and_drift_as_far_as_asked() {
    let (lean, pitch) = (0.6_f32, 40e-3);
    let waves = |flatness, drift| {
        let curl = Curl {
            radius: 3e-3,
            pitch,
            variation: 0.0,
            phase: CurlPhase::PerStrand,
            flatness,
            drift,
        };
        let comb = CombPattern::Along(Vec3::X);
        let base = Planting { length: 0.3, nodes: 400, lean, comb, ..straight(4e3) };
        let planted = Planting { curl: Some(curl), ..base }.plant(&plane(0.2, 0.2)).unwrap();
        let way = Vec3::new(lean.sin(), lean.cos(), 0.0);
        let strands = planted.groom.strands();
        strands.map(|strand| crossings(strand.points, way)).collect::<Vec<_>>()
    };
    let widest =
        |of: &[(Vec<f32>, f32, Vec3)]| of.iter().map(|(_, out, _)| *out).fold(0.0, f32::max);
    assert!(widest(&waves(0.0, 0.0)) > 2.5e-3);
    assert!(widest(&waves(0.7, 0.0)) < 1.2e-3);
    let even = waves(1.0, 0.0);
    assert!(widest(&even) < 2e-5, "{}", widest(&even));
    for (at, _, side) in &even {
        // Beside the scalp's normal and the strand, within 40°.
        assert!(side.dot(Vec3::Z).abs() > 0.7_f32.cos() - 1e-3, "{side}");
        assert!(
            at.windows(2).all(|p| ((p[1] - p[0]) / (0.5 * pitch) - 1.0).abs() < 0.01),
            "{at:?}"
        );
    }
    let drifting = waves(1.0, 0.25);
    assert!(widest(&drifting) < 2e-5);
    let mut halves = Vec::new();
    for (at, _, _) in &drifting {
        // Where they are beside even ones: within twice a quarter of a turn of the first.
        for (i, place) in at.iter().enumerate() {
            let off = place - at[0] - 0.5 * pitch * i as f32;
            assert!(off.abs() < 0.5 * pitch * 1.02, "{off} m");
        }
        halves.extend(at.windows(2).map(|p| (p[1] - p[0]) / (0.5 * pitch)));
    }
    let spread = halves.iter().map(|h| (h - 1.0).powi(2)).sum::<f32>() / halves.len() as f32;
    assert!(spread.sqrt() > 0.1, "{}", spread.sqrt());
    // Those of a lock drift alike.
    let curl = Curl { drift: 0.4, flatness: 0.5, variation: 0.0, radius: 3e-3, pitch, ..default() };
    let lock = Some(Clump { spacing: 1.0, strength: 0.0 });
    let base = Planting { length: 0.3, nodes: 100, clump: lock, ..straight(4e3) };
    let planted = Planting { curl: Some(curl), ..base }.plant(&plane(0.2, 0.2)).unwrap();
    let shape = |points: &[Vec3]| points.iter().map(|p| *p - points[0]).collect::<Vec<_>>();
    let shapes: Vec<_> = planted.groom.strands().map(|strand| shape(strand.points)).collect();
    for other in &shapes[1..] {
        let apart = other.iter().zip(&shapes[0]).map(|(a, b)| a.distance(*b));
        assert!(apart.fold(0.0, f32::max) < 1e-4);
    }
}

#[test]
fn strands_lean_the_way_they_are_combed() {
    let directions = |planting: Planting| -> Vec<(Vec3, Vec3)> {
        let planted = planting.plant(&plane(0.2, 0.2)).unwrap();
        let way = |p: &[Vec3]| (p[p.len() - 1] - p[0]).normalize();
        planted.groom.strands().map(|s| (s.points[0], way(s.points))).collect()
    };
    let lean = 0.6_f32;
    let expect = |planting: Planting, comb: &dyn Fn(Vec3) -> Vec3| {
        for (root, way) in directions(planting) {
            let expected = Vec3::Y * lean.cos() + comb(root).normalize() * lean.sin();
            assert!(way.distance(expected) < 1e-3, "{way} at {root}, not {expected}");
        }
    };
    let base = Planting { lean, ..straight(5e3) };
    for (_, way) in directions(base) {
        assert!(way.distance(Vec3::Y) < 1e-4);
    }
    let along = Vec3::new(1.0, 5.0, 1.0);
    expect(Planting { comb: CombPattern::Along(along), ..base }, &|_| Vec3::new(1.0, 0.0, 1.0));
    let center = Vec3::new(0.02, 0.0, 0.01);
    let whorl = |turn| Planting { comb: CombPattern::Whorl { center, turn }, ..base };
    expect(whorl(0.0), &|root| root - center);
    expect(whorl(PI), &|root| center - root);
    expect(whorl(0.5 * PI), &|root| Vec3::Y.cross(root - center));
    let parted = CombPattern::Parted { at: Vec3::ZERO, across: Vec3::X, along: Vec3::Z };
    expect(Planting { comb: parted, ..base }, &|root| Vec3::new(root.x.signum(), 0.0, 1.0));
    // A map goes before the settings.
    let field = |place: &RootPlace| Vec3::new(-place.position.z, 0.0, place.position.x);
    let maps = PlantingMaps::new().direction(&field);
    let mapped = Planting { comb: CombPattern::Along(Vec3::X), ..base }
        .plant_with(&plane(0.2, 0.2), &maps)
        .unwrap();
    for strand in mapped.groom.strands() {
        let (root, way) = (strand.points[0], strand.points[1] - strand.points[0]);
        assert!(way.xz().normalize().distance(Vec2::new(-root.z, root.x).normalize()) < 1e-2);
    }
    // Flat to the scalp and jittered: still out of it.
    let flat =
        Planting { lean: 1.4, jitter: 0.5, comb: CombPattern::Along(Vec3::X), ..straight(5e3) };
    for (_, way) in directions(flat) {
        assert!(way.y > 0.09, "{way}");
    }
}

#[test]
fn jitter_tilts_by_no_more_than_asked() {
    let planted = Planting { jitter: 0.3, ..straight(1e4) }.plant(&plane(0.2, 0.2)).unwrap();
    let tilts: Vec<f32> = (planted.groom.strands())
        .map(|s| (s.points[1] - s.points[0]).angle_between(Vec3::Y))
        .collect();
    let most = tilts.iter().copied().fold(0.0, f32::max);
    assert!((0.27..0.301).contains(&most), "{most}");
}

#[test]
fn tips_of_a_lock_draw_together() {
    let spread = |strength| {
        let clump = Some(Clump { spacing: 0.02, strength });
        let planting = Planting { clump, jitter: 0.1, ..straight(4e4) };
        let planted = planting.plant(&plane(0.1, 0.1)).unwrap();
        let tips: Vec<Vec3> =
            planted.groom.strands().map(|s| s.points[s.points.len() - 1]).collect();
        let nearest = tips.iter().enumerate().map(|(i, a)| {
            let others = tips.iter().enumerate().filter(|(j, _)| *j != i);
            others.map(|(_, b)| a.distance(*b)).fold(f32::MAX, f32::min)
        });
        nearest.sum::<f32>() / tips.len() as f32
    };
    let (loose, tight) = (spread(0.0), spread(0.9));
    assert!(tight < 0.45 * loose, "{tight} of {loose}");
}

#[test]
fn falling_hair_lies_on_the_mesh_and_ends_below() {
    let ball = Sphere::new(0.09).mesh().ico(20).unwrap();
    let upper = |place: &RootPlace| if place.position.y > 0.0 { 1.0 } else { 0.0 };
    let maps = PlantingMaps::new().density(&upper);
    for curl in [None, Some(Curl { radius: 3e-3, pitch: 20e-3, ..default() })] {
        let planting = Planting {
            length: 0.3,
            nodes: 60,
            lean: 1.0,
            comb: CombPattern::Whorl { center: Vec3::Y * 0.09, turn: 0.3 },
            curl,
            drape: Some(Drape::default()),
            ..straight(1e4)
        };
        let planted = planting.plant_with(&ball, &maps).unwrap();
        for strand in planted.groom.strands() {
            let inner = strand.points.iter().map(|p| p.length()).fold(f32::MAX, f32::min);
            assert!(inner > 0.0885, "{inner}");
            let tip = strand.points[59];
            let way = (tip - strand.points[52]).normalize();
            assert!(tip.y < 0.0 && way.y < -0.7, "{tip}");
        }
    }
}

#[test]
fn a_cut_ends_strands_at_its_plane() {
    let wall = plane(0.2, 0.2).transformed_by(Transform::from_rotation(Quat::from_rotation_x(1.2)));
    let cut = Cut { at: Vec3::NEG_Y * 0.15, normal: Vec3::Y, least: 0.03 };
    let planting = Planting {
        length: 0.4,
        nodes: 40,
        drape: Some(Drape::default()),
        cut: Some(cut),
        ..straight(1e4)
    };
    let planted = planting.plant(&wall).unwrap();
    for strand in planted.groom.strands() {
        let tip = strand.points[39];
        assert!((tip.y + 0.15).abs() < 6e-3, "{tip}");
    }
    let above = Cut { at: Vec3::Y, ..cut };
    let planted = Planting { cut: Some(above), ..planting }.plant(&wall).unwrap();
    for strand in planted.groom.strands() {
        let strand = Strand::from_polyline(strand.points).unwrap();
        assert!((strand.length() - 0.03).abs() < 1e-3);
    }
}

#[test]
fn a_length_map_shortens_and_bares() {
    let map = |place: &RootPlace| if place.position.x > 0.0 { 0.5 } else { 0.0 };
    let maps = PlantingMaps::new().length(&map);
    let planted = straight(1e4).plant_with(&plane(0.2, 0.2), &maps).unwrap();
    assert!((planted.groom.len() as f32 - 200.0).abs() < 15.0);
    assert_eq!(planted.groom.len(), planted.roots.len());
    for strand in planted.groom.strands() {
        assert!(strand.points[0].x > 0.0);
        assert!((strand.points[11].y - 0.05).abs() < 1e-4);
    }
}

#[test]
fn lists_strips_and_indices_say_the_same() {
    let corners: Vec<[f32; 3]> =
        vec![[0.0, 0.0, 0.0], [0.0, 0.0, 0.1], [0.1, 0.0, 0.0], [0.1, 0.0, 0.1]];
    let mesh = |topology, positions: Vec<[f32; 3]>| {
        Mesh::new(topology, RenderAssetUsages::default())
            .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, positions)
    };
    let pick = |order: &[usize]| order.iter().map(|i| corners[*i]).collect::<Vec<_>>();
    let list = PrimitiveTopology::TriangleList;
    let strip = PrimitiveTopology::TriangleStrip;
    let meshes = [
        triangles(corners.clone(), vec![0, 1, 2, 2, 1, 3]),
        mesh(list, pick(&[0, 1, 2, 2, 1, 3])),
        mesh(strip, corners.clone()),
        mesh(strip, corners.clone()).with_inserted_indices(Indices::U16(vec![0, 1, 2, 3])),
        // Twice the first triangle's edge, as strips are joined; then restarted.
        mesh(strip, corners.clone()).with_inserted_indices(Indices::U16(vec![0, 0, 0, 1, 2, 3])),
        mesh(strip, corners.clone()).with_inserted_indices(Indices::U16(vec![
            0,
            1,
            2,
            u16::MAX,
            2,
            1,
            3,
        ])),
    ];
    let planted = meshes.map(|m| straight(3e4).plant(&m).unwrap());
    for other in &planted {
        assert_eq!(other.groom.len(), 300);
        // The second triangle's corners may begin elsewhere, so only the side is the same.
        for strand in other.groom.strands() {
            assert!(strand.points[11].y > 0.0999, "{:?}", strand.points);
        }
    }
    assert_eq!(planted[0].groom, planted[1].groom);
    assert_eq!(planted[0].groom, planted[5].groom);
}

#[test]
fn hair_grows_along_smooth_normals_but_never_inward() {
    let coarse = Sphere::new(0.1).mesh().ico(3).unwrap();
    for strand in straight(1e4).plant(&coarse).unwrap().groom.strands() {
        let way = strand.points[1] - strand.points[0];
        assert!(way.angle_between(strand.points[0]) < 0.05);
    }
    let turned = vec![[0.0, -1.0, 0.0]; 4];
    let wrong = plane(0.1, 0.1).with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, turned);
    for strand in straight(1e4).plant(&wrong).unwrap().groom.strands() {
        assert!(strand.points[11].y > 0.09);
    }
}

#[test]
fn what_cannot_be_planted_says_why() {
    let quad = || plane(0.1, 0.1);
    let corners = |count: usize| vec![[0.0, 0.0, 0.0]; count];
    let error = |mesh: &Mesh| straight(1e4).plant(mesh).unwrap_err();
    let lines = Mesh::new(PrimitiveTopology::LineList, RenderAssetUsages::default())
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, corners(4));
    assert_eq!(error(&lines), PlantError::NotTriangles { found: PrimitiveTopology::LineList });
    let empty = Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default());
    assert_eq!(error(&empty), PlantError::NoPositions);
    assert_eq!(error(&triangles(Vec::new(), Vec::new())), PlantError::NoTriangles);
    assert_eq!(error(&triangles(corners(3), vec![0, 1])), PlantError::NoTriangles);
    assert_eq!(
        error(&triangles(corners(3), vec![0, 1, 3])),
        PlantError::Index { found: 3, vertices: 3 }
    );
    assert_eq!(error(&triangles(corners(3), vec![0, 1, 2])), PlantError::NoArea { found: 0.0 });
    let broken = vec![[0.0, 0.0, 0.0], [f32::NAN, 0.0, 0.0], [0.0, 0.0, 1.0]];
    assert_eq!(error(&triangles(broken, vec![0, 1, 2])), PlantError::NonFinite { vertex: 1 });
    let far = quad().translated_by(Vec3::X * 1e4);
    assert!(matches!(error(&far), PlantError::TooFar { found, .. } if found > 9e3));

    let refuse = |planting: Planting| planting.plant(&quad()).unwrap_err();
    let base = straight(1e4);
    assert!(matches!(refuse(straight(1e12)), PlantError::TooMany { found } if found > 9e9));
    assert!(matches!(refuse(straight(1.1e8)), PlantError::TooMany { found } if found > 1e6));
    assert!(matches!(refuse(straight(1.0)), PlantError::NoRoots { .. }));
    let none = |_: &RootPlace| 0.0;
    let bald = base.plant_with(&quad(), &PlantingMaps::new().density(&none)).unwrap_err();
    assert!(matches!(bald, PlantError::NoRoots { .. }));
    let bald = base.plant_with(&quad(), &PlantingMaps::new().length(&none)).unwrap_err();
    assert!(matches!(bald, PlantError::NoRoots { .. }));
    let curl = Some(Curl { radius: 2e-3, pitch: 5e-3, ..default() });
    let coarse = refuse(Planting { curl, ..base });
    assert_eq!(
        coarse.to_string(),
        "Planting::nodes is 12, expected 31 or more: the curl turns 7.4 \
         times and needs 4 nodes a turn"
    );

    let curl = |radius, pitch, variation| {
        Some(Curl { radius, pitch, variation, phase: CurlPhase::Same, ..default() })
    };
    let drape =
        |toward, over, clearance, layering| Some(Drape { toward, over, clearance, layering });
    let down = Vec3::NEG_Y;
    let odd = [
        ("density", Planting { density: f32::NAN, ..base }),
        ("density", Planting { density: 0.0, ..base }),
        ("density", Planting { density: f32::INFINITY, ..base }),
        ("nodes", Planting { nodes: 1, ..base }),
        ("nodes", Planting { nodes: u32::MAX, ..base }),
        ("length", Planting { length: -1.0, ..base }),
        ("length", Planting { length: f32::INFINITY, ..base }),
        ("length_variation", Planting { length_variation: 1.0, ..base }),
        ("lean", Planting { lean: 1.6, ..base }),
        ("jitter", Planting { jitter: -0.1, ..base }),
        ("CombPattern::Along", Planting { comb: CombPattern::Along(Vec3::ZERO), ..base }),
        ("CombPattern::Along", Planting { comb: CombPattern::Along(Vec3::NAN), ..base }),
        ("turn", Planting { comb: CombPattern::Whorl { center: Vec3::Y, turn: f32::NAN }, ..base }),
        (
            "Whorl::center",
            Planting { comb: CombPattern::Whorl { center: Vec3::INFINITY, turn: 0.0 }, ..base },
        ),
        ("radius", Planting { curl: curl(0.0, 0.02, 0.0), ..base }),
        ("pitch", Planting { curl: curl(5e-3, f32::NAN, 0.0), ..base }),
        ("variation", Planting { curl: curl(5e-3, 0.05, 2.0), ..base }),
        ("spacing", Planting { clump: Some(Clump { spacing: 0.0, strength: 0.5 }), ..base }),
        ("strength", Planting { clump: Some(Clump { spacing: 0.1, strength: 1.0 }), ..base }),
        ("Drape::toward", Planting { drape: drape(Vec3::ZERO, 0.1, 0.0, 0.0), ..base }),
        ("over", Planting { drape: drape(down, 0.0, 0.0, 0.0), ..base }),
        ("clearance", Planting { drape: drape(down, 0.1, -1.0, 0.0), ..base }),
        ("layering", Planting { drape: drape(down, 0.1, 0.0, f32::NAN), ..base }),
        ("Cut::normal", Planting { cut: Some(Cut { normal: Vec3::ZERO, ..default() }), ..base }),
        ("least", Planting { cut: Some(Cut { least: 0.0, ..default() }), ..base }),
    ];
    for (what, planting) in odd {
        let error = refuse(planting);
        let text = error.to_string();
        assert!(matches!(error, PlantError::Setting(_)), "{text}");
        assert!(text.contains(what) && text.contains("expected"), "{what}: {text}");
    }
}

#[test]
fn a_mesh_on_the_graphics_device_is_refused() {
    let mut mesh = plane(0.1, 0.1);
    mesh.asset_usage = RenderAssetUsages::RENDER_WORLD;
    let _ = <RenderMesh as RenderAsset>::take_gpu_data(&mut mesh, None);
    assert_eq!(straight(1e4).plant(&mesh).unwrap_err(), PlantError::Extracted);
}

/// Where hair is on a head: on the crown, not in the face nor on the ears, and alike on both sides.
#[test]
fn the_hairline_leaves_face_and_ears_free() {
    let scalp = Scalp::default();
    let at = |right: f32, up: f32, front: f32| {
        let place = Vec3::new(right, up, front);
        let (share, mirrored) =
            (scalp.density(place), scalp.density(place * Vec3::new(-1.0, 1.0, 1.0)));
        assert!((share - mirrored).abs() < 1e-6);
        share
    };
    assert_eq!(at(0.0, 0.1, 0.0), 1.0);
    assert_eq!(at(0.0, 0.0, -0.1), 1.0);
    assert_eq!(at(0.07, 0.06, 0.0), 1.0);
    assert_eq!(at(0.0, 0.05, 0.08), 0.0);
    assert_eq!(at(0.08, 0.01, 0.0), 0.0);
    assert_eq!(at(0.0, -0.08, -0.07), 0.0);
    assert_eq!(at(f32::NAN, 0.0, 0.0), 0.0);
    // Turned with its head.
    let lying = Scalp { up: Dir3::X, front: Dir3::Y, ..scalp };
    assert_eq!(lying.density(Vec3::X), 1.0);
    assert_eq!(lying.density(Vec3::new(0.05, 0.08, 0.0)), 0.0);
    let receded = Scalp { recede: 0.3, ..scalp };
    assert!(
        receded.density(Vec3::new(0.0, 0.08, 0.06)) < scalp.density(Vec3::new(0.0, 0.08, 0.06))
    );
}

/// Guides of a preset on a ball of a head: where each begins and ends, and its length (m).
fn guides_on_a_ball(preset: HairPreset) -> Vec<(Vec3, Vec3, f32)> {
    let head = Sphere::new(0.1).mesh().ico(24).unwrap();
    let planted = preset.plant(&head, &Scalp { height: 0.1, ..default() }).unwrap();
    let of = |points: &[Vec3]| {
        let length = points.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
        (points[0], points[points.len() - 1], length)
    };
    planted.groom.strands().map(|strand| of(strand.points)).collect()
}

#[test]
fn a_beard_grows_on_the_lower_face_only() {
    let guides = guides_on_a_ball(HairPreset::Beard);
    assert!(guides.len() > 60, "{}", guides.len());
    for (root, _, length) in &guides {
        assert!(root.y < 0.035 && root.z > -0.001 && *length < 0.035, "{root} {length}");
        // The lips are free.
        let up = root.y.atan2(root.x.hypot(root.z)).to_degrees();
        assert!((up + 36.5).abs() > 4.0 || root.x.abs() > 0.012, "{root}");
    }
    // Chin, and both cheeks before the ear.
    for place in [Vec3::new(0.0, -0.075, 0.066), Vec3::new(0.082, -0.04, 0.04)] {
        for side in [-1.0, 1.0] {
            let there = place * Vec3::new(side, 1.0, 1.0);
            assert!(guides.iter().any(|(root, ..)| root.distance(there) < 0.02), "{there}");
        }
    }
}

#[test]
fn a_fringe_ends_above_the_brows() {
    let guides = guides_on_a_ball(HairPreset::Fringe);
    let over_forehead = |root: &Vec3| root.z > 0.05 && root.y > 0.07 && root.x.abs() < 0.026;
    let fringe: Vec<_> = guides.iter().filter(|(root, ..)| over_forehead(root)).collect();
    assert!(fringe.len() > 1, "{}", fringe.len());
    for (root, tip, length) in fringe {
        let up = tip.y.atan2(tip.x.hypot(tip.z));
        assert!((0.05..0.5).contains(&up) && tip.z > 0.06, "from {root} to {tip}");
        assert!(*length < 0.16, "{length}");
    }
    // Elsewhere it is chin-long.
    assert!(guides.iter().any(|(.., length)| *length > 0.2));
}

#[test]
fn an_undercut_is_close_at_the_sides_and_long_on_top() {
    for (root, _, length) in guides_on_a_ball(HairPreset::Undercut) {
        if root.y < 0.04 {
            assert!(length < 0.02, "{root} {length}");
        }
        if root.y > 0.07 && root.x > -0.02 && root.z > -0.01 {
            assert!(length > 0.1, "{root} {length}");
        }
        // What hung down behind would cover what is clipped.
        if root.z < -0.06 {
            assert!(length < 0.075, "{root} {length}");
        }
    }
}

/// Locks of guides keep to their side of a parting, and a fringe's strands are no lock with long ones.
#[test]
fn locks_do_not_reach_across_a_parting() {
    for (root, tip, _) in guides_on_a_ball(HairPreset::Straight) {
        if root.z > 0.02 && (0.006..0.05).contains(&root.x.abs()) {
            assert!(root.x * (tip.x - root.x) > 0.0, "from {root} to {tip}");
        }
    }
    for (root, tip, length) in guides_on_a_ball(HairPreset::Fringe) {
        // Nothing long hangs before the face.
        let is_in_the_face = tip.z > 0.09 && tip.x.abs() < 0.04 && tip.y < -0.02;
        assert!(!is_in_the_face, "from {root} to {tip}, {length} m");
    }
}

#[test]
fn presets_are_known_by_their_names() {
    for preset in HairPreset::ALL {
        assert_eq!(HairPreset::named(&preset.name()), Some(preset));
        assert_eq!(HairPreset::ALL.iter().filter(|p| **p == preset).count(), 1);
    }
    assert_eq!(HairPreset::named("Bald"), None);
}

/// Each preset on a ball of a head: no strand is torn, restless or in the head a second after it
/// is let go.
#[test]
fn presets_settle_on_a_head() {
    let head = Sphere::new(0.1).mesh().ico(20).unwrap();
    let scalp = Scalp { height: 0.1, ..default() };
    for preset in HairPreset::ALL {
        let recipe = preset.planting(&scalp);
        let few = Planting { density: 0.12 * recipe.density, ..recipe };
        let planted = preset.plant_as(&few, &head, &scalp).unwrap();
        let mut app = crate::common::test_app(60.0);
        let hair = app.world_mut().spawn((Hair, preset.settings())).id();
        app.world_mut().spawn((HairCollider::sphere(0.0985).unwrap(), Transform::default()));
        for strand in planted.groom.strands() {
            let strand = Strand::from_polyline(strand.points).unwrap();
            app.world_mut().spawn((StrandOf(hair), strand));
        }
        crate::common::run(&mut app, 1.5);
        let world = app.world_mut();
        let mut worst = (0.0f32, 0.0f32, 1.0f32);
        for strand in world.query::<&Strand>().iter(world) {
            worst.0 = worst.0.max(strand.peak_strain());
            worst.1 = worst.1.max(crate::common::rms_speed(strand));
            let heights = strand.positions().iter().map(|p| p.length());
            worst.2 = heights.fold(worst.2, f32::min);
        }
        assert!(worst.0 < 0.02, "{preset:?}: strain {}", worst.0);
        assert!(worst.1 < 0.3, "{preset:?}: {} m/s", worst.1);
        assert!(worst.2 > 0.0975, "{preset:?}: {} m from the centre", worst.2);
    }
}

fn coordinate() -> impl Strategy<Value = f32> {
    prop_oneof![
        8 => -0.2f32..0.2,
        2 => Just(0.0),
        1 => -50.0f32..50.0,
        1 => prop::sample::select(vec![f32::NAN, f32::INFINITY, 1e30, -1e38, 1e-30]),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// Whatever the mesh: a groom whose strands can be simulated and whose roots keep apart, or a
    /// reason.
    #[test]
    fn no_mesh_panics(
        positions in prop::collection::vec([coordinate(), coordinate(), coordinate()], 0..12),
        indices in prop::collection::vec(0u32..12, 0..30),
        is_strip in any::<bool>(),
        normals in prop::option::of([coordinate(), coordinate(), coordinate()]),
        nodes in 2u32..40,
        curls in any::<bool>(),
        falls in any::<bool>(),
        seed in any::<u64>(),
    ) {
        let topology = match is_strip {
            true => PrimitiveTopology::TriangleStrip,
            false => PrimitiveTopology::TriangleList,
        };
        let mut mesh = Mesh::new(topology, RenderAssetUsages::default());
        if let Some(normal) = normals {
            mesh.insert_attribute(Mesh::ATTRIBUTE_NORMAL, vec![normal; positions.len()]);
        }
        mesh.insert_attribute(Mesh::ATTRIBUTE_POSITION, positions);
        if !indices.is_empty() {
            mesh.insert_indices(Indices::U32(indices));
        }
        let planting = Planting {
            density: 300.0,
            seed,
            nodes,
            curl: curls.then_some(Curl { radius: 4e-3, pitch: 0.1, ..default() }),
            clump: curls.then_some(Clump::default()),
            drape: falls.then_some(Drape::default()),
            ..default()
        };
        // What a mesh of 50 m would carry is not the point.
        let near = |place: &RootPlace| if place.position.length() < 1.0 { 1.0 } else { 0.001 };
        if let Ok(planted) = planting.plant_with(&mesh, &PlantingMaps::new().density(&near)) {
            prop_assert_eq!(planted.groom.len(), planted.roots.len());
            for strand in planted.groom.strands() {
                prop_assert_eq!(strand.points.len(), nodes as usize);
                let made = Strand::from_polyline(strand.points);
                prop_assert!(made.is_ok(), "{:?}: {:?}", made.err(), strand.points);
            }
            let mut places = roots(&planted);
            places.truncate(500);
            prop_assert!(nearest_pair(&places) >= 0.5 * 300f32.sqrt().recip());
        }
    }
}

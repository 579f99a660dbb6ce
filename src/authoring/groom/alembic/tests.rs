//! Archives written here: transforms, types, attributes, and everything that can be wrong.

use super::{
    super::{
        GroomCache, GroomError, GroomFormat, GroomGroup, GroomSettings, GroomStrand, UpAxis,
        curve_sets::{
            BYTES_PER_NODE, COLOR, DAMPING, GROUP, GROUP_NAME, GUIDE, ROOT_UV, STIFFNESS, WIDTH,
        },
    },
    write::{Archive, Pod, Written, floats},
    *,
};

const CURVES: &str = "schema=AbcGeom_Curve_v2";
const XFORM: &str = "schema=AbcGeom_Xform_v3";

/// A set of two curves of as many points, along Y from x = 0 and x = 1.
fn points(each: usize) -> Vec<f32> {
    (0..2).flat_map(|x| (0..each).flat_map(move |y| [x as f32, y as f32, 0.0])).collect()
}

fn ints(numbers: &[i32]) -> Vec<u8> {
    numbers.iter().flat_map(|n| n.to_le_bytes()).collect()
}

fn doubles(numbers: &[f64]) -> Vec<u8> {
    numbers.iter().flat_map(|n| n.to_le_bytes()).collect()
}

/// The properties that a set needs.
fn needed(archive: &mut Archive, each: usize, kind: [u8; 3]) -> Vec<Written> {
    let counts = ints(&[each as i32; 2]);
    vec![
        archive.array("P", "", (Pod::F32, 3), &[&floats(points(each))]),
        archive.array("nVertices", "", (Pod::I32, 1), &[&counts]),
        archive.scalar("curveBasisAndType", "", (Pod::U8, 4), &[&kind[..], &kind[2..]].concat()),
    ]
}

fn set(archive: &mut Archive, name: &str, properties: Vec<Written>) -> Written {
    let properties = vec![archive.compound(".geom", CURVES, properties)];
    archive.object(name, CURVES, properties, Vec::new())
}

/// An archive of one set with these properties besides those that it needs.
fn one(
    each: usize,
    kind: [u8; 3],
    more: impl FnOnce(&mut Archive) -> (Vec<Written>, Vec<Written>),
) -> Vec<u8> {
    let mut archive = Archive::new();
    let mut properties = needed(&mut archive, each, kind);
    let (own, attributes) = more(&mut archive);
    properties.extend(own);
    properties.push(archive.compound(".arbGeomParams", "", attributes));
    let set = set(&mut archive, "hair", properties);
    archive.finished(vec![set])
}

fn plain(each: usize, kind: [u8; 3]) -> Vec<u8> {
    one(each, kind, |_| default())
}

fn transform(
    archive: &mut Archive,
    (ops, vals, inherits): (&[u8], &[f64], bool),
    more: Vec<Written>,
    children: Vec<Written>,
) -> Written {
    let properties = vec![
        archive.scalar(".inherits", "", (Pod::U8, 1), &[u8::from(inherits)]),
        archive.scalar(".ops", "", (Pod::U8, ops.len() as u32), ops),
        archive.scalar(".vals", "", (Pod::F64, vals.len() as u32), &doubles(vals)),
    ];
    let mut properties = vec![archive.compound(".xform", XFORM, properties)];
    properties.extend(more);
    archive.object("place", XFORM, properties, children)
}

fn lines(file: &[u8]) -> Vec<Vec<Vec3>> {
    let (groom, _) = read(file).unwrap_or_else(|error| panic!("{error}"));
    groom.strands().map(|s| s.points.to_vec()).collect()
}

fn error(file: &[u8]) -> String {
    read(file).unwrap_err().to_string()
}

#[test]
fn types_that_pass_through_their_points_are_joined() {
    for kind in [[1, 0, 0], [1, 0, 3], [1, 0, 2], [0, 0, 3], [0, 0, 0]] {
        let lines = lines(&plain(5, kind));
        let expected: Vec<Vec3> = (0..5).map(|y| Vec3::new(1.0, y as f32, 0.0)).collect();
        assert_eq!((lines.len(), &lines[1]), (2, &expected), "{kind:?}");
    }
    let (groom, losses) = read(&plain(5, [1, 1, 0])).unwrap();
    assert_eq!((groom.len(), losses.opened_loops.count), (2, 2));
}

#[test]
fn bezier_b_splines_and_nurbs_are_sampled_from_end_to_end() {
    // The points of a set lie on straight lines, and so do all of its nodes.
    for (kind, each, nodes) in
        [([0, 0, 1], 7, 7), ([0, 0, 1], 6, 4), ([0, 0, 2], 6, 6), ([2, 0, 0], 6, 6)]
    {
        let lines = lines(&plain(each, kind));
        assert_eq!(lines[1].len(), nodes, "{kind:?}");
        assert!(lines[1].iter().all(|p| p.x == 1.0 && p.z == 0.0));
        assert!(lines[1].windows(2).all(|p| p[1].y > p[0].y));
        assert_eq!((lines[1][0].y, lines[1][nodes - 1].y), (0.0, (nodes - 1) as f32));
    }
    let nurbs = |orders: &[u8], knots: &[f32]| {
        one(3, [2, 0, 0], |archive| {
            let orders = archive.array(".orders", "", (Pod::U8, 1), &[orders]);
            let knots = archive.array(".knots", "", (Pod::F32, 1), &[&floats(knots.to_vec())]);
            let weights = archive.array("w", "", (Pod::F32, 1), &[&floats([1.0; 6])]);
            (vec![orders, knots, weights], Vec::new())
        })
    };
    // Unclamped knots: the middle half of the curve.
    let open = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0].repeat(2);
    assert_eq!(
        lines(&nurbs(&[3, 3], &open))[0].iter().map(|p| p.y).collect::<Vec<_>>(),
        [0.5, 1.0, 1.5]
    );
    for wrong in [&[5.0, 4.0, 3.0, 2.0, 1.0, 0.0][..], &[f32::NAN; 12], &[1.0; 12]] {
        let (groom, losses) = read(&nurbs(&[3, 3], wrong)).unwrap();
        assert_eq!((groom.len(), losses.broken_arrays.count), (2, 1), "{losses}");
        assert_eq!(groom.points()[2].y, 2.0);
    }
    for kind in [[0, 0, 4], [0, 0, 5], [7, 0, 0]] {
        let error = error(&plain(4, kind));
        assert!(
            error.starts_with("byte ")
                && error.contains("in /hair")
                && error.contains("Catmull-Rom"),
            "{error}"
        );
    }
}

#[test]
fn transforms_are_applied_outermost_first_and_scale_widths() {
    let placed = |ops: &[u8], vals: &[f64], inherits| {
        let mut archive = Archive::new();
        let mut properties = needed(&mut archive, 2, [1, 0, 0]);
        properties.push(archive.attribute(("width", "con"), (Pod::F32, 1), &floats([0.5])));
        let hair = set(&mut archive, "hair", properties);
        let inner = transform(&mut archive, (ops, vals, inherits), Vec::new(), vec![hair]);
        // Moved by 10 along X.
        let outer =
            transform(&mut archive, (&[1 << 4], &[10.0, 0.0, 0.0], true), Vec::new(), vec![inner]);
        let groom = read(&archive.finished(vec![outer])).unwrap().0;
        (groom.points()[1], groom.points()[2], groom.strand(0).unwrap().widths.unwrap()[0])
    };
    let near = |(p, q, width): (Vec3, Vec3, f32), up: [f32; 3], beside: [f32; 3], expected: f32| {
        let (up, beside) = (Vec3::from(up), Vec3::from(beside));
        assert!(p.distance(up) < 1e-6 && q.distance(beside) < 1e-6, "{p} and {q}");
        assert!((width - expected).abs() < 1e-6, "{width}");
    };
    near(placed(&[], &[], true), [10.0, 1.0, 0.0], [11.0, 0.0, 0.0], 0.5);
    near(placed(&[], &[], false), [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], 0.5);
    near(placed(&[0], &[2.0, 2.0, 2.0], true), [10.0, 2.0, 0.0], [12.0, 0.0, 0.0], 1.0);
    // Turned about Z, then moved.
    let ops = [1 << 4, 6 << 4];
    near(placed(&ops, &[0.0, 5.0, 0.0, 90.0], true), [9.0, 5.0, 0.0], [10.0, 6.0, 0.0], 0.5);
    let ops = [2 << 4, 4 << 4, 5 << 4];
    near(
        placed(&ops, &[0.0, 0.0, 2.0, 90.0, 90.0, 0.0], true),
        [10.0, 0.0, 1.0],
        [10.0, 1.0, 0.0],
        0.5,
    );
    // Row vectors: X becomes Y, and moved.
    let matrix = [0.0, 1.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 7.0, 1.0];
    near(placed(&[3 << 4], &matrix, true), [9.0, 0.0, 7.0], [10.0, 1.0, 7.0], 0.5);
    let mut archive = Archive::new();
    let broken = transform(&mut archive, (&[3 << 4], &[1.0], true), Vec::new(), Vec::new());
    let error = error(&archive.finished(vec![broken]));
    assert!(error.contains("transform's numbers is 1, expected 16 or more"), "{error}");
}

#[test]
fn several_sets_are_joined_and_others_counted() {
    let mut archive = Archive::new();
    let bare = needed(&mut archive, 3, [1, 0, 0]);
    let bare = set(&mut archive, "bare", bare);
    let mut full = needed(&mut archive, 3, [1, 0, 0]);
    full.push(archive.attribute(("width", "uni"), (Pod::F32, 1), &floats([0.25, 0.75])));
    let guides = [1i16, 0].map(i16::to_le_bytes).concat();
    let attributes = vec![
        archive.attribute((GUIDE, "uni"), (Pod::I16, 1), &guides),
        archive.attribute((COLOR, "con"), (Pod::F32, 3), &floats([0.5, 0.25, 0.0])),
        archive.attribute((ROOT_UV, "uni"), (Pod::F32, 2), &floats([0.1, 0.2, 0.3, 0.4])),
        archive.attribute((GROUP, "con"), (Pod::I32, 1), &ints(&[3])),
        archive.attribute((STIFFNESS, "uni"), (Pod::F32, 1), &floats([0.5, 2.0])),
        archive.attribute(("groom_closest_guides", "uni"), (Pod::I32, 1), &ints(&[0, 0])),
    ];
    full.push(archive.compound(".arbGeomParams", "", attributes));
    let full = set(&mut archive, "full", full);
    let empty = vec![archive.array("nVertices", "", (Pod::I32, 1), &[])];
    let empty = set(&mut archive, "empty", empty);
    let hidden = needed(&mut archive, 3, [1, 0, 0]);
    let hidden = set(&mut archive, "hidden", hidden);
    let visible = vec![archive.scalar("visible", "", (Pod::U8, 1), &[0])];
    let place = transform(&mut archive, (&[], &[], true), visible, vec![hidden]);
    let mesh = archive.object("head", "schema=AbcGeom_PolyMesh_v1", Vec::new(), Vec::new());
    let copy =
        archive.object("copy", "isInstance=1;schema=AbcGeom_Curve_v2", Vec::new(), Vec::new());
    let file = archive.finished(vec![bare, full, empty, place, mesh, copy]);
    let (groom, losses) = read(&file).unwrap();
    assert_eq!((groom.len(), groom.points().len()), (4, 12));
    assert_eq!(
        groom.strands().map(|s| s.is_guide).collect::<Vec<_>>(),
        [false, false, true, false]
    );
    // The first set has the mean of the second.
    let widths: Vec<f32> = groom.strands().map(|s| s.widths.unwrap()[0]).collect();
    assert_eq!(widths, [0.5, 0.5, 0.25, 0.75]);
    let colors: Vec<LinearRgba> = groom.strands().map(|s| s.colors.unwrap()[2]).collect();
    assert_eq!(colors, [LinearRgba::rgb(0.5, 0.25, 0.0); 4]);
    assert_eq!(groom.strand(3).unwrap().uv, Some(Vec2::new(0.3, 1.0 - 0.4)));
    assert_eq!(groom.strand(0).unwrap().uv, Some(Vec2::ZERO));
    let part = |part: &str| [GroomPlace::Part(part.to_owned())];
    assert_eq!(losses.hidden_curves.places, part("/place/hidden"));
    assert_eq!(losses.empty_curves.places, part("/empty"));
    assert_eq!(losses.unread_arrays.places, part("/full.groom_closest_guides"));
    let groups: Vec<_> = groom.strands().map(|s| s.group.map(|of| (of.id, &*of.path))).collect();
    assert_eq!(groups[..2], [Some((0, "/bare")); 2]);
    assert_eq!(groups[2..], [Some((3, "/full")); 2]);
    let shares: Vec<f32> = groom.strands().map(|s| s.stiffness.unwrap()).collect();
    assert_eq!(shares, [1.0, 1.0, 0.5, 2.0], "strands without are as stiff as the hair");
    assert_eq!(losses.skipped_primitives.count, 2, "{losses}");
    assert!(!losses.is_broken());
    // The marked strand is the guide.
    assert_eq!(groom.guides(9), [2]);
    assert_eq!(groom.thinned(2).unwrap().guides(9), [1]);
}

#[test]
fn optional_numbers_are_recognised_by_their_count() {
    let widths = |values: Vec<f32>, indices: Option<&[i32]>| {
        one(4, [0, 0, 1], |archive| {
            let values = floats(values);
            let width = match indices {
                None => archive.attribute((WIDTH, "con"), (Pod::F32, 1), &values),
                Some(indices) => {
                    let values = archive.array(".vals", "", (Pod::F32, 1), &[&values]);
                    let indices = archive.array(".indices", "", (Pod::I32, 1), &[&ints(indices)]);
                    archive.compound(WIDTH, "", vec![values, indices])
                }
            };
            // The first wins.
            let other = archive.attribute(("width", "con"), (Pod::F32, 1), &floats([9.0]));
            (vec![other], vec![width])
        })
    };
    let read_widths = |file: &[u8]| read(file).unwrap().0.widths.to_vec();
    assert_eq!(read_widths(&widths(vec![0.5], None)), [0.5; 8]);
    assert_eq!(read_widths(&widths(vec![1.0, 2.0], None)), [1., 1., 1., 1., 2., 2., 2., 2.]);
    let each: Vec<f32> = (0..8).map(|i| i as f32).collect();
    assert_eq!(read_widths(&widths(each.clone(), None)), each);
    // One at an anchor, blended between.
    assert_eq!(
        read_widths(&widths(vec![0.0, 3.0, 6.0, 9.0], None)),
        [0., 1., 2., 3., 6., 7., 8., 9.]
    );
    assert_eq!(
        read_widths(&widths(vec![5.0, 7.0], Some(&[1, 0]))),
        [7., 7., 7., 7., 5., 5., 5., 5.]
    );
    for broken in [widths(vec![1.0; 3], None), widths(vec![1.0; 2], Some(&[0, 2]))] {
        let (groom, losses) = read(&broken).unwrap();
        assert!(groom.widths.is_empty() && losses.broken_arrays.count == 1, "{losses}");
        assert!(losses.to_string().contains("/hair.groom_width: "), "{losses}");
        assert!(losses.is_broken());
    }
}

#[test]
fn a_groom_has_the_first_sample_and_a_cache_all() {
    let file = moving(&[0.5, 0.75, 1.5]);
    let (groom, losses) = read(&file).unwrap();
    assert_eq!((groom.points()[0], losses.unread_samples.count), (Vec3::ZERO, 2));
    let (cache, losses) = GroomCache::from_file(&file, &GroomSettings::default()).unwrap();
    assert!(losses.is_empty(), "{losses}");
    assert_eq!((cache.groom(), cache.times()), (&groom, &[0.0, 0.25, 1.0][..]));
    for (frame, x) in [0.0, 1.0, 3.0].into_iter().enumerate() {
        let expected: Vec<Vec3> =
            groom.points().iter().map(|p| *p + Vec3::new(x, 2.0 * x, 0.0)).collect();
        assert_eq!(cache.frame(frame), expected, "{frame}");
    }
    // In the same unit and axes, thinned alike, with as many nodes each.
    let settings = GroomSettings {
        scale: Some(0.01),
        up: Some(UpAxis::Z),
        keep_every: 2,
        nodes: Some(5),
        ..default()
    };
    let (cache, losses) = GroomCache::from_file(&file, &settings).unwrap();
    assert_eq!((cache.groom().len(), losses.thinned_strands.count), (1, 1));
    let last = cache.frame(2);
    assert!(last.len() == 5 && last[0].distance(Vec3::new(0.03, 0.0, -0.06)) < 1e-7, "{last:?}");
    assert!(last[4].distance(Vec3::new(0.03, 0.0, -0.08)) < 1e-7, "{last:?}");
    // Evenly apart, as most exporters have them: the length of a cycle, and when in it a sample is.
    let mut even = file.clone();
    let acyclic = (f64::MAX / 32.0).to_le_bytes();
    let at = even.windows(8).position(|bytes| bytes == acyclic).unwrap();
    even[at..at + 8].copy_from_slice(&0.04_f64.to_le_bytes());
    even[at + 8..at + 12].copy_from_slice(&1u32.to_le_bytes());
    let (cache, _) = GroomCache::from_file(&even, &GroomSettings::default()).unwrap();
    let times = cache.times();
    assert!((times[1] - 0.04).abs() < 1e-7 && (times[2] - 0.08).abs() < 1e-7, "{times:?}");
}

/// Two curves that move along X by P, to 0, 1 and 3, and by the transform above them along Y by twice that.
fn moving(times: &[f32; 3]) -> Vec<u8> {
    let mut archive = Archive::animated(times);
    let mut properties = needed(&mut archive, 3, [1, 0, 0]);
    let ways = [0.0, 1.0, 3.0_f32];
    let along = |x: f32| {
        floats(points(3).into_iter().enumerate().map(|(i, n)| if i % 3 == 0 { n + x } else { n }))
    };
    let samples = ways.map(along);
    properties[0] = archive.array("P", "", (Pod::F32, 3), &samples.each_ref().map(Vec::as_slice));
    let hair = set(&mut archive, "hair", properties);
    let up = ways.map(|x| doubles(&[0.0, f64::from(2.0 * x), 0.0]));
    let properties = vec![
        archive.scalar(".ops", "", (Pod::U8, 1), &[1 << 4]),
        archive.scalars(".vals", "", (Pod::F64, 3), &up.each_ref().map(Vec::as_slice)),
    ];
    let properties = vec![archive.compound(".xform", XFORM, properties)];
    let place = archive.object("place", XFORM, properties, vec![hair]);
    archive.finished(vec![place])
}

#[test]
fn frames_that_cannot_be_played_are_errors_that_name_them() {
    let of = |samples: &[&[f32]], times: &[f32]| {
        let mut archive = Archive::animated(times);
        let mut properties = needed(&mut archive, 3, [1, 0, 0]);
        let samples: Vec<Vec<u8>> = samples.iter().map(|s| floats(s.iter().copied())).collect();
        let samples: Vec<&[u8]> = samples.iter().map(Vec::as_slice).collect();
        properties[0] = archive.array("P", "", (Pod::F32, 3), &samples);
        let set = set(&mut archive, "hair", properties);
        let file = archive.finished(vec![set]);
        GroomCache::from_file(&file, &GroomSettings::default()).unwrap_err().to_string()
    };
    let good = points(3);
    let says = of(&[&good, &good[3..]], &[0.0, 1.0]);
    assert!(says.contains("5 in /hair, expected 6"), "{says}");
    let mut broken = good.clone();
    broken[4] = f32::NAN;
    let says = of(&[&good, &broken], &[0.0, 1.0]);
    assert!(says.contains("node 1 of frame 1 is not finite"), "{says}");
    let says = of(&[&good, &good], &[1.0, 1.0]);
    assert!(says.contains("frame 1 is at 0 s, expected a finite time after 0 s"), "{says}");
}

#[test]
fn changed_bytes_of_what_moves_do_no_harm() {
    let (mut state, mut read_all) = (1u64, 0);
    let mut random = |below: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (state >> 33) as usize % below
    };
    let whole = moving(&[0.0, 0.1, 0.2]);
    for end in 6..whole.len() {
        let read = GroomCache::from_file(&whole[..end], &GroomSettings::default());
        assert!(read.unwrap_err().to_string().starts_with("byte "), "{end}");
    }
    for _ in 0..3000 {
        let mut file = whole.clone();
        for _ in 0..=random(4) {
            let at = random(file.len());
            file[at] = random(256) as u8;
        }
        if let Ok((cache, _)) = GroomCache::from_file(&file, &GroomSettings::default()) {
            read_all += 1;
            assert!(cache.len() * cache.groom().points().len() * 12 <= 16 * file.len() + (1 << 20));
        }
    }
    assert!(read_all > 300, "{read_all}");
}

#[test]
fn what_contradicts_itself_is_an_error_that_says_where() {
    let mut archive = Archive::new();
    let mut properties = needed(&mut archive, 3, [1, 0, 0]);
    properties[1] = archive.array("nVertices", "", (Pod::I32, 1), &[&ints(&[3, 4])]);
    let wrong = set(&mut archive, "hair", properties);
    let says = error(&archive.finished(vec![wrong]));
    assert!(says.starts_with("byte ") && says.contains("6 in /hair, expected 7"), "{says}");
    let mut unfinished = plain(3, [1, 0, 0]);
    unfinished[5] = 0;
    assert!(error(&unfinished).contains("did not finish"));
    let nothing = error(&Archive::new().finished(Vec::new()));
    assert!(nothing.contains("without curves (nothing left out)"), "{nothing}");
}

#[test]
fn archives_that_contain_themselves_and_copies_without_end_are_refused() {
    let file = plain(3, [1, 0, 0]);
    let top = u64::from_le_bytes(*file.last_chunk::<32>().unwrap().first_chunk().unwrap());
    // A child of the top becomes the top itself.
    let mut loops = file.clone();
    let at = top as usize + 8 + 8;
    loops[at..at + 8].copy_from_slice(&top.to_le_bytes());
    let says = error(&loops);
    assert!(says.starts_with("byte ") && says.contains("expected"), "{says}");
    let mut archive = Archive::new();
    let mut properties = needed(&mut archive, 64, [1, 0, 0]);
    properties.truncate(3);
    let set = archive.compound(".geom", CURVES, properties);
    let copies = (0..100).map(|_| {
        let same = set.clone();
        archive.object("copy", CURVES, vec![same], Vec::new())
    });
    let copies = copies.collect();
    let says = error(&archive.finished(copies));
    assert!(says.contains("as the file's size justifies"), "{says}");
}

fn group(id: i32, name: &str) -> GroomGroup {
    GroomGroup { id, name: name.to_owned(), path: "/groom/strands".to_owned() }
}

fn whole() -> Groom {
    let strands = (0..7).map(|i| {
        (0..2 + i).map(move |k| Vec3::new(i as f32 * 0.01, k as f32 * 0.02, (i * k) as f32 * 1e-3))
    });
    let groom = Groom::from_polylines(strands).unwrap();
    let nodes = groom.points().len();
    let color = |i: usize| LinearRgba::rgb(i as f32 / 50.0, 0.5, 0.25);
    groom
        .with_widths((0..nodes).map(|i| i as f32 * 1e-6).collect())
        .and_then(|g| g.with_colors((0..nodes).map(color).collect()))
        .and_then(|g| {
            g.with_uvs((0..7).map(|i| Vec2::new(i as f32 / 7.0, i as f32 / 8.0)).collect())
        })
        .and_then(|g| g.with_guides((0..7).map(|i| i % 3 == 0).collect()))
        .and_then(|g| g.with_stiffness((0..7).map(|i| 0.5 + i as f32).collect()))
        .and_then(|g| g.with_damping((0..7).map(|i| 0.25 * i as f32).collect()))
        .and_then(|g| {
            g.with_groups(vec![group(2, "fringe"), group(-1, "")], vec![0, 0, 1, 0, 1, 1, 0])
        })
        .unwrap()
}

#[test]
fn what_is_written_is_read_again() {
    let groom = whole();
    let file = write(&groom).unwrap();
    assert_eq!(GroomFormat::of(&file), Ok(GroomFormat::Alembic));
    let (again, losses) = read(&file).unwrap();
    assert_eq!((&again, losses.is_empty()), (&groom, true), "{losses}");
    assert_eq!(write(&again).unwrap(), file);
    let (again, losses) = Groom::from_file(&file, &GroomSettings::default()).unwrap();
    assert!(again == groom && losses.is_empty(), "{losses}");
    let bare = Groom::from_polylines([[Vec3::ZERO, Vec3::Y]]).unwrap();
    assert_eq!(read(&write(&bare).unwrap()).unwrap().0, bare);
    assert_eq!(write(&Groom::default()), Err(GroomError::Empty));
}

#[test]
fn every_truncation_is_an_error_that_says_where() {
    let file = write(&whole()).unwrap();
    for end in 6..file.len() {
        let error = error(&file[..end]);
        assert!(error.starts_with("byte ") && error.contains("expected"), "{end}: {error}");
    }
}

#[test]
fn changed_bytes_do_no_harm() {
    let mut state = 1u64;
    let mut random = |below: usize| {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below
    };
    let files = [write(&whole()).unwrap(), plain(6, [0, 0, 2]), plain(7, [0, 0, 1])];
    let mut read_all = 0;
    for round in 0..3000 {
        let mut file = files[round % 3].clone();
        for _ in 0..=random(6) {
            let at = random(file.len());
            file[at] = random(256) as u8;
        }
        if let Ok((groom, _)) = read(&file) {
            read_all += 1;
            assert!(groom.points().len() <= file.len() / BYTES_PER_NODE);
            assert!(groom.points().iter().all(|p| p.is_finite()));
        }
    }
    assert!(read_all > 500, "{read_all}");
}

#[test]
fn groups_have_the_names_and_numbers_of_the_file() {
    let named = |attributes: fn(&mut Archive) -> Vec<Written>| {
        let file = one(4, [1, 0, 0], |archive| (Vec::new(), attributes(archive)));
        let (groom, losses) = read(&file).unwrap();
        assert!(losses.is_empty(), "{losses}");
        let of = |strand: GroomStrand| strand.group.map(|of| (of.id, of.name.clone()));
        (groom.groups().len(), groom.strands().map(of).collect::<Vec<_>>())
    };
    assert_eq!(named(|_| Vec::new()), (0, vec![None, None]), "one set without any is no group");
    let one_name =
        named(|archive| vec![archive.attribute((GROUP_NAME, "con"), (Pod::Text, 1), b"beard\0")]);
    assert_eq!(one_name, (1, vec![Some((0, "beard".to_owned())); 2]));
    let each = named(|archive| {
        let names = archive.attribute((GROUP_NAME, "uni"), (Pod::Text, 1), b"left\0right\0");
        let ids = archive.attribute((GROUP, "uni"), (Pod::I32, 1), &ints(&[7, -2]));
        vec![names, ids]
    });
    let expected = vec![Some((7, "left".to_owned())), Some((-2, "right".to_owned()))];
    assert_eq!(each, (2, expected));
    let ids = named(|archive| vec![archive.attribute((GROUP, "con"), (Pod::I32, 1), &ints(&[5]))]);
    assert_eq!(ids, (1, vec![Some((5, "hair".to_owned())); 2]), "named as its curves are");

    // They stay with their strands.
    let whole = whole();
    let picked = whole.picked([6, 2, 0]);
    let name = |strand: GroomStrand| strand.group.unwrap().name.clone();
    assert_eq!(picked.strands().map(name).collect::<Vec<_>>(), ["fringe", "", "fringe"]);
    let shares: Vec<f32> = picked.strands().map(|s| s.stiffness.unwrap()).collect();
    assert_eq!(shares, [6.5, 2.5, 0.5]);
    let head =
        |path: &str| GroomGroup { path: path.to_owned(), ..group(0, "") }.head().map(str::to_owned);
    assert_eq!(head("/groom/Head/Hair/Hair"), Some("Head".to_owned()));
    assert_eq!((head("/groom/Hair/Hair"), head("/hair"), head("")), (None, None, None));
}

#[test]
fn halves_are_read() {
    let file = one(4, [1, 0, 0], |archive| {
        let halves = [0.5, 2.0].map(|share| half::f16::from_f32(share).to_le_bytes()).concat();
        (Vec::new(), vec![archive.attribute((DAMPING, "uni"), (Pod::F16, 1), &halves)])
    });
    let (groom, losses) = read(&file).unwrap();
    assert!(losses.is_empty(), "{losses}");
    let shares: Vec<f32> = groom.strands().filter_map(|strand| strand.damping).collect();
    assert_eq!(shares, [0.5, 2.0]);
}

#[test]
fn broken_stiffness_is_left_out_as_other_numbers_are() {
    let with = |shares: [f32; 2]| {
        one(4, [1, 0, 0], |archive| {
            let shares = archive.attribute((STIFFNESS, "uni"), (Pod::F32, 1), &floats(shares));
            (Vec::new(), vec![shares])
        })
    };
    let (groom, losses) = read(&with([2.0, -1.0])).unwrap();
    assert_eq!((groom.len(), losses.broken_strands.count), (1, 1), "{losses}");
    let (groom, losses) = read(&with([0.0, f32::NAN])).unwrap();
    assert!(groom.len() == 2 && losses.broken_arrays.count == 1, "{losses}");
    assert!(groom.strands().all(|strand| strand.stiffness.is_none()));
}

//! Hairdos in a real app: taken, saved, loaded, put on, carried over, blended; and files that are no
//! hairdos.
#![cfg(feature = "save")]

use crate::common::*;
use crate::wardrobe::{Hairdos, Order, WardrobePlugin};
/// What the salon's wardrobe takes from the scenes.
use bevy::prelude::*;
use bevy_keratin::{
    FaultKind, hair::strand::StrandHistory, hairdo::save::NEWEST_FORMAT,
    keratin::treatment::Treatments, prelude::*,
};
use core::f32::consts::PI;
use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};

/// A hair of `strands` curls of `nodes` nodes each, far enough apart to leave each other alone.
fn curls(app: &mut App, strands: usize, nodes: usize) -> Entity {
    let hair = app.world_mut().spawn(Hair).id();
    for s in 0..strands {
        let root = Vec3::new(0.2 * s as f32, 1.0, 0.0);
        app.world_mut().spawn((StrandOf(hair), curl(root, nodes, 0.02, 1.5 * PI)));
    }
    hair
}

/// A helix of 24 cm or so that turns by `angle`.
fn curl(root: Vec3, nodes: usize, radius: f32, angle: f32) -> Strand {
    let points: Vec<Vec3> = (0..nodes)
        .map(|i| i as f32 / (nodes - 1) as f32)
        .map(|t| {
            let (sine, cosine) = (angle * t).sin_cos();
            root + Vec3::new(radius * (cosine - 1.0), -0.03 * t, radius * sine)
        })
        .collect();
    Strand::from_polyline(&points).unwrap()
}

/// A head that has been through something: part permed, part wet, still swinging.
fn treated(strands: usize, nodes: usize) -> (App, Entity) {
    let mut app = test_app(60.0);
    let hair = curls(&mut app, strands, nodes);
    run(&mut app, 0.2);
    let first = members(&app, hair)[0];
    app.world_mut().write_message(HairTreatment::lotion(first).joints(1..3));
    app.world_mut().write_message(HairTreatment::wet(hair).joints(0..2));
    run(&mut app, 0.1);
    app.world_mut().write_message(HairTreatment::neutraliser(first).over(0.05));
    app.world_mut().write_message(SoakHair { target: first, wetness: 0.6 });
    run(&mut app, 0.2);
    app.world_mut().entity_mut(hair).insert(Cuticle { damage: 0.7, softening: 0.5 });
    (app, hair)
}

fn members(app: &App, hair: Entity) -> Vec<Entity> {
    app.world().get::<Strands>(hair).unwrap().iter().collect()
}

fn of(app: &App, hair: Entity) -> Hairdo {
    Hairdo::of(app.world(), hair).unwrap()
}

fn apply(app: &mut App, hair: Entity, hairdo: &Hairdo) {
    hairdo.apply(app.world_mut(), hair).unwrap();
}

/// Every bit of a hair's state.
fn bits(app: &App, hair: Entity) -> (Vec<u8>, Vec<[u32; 3]>, WaterLedger) {
    let velocities = members(app, hair).into_iter().flat_map(|member| {
        let strand = strand(app, member);
        strand.velocities().iter().chain(strand.angular_velocities()).copied().collect::<Vec<_>>()
    });
    let velocities = velocities.map(|v| v.to_array().map(f32::to_bits)).collect();
    (of(app, hair).to_bytes(), velocities, *app.world().resource::<WaterLedger>())
}

#[test]
fn saved_loaded_and_saved_is_byte_equal() {
    let (mut app, hair) = treated(3, 9);
    let hairdo = of(&app, hair);
    assert!(hairdo.water() > 0.0 && hairdo.cuticle().is_some());
    let bytes = hairdo.to_bytes();
    let read = Hairdo::from_bytes(&bytes).unwrap();
    assert_eq!(read, hairdo);
    assert_eq!(read.to_bytes(), bytes);

    run(&mut app, 1.0);
    app.world_mut().entity_mut(hair).remove::<Cuticle>();
    assert_ne!(of(&app, hair).to_bytes(), bytes, "it moved on");
    apply(&mut app, hair, &read);
    assert_eq!(of(&app, hair).to_bytes(), bytes);
    for member in members(&app, hair) {
        let (strand, history) =
            (strand(&app, member), app.world().get::<StrandHistory>(member).unwrap());
        assert!(strand.velocities().iter().all(|v| *v == Vec3::ZERO));
        assert!(strand.angular_velocities().iter().all(|v| *v == Vec3::ZERO));
        for overstep in [0.0, 0.3, 1.0] {
            for (i, p) in strand.positions().iter().enumerate() {
                let drawn = history.drawn(strand, i, overstep);
                assert!(drawn.distance(*p) < 1e-6, "it streaks");
            }
        }
    }
    let (per_node, nodes) = (bytes.len() / hairdo.nodes(), hairdo.nodes());
    println!("{nodes} nodes, {per_node} bytes each");
    assert!(per_node < 120);
}

#[test]
fn new_and_bald_hair_can_be_saved_too() {
    let mut app = test_app(60.0);
    let hair = curls(&mut app, 2, 9);
    let fresh = of(&app, hair);
    run(&mut app, 0.1);
    apply(&mut app, hair, &fresh);
    assert_eq!(of(&app, hair), fresh, "bonds are filled in as the tick does");
    let per_node = fresh.to_bytes().len() / fresh.nodes();
    println!("untreated: {per_node} bytes a node");
    assert!(per_node < 60);
    // put on before the first tick
    let (other, permed, ..) = permed();
    let perm = of(&other, permed);
    let (unborn, strand) = one_strand(&mut app, 0.24, 8, Vec3::Y);
    apply(&mut app, unborn, &perm);
    app.update();
    let bonds = &app.world().get::<Bonds>(strand).unwrap().joints;
    assert_eq!(bonds, perm.strands()[0].joints());

    let bald = app.world_mut().spawn(Hair).id();
    let none = of(&app, bald);
    assert_eq!(none, Hairdo::default());
    assert_eq!(Hairdo::from_bytes(&none.to_bytes()).unwrap(), none);
    apply(&mut app, bald, &none);
}

fn shape(strand: &Strand) -> Vec<Vec3> {
    (0..strand.edges()).map(|i| strand.darboux(i).xyz()).collect()
}

/// Share of the held shape that is kept.
fn kept(strand: &Strand, held: &[Vec3]) -> f32 {
    let dot: f32 = shape(strand).iter().zip(held).map(|(a, b)| a.dot(*b)).sum();
    dot / held.iter().map(|h| h.length_squared()).sum::<f32>()
}

fn straight() -> (App, Entity, Entity) {
    let mut app = test_app(60.0);
    no_gravity(&mut app);
    app.insert_resource(HairDefault(AirDrag { rate: 6.0 }));
    let (hair, strand) = one_strand(&mut app, 0.24, 8, Vec3::Y);
    run(&mut app, 0.1);
    (app, hair, strand)
}

/// A straight strand, guided onto an arc, permed there and released.
fn permed() -> (App, Entity, Entity, Vec<Vec3>) {
    let (mut app, hair, entity) = straight();
    for step in 1..=60 {
        let mut arc = strand(&app, entity).clone();
        let omega = Vec3::X * (0.3 * step as f32 / 60.0).sin();
        arc.pose(core::iter::repeat_n(omega, arc.edges()));
        let targets = arc.positions().iter().map(|p| Some(*p)).collect();
        app.world_mut().entity_mut(entity).insert(HeldNodes { targets, ..default() });
        app.update();
    }
    run(&mut app, 0.5);
    let held = shape(strand(&app, entity));
    for treat in [
        HairTreatment::lotion(entity),
        HairTreatment::neutraliser(entity),
        HairTreatment::dry(entity),
    ] {
        app.world_mut().write_message(treat);
        run(&mut app, 0.1);
    }
    app.world_mut().entity_mut(entity).remove::<HeldNodes>();
    run(&mut app, 4.0);
    (app, hair, entity, held)
}

#[test]
fn a_perm_saved_and_loaded_keeps_its_share() {
    let (mut app, hair, entity, held) = permed();
    let share = kept(strand(&app, entity), &held);
    assert!((share - 0.67).abs() < 0.003, "{share}");
    let bytes = of(&app, hair).to_bytes();

    let (mut other, other_hair, other_entity) = straight();
    apply(&mut other, other_hair, &Hairdo::from_bytes(&bytes).unwrap());
    let loaded = kept(strand(&other, other_entity), &held);
    println!("kept {share}, loaded {loaded}");
    assert!((loaded - share).abs() < 1e-6);
    // the same from here on, to the bit
    let own = of(&app, hair);
    apply(&mut app, hair, &own);
    run(&mut app, 2.0);
    run(&mut other, 2.0);
    assert_eq!(of(&app, hair).to_bytes(), of(&other, other_hair).to_bytes());
    let later = kept(strand(&other, other_entity), &held);
    println!("two seconds later {later}");
    assert!((later - share).abs() < 1e-3, "{later}");
    // and what it springs back to is the perm
    Hair::reset(other.world_mut().entity_mut(other_hair));
    let reset = kept(strand(&other, other_entity), &held);
    assert!((reset - share).abs() < 1e-3, "{reset}");
}

#[test]
fn wet_hair_keeps_its_water_and_the_books_stay_true() {
    let (mut app, hair) = treated(3, 9);
    let wet = of(&app, hair);
    let error = |app: &App| app.world().resource::<WaterLedger>().error();

    let mut other = test_app(60.0);
    let other_hair = curls(&mut other, 3, 9);
    run(&mut other, 0.1);
    let dry = of(&other, other_hair);
    assert_eq!(dry.water(), 0.0);
    apply(&mut other, other_hair, &wet);
    assert_eq!(of(&other, other_hair), wet);
    assert!(error(&other) < 1e-12, "{}", error(&other));
    let first = members(&other, other_hair)[0];
    let now = other.world().get::<Moisture>(first).unwrap().clone();
    let was = app.world().get::<Moisture>(members(&app, hair)[0]).unwrap();
    assert_eq!((now.wetness(), now.sheen()), (was.wetness(), was.sheen()), "seen at once");
    run(&mut other, 1.0);
    assert!(error(&other) < 1e-5, "{}", error(&other));
    assert!(of(&other, other_hair).water() > 0.9 * wet.water(), "it dries in minutes");
    apply(&mut other, other_hair, &dry);
    assert!(error(&other) < 1e-5, "{}", error(&other));
    run(&mut other, 0.1);
    assert_eq!(of(&other, other_hair).water(), 0.0);
    assert!(error(&other) < 1e-5, "{}", error(&other));
    assert!(other.world().get::<Moisture>(first).unwrap().is_untouched());

    // wet over wet, on the hair itself
    run(&mut app, 1.0);
    apply(&mut app, hair, &wet);
    run(&mut app, 0.1);
    assert!(error(&app) < 1e-5, "{}", error(&app));
}

#[test]
fn what_was_under_way_ends() {
    let (mut app, hair, entity) = straight();
    let before = of(&app, hair);
    app.world_mut().write_message(HairTreatment::wet(hair).over(10.0));
    run(&mut app, 1.0);
    assert!(!app.world().get::<Treatments>(entity).unwrap().acting().is_empty());
    apply(&mut app, hair, &before);
    run(&mut app, 1.0);
    let bonds = app.world().get::<Bonds>(entity).unwrap();
    assert!(bonds.rates(BondKind::Hydrogen).all(|rate| rate == 1.0));
}

#[test]
fn hair_on_a_rod_is_wound_again_and_never_torn() {
    let (mut app, hair, entity) = straight();
    let before = of(&app, hair);
    let rod = app.world_mut().spawn((PermRod::default(), Transform::from_xyz(0.03, 0.1, 0.0))).id();
    let winding = PermWinding { seconds: 0.5, ..default() };
    app.world_mut().entity_mut(entity).insert((WoundOn(rod), winding));
    run(&mut app, 1.0);
    apply(&mut app, hair, &before);
    let mut peak = 0.0_f32;
    for _ in 0..60 {
        app.update();
        peak = peak.max(strand(&app, entity).peak_strain());
    }
    println!("peak strain {peak}");
    assert!(peak < 0.1);
}

#[test]
fn strands_go_with_their_roots() {
    let (mut app, hair, entity) = straight();
    let before = of(&app, hair);
    let moved = Vec3::new(0.1, 0.2, 0.3);
    app.world_mut().get_mut::<Strand>(entity).unwrap().positions_mut()[0] += moved;
    apply(&mut app, hair, &before);
    let old = before.strands()[0].positions();
    for (now, old) in strand(&app, entity).positions().iter().zip(old) {
        assert!(now.distance(*old + moved) < 1e-6);
    }
}

#[test]
fn another_groom_is_reported_and_the_hair_is_left_alone() {
    let (mut app, hair) = treated(3, 9);
    let mut others = test_app(60.0);
    let fewer = curls(&mut others, 2, 9);
    let finer = curls(&mut others, 3, 17);
    let odd = curls(&mut others, 2, 9);
    others.world_mut().spawn((StrandOf(odd), curl(Vec3::ZERO, 10, 0.02, 1.0)));
    let cases = [
        (fewer, HairdoError::Strands { found: 2, expected: 3 }),
        (finer, HairdoError::Nodes { strand: 0, found: 17, expected: 9 }),
        (odd, HairdoError::Nodes { strand: 2, found: 10, expected: 9 }),
    ];
    for (other, expected) in cases {
        let hairdo = of(&others, other);
        let before = bits(&app, hair);
        let error = hairdo.apply(app.world_mut(), hair).unwrap_err();
        assert_eq!(error, expected);
        assert!(error.to_string().contains("apply_resampled"), "{error}");
        assert!(bits(&app, hair) == before, "{error}");
        assert_eq!(Hairdo::blend(&of(&app, hair), &hairdo, 0.5).unwrap_err(), expected);
        queue(&mut app, hair, hairdo.into_command());
        assert!(bits(&app, hair) == before);
        app.update();
        let reported = faults(&mut app);
        assert!(
            matches!(&reported[..], [f] if f.kind == FaultKind::Hairdo && f.cause() == Some(&expected))
        );
    }
    let before = bits(&app, hair);
    let own = of(&app, hair);
    let strand = members(&app, hair)[0];
    let gone = app.world_mut().spawn_empty().id();
    app.world_mut().despawn(gone);
    for entity in [strand, gone] {
        let expected = HairdoError::NoHair { entity };
        assert_eq!(Hairdo::of(app.world(), entity).unwrap_err(), expected);
        assert_eq!(own.apply(app.world_mut(), entity).unwrap_err(), expected);
        assert_eq!(own.apply_resampled(app.world_mut(), entity).unwrap_err(), expected);
    }
    let error = Hairdo::default().apply_resampled(app.world_mut(), hair).unwrap_err();
    assert_eq!(error, HairdoError::Bald);
    assert!(bits(&app, hair) == before);
    queue(&mut app, hair, own.clone().into_command());
    assert_eq!(of(&app, hair), own);
    queue(&mut app, hair, own.clone().into_resampled_command());
    assert_eq!(of(&app, hair), own, "on the same groom nothing is resampled");
}

fn queue(app: &mut App, hair: Entity, command: impl bevy::ecs::system::EntityCommand<Out = ()>) {
    app.world_mut().commands().entity(hair).queue(command);
    app.world_mut().flush();
}

#[test]
fn broken_hair_is_not_saved() {
    let (mut app, hair) = treated(2, 9);
    let second = members(&app, hair)[1];
    let good = of(&app, hair);
    app.world_mut().get_mut::<Strand>(second).unwrap().positions_mut()[4].y = f32::NAN;
    let error = Hairdo::of(app.world(), hair).unwrap_err();
    assert_eq!(error, HairdoError::NonFinite { what: "position", strand: 1, at: 4 });
    app.world_mut().get_mut::<Bonds>(second).unwrap().joints[2].rates[1] = 7.0;
    // and a good hairdo mends it
    apply(&mut app, hair, &good);
    assert_eq!(of(&app, hair), good);
    app.world_mut().get_mut::<Bonds>(second).unwrap().joints[2].rates[1] = 7.0;
    let error = Hairdo::of(app.world(), hair).unwrap_err();
    assert!(matches!(error, HairdoError::OutOfRange { strand: 1, at: 9, .. }), "{error}");
    assert!(error.to_string().contains("is 7, expected 0 to 1"), "{error}");
    app.world_mut().spawn((StrandOf(hair), Strand::default()));
    app.world_mut().get_mut::<Bonds>(second).unwrap().joints[2].rates[1] = 1.0;
    let error = Hairdo::of(app.world(), hair).unwrap_err();
    assert_eq!(error, HairdoError::TooFewNodes { strand: 2, found: 0 });
}

/// CRC-32, bit by bit.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0, |sum, byte| {
        (0..8).fold(
            sum ^ u32::from(*byte),
            |s, _| if s & 1 == 1 { 0xEDB8_8320 ^ s >> 1 } else { s >> 1 },
        )
    })
}

const HEAD: usize = 18;

/// A file of these numbers with length and checksum as they should be.
fn sealed(format: u16, payload: &[u8]) -> Vec<u8> {
    let mut file = b"\x8bhairdo\n".to_vec();
    file.extend(format.to_le_bytes());
    file.extend((payload.len() as u64).to_le_bytes());
    file.extend(payload);
    file.extend(crc32(&file).to_le_bytes());
    file
}

#[test]
fn other_files_are_reported_and_the_hair_is_left_alone() {
    let (app, hair) = treated(2, 5);
    let before = bits(&app, hair);
    let good = before.0.clone();
    let payload = &good[HEAD..good.len() - 4];
    assert_eq!(sealed(1, payload), good, "without looks the first format is written");
    let error = |bytes: &[u8]| Hairdo::from_bytes(bytes).unwrap_err();

    for bytes in [&b"glTF"[..], b"\x8bhairdu\n1234567890123456", b"{}", &[0; 100]] {
        assert_eq!(error(bytes), HairdoError::NotAHairdo);
    }
    let future = error(&sealed(NEWEST_FORMAT + 6, &[1, 2, 3]));
    assert_eq!(future, HairdoError::FutureVersion { found: 10, newest: 4 });
    assert!(future.to_string().contains("update"), "{future}");
    assert!(matches!(error(&sealed(0, payload)), HairdoError::Malformed { offset: 8, .. }));
    let mut damaged = good.clone();
    damaged[HEAD + 40] ^= 4;
    assert!(matches!(error(&damaged), HairdoError::Checksum { .. }));
    let mut longer = good.clone();
    longer.push(0);
    let end = good.len() as u64;
    assert!(matches!(error(&longer), HairdoError::Malformed { offset, .. } if offset == end));
    // a valid checksum, but a wrong length
    let more: Vec<u8> = payload.iter().copied().chain([0]).collect();
    let at = (good.len() - 4) as u64;
    assert!(
        matches!(error(&sealed(1, &more)), HairdoError::Malformed { offset, .. } if offset == at)
    );
    let vast = [0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 1, 0];
    let head = HEAD as u64;
    assert!(
        matches!(error(&sealed(1, &vast)), HairdoError::Malformed { offset, .. } if offset == head)
    );
    // not finite, out of range: the second strand's first position follows the first strand
    let mut hairdo = payload.to_vec();
    let place = Hairdo::from_bytes(&good).unwrap().strands()[1].positions()[0].x.to_le_bytes();
    let at = hairdo.windows(4).rposition(|w| w == place).unwrap();
    hairdo[at..at + 4].copy_from_slice(&f32::NAN.to_le_bytes());
    let wrong = error(&sealed(1, &hairdo));
    assert_eq!(wrong, HairdoError::NonFinite { what: "position", strand: 1, at: 0 });
    assert!(bits(&app, hair) == before);
}

#[test]
fn no_truncation_is_taken_for_a_hairdo() {
    let (app, hair) = treated(2, 5);
    let good = of(&app, hair).to_bytes();
    for end in 0..good.len() {
        let error = Hairdo::from_bytes(&good[..end]).unwrap_err();
        let expected = if end < HEAD { HEAD + 4 } else { good.len() } as u64;
        assert_eq!(error, HairdoError::Truncated { found: end as u64, expected }, "{end}");
        // cut off, with a valid checksum
        if end >= HEAD && end + 4 < good.len() {
            let error = Hairdo::from_bytes(&sealed(1, &good[HEAD..end])).unwrap_err();
            assert!(matches!(error, HairdoError::Malformed { .. }), "{end}: {error}");
        }
    }
}

#[test]
fn no_flipped_bit_goes_unnoticed() {
    let (app, hair) = treated(2, 5);
    let good = of(&app, hair).to_bytes();
    println!("{} bits", good.len() * 8);
    for bit in 0..good.len() * 8 {
        let mut bad = good.clone();
        bad[bit / 8] ^= 1 << (bit % 8);
        assert!(Hairdo::from_bytes(&bad).is_err(), "bit {bit}");
    }
}

#[test]
fn random_bytes_never_panic_and_what_is_read_is_valid() {
    let (mut app, hair) = treated(2, 5);
    let good = of(&app, hair).to_bytes();
    let payload = &good[HEAD..good.len() - 4];
    let mut random = Xoshiro256PlusPlus::seed_from_u64(5);
    let mut read = 0;
    for case in 0..30_000 {
        let bytes = match case % 3 {
            // anything
            0 => (0..random.random_range(0..200)).map(|_| random.random()).collect(),
            // anything, sealed
            1 => {
                let noise: Vec<u8> =
                    (0..random.random_range(0..200)).map(|_| random.random()).collect();
                sealed(1, &noise)
            }
            // a hairdo with some bytes changed, sealed
            _ => {
                let mut changed = payload.to_vec();
                for _ in 0..random.random_range(1..4) {
                    let at = random.random_range(0..changed.len());
                    changed[at] = random.random();
                }
                sealed(1, &changed)
            }
        };
        if let Ok(hairdo) = Hairdo::from_bytes(&bytes) {
            read += 1;
            assert_eq!(Hairdo::from_bytes(&hairdo.to_bytes()).unwrap(), hairdo);
            if read % 50 == 0 {
                let _ = hairdo.apply(app.world_mut(), hair);
                app.update();
                let _ = Hairdo::blend(&hairdo, &hairdo, 0.5);
                let _ = hairdo.resampled_for(&of(&app, hair));
            }
        }
    }
    println!("{read} of 30000 could be read");
    assert!(read > 1000);
}

/// Radius of the circle through each three neighbouring nodes, on average.
fn radius(points: &[Vec3]) -> f32 {
    let of_three = |p: &[Vec3]| {
        let (a, b, c) = (p[1] - p[0], p[2] - p[1], p[2] - p[0]);
        a.length() * b.length() * c.length() / (2.0 * a.cross(b).length())
    };
    points.windows(3).map(of_three).sum::<f32>() / (points.len() - 2) as f32
}

#[test]
fn a_curl_keeps_its_radius_on_other_nodes_and_lengths() {
    for (nodes, longer) in [(17, 1.0), (65, 1.0), (9, 1.0), (33, 1.5), (25, 0.6)] {
        let mut app = test_app(60.0);
        no_gravity(&mut app);
        let curly = app.world_mut().spawn(Hair).id();
        app.world_mut().spawn((StrandOf(curly), curl(Vec3::Y, 33, 0.02, 3.0 * PI)));
        run(&mut app, 0.1);
        app.world_mut().write_message(SoakHair { target: curly, wetness: 0.4 });
        app.update();
        let hairdo = of(&app, curly);
        let old = radius(hairdo.strands()[0].positions());

        let length = hairdo.strands()[0].rest_lengths().iter().sum::<f32>() * longer;
        let plain = app.world_mut().spawn(Hair).id();
        for x in [0.0, 0.3] {
            let line: Vec<Vec3> = (0..nodes)
                .map(|i| Vec3::new(x, 1.0 + length * i as f32 / (nodes - 1) as f32, 0.0))
                .collect();
            let strand = Strand::from_polyline(&line).unwrap();
            app.world_mut().spawn((StrandOf(plain), strand));
        }
        run(&mut app, 0.1);
        hairdo.apply_resampled(app.world_mut(), plain).unwrap();
        let first = members(&app, plain)[0];
        let worn = strand(&app, first).clone();
        let now = radius(worn.positions());
        // it stays: the bonds agree with where the nodes are
        Hair::reset(app.world_mut().entity_mut(plain));
        let rest = radius(strand(&app, first).positions());
        println!("{nodes} nodes, {longer} long: radius {old} is {now}, at rest {rest}");
        assert!((now / old - 1.0).abs() < 0.04 && (rest / old - 1.0).abs() < 0.04);
        assert!(worn.peak_strain() < 1e-4);
        let wetness = app.world().get::<Moisture>(first).unwrap().wetness();
        assert!(wetness.iter().all(|w| (w - 0.4).abs() < 0.01), "{wetness:?}");
        if longer == 1.0 {
            let apart = worn
                .positions()
                .last()
                .unwrap()
                .distance(*hairdo.strands()[0].positions().last().unwrap());
            println!("tips {apart} m apart");
            assert!(apart < 0.015, "directions are kept: {apart}");
        }
    }
}

#[test]
fn blending_is_exact_at_its_ends_and_keeps_lengths() {
    let (mut app, hair) = treated(3, 9);
    let a = of(&app, hair);
    // turned round the other way, and dry
    for member in members(&app, hair) {
        let mut strand = app.world_mut().get_mut::<Strand>(member).unwrap();
        let mirrored: Vec<Vec3> = shape(&strand).into_iter().map(|omega| -omega).collect();
        strand.pose(mirrored);
    }
    Hair::restyle(app.world_mut().entity_mut(hair));
    app.world_mut().write_message(SoakHair { target: hair, wetness: 0.0 });
    run(&mut app, 0.5);
    let b = of(&app, hair);
    assert_eq!(Hairdo::blend(&a, &b, 0.0).unwrap().to_bytes(), a.to_bytes());
    assert_eq!(Hairdo::blend(&a, &b, 1.0).unwrap().to_bytes(), b.to_bytes());
    for t in [-0.1, 1.1, f32::NAN] {
        assert!(matches!(Hairdo::blend(&a, &b, t), Err(HairdoError::Value(_))));
    }
    let edges = |h: &Hairdo| -> Vec<f32> {
        let strands = h.strands().iter();
        strands.flat_map(|s| s.positions().windows(2).map(|p| p[0].distance(p[1]))).collect()
    };
    let farthest = |x: &Hairdo, y: &Hairdo| {
        let nodes = |h: &Hairdo| -> Vec<Vec3> {
            h.strands().iter().flat_map(|s| s.positions().to_vec()).collect()
        };
        nodes(x).iter().zip(nodes(y)).map(|(a, b)| a.distance(b)).fold(0.0, f32::max)
    };
    println!("apart {} m", farthest(&a, &b));
    let mut before = a.clone();
    for step in 1..=100 {
        let now = Hairdo::blend(&a, &b, step as f32 * 0.01).unwrap();
        for ((x, y), z) in edges(&a).into_iter().zip(edges(&b)).zip(edges(&now)) {
            assert!(z > x.min(y) - 1e-6 && z < x.max(y) + 1e-6, "{x} {y} {z}");
        }
        let step = farthest(&before, &now);
        assert!(step < 0.05 * farthest(&a, &b) + 1e-4, "it jumps by {step}");
        before = now;
    }
    let half = Hairdo::blend(&a, &b, 0.5).unwrap();
    assert!((half.water() - 0.5 * (a.water() + b.water())).abs() < 1e-9 * a.water());
    let rate = |h: &Hairdo| h.strands()[0].joints()[1].rates[0];
    assert!((rate(&half) - 0.5 * (rate(&a) + rate(&b))).abs() < 1e-6);
    assert_eq!(Hairdo::blend(&a, &a, 0.3).unwrap().strands()[1].joints(), a.strands()[1].joints());
    apply(&mut app, hair, &half);
    assert_eq!(of(&app, hair), half);
    run(&mut app, 0.5);
    assert!(faults(&mut app).is_empty());
}

fn order(app: &mut App, order: Order) -> String {
    app.world_mut().write_message(order);
    app.update();
    app.world().resource::<Hairdos>().reported.clone()
}

#[test]
fn the_salon_undoes_redoes_saves_and_loads() {
    let (mut app, hair, _) = straight();
    app.world_mut().entity_mut(hair).insert(crate::scenes::Treated);
    WardrobePlugin.build(&mut app);
    let rate = |app: &App| of(app, hair).strands()[0].joints()[3].rates[0];
    let treat = |app: &mut App, treat| {
        assert_eq!(order(app, Order::Remember), "");
        app.world_mut().write_message(treat);
        run(app, 0.1);
    };
    let undoable = |app: &App| {
        let hairdos = app.world().resource::<Hairdos>();
        (hairdos.can_undo(), hairdos.can_redo())
    };
    assert_eq!(undoable(&app), (false, false));
    assert_eq!(order(&mut app, Order::Undo), "there is no such step");
    treat(&mut app, HairTreatment::wet(hair));
    treat(&mut app, HairTreatment::set(hair, BondKind::Hydrogen, 0.5).unwrap());
    assert_eq!(rate(&app), 0.5);
    for (step, expected, able) in [
        (Order::Undo, 0.0, (true, true)),
        (Order::Undo, 1.0, (false, true)),
        (Order::Redo, 0.0, (true, true)),
        (Order::Redo, 0.5, (true, false)),
        (Order::Undo, 0.0, (true, true)),
    ] {
        assert_eq!(order(&mut app, step), "");
        assert_eq!((rate(&app), undoable(&app)), (expected, able));
    }
    treat(&mut app, HairTreatment::dry(hair));
    assert_eq!(undoable(&app), (true, false), "a new way was taken");

    let folder = std::env::temp_dir();
    let path = folder.join(format!("bevy_keratin-{}.keratin", std::process::id()));
    let reported = order(&mut app, Order::Save(path.clone()));
    assert!(reported.starts_with("saved"), "{reported}");
    treat(&mut app, HairTreatment::wet(hair));
    assert_eq!(order(&mut app, Order::Load(path.clone())), "loaded");
    assert_eq!(rate(&app), 1.0);
    // What cannot be written to its end leaves the file that was there.
    let unfinished = path.with_added_extension("part");
    let whole = std::fs::read(&path).unwrap();
    std::fs::create_dir(&unfinished).unwrap();
    let reported = order(&mut app, Order::Save(path.clone()));
    std::fs::remove_dir(&unfinished).unwrap();
    assert!(!reported.starts_with("saved"), "{reported}");
    assert_eq!(std::fs::read(&path).unwrap(), whole);
    assert_eq!(order(&mut app, Order::Undo), "");
    assert_eq!(rate(&app), 0.0);
    // a step of other hair waits until it fits
    let more = app.world_mut().spawn((StrandOf(hair), curl(Vec3::X, 9, 0.02, 1.0))).id();
    let reported = order(&mut app, Order::Undo);
    assert!(reported.contains("another groom"), "{reported}");
    app.world_mut().despawn(more);
    let able = undoable(&app);
    assert_eq!(able, (true, true));
    std::fs::write(&path, b"no hair").unwrap();
    let reported = order(&mut app, Order::Load(path.clone()));
    assert!(reported.contains("not a hairdo"), "{reported}");
    std::fs::remove_file(&path).unwrap();
    let reported = order(&mut app, Order::Load(path));
    assert!(reported.contains("keratin: "), "{reported}");
    assert_eq!(rate(&app), 0.0, "the hair is left alone");
}

#[test]
fn undoing_does_not_keep_hairdos_for_ever() {
    let mut hairdos = Hairdos::default();
    for _ in 0..1000 {
        hairdos.push(Hairdo::default());
    }
    let steps = core::iter::from_fn(|| hairdos.undo(Hairdo::default())).count();
    assert_eq!(steps, 50);
}

#[test]
fn other_strands_take_the_style_of_the_nearest() {
    let mut app = test_app(60.0);
    no_gravity(&mut app);
    let source = app.world_mut().spawn(Hair).id();
    let turns = [0.5 * PI, 1.0 * PI, 2.0 * PI];
    for (x, angle) in [0.0, 0.2, 0.4].into_iter().zip(turns) {
        app.world_mut().spawn((StrandOf(source), curl(Vec3::X * x, 17, 0.02, angle)));
    }
    let target = app.world_mut().spawn(Hair).id();
    let places = [(0.05, 0), (0.39, 2), (0.13, 1), (0.31, 2), (-1.0, 0)];
    for (x, _) in places {
        app.world_mut().spawn((StrandOf(target), curl(Vec3::X * x, 12, 0.1, 1.0)));
    }
    run(&mut app, 0.1);
    let hairdo = of(&app, source);
    hairdo.apply_resampled(app.world_mut(), target).unwrap();
    for (member, (x, nearest)) in members(&app, target).into_iter().zip(places) {
        let worn = strand(&app, member);
        assert_eq!(worn.positions()[0], Vec3::X * x, "roots stay");
        let expected = radius(hairdo.strands()[nearest].positions());
        let found = radius(worn.positions());
        assert!((found / expected - 1.0).abs() < 0.03, "at {x}: {found}, expected {expected}");
    }
    run(&mut app, 0.5);
    assert!(faults(&mut app).is_empty());
}

#[test]
fn two_nodes_are_a_strand_too() {
    let mut app = test_app(60.0);
    let fine = curls(&mut app, 1, 9);
    let coarse = app.world_mut().spawn(Hair).id();
    let line = Strand::from_polyline(&[Vec3::ZERO, Vec3::X * 0.1]).unwrap();
    app.world_mut().spawn((StrandOf(coarse), line));
    run(&mut app, 0.1);
    let (few, many) = (of(&app, coarse), of(&app, fine));
    assert_eq!(many.resampled_for(&few).unwrap().nodes(), 2);
    let straight = few.resampled_for(&many).unwrap();
    assert_eq!(straight.nodes(), 9);
    let positions = straight.strands()[0].positions();
    let along = (positions[1] - positions[0]).normalize();
    assert!(positions.windows(2).all(|p| (p[1] - p[0]).normalize().distance(along) < 1e-4));
    apply(&mut app, fine, &straight);
    apply(&mut app, coarse, &few);
    assert_eq!(Hairdo::from_bytes(&few.to_bytes()).unwrap(), few);
    assert_eq!(Hairdo::blend(&few, &few, 0.5).unwrap().nodes(), 2);
}

/// A hairdo of one strand of three nodes with a cuticle in the first format, as its description has it.
const FORMAT_1: &[u8] = include_bytes!("../data/format-1.hairdo");

#[test]
fn files_of_the_first_format_are_read_as_before() {
    let hairdo = Hairdo::from_bytes(FORMAT_1).unwrap();
    let strand = &hairdo.strands()[0];
    let places = [Vec3::ZERO, Vec3::new(0.0, -0.0625, 0.0), Vec3::new(0.0, -0.125, 0.0)];
    assert_eq!((hairdo.strands().len(), strand.positions()), (1, &places[..]));
    assert_eq!(strand.joints()[1].rates, [0.25, 1.0, 1.0, 1.0]);
    assert_eq!(hairdo.cuticle(), Some(Cuticle { damage: 0.5, softening: 0.25 }));
    assert_eq!((hairdo.look(), hairdo.dye(), hairdo.preset()), (None, &HairDye::default(), None));
    assert_eq!(hairdo.to_bytes(), FORMAT_1, "and written alike");
}

fn look() -> HairLook {
    HairLook {
        melanin: Melanin::AUBURN,
        dye: HairColor::new(0.9, 0.8, 0.7),
        grey: 0.375,
        shading: HairShading::KajiyaKay,
        ..default()
    }
}

fn dye() -> HairDye {
    let streaks = Streaks { width: 0.02, seed: 9, ..default() };
    HairDye::of(DyeLayer::bleached(HairColor::PINK).tips(0.4))
        .with(DyeLayer { streaks: Some(streaks), ..DyeLayer::bleach(0.5) })
}

fn preset() -> WornPreset {
    WornPreset { name: "Curly".into(), seed: 77, length: 1.25 }
}

/// Hair with looks.
fn dyed() -> (App, Entity, Vec<u8>) {
    let (mut app, hair) = treated(2, 5);
    app.world_mut().entity_mut(hair).insert((look(), dye(), preset()));
    let bytes = of(&app, hair).to_bytes();
    (app, hair, bytes)
}

#[test]
fn looks_travel_with_the_hairdo() {
    let (mut app, hair, bytes) = dyed();
    let read = Hairdo::from_bytes(&bytes).unwrap();
    assert_eq!((read.look(), read.dye(), read.preset()), (Some(&look()), &dye(), Some(&preset())));
    assert_eq!(read, of(&app, hair));
    assert_eq!(read.to_bytes(), bytes);
    let mean = read.strands().iter().map(|s| s.rest_lengths().iter().sum::<f32>()).sum::<f32>();
    assert!((read.length() - 0.5 * mean).abs() < 1e-6);

    // Onto other hair, that keeps what it has grown from.
    let other = curls(&mut app, 3, 9);
    app.world_mut().entity_mut(other).insert(HairDye::from_color(HairColor::COBALT));
    queue(&mut app, other, read.clone().into_resampled_command());
    let world = app.world();
    assert_eq!(
        (world.get::<HairLook>(other), world.get::<HairDye>(other)),
        (Some(&look()), Some(&dye()))
    );
    assert_eq!(world.get::<WornPreset>(other), None);
    // What has no look of its own leaves that of the hair, and takes its dye away.
    let bare = read.without_looks();
    apply(&mut app, hair, &bare);
    let world = app.world();
    assert_eq!((world.get::<HairLook>(hair), world.get::<HairDye>(hair)), (Some(&look()), None));
    assert!(faults(&mut app).is_empty());
}

#[test]
fn no_flipped_bit_or_cut_in_looks_goes_unnoticed() {
    let (.., good) = dyed();
    for bit in 0..good.len() * 8 {
        let mut bad = good.clone();
        bad[bit / 8] ^= 1 << (bit % 8);
        assert!(Hairdo::from_bytes(&bad).is_err(), "bit {bit}");
    }
    let payload = &good[HEAD..good.len() - 4];
    let looks = payload.len() - 220;
    for end in looks..payload.len() {
        let error = Hairdo::from_bytes(&sealed(2, &payload[..end])).unwrap_err();
        assert!(matches!(error, HairdoError::Malformed { .. }), "{end}: {error}");
    }
    // Changed and sealed: refused, or a hairdo that can be written again.
    let mut random = Xoshiro256PlusPlus::seed_from_u64(11);
    let mut read = 0;
    for _ in 0..5000 {
        let mut changed = payload.to_vec();
        let at = random.random_range(looks..changed.len());
        changed[at] = random.random();
        if let Ok(hairdo) = Hairdo::from_bytes(&sealed(2, &changed)) {
            read += 1;
            assert_eq!(Hairdo::from_bytes(&hairdo.to_bytes()).unwrap(), hairdo);
        }
    }
    println!("{read} of 5000 could be read");
    assert!(read > 500);
}

#[test]
fn looks_that_cannot_be_are_reported() {
    let (.., good) = dyed();
    let mut payload = good[HEAD..good.len() - 4].to_vec();
    let grey = 0.375f32.to_le_bytes();
    let at = payload.windows(4).rposition(|w| w == grey).unwrap();
    payload[at..at + 4].copy_from_slice(&7f32.to_le_bytes());
    let error = Hairdo::from_bytes(&sealed(2, &payload)).unwrap_err();
    assert!(error.to_string().contains("HairLook::grey is 7, expected 0 to 1"), "{error}");
}

#[test]
fn looks_are_blended_by_what_they_absorb() {
    let (mut app, hair) = treated(2, 5);
    let of_look = |app: &mut App, melanin, dye: HairDye| {
        app.world_mut().entity_mut(hair).insert((HairLook { melanin, ..default() }, dye));
        of(app, hair)
    };
    let pink = HairDye::pink();
    let black = of_look(&mut app, Melanin::BLACK, HairDye::default());
    let blond = of_look(&mut app, Melanin::BLOND, pink.clone());
    for (t, end) in [(0.0, &black), (1.0, &blond)] {
        assert_eq!(Hairdo::blend(&black, &blond, t).unwrap().to_bytes(), end.to_bytes());
    }
    let half = Hairdo::blend(&black, &blond, 0.5).unwrap();
    let absorbed = half.look().unwrap().melanin.absorption();
    let expected = 0.5 * (Melanin::BLACK.absorption() + Melanin::BLOND.absorption());
    assert!(absorbed.distance(expected) < 1e-6);
    let layer = half.dye().layers[0];
    assert_eq!((half.dye().layers.len(), layer.bleach), (1, 0.5));
    let expected = 0.5 * HairColor::PINK.absorption();
    assert!(layer.absorption().distance(expected) < 1e-6);
}

#[test]
fn dyes_fade_into_each_other_without_a_jump() {
    let (mut app, hair) = treated(2, 5);
    let streaks = HairDye::of(DyeLayer::bleached(HairColor::COBALT).in_streaks(0.4));
    let mut with = |dye: HairDye| {
        app.world_mut().entity_mut(hair).insert(dye);
        of(&app, hair)
    };
    let hairdos = [HairDye::pink(), HairDye::default(), streaks].map(&mut with);
    let natural = Melanin::BROWN.absorption();
    for (a, b) in [(0, 1), (1, 2), (0, 2), (2, 0)] {
        let (a, b) = (&hairdos[a], &hairdos[b]);
        let at = |t: f32| {
            let dye = Hairdo::blend(a, b, t).unwrap().dye().clone();
            dye.absorption(natural, 0.5, |_| true)
        };
        let mut before = at(0.0);
        assert_eq!(before, a.dye().absorption(natural, 0.5, |_| true));
        for step in 1..=200 {
            let now = at(step as f32 * 0.005);
            assert!(now.distance(before) < 0.02, "{before} jumps to {now}");
            before = now;
        }
        assert_eq!(before, b.dye().absorption(natural, 0.5, |_| true));
    }
}

#[derive(Resource, Default)]
struct Answers {
    taken: Vec<(Entity, Hairdo)>,
    put_on: Vec<Entity>,
    refused: Vec<(Entity, HairdoError)>,
}

#[test]
fn systems_take_and_put_on_by_events() {
    let (mut app, hair, _) = dyed();
    let twin = curls(&mut app, 2, 5);
    let other = curls(&mut app, 4, 9);
    app.init_resource::<Answers>()
        .add_observer(|of: On<HairdoCaptured>, mut reported: ResMut<Answers>| {
            reported.taken.push((of.entity, of.hairdo.clone()));
        })
        .add_observer(|of: On<HairdoApplied>, mut reported: ResMut<Answers>| {
            reported.put_on.push(of.entity);
        })
        .add_observer(|of: On<HairdoRejected>, mut reported: ResMut<Answers>| {
            reported.refused.push((of.entity, of.error.clone()));
        });
    app.add_systems(
        Last,
        (move |mut commands: Commands, mut done: Local<bool>| {
            if !core::mem::replace(&mut *done, true) {
                commands.trigger(CaptureHairdo { entity: hair });
            }
        },),
    );
    app.update();
    let [(from, hairdo)] = &app.world().resource::<Answers>().taken[..] else {
        panic!("one answer")
    };
    let (from, hairdo) = (*from, hairdo.clone());
    assert_eq!((from, &hairdo), (hair, &of(&app, hair)));
    let strand = members(&app, hair)[0];
    for entity in [twin, other, strand] {
        let request = ApplyHairdo { entity, hairdo: hairdo.clone() };
        app.world_mut().commands().trigger(request);
    }
    app.world_mut().flush();
    app.world_mut().commands().trigger(CaptureHairdo { entity: strand });
    app.world_mut().flush();
    let reported = app.world().resource::<Answers>();
    assert_eq!(reported.put_on, [twin, other]);
    let refused = HairdoError::NoHair { entity: strand };
    assert_eq!(reported.refused, [(strand, refused.clone()), (strand, refused)]);
    assert_eq!(of(&app, twin).strands()[1].joints(), hairdo.strands()[1].joints());
    assert_eq!(app.world().get::<HairDye>(other), Some(&dye()));
    app.update();
    assert_eq!(fault_kinds(&mut app), [FaultKind::Hairdo; 2]);
}

#[test]
fn a_hairdo_is_known_to_reflection() {
    use bevy::ecs::reflect::AppTypeRegistry;
    let (app, hair, _) = dyed();
    let hairdo = of(&app, hair);
    let copy: Box<dyn PartialReflect> = hairdo.reflect_clone().unwrap().into_partial_reflect();
    assert_eq!(Hairdo::take_from_reflect(copy).unwrap(), hairdo);
    let dye = <HairDye as FromReflect>::from_reflect(dye().to_dynamic().as_ref()).unwrap();
    assert_eq!(dye, self::dye());
    let registry = app.world().resource::<AppTypeRegistry>().read();
    for name in ["Hairdo", "HairDye", "DyeLayer", "HairLook", "WornPreset", "ApplyHairdo"] {
        assert!(registry.get_with_short_type_path(name).is_some(), "{name}");
    }
}

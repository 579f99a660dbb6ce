//! Scale: heads that are hidden, squashed and sheared, solids, winds and water as they are drawn.

use super::{Row, all, apart, app, fault_count, head, place_mut, run, strand, strand_along};
use bevy::prelude::*;
use bevy_keratin::prelude::*;

/// Line 8: a head that is scaled away in first person, while it walks and turns, comes back as it was.
pub fn hidden() -> Vec<Row> {
    let mut rows = Vec::new();
    for scale in [0.1, 0.01, 0.0001, 0.0] {
        rows.extend(hidden_bone(scale));
        let mut app = app(60.0);
        let head = head(&mut app, 10);
        let before = all(&mut app);
        let mut solved = 0.0;
        for tick in 0..120 {
            place_mut(&mut app, head, |place| {
                place.scale = Vec3::splat(if (10..110).contains(&tick) { scale } else { 1.0 });
                if (10..105).contains(&tick) {
                    place.translation.x += 0.05;
                    place.rotate_y(0.05);
                }
            });
            app.update();
            let owner = app.world_mut().query::<&MotionOwner>().single(app.world());
            let moves = owner.is_ok_and(|owner| owner.moves());
            solved += f32::from(u8::from(moves && (12..108).contains(&tick)));
        }
        let mut off = 0.0f32;
        for (a, b) in all(&mut app).iter().zip(&before) {
            for (p, q) in a.positions().iter().zip(b.positions()) {
                off = off.max(p.distance(*q));
            }
        }
        rows.extend([
            Row::at_most(format!("head hidden at {scale}: off on return (m)"), off, 2e-3),
            Row::at_most(format!("head hidden at {scale}: ticks that move it"), solved, 0.0),
        ]);
    }
    rows
}

/// Hair that is not at the middle of the bone that is scaled away, and walks on a little meanwhile.
fn hidden_bone(scale: f32) -> Vec<Row> {
    let mut app = app(60.0);
    let bone = app.world_mut().spawn(Transform::from_xyz(0.0, 1.6, 0.0)).id();
    let (hair, id) = strand_along(&mut app, 0.3, 12, Vec3::NEG_Y);
    let beside = Transform::from_xyz(0.0, 0.1, 0.06);
    app.world_mut().entity_mut(hair).insert((ChildOf(bone), beside));
    run(&mut app, 1.0);
    let before = strand(&app, id);
    let mut off = 0.0f32;
    for tick in 0..90 {
        place_mut(&mut app, bone, |place| {
            place.scale = Vec3::splat(if tick < 30 { scale } else { 1.0 });
            place.translation.x += if tick < 30 { 0.005 } else { 0.0 };
        });
        app.update();
        off = off.max(apart(strand(&app, id).positions(), before.positions()));
    }
    vec![
        Row::at_most(format!("hair beside a bone hidden at {scale}: off (m)"), off, 1e-3),
        Row::at_most(
            format!("hair beside a bone hidden at {scale}: faults"),
            fault_count(&app),
            0.0,
        ),
    ]
}

/// Line 8: on a head that is squashed and sheared, roots are where the skin is drawn, and strands keep
/// their lengths in the world.
pub fn squashed() -> Vec<Row> {
    let mut app = app(60.0);
    let head = head(&mut app, 10);
    let own: Vec<Vec3> = all(&mut app).iter().map(|strand| strand.positions()[0]).collect();
    // A parent that turns between two scales shears.
    let neck = app.world_mut().spawn(Transform::from_scale(Vec3::new(1.0, 1.3, 1.0))).id();
    app.world_mut().entity_mut(head).insert(ChildOf(neck));
    for tick in 0..90 {
        let share = (tick as f32 / 60.0).min(1.0);
        place_mut(&mut app, head, |place| {
            place.scale = Vec3::new(1.0 + 0.2 * share, 1.0 - 0.3 * share, 1.0);
            place.rotation = Quat::from_rotation_z(0.3);
        });
        app.update();
    }
    let global = |app: &App, id: Entity| app.world().get::<GlobalTransform>(id).copied();
    let skin = global(&app, head).unwrap_or_default();
    let hair = app.world_mut().query_filtered::<Entity, With<Hair>>().single(app.world());
    let drawn = hair.ok().and_then(|hair| global(&app, hair)).unwrap_or_default();
    let (mut off, mut strain) = (0.0f32, 0.0f32);
    for (strand, own) in all(&mut app).iter().zip(&own) {
        let root = drawn.transform_point(strand.positions()[0]);
        off = off.max(root.distance(skin.transform_point(*own)));
        strain = strain.max(strand.peak_strain());
    }
    let scales = drawn.compute_transform().scale;
    let uneven = scales.max_element() / scales.min_element() - 1.0;
    vec![
        Row::at_most("squashed head: roots off the drawn skin (m)", off, 1e-4),
        Row::at_most("squashed head: strands drawn longer along one axis", uneven, 1e-3),
        Row::at_most("squashed head: strain", strain, 0.02),
    ]
}

/// Where the nodes of a strand rest that hangs out over a solid, and faults.
fn rests_on(solid: HairCollider, parent: Transform, place: Transform) -> (Vec<Vec3>, f32) {
    let mut app = app(60.0);
    let (_, e) = strand_along(&mut app, 0.24, 8, Vec3::new(0.98, 0.2, 0.0));
    let parent = app.world_mut().spawn(parent).id();
    app.world_mut().spawn((solid, place, ChildOf(parent)));
    run(&mut app, 1.5);
    (strand(&app, e).positions().to_vec(), fault_count(&app))
}

/// The corners and faces of a box.
fn cuboid(half: Vec3) -> ([Vec3; 8], [[u32; 3]; 12]) {
    let corners = core::array::from_fn(|k| {
        let way = |bit: usize| if k & bit != 0 { 1.0 } else { -1.0 };
        half * Vec3::new(way(1), way(2), way(4))
    });
    let face = |[a, b, c, d]: [u32; 4]| [[a, b, c], [b, d, c]];
    let sides =
        [[0, 2, 1, 3], [4, 5, 6, 7], [0, 1, 4, 5], [2, 6, 3, 7], [0, 4, 2, 6], [1, 3, 5, 7]];
    let all: Vec<[u32; 3]> = sides.into_iter().flat_map(face).collect();
    (corners, all.try_into().unwrap_or_default())
}

/// Line 8: each scaled shape acts as one of that size does, as the control one by the mean scale does not.
pub fn solids() -> Vec<Row> {
    let mut rows = zones_and_water();
    let s = Vec3::new(2.0, 0.5, 1.25);
    let round = Vec3::new(1.5, 0.4, 1.5);
    let half = Vec3::new(0.06, 0.1, 0.1);
    let baked = |half: Vec3, cell| {
        let (corners, faces) = cuboid(half);
        HairCollider::grid(DistanceGrid::bake(&corners, &faces, cell).unwrap())
    };
    let hull = |half| HairCollider::hull(&cuboid(half).0).unwrap();
    let tilted = |normal: Vec3| HairCollider::plane(Dir3::new(normal).unwrap());
    let cases: [(&str, HairCollider, Vec3, HairCollider, f32); 9] = [
        (
            "ball",
            HairCollider::sphere(0.1).unwrap(),
            s,
            HairCollider::ellipsoid(0.1 * s).unwrap(),
            2e-3,
        ),
        (
            "ellipsoid",
            HairCollider::ellipsoid(half).unwrap(),
            s,
            HairCollider::ellipsoid(half * s).unwrap(),
            2e-3,
        ),
        (
            "box",
            HairCollider::rounded_cuboid(2.0 * half, 0.01).unwrap(),
            s,
            HairCollider::rounded_cuboid(2.0 * half * s, 0.005).unwrap(),
            2e-3,
        ),
        (
            "floor",
            HairCollider::cuboid(Vec3::ONE).unwrap(),
            Vec3::new(10.0, 0.2, 10.0),
            HairCollider::cuboid(Vec3::new(10.0, 0.2, 10.0)).unwrap(),
            2e-3,
        ),
        (
            "cylinder",
            HairCollider::cylinder(0.08, 0.2).unwrap(),
            round,
            HairCollider::cylinder(0.12, 0.08).unwrap(),
            2e-3,
        ),
        (
            "capsule",
            HairCollider::capsule(0.05, 0.1).unwrap(),
            Vec3::new(1.0, 2.0, 1.0),
            HairCollider::capsule(0.05, 0.3).unwrap(),
            2e-3,
        ),
        (
            "plane",
            tilted(Vec3::new(-1.0, 1.0, 0.3)),
            s,
            tilted(Vec3::new(-1.0, 1.0, 0.3) / s),
            2e-3,
        ),
        ("hull", hull(half), s, hull(half * s), 2e-3),
        ("grid", baked(half, 0.01), s, baked(half * s, 0.0025), 6e-3),
    ];
    let far = Transform::from_xyz(9.0, 0.0, 0.0);
    let (free, _) = rests_on(HairCollider::sphere(0.01).unwrap(), default(), far);
    for (k, (name, solid, scale, alike, off)) in cases.into_iter().enumerate() {
        let top = if name == "floor" { -0.2 } else { -0.12 };
        let turn = Quat::from_rotation_y(0.3);
        let at = Transform::from_xyz(0.1, top, 0.01).with_rotation(turn);
        let (expected, faults) = rests_on(alike, default(), at);
        let touched = apart(&expected, &free).min(5e-3);
        rows.extend([
            Row::new(
                format!("control, {name} of that size: it moves hair (m)"),
                5e-3,
                touched,
                0.0,
            ),
            Row::at_most(format!("control, {name} of that size: faults"), faults, 0.0),
        ]);
        let (mean, _) = rests_on(
            solid.clone(),
            default(),
            at.with_scale(Vec3::splat(scale.element_product().cbrt())),
        );
        let by_mean = apart(&mean, &expected).min(4.0 * off);
        let what =
            format!("control, {name} by its mean scale: off by four times the tolerance (m)");
        rows.push(Row::new(what, 4.0 * off, by_mean, 0.0));
        // Its own scale, and by turns that of its parent, both, and a mirrored one.
        let ways = [
            ("parent's", at.with_scale(scale), Transform::IDENTITY),
            ("both's", at.with_scale(Vec3::splat(2.0)), Transform::from_scale(0.5 * scale)),
            ("mirrored", Transform::IDENTITY, at.with_scale(scale * Vec3::new(1.0, 1.0, -1.0))),
        ];
        for (whose, parent, own) in
            [("its own", Transform::IDENTITY, at.with_scale(scale)), ways[k % 3]]
        {
            let (found, faults) = rests_on(solid.clone(), parent, own);
            let what = format!("{name}, {whose} scale");
            rows.extend([
                Row::at_most(
                    format!("{what}: off one of that size (m)"),
                    apart(&found, &expected),
                    off,
                ),
                Row::at_most(format!("{what}: faults"), faults, 0.0),
            ]);
        }
    }
    rows
}

/// How far the tip of a strand of 20 cm is aside from under its root (m).
pub(super) fn aside(app: &App, e: Entity) -> f32 {
    let strand = strand(app, e);
    let p = strand.positions();
    let off = p[p.len() - 1] - p[0];
    off.x.hypot(off.z)
}

/// Line 8: winds and water are as large as their transform scales them.
fn zones_and_water() -> Vec<Row> {
    let mut rows = Vec::new();
    let scale = Vec3::new(4.0, 0.25, 4.0);
    let zone = |half_size| WindZone {
        shape: ZoneShape::Box,
        half_size,
        falloff: 0.05,
        velocity: Vec3::X * 5.0,
        ..default()
    };
    let stream = |half_size| WaterVolume {
        shape: ZoneShape::Ellipsoid,
        half_size,
        current: Vec3::X * 0.3,
        ..default()
    };
    // A strand far aside in what is flat and wide, and one above it.
    let found = |spawn: &dyn Fn(&mut App)| {
        let mut app = app(60.0);
        app.insert_resource(HairDefault(HairWetting { soaking: 0.0, ..default() }));
        spawn(&mut app);
        let places = [Vec3::new(2.5, 0.1, 0.5), Vec3::new(0.0, 0.7, 0.0)];
        let strands = places.map(|place| {
            let (hair, e) = strand_along(&mut app, 0.2, 6, Vec3::NEG_Y);
            place_mut(&mut app, hair, |at| at.translation = place);
            e
        });
        run(&mut app, 2.0);
        (strands.map(|e| aside(&app, e)), fault_count(&app))
    };
    let scaled = Transform::from_scale(scale);
    for (name, stretched, alike, mean) in [
        (
            "wind",
            found(&|app| _ = app.world_mut().spawn((zone(Vec3::ONE), scaled))),
            found(&|app| _ = app.world_mut().spawn(zone(scale))),
            found(&|app| _ = app.world_mut().spawn(zone(Vec3::splat(1.587)))),
        ),
        (
            "water",
            found(&|app| _ = app.world_mut().spawn((stream(Vec3::ONE), scaled))),
            found(&|app| _ = app.world_mut().spawn(stream(scale))),
            found(&|app| _ = app.world_mut().spawn(stream(Vec3::splat(1.587)))),
        ),
    ] {
        let [(stretched, faults), (alike, _), (mean, _)] = [stretched, alike, mean];
        let least = |got: f32| got.min(0.03);
        rows.extend([
            Row::new(format!("{name}, its size: far hair aside (m)"), 0.03, least(alike[0]), 0.0),
            Row::at_most(format!("{name}, its size: hair above aside (m)"), alike[1], 1e-3),
            Row::new(format!("{name} scaled: far hair aside (m)"), alike[0], stretched[0], 1e-3),
            Row::at_most(format!("{name} scaled: hair above aside (m)"), stretched[1], 1e-3),
            Row::at_most(format!("{name} scaled: faults"), faults, 0.0),
            Row::at_most(format!("control, {name} by its mean scale: far (m)"), mean[0], 1e-3),
            Row::new(format!("control, {name} by its mean: above (m)"), 0.03, least(mean[1]), 0.0),
        ]);
    }
    rows
}

//! Hair as it is drawn now, as a groom and in files.

use crate::common::*;
use bevy::prelude::*;
use bevy_keratin::{
    authoring::groom::{alembic, yuksel},
    prelude::*,
    render::{FollowerRoot, FollowerRoots, HairFollowers, HairLook},
};

/// Followers that are drawn where their roots say, in the shape of their guides.
fn plain(count: u32) -> HairFollowers {
    HairFollowers {
        phase_variation: 0.0,
        stray: 0.0,
        clump: 0.0,
        wet_clump: 0.0,
        locks: Vec3::ZERO,
        lock_length_variation: 0.0,
        frizz: 0.0,
        flyaways: 0.0,
        ..HairFollowers::new(count)
    }
}

/// Twelve guides that stand out to the side, with followers between them.
fn tress(app: &mut App) -> (Entity, Vec<Entity>, Vec<Vec3>) {
    let between = |i: usize| Vec3::new(0.0, 0.0, 0.005 * i as f32 + 0.002);
    let roots: Vec<Vec3> = (0..11).map(between).collect();
    let root = |place: &Vec3| FollowerRoot {
        place: *place,
        length: 0.1,
        reach: Vec3::X * 0.1,
        ..default()
    };
    let followers = FollowerRoots(roots.iter().map(root).collect());
    let look = HairLook { width: 2e-4, taper: 0.5, ..default() };
    let hair = app.world_mut().spawn((Hair, followers, plain(1000), look)).id();
    let grow = |i: usize| {
        let node = |k: usize| Vec3::new(0.0125 * k as f32, 0.0, 0.005 * i as f32);
        let strand = Strand::from_polyline(&(0..9).map(node).collect::<Vec<_>>()).unwrap();
        app.world_mut().spawn((StrandOf(hair), strand)).id()
    };
    let strands = (0..12).map(grow).collect();
    (hair, strands, roots)
}

#[test]
fn all_drawn_strands_become_a_groom_in_their_present_shape() {
    let mut app = test_app(60.0);
    let (hair, strands, roots) = tress(&mut app);
    run(&mut app, 0.5);
    let groom = Groom::of_hair(app.world_mut(), hair).unwrap();
    assert_eq!(groom.len(), 12 + 11);
    let all: Vec<_> = groom.strands().collect();
    for (drawn, id) in all.iter().zip(&strands) {
        assert_eq!(drawn.points, strand(&app, *id).positions(), "guides are what is simulated");
        assert!(drawn.is_guide);
    }
    let sunk = strand(&app, strands[0]).positions()[8].y;
    assert!(sunk < -0.003, "gravity has bent it: {sunk}");
    for (drawn, root) in all[12..].iter().zip(&roots) {
        assert_eq!((drawn.points.len(), drawn.is_guide), (17, false));
        assert!(drawn.points[0].distance(*root) < 1e-6);
        let tip = drawn.points[16];
        assert!((tip.y - sunk).abs() < 1e-3, "followers hang as their guides do: {tip} {sunk}");
        assert!((drawn.length() - 0.1).abs() < 1e-3);
        let widths = drawn.widths.unwrap();
        assert_eq!((widths[0], widths[16]), (2e-4, 1e-4), "the look's, tapered");
    }
    // Cut hair is as short as it is drawn.
    app.world_mut().trigger(CutHair::all(hair, CutBy::Length(0.05)));
    app.world_mut().flush();
    run(&mut app, 0.1);
    let cut = Groom::of_hair(app.world_mut(), hair).unwrap();
    for strand in cut.strands() {
        assert!((strand.length() - 0.05).abs() < 2e-3, "{}", strand.length());
    }
}

#[test]
fn present_hair_in_a_file_comes_back_strand_for_strand() {
    let mut app = test_app(60.0);
    let (hair, ..) = tress(&mut app);
    app.insert_resource(HairWind { velocity: Vec3::new(3.0, 1.0, 2.0), ..default() });
    app.world_mut().entity_mut(hair).insert(HairFollowers::new(300));
    run(&mut app, 0.3);
    let groom = Groom::of_hair(app.world_mut(), hair).unwrap();
    let (again, losses) = alembic::read(&alembic::write(&groom).unwrap()).unwrap();
    assert!(losses.is_empty(), "{losses}");
    assert_eq!(again, groom);
    // `.hair` has no marks of guides.
    let file = yuksel::write(&groom).unwrap();
    let (again, losses) = yuksel::read(&file).unwrap();
    assert!(losses.is_empty(), "{losses}");
    assert_eq!(again.len(), groom.len());
    for (a, b) in again.strands().zip(groom.strands()) {
        assert_eq!((a.points, a.widths), (b.points, b.widths));
    }
    // And grows on another head as the same simulated strands.
    let settings = GroomSettings {
        scale: Some(1.0),
        up: Some(UpAxis::Y),
        roots: RootEnd::First,
        keep_strays: true,
        ..default()
    };
    let (read, losses) = Groom::from_file(&file, &settings).unwrap();
    assert!(losses.is_empty(), "{losses}");
    assert_eq!(read.points(), groom.points());
}

#[test]
fn all_hair_of_a_wearer_is_in_the_frame_of_the_first() {
    let mut app = app_with_meshes(60.0);
    let (hair, ..) = tress(&mut app);
    let (beard, strands, _) = tress(&mut app);
    app.world_mut().entity_mut(hair).insert(HairFollowers::none());
    let place = Transform::from_xyz(0.0, 0.3, 0.0).with_rotation(Quat::from_rotation_y(1.0));
    app.world_mut().entity_mut(beard).insert((HairFollowers::none(), place));
    let wearer = app.world_mut().spawn_empty().id();
    [hair, beard].iter().for_each(|of| _ = app.world_mut().entity_mut(*of).insert(WornBy(wearer)));
    run(&mut app, 0.1);
    let groom = Groom::of_hair(app.world_mut(), wearer).unwrap();
    assert_eq!(groom.len(), 24);
    let tip = place.transform_point(strand(&app, strands[3]).positions()[8]);
    assert!(groom.strand(15).unwrap().points[8].distance(tip) < 1e-5);

    let nobody = app.world_mut().spawn_empty().id();
    assert_eq!(Groom::of_hair(app.world_mut(), nobody), Err(GroomError::NoHair));
    let bald = app.world_mut().spawn(Hair).id();
    assert_eq!(Groom::of_hair(app.world_mut(), bald), Err(GroomError::Empty));
}

#[test]
fn strands_between_guides_are_out_of_solids() {
    let mut app = app_with_meshes(60.0);
    let (hair, ..) = tress(&mut app);
    run(&mut app, 0.1);
    let ball = Transform::from_xyz(0.05, 0.0, 0.027);
    app.world_mut().spawn((HairCollider::sphere(0.005).unwrap(), ball));
    app.update();
    let groom = Groom::of_hair(app.world_mut(), hair).unwrap();
    let followers = groom.strands().filter(|strand| !strand.is_guide);
    let nearest = followers
        .flat_map(|strand| strand.points.iter().map(|p| p.distance(ball.translation)))
        .fold(f32::MAX, f32::min);
    assert!(nearest > 0.005, "{nearest}");
}

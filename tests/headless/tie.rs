//! Ties gather hair, hold it, let it go, and are kept by hairdos.

use crate::common::{fault_kinds, run, strand, test_app};
use bevy::prelude::*;
use bevy_keratin::{FaultKind, prelude::*};

const HEAD: f32 = 0.09;

#[derive(Resource, Default)]
struct Answers(Vec<HairTied>);

struct Worn {
    app: App,
    head: Entity,
    hair: Entity,
    strands: Vec<Entity>,
}

impl Worn {
    /// A head at a place with strands of a length all over its upper half, settled.
    fn new(place: Transform, length: f32) -> Self {
        let mut app = test_app(60.0);
        app.init_resource::<Answers>();
        app.add_observer(|tied: On<HairTied>, mut all: ResMut<Answers>| all.0.push(*tied.event()));
        let ball = HairCollider::sphere(HEAD).unwrap();
        let head = app.world_mut().spawn((ball, place)).id();
        let hair = app.world_mut().spawn((Hair, ChildOf(head))).id();
        let grow = |i: usize| {
            let y = (i as f32 + 0.5) / 60.0;
            let across = (1.0 - y * y).sqrt();
            let (sine, cosine) = (2.4 * i as f32).sin_cos();
            let normal = Vec3::new(across * cosine, y, across * sine);
            let node = |k: usize| normal * (HEAD + 0.002 + length / 14.0 * k as f32);
            Strand::from_polyline(&(0..15).map(node).collect::<Vec<_>>()).unwrap()
        };
        let strands =
            (0..60).map(|i| app.world_mut().spawn((StrandOf(hair), grow(i))).id()).collect();
        run(&mut app, 3.0);
        Self { app, head, hair, strands }
    }

    /// A tie behind the head, and the request to gather some strands.
    fn tie(&mut self, region: StrandRegion) -> Entity {
        let out = Vec3::new(0.0, 0.4, 0.9).normalize();
        let behind = Transform::from_translation(out * 0.115)
            .with_rotation(Quat::from_rotation_arc(Vec3::Y, out));
        let world = self.app.world_mut();
        let tie = world.spawn((HairTie::default(), behind, ChildOf(self.head))).id();
        world.trigger(TieHair { hair: self.hair, tie, region });
        tie
    }

    fn answer(&mut self) -> HairTied {
        let all = core::mem::take(&mut self.app.world_mut().resource_mut::<Answers>().0);
        let [answer] = all[..] else { panic!("{all:?}") };
        answer
    }

    fn tied(&self) -> impl Iterator<Item = Entity> + '_ {
        self.strands.iter().copied().filter(|id| self.app.world().entity(*id).contains::<Tied>())
    }

    /// How far the strands' nearest points are from the middle of a tie behind the head, the farthest of tied ones
    /// and the nearest of others (m, in the hair's frame).
    fn ring(&self) -> (f32, f32) {
        let ring = Vec3::new(0.0, 0.4, 0.9).normalize() * 0.115;
        let (mut farthest, mut nearest) = (0.0_f32, f32::INFINITY);
        for id in &self.strands {
            let p = strand(&self.app, *id).positions();
            let near = |ends: &[Vec3]| {
                let t = (ring - ends[0]).dot(ends[1] - ends[0]) / ends[0].distance_squared(ends[1]);
                ends[0].lerp(ends[1], t.clamp(0.0, 1.0)).distance(ring)
            };
            let apart = p.windows(2).map(near).fold(f32::INFINITY, f32::min);
            if self.app.world().entity(*id).contains::<Tied>() {
                farthest = farthest.max(apart);
            } else {
                nearest = nearest.min(apart);
            }
        }
        (farthest, nearest)
    }

    fn strain(&self) -> f32 {
        let edges = |id: &Entity| {
            let strand = strand(&self.app, *id);
            let edges = strand.positions().windows(2).zip(strand.rest_lengths());
            edges.map(|(ends, l)| (ends[0].distance(ends[1]) / l - 1.0).abs()).fold(0.0, f32::max)
        };
        self.strands.iter().map(edges).fold(0.0, f32::max)
    }

    fn lowest(&self) -> f32 {
        let nodes = self.strands.iter().flat_map(|id| strand(&self.app, *id).positions());
        nodes.map(|p| p.y).fold(f32::INFINITY, f32::min)
    }
}

#[test]
fn a_ponytail_is_gathered_round_the_head_and_holds() {
    for place in [
        Transform::from_xyz(0.0, 1.6, 0.0),
        Transform::from_xyz(300.0, 1.6, -20.0)
            .with_rotation(Quat::from_rotation_y(2.0))
            .with_scale(Vec3::splat(2.0)),
    ] {
        let mut worn = Worn::new(place, 0.35);
        let tie = worn.tie(StrandRegion::All);
        let mut strain = 0.0_f32;
        for _ in 0..180 {
            worn.app.update();
            strain = strain.max(worn.strain());
        }
        let answer = worn.answer();
        assert_eq!((answer.hair, answer.tie), (worn.hair, tie));
        assert_eq!((answer.strands, answer.too_short), (60, 0));
        let (farthest, _) = worn.ring();
        println!("{:?}: {farthest} m off, strain {strain}", place.translation);
        assert!(farthest < 0.0128 + 0.004, "{farthest} m from the middle of the ring");
        assert!(strain < 0.041, "{strain}");
        // The tail hangs behind the head, and the head stays bare of it in front.
        for id in &worn.strands {
            let p = strand(&worn.app, *id).positions();
            let tip = p[14];
            assert!(tip.z > 0.0, "a tip in front at {tip}");
            assert!(p.iter().all(|p| p.length() > HEAD - 0.002), "{p:?}");
        }
        // A head that is shaken at 3 Hz loses none.
        for tick in 0..120 {
            let swing = (core::f32::consts::TAU * 3.0 * tick as f32 / 60.0).sin();
            let mut at = worn.app.world_mut().get_mut::<Transform>(worn.head).unwrap();
            at.translation.x = place.translation.x + 0.05 * swing;
            worn.app.update();
            strain = strain.max(worn.strain());
        }
        // Strands that gave way in that come back.
        println!("shaken: {:?} m off, strain {strain}", worn.ring().0);
        assert!(strain < 0.041, "{strain}");
        run(&mut worn.app, 1.0);
        println!("{:?} m off", worn.ring().0);
        assert!(worn.ring().0 < 0.0128 + 0.004, "{:?}", worn.ring());
        // Despawned, it lets go.
        worn.app.world_mut().despawn(tie);
        run(&mut worn.app, 3.0);
        assert_eq!(worn.tied().count(), 0);
        let free = strand(&worn.app, worn.strands[30]).positions()[14];
        assert!(worn.ring().1 < f32::INFINITY && free.is_finite());
        let held = worn.app.world().get::<HeldNodes>(worn.strands[30]).unwrap();
        assert!(held.targets.is_empty());
    }
}

#[test]
fn a_region_is_tied_and_what_is_too_short_stays_free() {
    let mut worn = Worn::new(Transform::from_xyz(0.0, 1.6, 0.0), 0.35);
    // Half up: roots above 5 cm.
    let above = StrandRegion::Above { point: Vec3::Y * 0.05, normal: Vec3::Y };
    let tie = worn.tie(above);
    run(&mut worn.app, 1.0);
    let roots = worn.strands.iter().map(|id| strand(&worn.app, *id).positions()[0]);
    let expected = roots.filter(|root| root.y > 0.05).count();
    let answer = worn.answer();
    assert_eq!((answer.strands, answer.too_short, worn.tied().count()), (expected, 0, expected));
    // Another tie takes what it wants.
    let other = worn.tie(StrandRegion::All);
    run(&mut worn.app, 1.0);
    assert_eq!(worn.answer().strands, 60);
    assert!(worn.app.world().get::<TiedStrands>(tie).is_none_or(|tied| tied.is_empty()));
    worn.app.world_mut().entity_mut(other).remove::<HairTie>();
    run(&mut worn.app, 0.1);
    assert_eq!(worn.tied().count(), 0);

    // 12 cm do not reach from the forehead round to it, but from behind.
    let mut worn = Worn::new(Transform::default(), 0.12);
    worn.tie(StrandRegion::All);
    run(&mut worn.app, 1.0);
    let answer = worn.answer();
    assert!(answer.too_short > 15 && answer.strands > 10, "{answer:?}");
    assert_eq!((answer.strands + answer.too_short, worn.tied().count()), (60, answer.strands));

    let hair = worn.hair;
    worn.app.world_mut().trigger(TieHair::all(hair, hair));
    let head = worn.head;
    worn.app.world_mut().trigger(TieHair::all(head, hair));
    run(&mut worn.app, 0.1);
    let kinds = fault_kinds(&mut worn.app).into_iter().filter(|kind| *kind == FaultKind::NoTarget);
    assert_eq!(kinds.count(), 2);
    worn.tie(StrandRegion::Above { point: Vec3::ZERO, normal: Vec3::NAN });
    worn.app.update();
    assert_eq!(fault_kinds(&mut worn.app), [FaultKind::Setting]);
}

#[cfg(feature = "save")]
#[test]
fn a_hairdo_keeps_its_ties() {
    let mut worn = Worn::new(Transform::from_xyz(0.0, 1.6, 0.0), 0.35);
    let loose = Hairdo::of(worn.app.world(), worn.hair).unwrap();
    let tie = worn.tie(StrandRegion::All);
    run(&mut worn.app, 2.0);
    let bytes = Hairdo::of(worn.app.world(), worn.hair).unwrap().to_bytes();
    let ponytail = Hairdo::from_bytes(&bytes).unwrap();
    assert_eq!(ponytail.to_bytes(), bytes);
    assert_eq!(loose.to_bytes()[8], 1, "without ties the first format is written");
    assert_eq!(bytes[8], 3);

    // Undone and done again, by the tie that is there.
    let hair = worn.hair;
    loose.apply(worn.app.world_mut(), hair).unwrap();
    run(&mut worn.app, 2.0);
    assert_eq!(worn.tied().count(), 0);
    assert!(worn.app.world().get_entity(tie).is_ok(), "the game's own tie stays");

    // On another head, turned and larger.
    let place = Transform::from_xyz(3.0, 1.0, 0.0)
        .with_rotation(Quat::from_rotation_y(1.0))
        .with_scale(Vec3::splat(1.5));
    let mut other = Worn::new(place, 0.35);
    let hair = other.hair;
    ponytail.apply(other.app.world_mut(), hair).unwrap();
    run(&mut other.app, 3.0);
    assert_eq!(other.tied().count(), 60);
    let (farthest, _) = other.ring();
    assert!(farthest < 0.0128 + 0.004, "{farthest}");
    let again = Hairdo::of(other.app.world(), hair).unwrap();
    assert_eq!(again.to_bytes()[8], 3);
    // Its tie came with the hairdo, and goes with it.
    let ties = |app: &mut App| app.world_mut().query::<&HairTie>().iter(app.world()).count();
    assert_eq!(ties(&mut other.app), 1);
    ponytail.apply(other.app.world_mut(), hair).unwrap();
    run(&mut other.app, 0.1);
    assert_eq!(ties(&mut other.app), 1);
    loose.apply(other.app.world_mut(), hair).unwrap();
    run(&mut other.app, 1.0);
    assert_eq!((ties(&mut other.app), other.tied().count()), (0, 0));

    // Longer hair is held as far from its roots.
    let mut longer = Worn::new(Transform::default(), 0.5);
    let hair = longer.hair;
    ponytail.apply_resampled(longer.app.world_mut(), hair).unwrap();
    run(&mut longer.app, 3.0);
    assert_eq!(longer.tied().count(), 60);
    assert!(longer.ring().0 < 0.0128 + 0.012, "{:?}", longer.ring());
    assert!(longer.lowest() < other.lowest(), "a longer tail");

    // What the game holds is kept, too.
    let mut held = Worn::new(Transform::default(), 0.35);
    let (hair, first) = (held.hair, held.strands[0]);
    let at = strand(&held.app, first).positions()[8] + Vec3::Y * 0.05;
    let mut targets = vec![None; 9];
    targets[8] = Some(at);
    held.app.world_mut().entity_mut(first).insert(HeldNodes { targets, ..default() });
    run(&mut held.app, 1.0);
    let saved = Hairdo::of(held.app.world(), hair).unwrap();
    let saved = Hairdo::from_bytes(&saved.to_bytes()).unwrap();
    let mut held = Worn::new(Transform::default(), 0.35);
    saved.apply(held.app.world_mut(), held.hair).unwrap();
    run(&mut held.app, 2.0);
    assert!(strand(&held.app, held.strands[0]).positions()[8].distance(at) < 1e-3);
}

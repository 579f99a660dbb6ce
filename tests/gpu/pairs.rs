//! Features in pairs: hair that is asked to be on the device meets any of them in any order.

use crate::{
    residence::grow,
    sleep::damped,
    stage::{Stage, curls},
};
use bevy::{ecs::entity_disabling::Disabled, prelude::*};
use bevy_keratin::{
    LodLevel, SleepCounts,
    gpu::{HairResidence, fetch_strands},
    prelude::*,
};
use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};

/// Radius of each head (m, in its own measure).
const HEAD: f32 = 0.08;

/// A hair, and what has happened to it.
struct Subject {
    hair: Entity,
    colliders: Vec<Entity>,
    is_wet: bool,
    is_away: bool,
    /// For the message where something is wrong.
    story: String,
}

/// What happens to a hair.
#[derive(Clone, Copy, Debug)]
enum Event {
    Settles,
    ChangesLevel,
    Scales,
    GetsWet,
    MeetsCollider,
    LosesColliders,
    GoesAwayOrComesBack,
    LosesStrand,
    IsAskedHome,
    IsAskedBack,
    Turns,
    IsTreated,
    Rests,
}

impl Event {
    const ALL: [Self; 13] = [
        Self::Settles,
        Self::ChangesLevel,
        Self::Scales,
        Self::GetsWet,
        Self::MeetsCollider,
        Self::LosesColliders,
        Self::GoesAwayOrComesBack,
        Self::LosesStrand,
        Self::IsAskedHome,
        Self::IsAskedBack,
        Self::Turns,
        Self::IsTreated,
        Self::Rests,
    ];

    fn happens(self, world: &mut World, subject: &mut Subject, lot: &mut Xoshiro256PlusPlus) {
        let hair = subject.hair;
        match self {
            Self::Settles => _ = world.entity_mut(hair).insert(Settling::default()),
            Self::ChangesLevel => {
                let level = LodLevel::new(0.5, 2, 3).unwrap().with_strands(0.5).unwrap();
                let lod = HairLod { levels: vec![level], ..default() };
                let share = HairScreenShare([0.2, 1.0][lot.random_range(0..2)]);
                world.entity_mut(hair).insert((lod, share));
            }
            Self::Scales => {
                let scales = [Vec3::ONE, Vec3::splat(2.0), Vec3::splat(-1.0), vec3(0.5, 0.5, -0.5)];
                let scale = scales[lot.random_range(0..scales.len())];
                world.get_mut::<Transform>(hair).unwrap().scale = scale;
            }
            // One of three, that others go on beside it.
            Self::GetsWet if lot.random_bool(0.3) && !subject.is_away => {
                world.write_message(SoakHair { target: hair, wetness: 1.0 });
                subject.is_wet = true;
            }
            Self::MeetsCollider => {
                let ball = HairCollider::sphere(0.03).unwrap();
                let cuboid = HairCollider::cuboid(Vec3::splat(0.02)).unwrap();
                let turn = Quat::from_rotation_y(lot.random_range(0.0..6.0));
                let place = Transform::from_translation(turn * vec3(0.15, 0.05, 0.0));
                let collider = [ball, cuboid][lot.random_range(0..2)].clone();
                subject.colliders.push(world.spawn((collider, place, ChildOf(hair))).id());
            }
            Self::LosesColliders => {
                subject.colliders.drain(..).for_each(|collider| _ = world.despawn(collider));
            }
            Self::GoesAwayOrComesBack => subject.put_away(world, !subject.is_away),
            Self::LosesStrand => {
                let strands: Vec<Entity> = world.get::<Strands>(hair).unwrap().iter().collect();
                if strands.len() > 4 {
                    world.despawn(strands[lot.random_range(0..strands.len())]);
                }
            }
            Self::IsAskedHome => _ = world.entity_mut(hair).insert(SimulateOn::Cpu),
            Self::IsAskedBack => _ = world.entity_mut(hair).insert(SimulateOn::Gpu),
            Self::Turns => world.get_mut::<Transform>(hair).unwrap().rotate_y(0.3),
            Self::IsTreated => _ = world.write_message(HairTreatment::dry(hair).over(0.2)),
            Self::Rests | Self::GetsWet => {}
        }
    }
}

impl Subject {
    fn new(hair: Entity, world: &mut World, i: usize) -> Self {
        let place = Transform::from_xyz(i as f32, 0.0, 0.0);
        world.entity_mut(hair).insert((place, damped()));
        let head = HairCollider::sphere(HEAD).unwrap();
        world.spawn((head, Transform::default(), ChildOf(hair)));
        let story = format!("hair {i}:");
        Self { hair, colliders: Vec::new(), is_wet: false, is_away: false, story }
    }

    fn put_away(&mut self, world: &mut World, away: bool) {
        let mut hair = world.entity_mut(self.hair);
        match away {
            true => hair.insert_recursive::<Strands>(Disabled),
            false => hair.remove_recursive::<Strands, Disabled>(),
        };
        self.is_away = away;
    }

    /// Its strands, wherever they are.
    fn strands(&self, world: &mut World) -> Vec<Strand> {
        fetch_strands(world, self.hair);
        let members: Vec<Entity> = world.get::<Strands>(self.hair).unwrap().iter().collect();
        members.into_iter().map(|e| world.get(e).cloned().unwrap()).collect()
    }

    /// Whether it is where it was asked to be, shown, and asleep: what is wet is neither there nor asleep.
    fn rests(&self, world: &World) -> bool {
        let hair = world.entity(self.hair);
        let sleeps = hair.get::<SleepCounts>().is_some_and(|counts| counts.all());
        let is_there = hair.get::<HairResidence>() == Some(&HairResidence::Gpu);
        !hair.contains::<Settling>() && (self.is_wet || sleeps && is_there)
    }
}

pub fn features_go_together_there(stage: &mut Stage) {
    (0..3).for_each(|seed| scenario(stage, seed));
}

fn scenario(stage: &mut Stage, seed: u64) {
    let mut lot = Xoshiro256PlusPlus::seed_from_u64(seed);
    grow(stage, SimulateOn::Gpu, curls(8, 6));
    stage.app.world_mut().resource_mut::<HairGpu>().blocking = lot.random_bool(0.5);
    let water = |stage: &Stage| stage.app.world().resource::<WaterLedger>().error();
    let (lost, mut faults) = (water(stage), Vec::new());
    let others = [0, 1].map(|_| Stage::spawn(&mut stage.app, SimulateOn::Gpu, curls(8, 6)));
    let world = stage.app.world_mut();
    let hairs = [stage.hair, others[0], others[1]].into_iter().enumerate();
    let mut all: Vec<Subject> = hairs.map(|(i, hair)| Subject::new(hair, world, i)).collect();
    for _ in 0..40 {
        let subject = &mut all[lot.random_range(0..3)];
        let event = Event::ALL[lot.random_range(0..Event::ALL.len())];
        subject.story += &format!(" {event:?}");
        event.happens(stage.app.world_mut(), subject, &mut lot);
        for _ in 0..lot.random_range(1..6) {
            stage.run(1);
            faults.extend(stage.faults());
        }
        for subject in &all {
            let strands = subject.strands(stage.app.world_mut());
            assert!(strands.iter().all(Strand::is_finite), "seed {seed}, {}", subject.story);
        }
    }
    for subject in &mut all {
        let world = stage.app.world_mut();
        subject.put_away(world, false);
        Event::IsAskedBack.happens(world, subject, &mut lot);
        Event::LosesColliders.happens(world, subject, &mut lot);
    }
    stage.at_once(4);
    for _ in 0..150 {
        stage.run(1);
        faults.extend(stage.faults());
        if all.iter().all(|subject| subject.rests(stage.app.world())) {
            break;
        }
    }
    stage.at_once(1);
    for subject in &all {
        let world = stage.app.world_mut();
        let story = format!("seed {seed}, {}", subject.story);
        let at = world.get::<HairResidence>(subject.hair);
        assert!(subject.rests(world), "{at:?}; {story}");
        let strands = subject.strands(world);
        assert!(strands.iter().all(Strand::is_finite), "{story}");
        let nodes = strands.iter().flat_map(Strand::positions);
        let deepest = nodes.map(|p| HEAD - p.length()).fold(f32::MIN, f32::max);
        assert!(deepest < 0.004, "{deepest} m in its head; {story}");
    }
    for (i, fault) in faults.iter().enumerate() {
        assert!(!faults[..i].contains(fault), "reported again: {fault}; seed {seed}");
    }
    assert!(water(stage) < lost + 1e-5, "{} of the water is lost; seed {seed}", water(stage));
    others.into_iter().for_each(|hair| _ = stage.app.world_mut().despawn(hair));
}

//! Strands that are led, held and wound where they cannot go.

use crate::common::{faults, test_app};
use bevy::prelude::*;
use bevy_keratin::prelude::*;

/// Radius of the head, at the origin (m).
const HEAD: f32 = 0.1;

struct Led {
    app: App,
    id: Entity,
    most: f32,
    fastest: f32,
}

impl Led {
    /// Ten edges of 3 cm upward from the crown of a ball.
    fn new(model: StrandModel, method: SolverMethod) -> Self {
        let mut app = test_app(60.0);
        app.world_mut().spawn(HairCollider::sphere(HEAD).unwrap());
        let hair = app.world_mut().spawn((Hair, model, HairSolver { method, ..default() })).id();
        let points: Vec<Vec3> = (0..=10).map(|i| Vec3::Y * (HEAD + 0.03 * i as f32)).collect();
        let strand = Strand::from_polyline(&points).unwrap();
        let id = app.world_mut().spawn((StrandOf(hair), strand)).id();
        Self { app, id, most: 0.0, fastest: 0.0 }
    }

    fn strand(&self) -> &Strand {
        self.app.world().get::<Strand>(self.id).unwrap()
    }

    fn strain(&self) -> f32 {
        let strand = self.strand();
        let edges = strand.positions().windows(2).zip(strand.rest_lengths());
        edges.map(|(ends, l)| (ends[0].distance(ends[1]) / l - 1.0).abs()).fold(0.0, f32::max)
    }

    fn tick(&mut self) {
        self.app.update();
        let strand = self.strand();
        self.fastest = strand.velocities().iter().fold(self.fastest, |v, w| v.max(w.length()));
        self.most = self.most.max(self.strain());
    }

    fn hold_tip(&mut self, at: Vec3) {
        let mut targets = vec![None; 11];
        targets[10] = Some(at);
        self.app.world_mut().entity_mut(self.id).insert(HeldNodes { targets, ..default() });
    }

    /// Leads the tip along a path in 90 ticks, then holds it.
    fn lead(&mut self, path: impl Fn(f32) -> Vec3) {
        for tick in 0..90 {
            self.hold_tip(path((tick + 1) as f32 / 90.0));
            self.tick();
        }
        for _ in 0..240 {
            self.tick();
        }
    }
}

/// The default solver, the papers' projections, masses and springs, with the strain that each may leave.
const MODELS: [(StrandModel, SolverMethod, f32); 3] = [
    (StrandModel::Rod, SolverMethod::Direct, 0.04),
    (StrandModel::Rod, SolverMethod::Sweeps, 0.05),
    (StrandModel::MassSpring, SolverMethod::Direct, 0.5),
];

#[test]
fn a_tip_that_is_led_where_hair_does_not_reach_gives_way() {
    let paths: [(&str, fn(f32) -> Vec3); 5] = [
        ("through the head", |t| Vec3::Y * (0.4 - 0.595 * t)),
        ("round it", |t| {
            let angle = core::f32::consts::PI * t;
            Vec3::new(angle.sin(), angle.cos(), 0.0) * (0.4 - 0.205 * t)
        }),
        ("at once behind it", |_| Vec3::new(0.01, -0.195, 0.0)),
        ("into it", |t| Vec3::Y * (0.4 - 0.37 * t) + Vec3::X * (0.02 * t)),
        ("far away", |t| Vec3::Y * 0.4 + Vec3::X * (2.0 * t)),
    ];
    for (what, path) in paths {
        for (model, method, strain) in MODELS {
            let mut led = Led::new(model, method);
            led.lead(path);
            let what = format!("{what} {model:?} {method:?}");
            println!("{what}: strain {}, {} at rest, {} m/s", led.most, led.strain(), led.fastest);
            let told = faults(&mut led.app);
            assert!(led.most < 1.05 * strain, "{what}: strain {}", led.most);
            // At once, that is 0.6 m within a tick.
            assert!(led.fastest < 30.0, "{what}: {} m/s", led.fastest);
            let [told] = &told[..] else { panic!("{what}: {told:?}") };
            assert!(told.entity == Some(led.id) && told.message.contains("node 10"), "{told:?}");
            // What it cannot reach is a third of its length away or more, but for the way round.
            led.lead(|_| Vec3::new(0.2, 0.15, 0.0));
            let tip = led.strand().positions()[10];
            assert!(tip.distance(Vec3::new(0.2, 0.15, 0.0)) < 1e-3, "{what}: then at {tip}");
            assert_eq!(faults(&mut led.app).len(), 0, "{what}");
        }
    }
}

#[test]
fn a_rod_behind_the_head_is_wound_as_far_as_hair_reaches() {
    for (what, at, axis) in [
        ("below", Vec3::NEG_Y * 0.14, Vec3::X),
        ("beside", Vec3::X * 0.14, Vec3::Z),
        ("behind", Vec3::new(0.09, -0.09, 0.0), Vec3::Z),
    ] {
        for (model, method, strain) in MODELS {
            let mut led = Led::new(model, method);
            let turn = Quat::from_rotation_arc(Vec3::Y, axis);
            let place = Transform::from_translation(at).with_rotation(turn);
            let rod = led.app.world_mut().spawn((PermRod::new(0.01, 0.2).unwrap(), place)).id();
            led.app.world_mut().entity_mut(led.id).insert(WoundOn(rod));
            for _ in 0..480 {
                led.tick();
            }
            let what = format!("{what} {model:?} {method:?}");
            println!("{what}: strain {}, {} at rest, {} m/s", led.most, led.strain(), led.fastest);
            assert!(led.most < 1.05 * strain, "{what}: strain {}", led.most);
            assert!(led.fastest < 20.0, "{what}: {} m/s", led.fastest);
            // Springs stretch to the rod beside the head.
            let told = faults(&mut led.app).len();
            assert!(told == 1 || told == 0 && model == StrandModel::MassSpring, "{what}: {told}");
            led.app.world_mut().entity_mut(rod).remove::<PermRod>();
            for _ in 0..480 {
                led.tick();
            }
            assert!(!led.app.world().entity(led.id).contains::<WoundOn>());
            // A rod arches to one side, as one does that was never wound; springs hang.
            let tip = led.strand().positions()[10];
            assert!(tip.y < 0.2 && tip.length() > 0.16, "{what}: {tip}");
        }
    }
}

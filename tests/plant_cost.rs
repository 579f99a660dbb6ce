//! What planting costs, and where roots are on the examples' head.

#[path = "../examples/shared/head.rs"]
#[allow(dead_code, reason = "the presets use all of it")]
mod head;
#[path = "../examples/shared/mannequin.rs"]
#[allow(dead_code, reason = "the salon uses all of it")]
mod mannequin;

/// What the mannequin takes from the scenes.
mod scenes {
    pub const HEAD_RADIUS: f32 = 0.1;
}

use bevy::prelude::*;
use bevy_keratin::{authoring::plant::*, forces::contact::ColliderShape};
use std::time::{Duration, Instant};

/// A clock that runs while this thread does, so that others on the machine do not count; a usual one
/// where the system has none.
struct Clock(Instant, Option<Duration>);

impl Clock {
    fn start() -> Self {
        Self(Instant::now(), Self::on_core())
    }

    fn on_core() -> Option<Duration> {
        let stat = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
        stat.split(' ').next()?.parse().ok().map(Duration::from_nanos)
    }

    fn passed(&self) -> Duration {
        let on_core = self.1.and_then(|from| Self::on_core()?.checked_sub(from));
        on_core.unwrap_or_else(|| self.0.elapsed())
    }
}

/// At most 150 ms of one core each, guides and the 40,000 drawn strands together, in a release build on
/// a machine of its own. This build is slower and the machine may be shared: what takes an order more
/// has lost its nearest-neighbour search.
#[test]
fn presets_are_planted_in_a_moment() {
    let mesh = mannequin::mesh();
    let scalp = Scalp { up: Dir3::X, front: Dir3::Y, height: 0.118, ..default() };
    for preset in HairPreset::ALL {
        let clock = Clock::start();
        let planted = preset.plant(&mesh, &scalp).unwrap();
        let guides = clock.passed();
        let (count, line) = (preset.settings().followers.count, preset.hairline());
        let drawn = preset.follower_roots(&planted, &mesh, &scalp, &line, count, 0).unwrap();
        let all = clock.passed();
        println!(
            "{preset:?}: {} guides in {guides:.1?}, {} drawn strands in {:.1?}",
            planted.groom.len(),
            drawn.0.len(),
            all - guides
        );
        assert!(all.as_secs_f32() < 3.0, "{preset:?} took {all:?}");
    }
}

/// A root inside a solid stretches its strand: the first node is pushed out of it, the root stays.
#[test]
fn no_root_is_inside_the_solids_of_the_training_head() {
    let mesh = mannequin::mesh();
    let scalp = Scalp { up: Dir3::X, front: Dir3::Y, height: 0.118, ..default() };
    let solids = head::close_fit().unwrap();
    // The mesh lies, its crown at +X and its face at +Y.
    let upright = |p: Vec3| Vec3::new(p.z, p.x, p.y);
    // How far outside (m), approximately for ellipsoids.
    let outside = |p: Vec3| {
        let all = solids.iter().map(|(collider, place)| {
            let p = place.compute_affine().inverse().transform_point3(p);
            match &collider.shape {
                ColliderShape::Capsule(c) => {
                    (p - Vec3::Y * p.y.clamp(-c.half_length, c.half_length)).length() - c.radius
                }
                ColliderShape::Sphere(s) => p.length() - s.radius,
                ColliderShape::Ellipsoid { radii } => {
                    ((p / *radii).length() - 1.0) * radii.min_element()
                }
                other => panic!("{other:?}"),
            }
        });
        all.fold(f32::INFINITY, f32::min)
    };
    // Fur grows on the cut below the shoulders as well, which solids reach through.
    for preset in HairPreset::ALL.into_iter().filter(|p| *p != HairPreset::Fur) {
        let planted = preset.plant(&mesh, &scalp).unwrap();
        let roots = planted.groom.strands().map(|s| outside(upright(s.points[0])));
        let least = roots.fold(f32::INFINITY, f32::min);
        println!("{preset:?}: roots are {:.2} mm outside at least", 1e3 * least);
        assert!(least > -0.1e-3, "{preset:?}: a root is {} mm inside", -1e3 * least);
    }
}

/// Hair would float over the skin. What [`head::close_fit`] adds lies within its vertices; of the others
/// one is as high as the nose, in the face where no hair lies, and one outside of the throat by 5 mm.
#[test]
fn the_solids_of_the_training_head_lie_within_its_skin() {
    let (solids, coarse) = (head::close_fit().unwrap(), head::body().unwrap().len());
    let ball = Sphere::new(1.0).mesh().ico(6).unwrap();
    let ways = ball.attribute(Mesh::ATTRIBUTE_POSITION).and_then(|p| p.as_float3()).unwrap();
    let mut most = [f32::NEG_INFINITY; 2];
    for (i, (collider, place)) in solids.iter().enumerate() {
        let (half_length, radius) = match &collider.shape {
            ColliderShape::Capsule(c) => (c.half_length, c.radius),
            ColliderShape::Sphere(s) => (0.0, s.radius),
            _ => continue,
        };
        for way in ways {
            for end in [-half_length, 0.0, half_length] {
                let p = place.transform_point(Vec3::Y * end + Vec3::from(*way) * radius);
                // Those of the chest reach through the cut below it.
                let lying = Vec3::new(p.y, p.z, p.x);
                let is_free = lying.x > mannequin::BUST_END + 0.01
                    && (coarse <= i || lying.y < 0.06 || lying.x < -0.12);
                if is_free {
                    let most = &mut most[usize::from(coarse <= i)];
                    *most = most.max(mannequin::head(lying));
                }
            }
        }
    }
    println!("{:.1} mm outside at most, of the closer ones {:.1}", 1e3 * most[0], 1e3 * most[1]);
    assert!(most[0] < 5.5e-3 && most[1] < 1.5e-3, "{most:?}");
}

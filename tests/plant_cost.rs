//! What planting costs.

#[path = "../examples/salon/mannequin.rs"]
#[allow(dead_code, reason = "the salon uses all of it")]
mod mannequin;

/// What the mannequin takes from the scenes.
mod scenes {
    pub const HEAD_RADIUS: f32 = 0.1;
}

use bevy::prelude::*;
use bevy_keratin::plant::*;
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

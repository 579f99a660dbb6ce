//! What drawing hair allocates in a frame: nothing. Counted by a global allocator, so this is a
//! binary of its own.

mod common;
#[path = "common/device.rs"]
mod device;
#[path = "common/offscreen.rs"]
mod offscreen;

use bevy::{
    ecs::schedule::{ScheduleLabel, SingleThreadedExecutor},
    prelude::*,
    render::{ExtractSchedule, RenderApp},
};
use bevy_keratin::{
    prelude::*,
    render::{HairRenderSystems, WetLook},
};
use offscreen::Offscreen;

use counting::{begin, begin_ours, counted, end};

#[allow(unsafe_code, reason = "an allocator cannot be without")]
mod counting {
    use std::{
        alloc::{GlobalAlloc, Layout, System},
        backtrace::Backtrace,
        cell::Cell,
        sync::atomic::{AtomicU64, Ordering},
    };

    thread_local! {
        static HERE: Cell<bool> = const { Cell::new(false) };
        static OURS: Cell<bool> = const { Cell::new(false) };
    }
    static COUNT: AtomicU64 = AtomicU64::new(0);

    struct Counting;

    fn note() {
        // A thread that is ending has no cell any more, and nothing to be counted.
        if !HERE.try_with(Cell::get).unwrap_or(false) || std::thread::panicking() {
            return;
        }
        // Capturing a backtrace allocates, too.
        HERE.set(false);
        let counts = !OURS.get() || {
            let stack = Backtrace::force_capture().to_string();
            stack.contains("bevy_keratin::render::")
        };
        COUNT.fetch_add(u64::from(counts), Ordering::Relaxed);
        HERE.set(true);
    }

    // SAFETY: everything is the system allocator's; counting allocates nothing.
    unsafe impl GlobalAlloc for Counting {
        unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
            note();
            unsafe { System.alloc(layout) }
        }
        unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
            note();
            unsafe { System.alloc_zeroed(layout) }
        }
        unsafe fn realloc(&self, at: *mut u8, layout: Layout, size: usize) -> *mut u8 {
            note();
            unsafe { System.realloc(at, layout, size) }
        }
        unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
            unsafe { System.dealloc(at, layout) }
        }
    }

    #[global_allocator]
    static GLOBAL: Counting = Counting;

    /// From here on this thread's allocations count.
    pub fn begin() {
        OURS.set(false);
        HERE.set(true);
    }

    /// From here on those of this thread's allocations count that have the crate's code on the
    /// stack. A thread that takes a backtrace meanwhile, as wgpu may, waits for ever.
    pub fn begin_ours() {
        OURS.set(true);
        HERE.set(true);
    }

    pub fn end() {
        HERE.set(false);
    }

    /// How many there were since the last call.
    pub fn counted() -> u64 {
        COUNT.swap(0, Ordering::Relaxed)
    }
}

/// Counts in a schedule from just before the drawing systems to just behind them.
fn count_in(world: &mut World, label: impl ScheduleLabel, begin: fn()) {
    let mut schedules = world.resource_mut::<Schedules>();
    let schedule = schedules.get_mut(label).unwrap();
    schedule
        .set_executor(SingleThreadedExecutor::new())
        .add_systems((begin.before(HairRenderSystems), end.after(HairRenderSystems)));
}

/// The least that a frame allocates: a rare growth of Bevy's own lists is not what is asked for.
fn least(scene: &mut Offscreen) -> u64 {
    for _ in 0..8 {
        scene.app.update();
    }
    let frame = |_| {
        counted();
        scene.app.update();
        counted()
    };
    (0..12).map(frame).min().unwrap_or(0)
}

fn spawn_hair(world: &mut World, place: f32) {
    let parts = (HairFollowers::new(20), Transform::from_xyz(place, 0.1, 0.0));
    let hair = world.spawn((Hair, parts)).id();
    for i in 0..40 {
        let root = Vec3::new((i % 8) as f32, 0.0, (i / 8) as f32) * 4e-3;
        let node = |n: usize| root + Vec3::new(0.3, -1.0, 0.0) * (0.02 * n as f32);
        let strand = Strand::from_polyline(&[node(0), node(1), node(2), node(3)]).unwrap();
        world.spawn((StrandOf(hair), strand, WetLook(vec![0.5; 4])));
    }
}

/// Bevy's systems that happen to run between ours allocate as they like, and that differs from run to
/// run: of packing, only what has this crate's code on the stack counts.
fn drawing_allocates_nothing_once_it_runs() {
    for stage in [Stage::Packing, Stage::Upload] {
        let mut scene = Offscreen::new(64, 64);
        scene.look(Vec3::new(0.0, 0.0, 0.6), Vec3::ZERO);
        scene.ticking(1);
        match stage {
            Stage::Packing => count_in(scene.app.world_mut(), PostUpdate, begin_ours),
            Stage::Upload => {
                let world = scene.app.sub_app_mut(RenderApp).world_mut();
                count_in(world, ExtractSchedule, begin);
            }
        }
        let none = least(&mut scene);
        spawn_hair(scene.app.world_mut(), 0.0);
        counted();
        scene.app.update();
        let appearing = counted();
        let one = least(&mut scene);
        (0..3).for_each(|k| spawn_hair(scene.app.world_mut(), 0.1 * (k + 1) as f32));
        let four = least(&mut scene);
        println!("{stage:?}: {none} without hair, {one} with one, {four} with four");
        match stage {
            Stage::Packing => {
                assert!(appearing > none, "hair that appears does allocate, and is counted");
                assert_eq!((none, one, four), (0, 0, 0), "packing allocates in every frame");
            }
            // We only call `write_buffer`, for nodes and for the frame's numbers; wgpu takes a staging
            // buffer for each and tracks it.
            Stage::Upload => assert!(four <= none + 4 * 24, "two writes for each hair"),
        }
    }
}

#[derive(Clone, Copy, Debug)]
enum Stage {
    Packing,
    Upload,
}

fn main() -> std::process::ExitCode {
    let name = "drawing_allocates_nothing_once_it_runs";
    device::run_all(vec![device::device(name, drawing_allocates_nothing_once_it_runs)])
}

//! The app that benches time.

use bevy::{
    app::{TaskPoolOptions, TaskPoolPlugin, TaskPoolThreadAssignmentPolicy},
    prelude::*,
    time::TimeUpdateStrategy,
};
use core::time::Duration;

/// An app with one tick of 1/60 s per update on `threads` threads, without the hair plugins.
pub fn app(threads: usize) -> App {
    // The thread that runs the app works too.
    let pools = TaskPoolOptions {
        compute: TaskPoolThreadAssignmentPolicy {
            min_threads: threads - 1,
            max_threads: threads - 1,
            percent: 1.0,
            on_thread_spawn: None,
            on_thread_destroy: None,
        },
        ..default()
    };
    let mut app = App::new();
    app.add_plugins(MinimalPlugins.set(TaskPoolPlugin { task_pool_options: pools }))
        .insert_resource(Time::<Fixed>::from_hz(60.0))
        .insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
    app.world_mut().resource_mut::<Time<Virtual>>().set_max_delta(Duration::MAX);
    app
}

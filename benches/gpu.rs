//! `cargo bench --bench gpu --features gpu`: what a tick of hair costs on this machine's graphics device.
//!
//! Strands that fall and swing among solids, three substeps of 1/180 s a tick. The time is that of the
//! device and of its queue: many ticks are submitted, then waited for. On a software device only the
//! smallest sizes are run, since a software renderer says nothing about a graphics card.
//!
//! `-- --all` runs all sizes on any device.

#[cfg(not(feature = "gpu"))]
fn main() {
    println!("skipped: it needs --features gpu");
}

#[cfg(feature = "gpu")]
fn main() {
    gpu::main();
}

#[cfg(feature = "gpu")]
mod gpu {
    use bevy::{
        app::{FixedMain, PluginGroupBuilder},
        prelude::*,
        render::{
            render_resource::PollType,
            renderer::{RenderAdapterInfo, RenderDevice, RenderQueue},
        },
        window::ExitCondition,
        winit::WinitPlugin,
    };
    use bevy_keratin::{
        gpu::{
            BYTES_PER_NODE, GpuStrands, HairGpu, HairKernels, HairResidence, SimulateOn,
            StrandView, SubstepRecord,
        },
        hair::strand::StrandHistory,
        prelude::*,
        render::HairRenderPlugin,
        solver::rod::obstacle::{Obstacle, Solid},
    };
    use std::{path::Path, time::Instant};

    const SUBSTEPS: usize = 3;

    struct Bench {
        device: RenderDevice,
        queue: RenderQueue,
        kernels: HairKernels,
    }

    fn windowless() -> PluginGroupBuilder {
        let exit_condition = ExitCondition::DontExit;
        DefaultPlugins
            .set(WindowPlugin { primary_window: None, exit_condition, ..default() })
            .set(bevy::log::LogPlugin { filter: "error".into(), ..default() })
            .disable::<WinitPlugin>()
            .disable::<bevy::render::pipelined_rendering::PipelinedRenderingPlugin>()
    }

    pub fn main() {
        let drivers = Path::new("/usr/share/vulkan/icd.d");
        let named = std::env::var_os("VK_ICD_FILENAMES").or(std::env::var_os("VK_DRIVER_FILES"));
        if cfg!(target_os = "linux") && named.is_none() && !drivers.exists() {
            println!("skipped: no graphics driver");
            return;
        }
        let mut app = App::new();
        app.add_plugins(windowless());
        app.finish();
        app.cleanup();
        let world = app.world();
        let info = world.resource::<RenderAdapterInfo>();
        println!(
            "{} ({:?}, {:?}), driver {} {}",
            info.name, info.device_type, info.backend, info.driver, info.driver_info
        );
        let device = world.resource::<RenderDevice>().clone();
        let queue = world.resource::<RenderQueue>().clone();
        let limits = device.limits();
        println!(
            "largest binding {} MiB, {} storage buffers a stage",
            limits.max_storage_buffer_binding_size >> 20,
            limits.max_storage_buffers_per_shader_stage
        );
        let start = Instant::now();
        let kernels = HairKernels::new(&device);
        println!("kernel made in {:.0} ms", start.elapsed().as_secs_f64() * 1e3);
        let is_software = format!("{:?}", info.device_type) == "Cpu";
        let all = std::env::args().any(|argument| argument == "--all");
        let counts: &[usize] = match is_software && !all {
            true => &[200],
            false => &[1_000, 10_000, 100_000],
        };
        let bench = Bench { device, queue, kernels };
        println!(
            "strands  nodes  solids  ms a tick  ns a segment and substep    MB  hand-over ms  \
             read-back ms"
        );
        for &strands in counts {
            for nodes in [9, 16, 32] {
                for solids in [0, 4, 8] {
                    bench.row(strands, nodes, solids, if is_software { 5 } else { 60 });
                }
            }
        }
        hand_over_in_a_game(10_000);
    }

    /// The tick in which a hair of a game goes to the device: its strands are looked at, packed and marked. The first
    /// time it asks the system for memory.
    fn hand_over_in_a_game(strands: usize) {
        let mut app = App::new();
        // Each run of the schedule is a tick.
        let hair = HairPlugins::new(FixedPostUpdate).build().disable::<HairRenderPlugin>();
        app.add_plugins((windowless(), hair));
        app.insert_resource(HairGpu { software: true, ..default() });
        app.finish();
        app.cleanup();
        let free = StrandContact { strength: 0.0, ..default() };
        let made = |app: &mut App, count: usize, on: SimulateOn| {
            let hair = app.world_mut().spawn((Hair, on, free)).id();
            let strands = polylines(count, 16).map(|strand| (strand, StrandOf(hair)));
            let strands: Vec<_> = strands.collect();
            app.world_mut().spawn_batch(strands);
            hair
        };
        let is_there =
            |app: &App, hair| app.world().get::<HairResidence>(hair) == Some(&HairResidence::Gpu);
        // Once this one is there, the kernels are.
        let first = made(&mut app, 32, SimulateOn::Gpu);
        let start = Instant::now();
        while !is_there(&app, first) && start.elapsed().as_secs() < 120 {
            app.update();
            app.world_mut().run_schedule(FixedMain);
        }
        // A software device plays on the processor's threads.
        let _ = app.world().resource::<RenderDevice>().poll(PollType::wait_indefinitely());
        let mut times = Vec::new();
        for _ in 0..8 {
            let hair = made(&mut app, strands, SimulateOn::Cpu);
            app.world_mut().run_schedule(FixedMain);
            app.world_mut().entity_mut(hair).insert(SimulateOn::Gpu);
            let start = Instant::now();
            app.world_mut().run_schedule(FixedMain);
            let took = start.elapsed().as_secs_f64();
            if is_there(&app, hair) {
                times.push(took * 1e3);
            }
            app.world_mut().despawn(hair);
        }
        let [first, later @ ..] = &mut times[..] else {
            println!("a game's hair did not go to this device");
            return;
        };
        later.sort_by(f64::total_cmp);
        let of = |time: Option<&f64>| time.copied().unwrap_or(f64::NAN);
        println!(
            "the tick in which a game's {strands} strands of 16 nodes go there: the first time {first:.1} \
             ms, then {:.1} to {:.1} ms",
            of(later.first()),
            of(later.last()),
        );
    }

    /// Strands that stand on a square and lean outwards.
    fn polylines(strands: usize, nodes: usize) -> impl Iterator<Item = Strand> {
        let side = (strands as f32).sqrt().ceil() as usize;
        (0..strands).map(move |i| {
            let place = [i % side, i / side].map(|k| 0.2 * k as f32 / side as f32 - 0.1);
            let root = Vec3::new(place[0], 0.0, place[1]);
            let direction = (root + Vec3::Y * 0.05).normalize_or(Vec3::Y);
            let step = 0.25 / (nodes - 1) as f32;
            let points: Vec<Vec3> =
                (0..nodes).map(|k| root + direction * (step * k as f32)).collect();
            Strand::from_polyline(&points).expect("points are apart")
        })
    }

    impl Bench {
        fn row(&self, strands: usize, nodes: usize, solids: usize, ticks: usize) {
            let largest = 128 * 32 * nodes * strands.div_ceil(32);
            if largest as u64 > self.device.limits().max_storage_buffer_binding_size {
                println!("{strands:7} {nodes:6}   too large for a binding of this device");
                return;
            }
            let (mut hair, hand_over) = self.hair(strands, nodes);
            let records = vec![record(solids); SUBSTEPS];
            let mut run = |ticks: usize| {
                for _ in 0..ticks {
                    hair.run(&self.device, &self.queue, &self.kernels, &records);
                }
                // A lost device has nothing to wait for.
                let _ = self.device.poll(PollType::wait_indefinitely());
            };
            run(2);
            let start = Instant::now();
            run(ticks);
            let tick = start.elapsed().as_secs_f64() / ticks as f64;
            let segments = (strands * (nodes - 1) * SUBSTEPS) as f64;
            let start = Instant::now();
            let answers = hair.read(&self.device, &self.queue).is_some();
            let read = if answers { start.elapsed().as_secs_f64() } else { f64::NAN };
            println!(
                "{strands:7} {nodes:6} {solids:7} {:10.3} {:25.2} {:5} {:12.1} {:12.1}",
                tick * 1e3,
                tick * 1e9 / segments,
                BYTES_PER_NODE * nodes * strands / 1_000_000,
                hand_over * 1e3,
                read * 1e3,
            );
        }

        /// Strands, and how long it took to hand them over (s).
        fn hair(&self, strands: usize, nodes: usize) -> (GpuStrands, f64) {
            let made: Vec<(Strand, Bonds)> = polylines(strands, nodes)
                .map(|strand| {
                    let bonds = Bonds::of(&strand);
                    (strand, bonds)
                })
                .collect();
            let history = StrandHistory::default();
            let views: Vec<StrandView<'_>> = made
                .iter()
                .map(|(strand, bonds)| StrandView::of(strand, bonds, &history))
                .collect();
            let start = Instant::now();
            let strands = GpuStrands::new(&self.device, &self.kernels, &views);
            (strands, start.elapsed().as_secs_f64())
        }
    }

    /// A substep of dry hair among spheres like those of a head and shoulders.
    fn record(solids: usize) -> SubstepRecord {
        let dt = 1.0 / 180.0;
        let ball = |i: usize| {
            let angle = i as f32 * 2.4;
            let at = Vec3::new(0.08 * angle.cos(), -0.12 - 0.01 * i as f32, 0.08 * angle.sin());
            let solid = Solid::Capsule { a: at, b: at, radius: 0.05 };
            Obstacle { solid, motion: None, friction: 0.3 }
        };
        SubstepRecord {
            dt,
            gravity: Vec3::NEG_Y * 9.8,
            retained: (-2.0 * dt).exp(),
            influence: BondInfluence::default().as_array(),
            bending_length: HairStiffness::default().bending_length,
            damping: HairStiffness::default().damping,
            torsion: HairStiffness::default().torsion,
            skin: StrandContact::default().radius,
            limiter_steps: HairSolver::default().limiter_steps,
            cuticle: default(),
            obstacles: (0..solids).map(ball).collect(),
            shapes: true,
            ..default()
        }
    }
}

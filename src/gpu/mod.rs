//! Hair by compute shaders: the direct solver or the paper's projections, obstacles, bonds, air and treatments,
//! one strand a thread.
//!
//! [`SimulateOn::Gpu`] on a hair asks for it, [`HairResidence`] says where the hair is and why. The tick
//! goes on as always and writes down what acts on the hair; once a frame, before any camera, the graphics
//! device runs what was written down and puts the nodes into the buffer that drawing reads. No node crosses
//! the bus for that.
//!
//! | file | what |
//! |---|---|
//! | `residence` | where hair is, where it is asked to be, and why it is elsewhere |
//! | `support` | what keeps it on the CPU |
//! | `compile` | the kernels of the app's device |
//! | `hair` | hair is handed over |
//! | `hand_back` | hair returns to the CPU; reports and requested states |
//! | `tick` | where each hair is from this tick on; what acts on it |
//! | `journal` | a record of each substep of the tick |
//! | `targets` | roots on a mesh and held nodes in it |
//! | `followers` | strands that follow others, at levels of detail |
//! | `treatments` | the clocks of treatments |
//! | `frame` | a frame in the render world |
//! | `shared` | a hair as both worlds hold it |
//! | `layout` | where a strand's numbers lie on the GPU |
//! | `record`, `sweeps` | what acts on a hair in one substep |
//! | `pipelines` | the kernels on a device |
//! | `target_buffer` | kinematic targets on a device |
//! | `strands` | a hair's strands there, substeps on a command encoder, reading back |
//! | `probe` | where strands are, for game code |
//! | `present` | nodes into the buffer that drawing reads |
//! | `watch`, `fingerprint` | whether a game has written to strands there, and what |
//! | `plugin` | all of it in an app |
//! | `wgsl/` | the mathematics, file by file the twins of `rod`, `rod::direct`, `bond` and `environment` |
//!
//! A thread takes its strand from root to tip in the CPU's order, without barriers and without atomics of
//! floats: the same device gives the same bits every time.
//!
//! # Where scratch lies
//!
//! In memory, 144 bytes a node, of which an elimination fills 96 on the way down and reads them once on the way
//! up. A variant with scratch in workgroup memory is not there, because it does not fit: 32 strands of 16 nodes
//! need 64 KiB, of 9 nodes 36, and devices guarantee 16 and have 32 to 64. Four strands of 32 nodes would fill
//! the 16, which leaves 28 of 32 threads idle. Where 64 KiB are there, as on RDNA 2 with 128 for four SIMDs, two
//! groups would fill them: half a wave a SIMD in place of the eight that hide the latency of memory now. The rows
//! of the elimination are read once before they are written again, so that there is little to be saved.
//!
//! # The paper's projections
//!
//! Hair whose [`HairSolver::method`](crate::HairSolver::method) are the [`Sweeps`](crate::Sweeps) has a kernel of its
//! own, chosen as it is handed over, and its edges have angular velocities, 16 bytes a node more. Where its method
//! changes it returns for a tick, or for the frames that its state takes, and goes back: each method finds what it
//! last left in the strands, as on the CPU.
//!
//! # Levels of detail
//!
//! Which strands follow which guides is decided on the CPU, by where strands are. So hair whose level changes
//! returns for a tick, or for the frames that its state takes where the game does not wait for it
//! ([`HairGpu::blocking`]), and goes back with its new guides; a [`HairBudget`](crate::HairBudget) does not count
//! it meanwhile. Levels that change no more than substeps change on the GPU. Hair at a level without simulated
//! strands stays on the CPU, where it costs next to nothing.
//!
//! # What it costs
//!
//! Times on a card are in the book (`docs/src/gpu.md`). What Mesa 22.3.6 makes of the kernels for RDNA 2 (Navi 21), compiled without a card:
//!
//! | kernel | runs | instructions | vector registers | waves a SIMD |
//! |---|---|---|---|---|
//! | `substep` | a substep | 18,180 | 128 | 8 |
//! | `sweep` | a substep by the paper's projections | 10,960 | 96 | 10 |
//! | `follow` | a substep, of followers | 1,080 | 56 | 18 |
//! | `set_targets` | a substep, of nodes with targets | 45 | 16 | 32 |
//! | `set_root_targets` | a tick, of followers' roots with targets | 28 | 16 | 32 |
//! | `sleep` | a tick, of hair that may sleep | 192 | 16 | 32 |
//! | `measure` | a frame | 275 | 24 | 32 |
//! | `present` | a frame | 380 | 32 | 32 |
//!
//! None spills. About 7,000 of `substep` are ellipsoids, wherever a node may touch a collider. Per segment and
//! substep, of hair that touches nothing, each loop counted whole: load 158, air 151, rest shape 173, masses 53,
//! prediction 126, search for whips 37, Newton step down 677 and up 135, limiter 181, frames and twist 265, check
//! 49: about 2,000. Each further Newton step, of fast strands and while contacts change, adds 830. In these loops
//! 1,030 bytes of a node are read and 480 written; its state is 160 of the one and 80 of the other, the rest is scratch and
//! places read again, which a cache may hold.
//!
//! By the paper's projections, 5 iterations and 2 steps of the limiter: load 214, air 151, rest shape 249, masses
//! 107, prediction 124, each iteration 189, each limiter step 110 (where the strand touches something 151), velocities
//! 79, check 80: about 2,170. Of these 1,370 are the projections' own, prediction to velocities; 1,290 without the
//! guard against endless loops, which wgpu adds to each. In an iteration 80 bytes of a node are read and 32 written.
//!
//! Of the others per node: `present` 182 instructions, 68 bytes read and 32 written; `measure` 97, 36 read; `sleep` 73,
//! 56 read, and 23 more with 32 written of a strand that is not still; `follow` 29 a substep with 28 read and 48
//! written, and with three guides 573 in the tick's last one, with 208 read and 64 written.

mod compile;
mod constants;
mod fingerprint;
mod followers;
mod frame;
mod hair;
mod hand_back;
mod journal;
mod layout;
mod pipelines;
mod plugin;
mod present;
mod probe;
mod record;
mod residence;
mod shared;
mod strands;
mod support;
mod sweeps;
mod target_buffer;
mod targets;
mod tick;
mod treatments;
mod watch;

#[doc(hidden)]
pub use followers::FollowRecord;
pub use hand_back::fetch_strands;
#[doc(hidden)]
pub use layout::{
    BYTES_PER_NODE, Contents, FollowerView, GROUP_SIZE, Layout, StrandState, StrandView,
};
#[doc(hidden)]
pub use pipelines::{HairKernels, SOURCE};
pub use plugin::HairGpuPlugin;
#[doc(hidden)]
pub use present::{DrawnMoment, DrawnNodes};
pub use probe::{HairProbe, HairProbed};
#[doc(hidden)]
pub use record::{
    BlowerRecord, GpuJournal, KinematicTarget, MAX_BLOWERS, MAX_OBSTACLES, MOST_TREATMENTS,
    SubstepRecord, TreatmentRecord,
};
pub use residence::{HairGpu, HairResidence, SimulateOn, Unsupported, WhyCpu};
#[doc(hidden)]
pub use strands::{GpuReport, GpuStrands};
#[doc(hidden)]
pub use sweeps::SweepRecord;

/// The room's share of [the prelude](crate::prelude).
pub mod prelude {
    pub use crate::gpu::{
        HairGpu, HairProbe, HairProbed, HairResidence, SimulateOn, Unsupported, WhyCpu,
    };
}

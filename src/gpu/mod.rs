//! Hair by compute shaders: the direct solver, its obstacles, bonds and air, one strand a thread. Nothing in
//! the tick uses it yet.
//!
//! | file | what |
//! |---|---|
//! | `layout` | where a strand's numbers lie on the GPU |
//! | `journal` | a record of each substep of the tick |
//! | `record` | what acts on a hair in one substep |
//! | `pipelines` | the kernels on a device |
//! | `strands` | a hair's strands there, substeps on a command encoder, reading back |
//! | `present` | nodes into the buffer that drawing reads |
//! | `wgsl/` | the mathematics, file by file the twins of `rod::direct`, `rod`, `bond` and `environment` |
//!
//! A thread takes its strand from root to tip in the CPU's order, without barriers and without atomics of
//! floats: the same device gives the same bits every time. Its scratch is in memory, 128 bytes a node.
//!
//! Counted before the friction rule and the limiter's guard were added: what Mesa 22.3.6 makes of the substep
//! for RDNA 2 (Navi 21), without a card: 10,478 instructions, 128 vector registers, none spilled, 8 waves. Of each loop compiled alone, counted whole, per segment and
//! substep of hair that touches nothing: load 169, air 129, rest shape 173, masses 41, prediction 102,
//! search for whips 45, Newton step down 851 and up 141, limiter 183 and a look at lengths about 100, frames
//! and twist 300, check 51: about 2,300. A second Newton step, of strands that touch or are fast, adds 1,000.

mod journal;
mod layout;
mod pipelines;
mod present;
mod record;
mod strands;

pub use journal::{GpuJournal, GpuJournalPlugin};
pub use layout::{BYTES_PER_NODE, Contents, LANES, Layout, StrandState, StrandView};
pub use pipelines::{HairKernels, SOURCE};
pub use present::DrawnNodes;
pub use record::{BlowerRecord, MOST_BLOWERS, MOST_OBSTACLES, SubstepRecord};
pub use strands::{GpuReport, GpuStrands};

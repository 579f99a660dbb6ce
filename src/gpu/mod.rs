//! Hair by compute shaders: the direct solver, its obstacles, bonds, air and treatments, one strand a
//! thread.
//!
//! [`SimulateOn::Gpu`] on a hair asks for it, [`HairResidence`] tells where the hair is and why. The tick
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
//! | `led` | roots on a mesh and held nodes in it |
//! | `followers` | strands that follow others, at levels of detail |
//! | `treatments` | the clocks of treatments |
//! | `frame` | a frame in the render world |
//! | `shared` | a hair as both worlds hold it |
//! | `layout` | where a strand's numbers lie on the GPU |
//! | `record` | what acts on a hair in one substep |
//! | `pipelines` | the kernels on a device |
//! | `leads` | led nodes on a device |
//! | `strands` | a hair's strands there, substeps on a command encoder, reading back |
//! | `probe` | where strands are, for game code |
//! | `present` | nodes into the buffer that drawing reads |
//! | `plugin` | all of it in an app |
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

mod compile;
mod followers;
mod frame;
mod hair;
mod hand_back;
mod journal;
mod layout;
mod leads;
mod led;
mod pipelines;
mod plugin;
mod present;
mod probe;
mod record;
mod residence;
mod shared;
mod strands;
mod support;
mod tick;
mod treatments;

#[doc(hidden)]
pub use followers::FollowRecord;
pub use hand_back::fetch_strands;
#[doc(hidden)]
pub use layout::{BYTES_PER_NODE, Contents, FollowerView, LANES, Layout, StrandState, StrandView};
#[doc(hidden)]
pub use pipelines::{HairKernels, SOURCE};
pub use plugin::HairGpuPlugin;
#[doc(hidden)]
pub use present::{DrawnMoment, DrawnNodes};
pub use probe::{HairProbe, HairProbed};
#[doc(hidden)]
pub use record::{
    BlowerRecord, GpuJournal, LedNode, MAX_BLOWERS, MAX_OBSTACLES, MOST_TREATMENTS, SubstepRecord,
    TreatmentRecord,
};
pub use residence::{HairGpu, HairResidence, SimulateOn, Unsupported, WhyCpu};
#[doc(hidden)]
pub use strands::{GpuReport, GpuStrands};

//! Contact between edges of different strands, as pairs: each is evaluated once, and acts on both alike.
//!
//! A strand stands for a lock: a soft tube around a firm core. In each substep a pair gives its edges one impulse
//! before the solver moves them: soft contact, the approach of cores, and Coulomb's friction with a memory of how far
//! it has slid since it stuck. Pairs come from a Verlet list of edges within reach of each other and a margin.
//!
//! | file | what |
//! |---|---|
//! | `state` | what is kept, and a substep of it |
//! | `geometry` | two edges as seen by each other |
//! | `kick` | the impulse between them |
//! | `search` | which pairs there are |
//! | `regions` | how much nearer they may have come since |
//! | `apart` | what keeps firm cores apart after the solver's step |
//! | `systems` | the same in the tick |

mod apart;
mod geometry;
mod kick;
mod regions;
mod search;
mod state;
mod systems;
#[cfg(test)]
mod tests;

pub(crate) use {
    state::Pairs,
    systems::{InContact, find, keep_strands_apart},
};

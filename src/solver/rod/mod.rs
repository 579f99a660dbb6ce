//! Cosserat rods on position-based dynamics, as pure functions.
//!
//! A strand is nodes p_0 (root) … p_{n−1} (tip) and edges with orientations q_i, whose tangent is
//! R(q) e3. Edge 0 forms a joint with the scalp's frame q_{−1}, which gives the root half cell its
//! double stiffness; the tip carries half a mass. Source: Demura, Fujisawa, Mikawa, *Hair Simulation
//! Based on Internal Chemical Bonds* (\[B\] here), on the rods of Kugelstadt & Schömer 2016.
//!
//! | file | equations of \[B\] |
//! |---|---|
//! | [`constraint`] | 1–5 stretch–shear, 6–11 bend–twist, 12 stiffness per iteration |
//! | [`stiffness`] | weights from the gravity-bending length (the paper gives none) |
//! | [`block`] | strands side by side: the layout of their lanes |
//! | [`step`] | one substep: predict, project, limit lengths, velocities |
//! | [`direct`] | the direct solver: one implicit step of a whole strand per substep |
//! | `sweep` | the iterations, root to tip, several at once |
//! | `limiter` | direct tridiagonal solve of a strand's lengths |
//! | `tridiagonal` | the Thomas algorithm |
//! | `balls` | bounding balls of obstacles |
//! | `near` | which obstacles a node may touch in a substep |
//! | [`obstacle`] | colliders as half-space, capsule, cylinder or placed shape, with friction |
//! | [`shape`] | boxes, ellipsoids, hulls and distance grids, each in its own frame |
//!
//! Strands of equal node count are solved [`LANES`](crate::base::lanes::LANES) side by side; see
//! [`block`] for the layout.

mod balls;
#[doc(hidden)]
pub mod block;
pub mod constraint;
pub mod direct;
#[doc(hidden)]
pub mod frame;
pub(crate) mod limiter;
pub(crate) mod near;
#[doc(hidden)]
pub mod obstacle;
#[doc(hidden)]
pub mod shape;
#[doc(hidden)]
pub mod step;
pub mod stiffness;
mod sweep;
pub(crate) mod touch;
pub(crate) mod tridiagonal;

pub use constraint::StretchProjection;
pub use stiffness::{HairSolver, HairStiffness, SolverMethod, StrandMaterial, Sweeps};

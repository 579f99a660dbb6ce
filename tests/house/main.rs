//! The house itself: who may know whom, which equation is where, what the README promises.

mod architecture;
mod equations;
mod readme;

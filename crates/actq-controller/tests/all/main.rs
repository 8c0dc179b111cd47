//! The controller's decisions, separately and together.

mod answers;
mod endpoint;
mod foc;
mod guard;
mod limits;
mod memory;
mod replays;
mod safety;
mod slots;
mod transitions;

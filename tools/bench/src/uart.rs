//! Drives the UR3 arm with the application in QEMU through its serial port, with faults on the line: how the controller
//! reacts to each fault, and how soon.
//!
//! The arm moves by the controller's own clock. It follows the state and the targets of the outputs that the controller
//! reports, read at the board before any fault. The rate limit and the safe action repeat the application's
//! computation. A host at the other end of the line sends an observation every 20 ms, and arms again when it reads that
//! the controller has stopped.

mod arm;
mod bits;
mod disturbance;
mod line;
mod rig;

pub use bits::{Compared, Log};
pub use disturbance::{Disturbance, Run};
pub use line::{Line, Noise, Tally};
pub use rig::{Progress, Reaction, Rig};

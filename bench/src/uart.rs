//! The UR3's arm, driven by the application in QEMU through its serial port, with faults on the line: what the
//! controller does about each, and how soon.
//!
//! The arm moves by the controller's own clock. It is told the outputs' state and what they are led to by what the
//! controller says, which is heard at the board, before any fault. The rate limit and the safe action are the
//! application's, computed here once more. A host at the other end of the line sends an observation every 20 ms, and
//! arms again where it reads that the controller has stopped.

mod arm;
mod bits;
mod line;
mod rig;
mod trouble;

pub use bits::foreign;
pub use line::{Line, Noise, Tally};
pub use rig::{Progress, Reaction, Rig};
pub use trouble::{Run, Trouble};

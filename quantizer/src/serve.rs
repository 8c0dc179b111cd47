//! An image as the policy of a simulator or robot, and recordings of what it was shown.

mod episodes;
mod protocol;
mod recorder;
mod recorders;
mod spool;

pub use protocol::{Seen, serve};
pub use recorder::{RecordPlan, serve_recorded};
pub use recorders::wait_for_recorders;

//! An image as the policy of a simulator or robot, and recordings of its observations.

mod episodes;
mod protocol;
mod recorder;
mod recorders;
mod spool;

pub(crate) use protocol::serve;
pub(crate) use recorder::{RecordPlan, serve_recorded};
pub(crate) use recorders::wait_for_recorders;

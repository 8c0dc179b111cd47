//! The controller's decisions, separately and together.

mod answers;
#[cfg(unix)]
mod c_client;
mod endpoint;
mod foc;
mod guard;
mod limits;
mod memory;
#[cfg(feature = "prefix")]
mod prefix;
mod receives;
mod replays;
mod safety;
mod slots;
mod transitions;

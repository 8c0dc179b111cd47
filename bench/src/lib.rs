//! What the tests and the measuring commands share: the firmware, built and under QEMU, counted instructions and
//! modelled cycles, the most stack of the application, golden kernel cases, drawn networks, the command `actq`, closed
//! loops, the comparison of methods, llama.cpp's K-quants.
#![forbid(unsafe_code)]

pub mod closed_loop;
pub mod command;
pub mod compare;
pub mod controller;
pub mod cycles;
pub mod evaluation;
pub mod firmware;
pub mod golden;
pub mod instruction;
pub mod kquants;
pub mod networks;
pub mod profile;
pub mod qemu;
mod shared;
pub mod stack;
pub mod uart;

use std::path::PathBuf;

pub use actq_boards::{Target, root, target_dir};
pub use shared::{shared_policies, skipped};

/// The project's own policy.
pub fn ur3() -> PathBuf {
    actq_ur3::policy_folder().to_owned()
}

/// The project's own flow.
pub fn ur3_flow() -> PathBuf {
    actq_ur3::flow_folder().to_owned()
}

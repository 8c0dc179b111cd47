//! Code shared by tests and measuring commands: building firmware and running it under QEMU, counted instructions and
//! modelled cycles, the maximum stack of the application, golden kernel cases, random networks and descriptions, the command `actq`,
//! closed loops.
#![forbid(unsafe_code)]

pub mod capi;
pub mod closed_loop;
pub mod command;
pub mod controller;
pub mod cycles;
pub mod descriptions;
pub mod evaluation;
pub mod firmware;
#[cfg(unix)]
pub mod flips;
pub mod golden;
pub mod instruction;
pub mod networks;
pub mod profile;
pub mod qemu;
mod shared;
pub mod stack;
pub mod timing;
pub mod uart;

use std::path::PathBuf;

use actq::budget::Budget;
use actq::data::Recordings;
use actq::methods::{Activations, Method, Options};
use actq::pipeline::quantize;
use actq::policy::Policy;
pub use actq_boards::{Target, root, target_dir};
use actq_kernels::Width;
use anyhow::Result;
pub use shared::{shared_policies, skipped};

/// Returns the bits of values, to compare them exactly.
pub fn bits(values: &[f32]) -> Vec<u32> {
    values.iter().map(|value| value.to_bits()).collect()
}

/// Returns the image of a policy whose weights are rounded to nearest; needs no recording.
pub fn rtn(policy: &Policy, width: Width, group: usize, activations: Activations) -> Result<Vec<u8>> {
    let options = Options { group, activations, ..Options::new(Method::Rtn, Budget::Width(width)) };
    Ok(quantize(policy, &Recordings::default(), &options, ())?.image)
}

/// Returns the folder of the project's own policy.
pub fn ur3() -> PathBuf {
    actq_ur3::policy_folder().to_owned()
}

/// Returns the folder of the project's own flow.
pub fn ur3_flow() -> PathBuf {
    actq_ur3::flow_folder().to_owned()
}

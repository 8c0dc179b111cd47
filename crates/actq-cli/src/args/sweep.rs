//! Arguments of `actq sweep`.

use std::path::{Path, PathBuf};

use actq::methods::Effort;

use super::jobs::PoolArgs;
use super::quantize::{DistillArgs, RunArgs};
use super::values::{clock, positive};

/// Arguments of `actq sweep`, without the methods.
#[derive(clap::Args, Debug)]
pub struct SweepArgs {
    /// The policy folders; or one spec or plan, with --store
    #[arg(required = true)]
    pub(crate) policy_dirs: Vec<PathBuf>,
    /// Budgets, in bits per weight of all weights [default: 2,2.5,3,4]
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = positive)]
    pub(crate) bpw: Vec<f64>,
    /// A calibration recording: .npz, .npy or .safetensors, or a folder of them; may be repeated [default: calib.* in
    /// POLICY_DIR]
    #[arg(long, value_name = "FILE|DIR")]
    pub(crate) calib: Vec<PathBuf>,
    /// The held-out recording to measure on [default: heldout.* in POLICY_DIR]
    #[arg(long, value_name = "FILE")]
    pub(crate) heldout: Option<PathBuf>,
    /// The processor's clock for predicted times, in Hz or as 168M [default: 168M]
    #[arg(long, value_name = "HZ", value_parser = clock)]
    pub(crate) clock: Option<f64>,
    /// Write bytes, cycles, errors, bits, allocations and scores as JSON
    #[arg(long, value_name = "FILE")]
    pub(crate) json: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) distill: DistillArgs,
    #[command(flatten)]
    pub(crate) run: RunArgs,
    #[command(flatten)]
    pub(crate) pool: PoolArgs,
}

impl SweepArgs {
    /// Returns `true` if a spec or plan is given instead of policies.
    pub fn has_spec(&self) -> bool {
        self.spec().is_some()
    }

    /// Returns the spec or plan that is given instead of policies.
    pub(crate) fn spec(&self) -> Option<&Path> {
        let is_spec = |path: &&PathBuf| path.extension().is_some_and(|ending| ending == "toml" || ending == "jsonl");
        self.policy_dirs.iter().find(is_spec).map(PathBuf::as_path)
    }

    /// Names the given options that a spec has keys for.
    pub(crate) fn of_a_spec(&self) -> Vec<&'static str> {
        let Self { bpw, calib, heldout, clock, distill: DistillArgs { effort, steps, relative }, run, .. } = self;
        let given = [
            ("--bpw", !bpw.is_empty()),
            ("--calib", !calib.is_empty()),
            ("--heldout", heldout.is_some()),
            ("--clock", clock.is_some()),
            ("--effort", *effort != Effort::Default),
            ("--steps", steps.is_some()),
            ("--relative", *relative),
            ("--seed", run.seed != 1),
        ];
        given.into_iter().filter(|(_, is_given)| *is_given).map(|(name, _)| name).collect()
    }
}

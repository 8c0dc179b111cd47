//! The smoke run of `cargo verify`: the kernels, a whole policy and the motor controller on a Cortex-M4 in QEMU.
//! [`crate::on_target`] has all tests of this kind, on every board.

use actq::methods::Activations;
use actq::policy::Policy;
use actq_bench::{Target, rtn, ur3};
use actq_kernels::Width;
use anyhow::Result;

use crate::on_target::{application, qemu};

#[test]
fn kernels_give_the_golden_sums() -> Result<()> {
    qemu::kernels_give_the_golden_sums(Target::Fpu)
}

#[test]
fn the_ur3_policy_matches_the_host() -> Result<()> {
    let policy = Policy::load(&ur3())?;
    let image = rtn(&policy, Width::W3, 0, Activations::Int8)?;
    qemu::same_bits(Target::Fpu, &image, &qemu::recorded(&ur3(), &policy)?)
}

#[test]
fn the_motor_controller_starts_and_matches_the_host() -> Result<()> {
    application::starts_and_acts_with_the_bits_of_the_host(Target::Fpu)
}

//! Arm's MPS2 with image AN500: a Cortex-M7 with the memory, the peripherals and so the `device` of AN386.
#![cfg(not(target_os = "none"))]

use crate::board::{Application, Board};
use crate::mps2_an386::{BOARD as AN386, SCRATCH};

pub(crate) const BOARD: Board = Board {
    name: "mps2-an500",
    machine: &["-M", "mps2-an500"],
    binaries: &["golden"],
    application: Some(Application { about: "Cortex-M7, QEMU", scratch: SCRATCH }),
    ..AN386
};

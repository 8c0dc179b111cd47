//! Arm's MPS3 with its FPGA image AN547: a Cortex-M55 with FPU and Helium. All of the firmware runs in the secure state.

use crate::board::{Application, Board};
use crate::mps2::SCRATCH;

pub(crate) const AN547: Board = Board {
    name: "mps3-an547",
    memory: "boards/src/mps3/memory.x",
    small: false,
    emulator: "qemu-system-arm",
    machine: &["-M", "mps3-an547"],
    binaries: &["functions", "golden", "portable"],
    application: Some(Application { about: "Cortex-M55, QEMU", scratch: SCRATCH }),
};

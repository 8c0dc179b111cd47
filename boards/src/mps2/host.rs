//! The MPS2 boards as the host knows them. Each has UART 0, a watchdog, and no power stage.

use super::SCRATCH;
use crate::board::{Application, Board};

/// AN386: a Cortex-M4 with FPU. The default board.
pub(crate) const AN386: Board = Board {
    name: "mps2-an386",
    memory: "memory.x",
    small: false,
    emulator: "qemu-system-arm",
    machine: &["-M", "mps2-an386"],
    binaries: &[
        "bench",
        "foc",
        "functions",
        "golden",
        "portable",
        "runtime",
        "runtime-poll",
        "stack",
        "start",
        "trigonometry",
    ],
    application: Some(Application { about: "Cortex-M4F, QEMU", scratch: SCRATCH }),
};

/// AN385: a Cortex-M3 with the memory of AN386.
pub(crate) const AN385: Board = Board {
    name: "mps2-an385",
    machine: &["-M", "mps2-an385"],
    binaries: &["functions", "golden", "portable", "runtime"],
    application: Some(Application { about: "Cortex-M3, QEMU", scratch: SCRATCH }),
    ..AN386
};

/// AN500: a Cortex-M7 with the memory and the peripherals of AN386.
pub(crate) const AN500: Board = Board {
    name: "mps2-an500",
    machine: &["-M", "mps2-an500"],
    binaries: &["golden"],
    application: Some(Application { about: "Cortex-M7, QEMU", scratch: SCRATCH }),
    ..AN386
};

/// AN505: a Cortex-M33 with FPU, DSP extension and TrustZone. All of the firmware runs in the secure state.
pub(crate) const AN505: Board = Board {
    name: "mps2-an505",
    memory: "boards/src/mps2/memory.x",
    machine: &["-M", "mps2-an505"],
    binaries: &["golden"],
    application: Some(Application { about: "Cortex-M33, QEMU", scratch: SCRATCH }),
    ..AN386
};

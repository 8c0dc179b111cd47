//! Arm's MPS2 with image AN386: a Cortex-M4 with FPU. The default board.

#[cfg(all(target_os = "none", any(feature = "mps2-an386", feature = "mps2-an500")))]
pub mod device;

#[cfg(not(target_os = "none"))]
use crate::board::{Application, Board};

/// Words of scratch memory that the application gives to a head on Arm's MPS2 boards.
#[cfg(any(not(target_os = "none"), feature = "cmsdk"))]
pub(crate) const SCRATCH: usize = 24 * 1024;

#[cfg(not(target_os = "none"))]
pub(crate) const BOARD: Board = Board {
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

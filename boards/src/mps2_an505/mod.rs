//! Arm's MPS2 with image AN505: a Cortex-M33 with FPU, DSP extension and TrustZone, of which all runs in the secure
//! state.

#[cfg(all(target_os = "none", feature = "mps2-an505"))]
pub mod device;

#[cfg(not(target_os = "none"))]
use crate::board::{Application, Board};
#[cfg(not(target_os = "none"))]
use crate::mps2_an386::SCRATCH;

#[cfg(not(target_os = "none"))]
pub(crate) const BOARD: Board = Board {
    name: "mps2-an505",
    memory: "boards/src/mps2_an505/memory.x",
    small: false,
    emulator: "qemu-system-arm",
    machine: &["-M", "mps2-an505"],
    binaries: &["golden"],
    application: Some(Application { about: "Cortex-M33, QEMU", scratch: SCRATCH }),
};

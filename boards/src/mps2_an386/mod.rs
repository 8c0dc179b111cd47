//! Arm's MPS2 with image AN386: a Cortex-M4 with FPU. The default board.

#[cfg(all(target_os = "none", any(feature = "mps2-an386", feature = "mps2-an500")))]
pub mod device;

#[cfg(not(target_os = "none"))]
pub(crate) const BOARD: crate::Board = crate::Board {
    name: "mps2-an386",
    memory: "boards/src/mps2_an386/memory.x",
    small: false,
    emulator: "qemu-system-arm",
    machine: &["-M", "mps2-an386"],
    transport: crate::Transport::Semihosting,
    shows: &["bench", "foc", "functions", "golden", "portable", "runtime", "runtime-poll", "stack", "start"],
    application: Some(crate::Application { about: "Cortex-M4F, QEMU", scratch: super::MPS2_SCRATCH }),
};

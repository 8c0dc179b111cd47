//! Arm's MPS2 with image AN386: a Cortex-M4 with FPU. The default board, whose memory is the workspace's `memory.x`.

use crate::{Board, Transport};

pub(crate) const BOARD: Board = Board {
    name: "mps2-an386",
    memory: "memory.x",
    small: false,
    emulator: "qemu-system-arm",
    machine: &["-M", "mps2-an386"],
    transport: Transport::Semihosting,
    shows: &["bench", "functions", "golden", "portable", "runtime", "runtime-poll", "stack"],
};

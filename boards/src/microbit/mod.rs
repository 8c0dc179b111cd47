//! The BBC micro:bit: a Cortex-M0 (nRF51822) with 256 KB of flash and 16 KB of RAM. It runs the golden cases that fit.

use crate::board::Board;

pub(crate) const BOARD: Board = Board {
    name: "microbit",
    memory: "boards/src/microbit/memory.x",
    small: true,
    emulator: "qemu-system-arm",
    machine: &["-M", "microbit"],
    binaries: &["golden"],
    application: None,
};

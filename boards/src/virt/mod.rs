//! QEMU's virt with a SiFive E31, which has RV32IMAC and nothing else: what it lacks is an illegal instruction.

use crate::board::Board;

pub(crate) const BOARD: Board = Board {
    name: "virt",
    memory: "boards/src/virt/memory.x",
    small: false,
    emulator: "qemu-system-riscv32",
    machine: &["-M", "virt", "-cpu", "sifive-e31", "-bios", "none"],
    shows: &["golden", "portable"],
    application: None,
};

//! QEMU's virt with a SiFive E31, which has only RV32IMAC: other extensions are illegal instructions.

use crate::board::Board;

pub(crate) const BOARD: Board = Board {
    name: "virt",
    memory: "boards/src/virt/memory.x",
    small: false,
    emulator: "qemu-system-riscv32",
    machine: &["-M", "virt", "-cpu", "sifive-e31", "-bios", "none"],
    binaries: &["functions", "golden", "portable"],
    application: None,
};

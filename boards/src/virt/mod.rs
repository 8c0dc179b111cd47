//! QEMU's virt with a SiFive E31, which has only RV32IMAC: other extensions are illegal instructions. The application uses
//! its UART, timer and PLIC, and an Intel 6300ESB as watchdog, on PCI.

#[cfg(target_os = "none")]
pub mod target;

#[cfg(not(target_os = "none"))]
use crate::board::{Application, Board};

/// Scratch memory that the application gives to a head, in words.
const SCRATCH: usize = 24 * 1024;

#[cfg(not(target_os = "none"))]
pub(crate) const BOARD: Board = Board {
    name: "virt",
    memory: "boards/src/virt/memory.x",
    small: false,
    emulator: "qemu-system-riscv32",
    machine: &["-M", "virt", "-cpu", "sifive-e31", "-bios", "none", "-device", "i6300esb,addr=1"],
    binaries: &["functions", "golden", "portable"],
    application: Some(Application { about: "RV32IMAC, QEMU", scratch: SCRATCH }),
};

/// The same with QEMU's own RV32, as far as it has Zba and Zbb, for measurements.
#[cfg(not(target_os = "none"))]
pub(crate) const ZB: Board = Board {
    name: "virt-zb",
    machine: &["-M", "virt", "-cpu", ZB_CPU, "-bios", "none"],
    binaries: &["golden"],
    application: None,
    ..BOARD
};
#[cfg(not(target_os = "none"))]
const ZB_CPU: &str = "rv32,f=off,d=off,zba=on,zbb=on,zbc=off,zbs=off";

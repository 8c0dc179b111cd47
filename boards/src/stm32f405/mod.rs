//! The STM32F405 of ODrive v3, VESC and Crazyflie: a Cortex-M4 with FPU at 168 MHz. QEMU's netduinoplus2 emulates this
//! part with its USARTs, but without its clocks, PWM, watchdog, DMA and flash controller.

pub mod flash;
pub mod watchdog_time;

#[cfg(all(target_os = "none", feature = "stm32f405"))]
pub mod device;

#[cfg(not(target_os = "none"))]
use crate::board::{Application, Board};

/// Words of scratch memory: 48 of the 128 KB of RAM.
pub(crate) const SCRATCH: usize = 12 * 1024;

#[cfg(not(target_os = "none"))]
pub(crate) const BOARD: Board = Board {
    name: "stm32f405",
    memory: "boards/src/stm32f405/memory.x",
    small: false,
    emulator: "qemu-system-arm",
    machine: &["-M", "netduinoplus2"],
    binaries: &["golden"],
    application: Some(Application {
        about: "Cortex-M4F: ODrive v3, VESC, Crazyflie; QEMU's netduinoplus2",
        scratch: SCRATCH,
    }),
};

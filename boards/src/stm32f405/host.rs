//! The STM32F405 as the host knows it: QEMU's netduinoplus2 emulates this part with its USARTs, but without its clocks,
//! PWM, watchdog, DMA and flash controller.

use super::SCRATCH;
use crate::board::{Application, Board};

/// The STM32F405.
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

//! AN385 with code of a Cortex-M0 or M0+. No machine of QEMU has such a core and memory for the application; its Cortex-M3
//! runs all instructions of Armv6-M. The firmware uses nothing else of it.

use crate::board::{Application, Board};
use crate::mps2::{SCRATCH, host};

pub(crate) const BOARD: Board = Board {
    name: "mps2-an385-v6m",
    memory: "boards/src/v6m/memory.x",
    application: Some(Application { about: "code of a Cortex-M0, QEMU", scratch: SCRATCH }),
    ..host::AN385
};

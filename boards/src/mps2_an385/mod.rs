//! Arm's MPS2 with image AN385: a Cortex-M3, the same memory as AN386.

use crate::board::Board;
use crate::mps2_an386::BOARD as AN386;

pub(crate) const BOARD: Board = Board {
    name: "mps2-an385",
    machine: &["-M", "mps2-an385"],
    binaries: &["golden", "portable"],
    application: None,
    ..AN386
};

//! The host's description of a board.

/// A board.
#[derive(Debug)]
pub struct Board {
    /// Name of the board, and of the feature that selects it.
    pub name: &'static str,
    /// Path of the memory's linker script from the workspace's root; link.x includes it. The default board's is
    /// `memory.x`.
    pub memory: &'static str,
    /// `true` if the memory holds little more than a small policy (cfg `actq_small` of the firmware).
    pub small: bool,
    /// QEMU's executable.
    pub emulator: &'static str,
    /// QEMU's arguments for the machine.
    pub machine: &'static [&'static str],
    /// Measuring binaries of `firmware/bench` that run on the board. The harness runs on every board.
    pub binaries: &'static [&'static str],
    /// The application's properties on the board, if it supports the board.
    pub application: Option<Application>,
}

/// Properties of the application on a board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Application {
    /// Human-readable description of the board.
    pub about: &'static str,
    /// Scratch memory for a head, in words (the device's `SCRATCH`).
    pub scratch: usize,
}

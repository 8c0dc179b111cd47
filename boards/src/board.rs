//! What a folder of this crate gives of its board to the host.

/// A machine.
#[derive(Debug)]
pub struct Board {
    /// Its name, and that of its folder with hyphens for underscores.
    pub name: &'static str,
    /// Path of the linker script of its memory, from the workspace's root: what link.x includes. That of the default
    /// board is `memory.x`.
    pub memory: &'static str,
    /// Whether its memory holds little more than a small policy (cfg `actq_small` of the firmware).
    pub small: bool,
    /// QEMU's program.
    pub emulator: &'static str,
    /// QEMU's machine, as arguments.
    pub machine: &'static [&'static str],
    /// The measuring binaries of `firmware-bench` that run on it. Its harness runs on every board.
    pub shows: &'static [&'static str],
    /// What the application runs with, where it has a `device` for the board.
    pub application: Option<Application>,
}

/// What the application runs with on a board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Application {
    /// What it is, for people.
    pub about: &'static str,
    /// Words of scratch memory that it gives to a head (the device's `SCRATCH`).
    pub scratch: usize,
}

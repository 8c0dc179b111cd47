//! The boards that the firmware runs on, so far all under QEMU.
//!
//! A board is a folder of this crate: its memory, how it is emulated, how it talks to the host, what it can show. A [`Target`] is a
//! board and the compiler's target for it, one line in the table below. From these follow the linker's scripts ([`link`]), cargo's
//! runner (this crate's binary, `.cargo/config.toml`), what is installed, and what tests and measurements run where.
#![forbid(unsafe_code)]

mod link;
mod microbit;
mod mps2_an385;
mod mps2_an386;
mod virt;

use std::io;
use std::path::Path;
use std::process::Command;

pub use link::link;

/// A machine.
#[derive(Debug)]
pub struct Board {
    /// Its name, and that of its folder with hyphens for underscores.
    pub name: &'static str,
    /// Linker script of its memory, from the workspace's root. `memory.x` there is the one of every Cortex-M, because link.x
    /// includes what it finds under this name; a board with other sizes has a script that sets them before.
    pub memory: &'static str,
    /// Whether its memory holds little more than a small policy (cfg `actq_small` of the firmware).
    pub small: bool,
    /// QEMU's program.
    pub emulator: &'static str,
    /// QEMU's machine, as arguments.
    pub machine: &'static [&'static str],
    /// How the firmware and the host talk.
    pub transport: Transport,
    /// The binaries of `firmware-bench` that run on it.
    pub shows: &'static [&'static str],
}

/// How the firmware and the host talk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transport {
    /// Calls to the host: command line, files, exit status.
    Semihosting,
}

impl Transport {
    /// QEMU's arguments for it.
    fn arguments(self) -> &'static [&'static str] {
        match self {
            Self::Semihosting => &["-semihosting-config", "enable=on,target=native"],
        }
    }
}

/// Declares [`Target`] from a line for each.
macro_rules! targets {
    ($($(#[doc = $doc:literal])* $target:ident: $triple:literal on $board:ident;)*) => {
        /// What the firmware is built for: a board and rustc's target.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
        pub enum Target {
            $($(#[doc = $doc])* $target,)*
        }

        impl Target {
            /// All of them.
            pub const ALL: [Self; [$($triple),*].len()] = [$(Self::$target),*];

            /// rustc's name.
            pub fn triple(self) -> &'static str {
                match self {
                    $(Self::$target => $triple,)*
                }
            }

            /// What it runs on.
            pub fn board(self) -> &'static Board {
                match self {
                    $(Self::$target => &$board::BOARD,)*
                }
            }
        }
    };
}

targets! {
    /// Cortex-M4 with FPU.
    Fpu: "thumbv7em-none-eabihf" on mps2_an386;
    /// Cortex-M4, floats in software: the same bits.
    NoFpu: "thumbv7em-none-eabi" on mps2_an386;
    /// Cortex-M3, without the DSP extension: the portable kernels.
    NoDsp: "thumbv7m-none-eabi" on mps2_an385;
    /// Cortex-M0: the portable kernels in little memory.
    Small: "thumbv6m-none-eabi" on microbit;
    /// RV32IMAC: the portable kernels.
    Riscv: "riscv32imac-unknown-none-elf" on virt;
}

impl Target {
    /// The target with this name of rustc's.
    pub fn of(triple: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|target| target.triple() == triple)
    }

    /// Whether the kernels are in assembler, unless `ACTQ_BACKEND` leaves it out.
    pub fn has_assembler(self) -> bool {
        self.triple().starts_with("thumbv7em")
    }

    /// The profile of a build (`Cargo.toml`).
    pub fn profile(self) -> &'static str {
        if self.has_assembler() { "firmware" } else { "release" }
    }

    /// The board with the firmware `elf`, under QEMU.
    pub fn run(self, elf: &Path) -> Command {
        let board = self.board();
        let mut command = Command::new(board.emulator);
        command
            .args(board.machine)
            .args(["-display", "none", "-monitor", "none", "-serial", "none"])
            .args(board.transport.arguments())
            .arg("-kernel")
            .arg(elf);
        command
    }
}

/// The workspace's root.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap_or(Path::new("."))
}

/// First line of the version text of a program: an emulator, the compiler.
pub fn version(program: &str) -> io::Result<String> {
    let output = Command::new(program).arg("--version").output()?;
    Ok(String::from_utf8_lossy(&output.stdout).lines().next().unwrap_or_default().to_owned())
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn cargo_runs_every_target_by_this_table() {
        let config = fs::read_to_string(root().join(".cargo/config.toml")).expect("cargo's configuration");
        for target in Target::ALL {
            let triple = target.triple();
            let section = config.split("[target.").find(|section| section.starts_with(&format!("{triple}]")));
            let runner = format!("runner = \"cargo run --quiet --package actq-boards -- {triple}\"");
            assert!(section.is_some_and(|section| section.contains(&runner)), "{triple}");
            assert!(root().join(target.board().memory).is_file(), "{triple}");
        }
    }

    #[test]
    fn a_target_is_found_by_its_name() {
        assert!(Target::ALL.into_iter().all(|target| Target::of(target.triple()) == Some(target)));
        assert_eq!(Target::of("x86_64-unknown-linux-gnu"), None);
    }
}

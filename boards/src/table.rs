//! The table of boards.
//!
//! A [`Target`] is a board and the compiler's target for it, one line in the table. From these follow the
//! linker's scripts ([`link`](crate::link())), cargo's runner (this crate's binary, `.cargo/config.toml`), what is
//! installed, and what tests and measurements run where.

use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::board::Board;
use crate::{microbit, mps2_an385, mps2_an386, mps2_an500, mps2_an505, stm32f405, virt};

/// How the time of an emulated board passes. Neither runs ahead of the host's, whose clock is in what it sends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Clock {
    /// By 2^`0` ns an instruction: times are the same in every run. QEMU then takes about a millisecond for a byte of
    /// the serial port.
    Counted(u32),
    /// With the host's, by as many instructions as that takes. A byte takes some 40 µs.
    Host,
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
    /// Cortex-M33 with FPU and DSP extension.
    M33: "thumbv8m.main-none-eabihf" on mps2_an505;
    /// Cortex-M7: the code of the Cortex-M4.
    M7: "thumbv7em-none-eabihf" on mps2_an500;
    /// STM32F405: a Cortex-M4 with the memory of a motor controller.
    F405: "thumbv7em-none-eabihf" on stm32f405;
}

impl Target {
    /// The target with this name of rustc's; where several boards share it, the first one.
    pub fn of(triple: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|target| target.triple() == triple)
    }

    /// The target of the board with this name; where it has several, the first one.
    pub fn on(board: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|target| target.board().name == board)
    }

    /// The feature of a firmware package that chooses the board: its name. Without a feature it is that of
    /// [`Target::of`].
    pub fn feature(self) -> Option<&'static str> {
        (Self::of(self.triple()) != Some(self)).then_some(self.board().name)
    }

    /// Whether the kernels are in assembler, unless `ACTQ_BACKEND` leaves it out.
    pub fn has_assembler(self) -> bool {
        ["thumbv7em", "thumbv8m.main"].iter().any(|core| self.triple().starts_with(core))
    }

    /// The profile of a build (`Cargo.toml`).
    pub fn profile(self) -> &'static str {
        if self.has_assembler() { "firmware" } else { "firmware-portable" }
    }

    /// The board with the firmware `elf`, under QEMU, which talks to the host.
    pub fn run(self, elf: &Path) -> Command {
        let mut command = self.emulate(elf, "none");
        command.args(["-semihosting-config", "enable=on,target=native"]);
        command
    }

    /// The board with the application `elf`, under QEMU, its serial port at one of QEMU's character devices.
    pub fn run_with_serial(self, elf: &Path, serial: &str, clock: Clock) -> Command {
        let mut command = self.emulate(elf, serial);
        let count = match clock {
            Clock::Counted(instruction) => format!("shift={instruction},align=on"),
            Clock::Host => "shift=auto".to_owned(),
        };
        command.args(["-icount", &count]);
        command
    }

    fn emulate(self, elf: &Path, serial: &str) -> Command {
        let board = self.board();
        let mut command = Command::new(board.emulator);
        command.args(board.machine).args(["-display", "none", "-monitor", "none", "-serial", serial]);
        command.arg("-kernel").arg(elf);
        command
    }
}

/// The workspace's root.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap_or(Path::new("."))
}

/// The folder that cargo builds into.
pub fn target_dir() -> PathBuf {
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), |dir| root().join(dir))
}

/// First line of the version text of a program: an emulator, the compiler.
pub fn version(program: &str) -> io::Result<String> {
    let output = Command::new(program).arg("--version").output()?;
    Ok(String::from_utf8_lossy(&output.stdout).lines().next().unwrap_or_default().to_owned())
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
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

    /// The default board's memory is at the root, and no file is left that no board links with.
    #[test]
    fn every_memory_script_is_of_a_board() {
        let default = Target::of("thumbv7em-none-eabihf").expect("the table's first line").board();
        assert_eq!((default.name, default.memory), ("mps2-an386", "memory.x"));
        let folders = fs::read_dir(root().join("boards/src")).expect("the boards").flatten().map(|entry| entry.path());
        let found: BTreeSet<PathBuf> = folders
            .chain([root().to_owned()])
            .map(|folder| folder.join("memory.x"))
            .filter(|file| file.is_file())
            .collect();
        assert_eq!(found, Target::ALL.map(|target| root().join(target.board().memory)).into());
    }

    #[test]
    fn a_target_is_found_by_its_name() {
        let found =
            |target: &Target| Target::of(target.triple()).is_some_and(|found| found.triple() == target.triple());
        assert!(Target::ALL.iter().all(found));
        assert_eq!(Target::of("x86_64-unknown-linux-gnu"), None);
        assert_eq!(Target::on("stm32f405"), Some(Target::F405));
        assert_eq!(Target::on("stm32"), None);
    }

    #[test]
    fn a_feature_chooses_what_the_triple_does_not() {
        let chosen: Vec<_> = Target::ALL.into_iter().filter_map(Target::feature).collect();
        assert_eq!(chosen, ["mps2-an500", "stm32f405"]);
    }
}

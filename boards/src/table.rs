//! The table of boards.
//!
//! A [`Target`] is a board and the compiler's target for it, one line in the table. The linker's scripts
//! ([`link`](crate::link())), cargo's runner (this crate's binary, `.cargo/config.toml`), the toolchain's setup, and
//! the boards of tests and measurements follow from it.

use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::board::Board;
use crate::{microbit, mps2, mps3, stm32f405, v6m, virt};

/// Clock of an emulated board. Except [`Self::Free`], it never runs ahead of the host's clock, whose time is in the host's
/// frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Clock {
    /// 2^`0` ns per instruction: times are the same in every run. QEMU then takes about a millisecond per byte of the
    /// serial port.
    Counted(u32),
    /// 2^`0` ns per instruction, and ahead of the host's clock if the host is fast: for a program that waits for no host.
    Free(u32),
    /// The host's time, with a variable number of instructions. A byte takes about 40 µs.
    Host,
}

/// Declares [`Target`] from one line per target.
macro_rules! targets {
    ($($(#[doc = $doc:literal])* $target:ident: $triple:literal on $board:path;)*) => {
        /// A target of the firmware: a board and rustc's target.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
        pub enum Target {
            $($(#[doc = $doc])* $target,)*
        }

        impl Target {
            /// All targets, in the table's order.
            pub const ALL: [Self; [$($triple),*].len()] = [$(Self::$target),*];

            /// Returns rustc's name of the target.
            pub fn triple(self) -> &'static str {
                match self {
                    $(Self::$target => $triple,)*
                }
            }

            /// Returns the target's board.
            pub fn board(self) -> &'static Board {
                match self {
                    $(Self::$target => &$board,)*
                }
            }
        }
    };
}

targets! {
    /// Cortex-M4 with FPU.
    Fpu: "thumbv7em-none-eabihf" on mps2::host::AN386;
    /// Cortex-M4 with floats in software, which give the same bits.
    NoFpu: "thumbv7em-none-eabi" on mps2::host::AN386;
    /// Cortex-M3, without the DSP extension: the portable kernels.
    NoDsp: "thumbv7m-none-eabi" on mps2::host::AN385;
    /// Cortex-M0: the portable kernels in little memory.
    Small: "thumbv6m-none-eabi" on microbit::BOARD;
    /// Code of the Cortex-M0 on a Cortex-M3, which has the memory to count all of it.
    V6m: "thumbv6m-none-eabi" on v6m::BOARD;
    /// RV32IMAC: the portable kernels.
    Riscv: "riscv32imac-unknown-none-elf" on virt::BOARD;
    /// RV32IMAC with Zba and Zbb.
    RiscvZb: "riscv32imac-unknown-none-elf" on virt::ZB;
    /// Cortex-M33 with FPU and DSP extension.
    M33: "thumbv8m.main-none-eabihf" on mps2::host::AN505;
    /// Cortex-M7: the code of the Cortex-M4.
    M7: "thumbv7em-none-eabihf" on mps2::host::AN500;
    /// STM32F405: a Cortex-M4 with the memory of a motor controller.
    F405: "thumbv7em-none-eabihf" on stm32f405::host::BOARD;
    /// Cortex-M55 with FPU and Helium.
    M55: "thumbv8m.main-none-eabihf" on mps3::AN547;
}

impl Target {
    /// Returns the target with this name of rustc's; if several boards share it, the first one.
    pub fn of(triple: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|target| target.triple() == triple)
    }

    /// Returns the target of the board with this name; if it has several, the first one.
    pub fn on(board: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|target| target.board().name == board)
    }

    /// Returns the feature of a firmware package that selects the board, which is the board's name. `None` for the
    /// board of [`Target::of`], which needs no feature.
    pub fn feature(self) -> Option<&'static str> {
        (Self::of(self.triple()) != Some(self)).then_some(self.board().name)
    }

    /// Returns `true` if the kernels are in assembler, unless `ACTQ_BACKEND` selects the portable ones.
    pub fn has_assembler(self) -> bool {
        ["thumbv7em", "thumbv8m.main"].iter().any(|core| self.triple().starts_with(core))
    }

    /// Returns cargo's variable with the flags of rustc, if they are not those of the triple in cargo's configuration.
    pub fn rustflags(self) -> Option<(&'static str, &'static str)> {
        let flags = match self {
            Self::M55 => "-C target-cpu=cortex-m55 -C target-feature=-mve",
            Self::RiscvZb => "-C target-cpu=sifive-e31 -C target-feature=+zba,+zbb",
            _ => return None,
        };
        Some(("RUSTFLAGS", flags))
    }

    /// Returns the profile of a build (`Cargo.toml`).
    pub fn profile(self) -> &'static str {
        if self.has_assembler() { "firmware" } else { "firmware-portable" }
    }

    /// Returns the QEMU command that runs the firmware `elf`, with calls to the host (semihosting).
    pub fn run(self, elf: &Path) -> Command {
        let mut command = self.emulate(elf, "none");
        command.args(["-semihosting-config", "enable=on,target=native"]);
        command
    }

    /// Returns the QEMU command that runs the application `elf`, with its serial port at one of QEMU's character
    /// devices.
    pub fn run_with_serial(self, elf: &Path, serial: &str, clock: Clock) -> Command {
        let mut command = self.emulate(elf, serial);
        let count = match clock {
            Clock::Counted(instruction) => format!("shift={instruction},align=on"),
            Clock::Free(instruction) => format!("shift={instruction},align=off"),
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

/// Returns the workspace's root.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap_or(Path::new("."))
}

/// Returns cargo's target folder.
pub fn target_dir() -> PathBuf {
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), |dir| root().join(dir))
}

/// Returns the first line of a program's version text.
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

    /// The default board's memory script is at the root, and each memory script belongs to a board.
    #[test]
    fn every_memory_script_belongs_to_a_board() {
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
    fn features_select_boards_that_triples_do_not() {
        let chosen: Vec<_> = Target::ALL.into_iter().filter_map(Target::feature).collect();
        assert_eq!(chosen, ["mps2-an385-v6m", "virt-zb", "mps2-an500", "stm32f405", "mps3-an547"]);
    }
}

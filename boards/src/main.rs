//! `actq-boards TARGET ELF [ARGUMENT ...]`: runs a firmware on the emulated board of a target. It is cargo's runner:
//! `ACTQ_IMAGE=... cargo run --package actq-firmware-bench --bin harness --target thumbv7em-none-eabihf -- serve`
//! serves an image.
#![forbid(unsafe_code)]

use std::path::Path;
use std::process::ExitCode;

use actq_boards::Target;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [triple, elf, firmware @ ..] = &arguments[..] else {
        eprintln!("usage: actq-boards TARGET ELF [ARGUMENT ...]");
        return ExitCode::from(2);
    };
    let Some(target) = Target::of(triple) else {
        let known = Target::ALL.map(Target::triple).join(", ");
        eprintln!("error: no board for the target {triple}; use one of {known}");
        return ExitCode::from(2);
    };
    let mut command = target.run(Path::new(elf));
    if !firmware.is_empty() {
        command.arg("-append").arg(firmware.join(" "));
    }
    match command.status() {
        Ok(status) if status.success() => ExitCode::SUCCESS,
        Ok(_) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!(
                "error: cannot start {}: {error}; `cargo xtask doctor` shows how to install it",
                target.board().emulator
            );
            ExitCode::FAILURE
        }
    }
}

//! The command `actq`.
#![forbid(unsafe_code)]

use std::process::ExitCode;

fn main() -> ExitCode {
    actq_cli::run()
}

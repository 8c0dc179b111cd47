//! Links for the board, writes the build's limits as Rust, and refuses an invalid key.

use std::path::PathBuf;
use std::{env, fs};

use actq_controller::Limits;

fn main() -> Result<(), String> {
    write_limits()?;
    #[cfg(feature = "signed")]
    check_key()?;
    actq_boards::link()
}

/// Writes `limits.rs`: an array of the comma-separated limits in ACTQ_LIMITS.
fn write_limits() -> Result<(), String> {
    println!("cargo::rerun-if-env-changed=ACTQ_LIMITS");
    let text = env::var("ACTQ_LIMITS").unwrap_or_default();
    let parts = text.split(',').filter(|_| !text.is_empty());
    let one = |part: &str| part.parse().map_err(|error| format!("ACTQ_LIMITS has {part:?}: {error}"));
    let limits: Vec<Limits> = parts.map(one).collect::<Result<_, _>>()?;
    let path = PathBuf::from(env::var_os("OUT_DIR").ok_or("OUT_DIR is not set; run this build script with cargo")?)
        .join("limits.rs");
    fs::write(&path, format!("{limits:?}")).map_err(|error| format!("{}: {error}", path.display()))
}

/// Checks that the key is a point of the curve. A text that is not 64 hexadecimal digits fails where it becomes a
/// constant.
#[cfg(feature = "signed")]
fn check_key() -> Result<(), String> {
    use actq_controller::slots::Key;

    println!("cargo::rerun-if-env-changed=ACTQ_PUBLIC_KEY");
    let digits = env::var("ACTQ_PUBLIC_KEY").unwrap_or_default();
    let key = Key::parse(&digits).map_or(Ok(()), |bytes| Key::new(&bytes).map(drop));
    key.map_err(|error| format!("ACTQ_PUBLIC_KEY is {error}"))
}

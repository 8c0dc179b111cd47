//! Links for the board, and refuses a key that is none.

fn main() -> Result<(), String> {
    #[cfg(feature = "signed")]
    check_key()?;
    actq_boards::link()
}

/// A text that is not 64 hexadecimal digits is refused where it becomes a constant.
#[cfg(feature = "signed")]
fn check_key() -> Result<(), String> {
    use actq_controller::slots::Key;

    println!("cargo::rerun-if-env-changed=ACTQ_PUBLIC_KEY");
    let digits = std::env::var("ACTQ_PUBLIC_KEY").unwrap_or_default();
    let key = Key::parse(&digits).map_or(Ok(()), |bytes| Key::new(&bytes).map(drop));
    key.map_err(|error| format!("ACTQ_PUBLIC_KEY is {error}"))
}

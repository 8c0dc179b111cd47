//! SHA-256 digests as text.

use std::fs;
use std::path::Path;

use actq::error::{Context as _, Result};
use actq::measure::size::hex;
use sha2::{Digest as _, Sha256};

/// Returns the digest of `bytes`, in 64 hexadecimal digits.
pub(crate) fn of_bytes(bytes: &[u8]) -> String {
    hex(&Sha256::digest(bytes))
}

/// Returns the digest of a file.
pub(crate) fn of_file(path: &Path) -> Result<String> {
    let bytes = fs::read(path).with_context(|| format!("{}: cannot read the file", path.display()))?;
    Ok(of_bytes(&bytes))
}

/// Returns `true` for 64 lower-case hexadecimal digits: such an address is safe as a file's name.
pub(crate) fn is_digest(text: &str) -> bool {
    text.len() == 64 && text.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'))
}

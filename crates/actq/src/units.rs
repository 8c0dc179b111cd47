//! Sizes and clocks as people write them.

use crate::error::{Context as _, Result};

/// Reads a number of bytes, as `98304`, `96K` or `1M`: K is 1024 bytes, M is 1024 K.
///
/// # Errors
///
/// If it is not one above 0; names the forms.
pub fn bytes(text: &str) -> Result<usize> {
    let (digits, unit) = split(text, [1024, 1024 * 1024]);
    let bytes = digits.parse().ok().and_then(|n: usize| n.checked_mul(unit)).filter(|n| *n > 0);
    bytes.context("use a number of bytes, or of KiB followed by K, or of MiB followed by M")
}

/// Reads a clock in Hz, as `168M`, `84000K` or `168000000`.
///
/// # Errors
///
/// If it is not at least 1 Hz; names the forms.
pub fn hertz(text: &str) -> Result<f64> {
    let (digits, unit) = split(text, [1_000, 1_000_000]);
    let hertz = digits.parse().ok().map(|n: f64| n * unit as f64).filter(|n| n.is_finite() && *n >= 1.0);
    hertz.context("use a number of Hz, or of MHz followed by M")
}

/// Splits off the letter K or M. Returns what is before it and its value, 1 without.
fn split(text: &str, [kilo, mega]: [usize; 2]) -> (&str, usize) {
    match text.char_indices().next_back() {
        Some((at, 'M' | 'm')) => (&text[..at], mega),
        Some((at, 'K' | 'k')) => (&text[..at], kilo),
        _ => (text, 1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_are_units() {
        let sizes = ["98304", "96K", "96k", "1M", "1m"].map(|text| bytes(text).expect("a size"));
        assert_eq!(sizes, [98304, 98304, 98304, 1 << 20, 1 << 20]);
        let clocks = ["168M", "84000k", "1", "0.5K"].map(|text| hertz(text).expect("a clock"));
        assert_eq!(clocks, [168e6, 84e6, 1.0, 500.0]);
        for text in ["", "K", "0", "-1", "1.5K", "1G", "18446744073709551615K"] {
            assert!(bytes(text).is_err(), "{text}");
        }
        for text in ["", "M", "0", "-1M", "inf", "nanM"] {
            assert!(hertz(text).is_err(), "{text}");
        }
    }
}

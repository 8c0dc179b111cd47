//! Text that is safe to print on a terminal.

/// Returns `true` if bytes are UTF-8 without control characters (C0, DEL, C1), which could control the terminal that
/// prints a name. It takes a quarter of the code of `core::str::from_utf8`.
pub(super) fn is_text(bytes: &[u8]) -> bool {
    // Bytes that must follow, the code point so far, and the least code point of this length that is not a control
    // character.
    let (mut more, mut point, mut least) = (0, 0u32, 0);
    for &byte in bytes {
        // In a lead byte, the bytes of its sequence; 1 in the other bytes; 0 in an ASCII character.
        let ones = byte.leading_ones();
        if more > 0 {
            (more, point) = (more - 1, point << 6 | u32::from(byte & 0x3f));
            let surrogate = point >> 11 == 0xd800 >> 11;
            if ones != 1 || more == 0 && (point < least || point > 0x10_ffff || surrogate) {
                return false;
            }
        } else if ones == 0 {
            if !(0x20..0x7f).contains(&byte) {
                return false;
            }
        } else {
            if !(2..=4).contains(&ones) {
                return false;
            }
            (more, point) = (ones - 1, u32::from(byte & 0x7f >> ones));
            least = (1 << (5 * ones - 4)).max(0xa0);
        }
    }
    more == 0
}

#[cfg(test)]
mod tests {
    use super::is_text;

    /// Tries all sequences of up to four bytes from the bytes at which the rules change.
    #[test]
    fn text_is_utf8_without_control_characters() {
        let edges = [
            0x00, 0x1f, 0x20, 0x7e, 0x7f, 0x80, 0x8f, 0x90, 0x9f, 0xa0, 0xbf, 0xc0, 0xc1, 0xc2, 0xdf, 0xe0, 0xe1, 0xec,
            0xed, 0xee,
        ];
        let edges = [&edges[..], &[0xef, 0xf0, 0xf1, 0xf3, 0xf4, 0xf5, 0xf7, 0xf8, 0xff]].concat();
        let mut sequences = vec![Vec::new()];
        for _ in 0..4 {
            let longer = sequences.iter().flat_map(|s: &Vec<u8>| edges.iter().map(|b| [&s[..], &[*b]].concat()));
            sequences = longer.collect();
            for bytes in &sequences {
                let expected = core::str::from_utf8(bytes).is_ok_and(|text| !text.contains(char::is_control));
                assert_eq!(is_text(bytes), expected, "{bytes:x?}");
            }
        }
    }
}

//! The public key of a build, as text.

/// The bytes of 64 hexadecimal digits; `None` where the text is something else. For constants, so that a build with another text fails.
pub const fn parse(text: &str) -> Option<[u8; 32]> {
    let (pairs, rest) = text.as_bytes().as_chunks();
    if pairs.len() != 32 || !rest.is_empty() {
        return None;
    }
    let (mut key, mut i) = ([0; 32], 0);
    while i < key.len() {
        let [high, low]: [u8; 2] = pairs[i];
        let (Some(high), Some(low)) = ((high as char).to_digit(16), (low as char).to_digit(16)) else { return None };
        key[i] = (high << 4 | low) as u8;
        i += 1;
    }
    Some(key)
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::borrow::ToOwned as _;
    use std::vec;

    use super::*;

    #[test]
    fn a_key_is_64_hexadecimal_digits() {
        let text = "00ff".to_owned() + &"0a".repeat(28) + "Bc10";
        let key = parse(&text).expect("a key");
        assert_eq!((key[..3].to_vec(), &key[30..]), (vec![0, 0xff, 10], &[0xbc, 0x10][..]));
        assert_eq!((parse(""), parse(&text[1..]), parse(&text[2..])), (None, None, None));
        assert_eq!((parse(&(text.clone() + "0")), parse(&(text.clone() + "00"))), (None, None));
        assert_eq!((parse(&text.replace('f', "g")), parse(&text.replace("ff", "\u{e9}"))), (None, None));
    }
}

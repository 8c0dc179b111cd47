//! Text for the serial port. `core::fmt` and itoa would bring panics into a program that has none.

use embedded_io::Write;

/// Writes text to a port, from left to right. A port that fails is given up: there is nobody to tell.
#[derive(Debug)]
pub struct Text<'w, W>(&'w mut W);

impl<'w, W: Write> Text<'w, W> {
    /// Text to `port`.
    pub fn to(port: &'w mut W) -> Self {
        Self(port)
    }

    /// A text as it stands.
    #[inline(never)]
    pub fn text(self, text: &str) -> Self {
        let _ = self.0.write_all(text.as_bytes());
        self
    }

    /// A number in decimal.
    #[inline(never)]
    pub fn number(self, number: u32) -> Self {
        let mut digits = [0; 10];
        let (mut rest, mut len) = (number, 0);
        for digit in digits.iter_mut().rev() {
            *digit = b'0' + (rest % 10) as u8;
            (rest, len) = (rest / 10, len + 1);
            if rest == 0 {
                break;
            }
        }
        let _ = self.0.write_all(digits.get(10 - len..).unwrap_or_default());
        self
    }

    /// A number in eight hexadecimal digits.
    #[inline(never)]
    pub fn hex(self, number: u32) -> Self {
        let digit = |place: u32| b"0123456789abcdef".get((number >> (28 - 4 * place) & 15) as usize).copied();
        let digits = [0, 1, 2, 3, 4, 5, 6, 7].map(|place| digit(place).unwrap_or(b'?'));
        let _ = self.0.write_all(&digits);
        self
    }

    /// The end of a line.
    pub fn end(self) {
        self.text("\n");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_in_both_ways() {
        let mut room = [0; 64];
        let mut out = &mut room[..];
        Text::to(&mut out)
            .text("a ")
            .number(0)
            .text(" ")
            .number(10)
            .text(" ")
            .number(u32::MAX)
            .text(" ")
            .hex(0x0123_abcd)
            .end();
        let rest = out.len();
        assert_eq!(room[..64 - rest], *b"a 0 10 4294967295 0123abcd\n");
    }
}

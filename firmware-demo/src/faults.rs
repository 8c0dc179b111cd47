//! Faults that a test asks for by three bytes of the line: a zero, a digit or letter, a zero. No frame is one byte long.

/// What is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Asked {
    /// To hide progress from the watchdog: link 1, head 2, output 4.
    Hide(u8),
    /// An instruction that is none.
    Undefined,
    /// A panic.
    Panic,
}

/// The last bytes.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Faults([u8; 3]);

impl Faults {
    pub(crate) fn push(&mut self, byte: u8) -> Option<Asked> {
        let [_, a, b] = self.0;
        self.0 = [a, b, byte];
        match self.0 {
            [0, digit @ b'0'..=b'7', 0] => Some(Asked::Hide(digit - b'0')),
            [0, b'h', 0] => Some(Asked::Undefined),
            [0, b'p', 0] => Some(Asked::Panic),
            _ => None,
        }
    }
}

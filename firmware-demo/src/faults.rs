//! Faults that a test asks for by three bytes of the line: a zero, a digit or letter, a zero. No frame is one byte
//! long.

/// What is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Asked {
    /// To hide progress from the watchdog: link 1, head 2, output 4.
    Hide(u8),
    /// An instruction that is none.
    Undefined,
    /// A panic.
    Panic,
    /// More stack than there is.
    Recursion,
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
            [0, b's', 0] => Some(Asked::Recursion),
            _ => None,
        }
    }
}

/// Calls itself until the stack ends.
#[cfg(target_os = "none")]
#[inline(never)]
pub(crate) fn recurse(depth: u32) -> u32 {
    let frame = core::hint::black_box([depth; 8]);
    // What comes back is needed, and whether it ends is not known.
    if depth == u32::MAX { depth } else { recurse(depth + 1) ^ core::hint::black_box(frame)[7] }
}

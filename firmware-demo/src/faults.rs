//! Faults that a test requests by three bytes on the line: a zero, a digit or letter, a zero. No frame is one byte
//! long.

/// A requested fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Request {
    /// Hides progress from the watchdog: link 1, head 2, output 4.
    Hide(u8),
    /// Executes an undefined instruction.
    Undefined,
    /// Panics.
    Panic,
    /// Overflows the stack.
    Recursion,
}

/// Detector of requests, with the last bytes of the line.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Faults([u8; 3]);

impl Faults {
    pub(crate) fn push(&mut self, byte: u8) -> Option<Request> {
        let [_, a, b] = self.0;
        self.0 = [a, b, byte];
        match self.0 {
            [0, digit @ b'0'..=b'7', 0] => Some(Request::Hide(digit - b'0')),
            [0, b'h', 0] => Some(Request::Undefined),
            [0, b'p', 0] => Some(Request::Panic),
            [0, b's', 0] => Some(Request::Recursion),
            _ => None,
        }
    }
}

/// Calls itself until the stack ends.
#[cfg(target_os = "none")]
#[inline(never)]
pub(crate) fn recurse(depth: u32) -> u32 {
    let frame = core::hint::black_box([depth; 8]);
    // The result is used, and the compiler cannot know that the recursion ends.
    if depth == u32::MAX { depth } else { recurse(depth + 1) ^ core::hint::black_box(frame)[7] }
}

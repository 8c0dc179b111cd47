//! Sender from messages to bytes.

use crate::fields::{Field as _, Writer};
use crate::frame::VERSION;
use crate::message::Message;

/// Writes and numbers the frames of one end.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sender {
    next: u32,
}

impl Sender {
    /// Creates a sender whose first frame has the number `first`.
    pub const fn new(first: u32) -> Self {
        Self { next: first }
    }

    /// Returns the number of the next frame.
    pub const fn next(&self) -> u32 {
        self.next
    }

    /// Writes a frame with the time `micros` into `buffer` and returns its bytes, including the final zero. `None` if
    /// the buffer is smaller than [`crate::frame::wire_bytes`]; the number is then not used.
    pub fn frame<'b>(&mut self, message: &Message<'_>, micros: u32, buffer: &'b mut [u8]) -> Option<&'b [u8]> {
        let mut w = Writer::new(buffer);
        VERSION.write(&mut w);
        message.kind().write(&mut w);
        self.next.write(&mut w);
        micros.write(&mut w);
        message.write(&mut w);
        let len = w.finish()?;
        *buffer.get_mut(len)? = 0;
        self.next = self.next.wrapping_add(1);
        buffer.get(..=len)
    }
}

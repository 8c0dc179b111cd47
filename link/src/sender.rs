//! From messages to bytes.

use crate::fields::Writer;
use crate::frame::VERSION;
use crate::message::Message;

/// Numbers the frames of one end.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sender {
    next: u32,
}

impl Sender {
    /// A sender whose first frame has the number `first`.
    pub const fn new(first: u32) -> Self {
        Self { next: first }
    }

    /// The number of the next frame.
    pub const fn next(&self) -> u32 {
        self.next
    }

    /// Writes a frame at the time `micros` into `buffer`, and gives its bytes with the zero at the end. `None` where
    /// the buffer is too small ([`crate::frame::wire_bytes`]); no number is used up then.
    pub fn frame<'b>(&mut self, message: &Message<'_>, micros: u32, buffer: &'b mut [u8]) -> Option<&'b [u8]> {
        let mut w = Writer::new(buffer);
        w.u8(VERSION);
        w.u8(message.kind());
        w.u32(self.next);
        w.u32(micros);
        message.write(&mut w);
        let len = w.finish()?;
        *buffer.get_mut(len)? = 0;
        self.next = self.next.wrapping_add(1);
        buffer.get(..=len)
    }
}

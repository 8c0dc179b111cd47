//! Receiver from bytes to messages.

use crate::decoder::Decoder;
use crate::fields::Reader;
use crate::frame::{self, VERSION};
use crate::message::Message;
use crate::report::Counters;
use crate::window::{HALF, Order, Window};

/// A message with its frame's sequence number and time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Received<'a> {
    /// The frame's sequence number.
    pub sequence: u32,
    /// The sender's time in µs; wraps.
    pub micros: u32,
    /// The message.
    pub message: Message<'a>,
}

/// Finds messages in bytes. `N` is the length of the longest frame before stuffing: [`frame::bytes`] of a payload.
///
/// A frame gives a message only if it is whole, undamaged, of this version, well-formed and new. All other frames are
/// only counted.
#[derive(Debug)]
pub struct Receiver<const N: usize> {
    decoder: Decoder<N>,
    window: Window,
    /// How far ahead of the last accepted number a number may be.
    reach: u32,
    counters: Counters,
}

impl<const N: usize> Receiver<N> {
    /// How far ahead of the last number a bounded receiver accepts one: more frames than a line loses within the longest
    /// deadline, at 2 kHz.
    pub const REACH: u32 = 1024;

    /// Length of the longest payload that fits, in bytes.
    pub const PAYLOAD: usize = N.saturating_sub(frame::bytes(0));

    /// Creates a receiver that accepts the first good frame with any sequence number.
    pub const fn new() -> Self {
        let counters = Counters { good: 0, damaged: 0, malformed: 0, repeated: 0, lost: 0 };
        Self { decoder: Decoder::new(), window: Window::open(), reach: HALF, counters }
    }

    /// Takes a byte and returns the message whose frame it ends.
    pub fn push(&mut self, byte: u8) -> Option<Received<'_>> {
        let Self { decoder, window, reach, counters } = self;
        let Ok(content) = decoder.push(byte)? else {
            counters.damaged = counters.damaged.wrapping_add(1);
            return None;
        };
        let Some(received) = parse(content) else {
            counters.malformed = counters.malformed.wrapping_add(1);
            return None;
        };
        // A disarm stops the outputs, whoever sends it.
        let reach = if received.message == Message::Disarm { HALF } else { *reach };
        match window.admit(received.sequence, reach) {
            Order::Repeated => {
                counters.repeated = counters.repeated.wrapping_add(1);
                None
            }
            Order::New { lost } => {
                counters.good = counters.good.wrapping_add(1);
                counters.lost = counters.lost.wrapping_add(lost);
                Some(received)
            }
        }
    }

    /// Accepts the next good frame with any sequence number, because the other end may have restarted. Call it only
    /// after a long time without good frames and while nothing moves. Returns `true` if the window was not open: a
    /// frame that was accepted before may then be accepted again.
    pub fn reopen(&mut self) -> bool {
        self.window.reopen()
    }

    /// Bounds the accepted numbers, or ends that: a bounded receiver refuses numbers more than [`Self::REACH`] ahead of
    /// the last one, except a disarm's. Frames that were recorded before the sender restarted may be so far ahead.
    pub fn bound(&mut self, is_bounded: bool) {
        self.reach = if is_bounded { Self::REACH } else { HALF };
    }

    /// Returns the counters of the frames so far.
    pub const fn counters(&self) -> Counters {
        self.counters
    }
}

impl<const N: usize> Default for Receiver<N> {
    fn default() -> Self {
        Self::new()
    }
}

fn parse(content: &[u8]) -> Option<Received<'_>> {
    let mut r = Reader(content);
    if r.field::<u8>()? != VERSION {
        return None;
    }
    let (kind, sequence, micros) = (r.field()?, r.field()?, r.field()?);
    Some(Received { sequence, micros, message: Message::parse(kind, r.rest())? })
}

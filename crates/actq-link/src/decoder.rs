//! Decoder from bytes to frames.

use cobs::{DecodeResult, DecoderState};
use heapless::Vec;

use crate::frame::{CHECKSUM, CRC, HEADER};

/// Finds frames in a stream of bytes. `N` is the length of the longest frame, before stuffing
/// ([`crate::frame::bytes`]).
///
/// It always finds the frame after the next zero, whatever bytes came before.
#[derive(Debug)]
pub(crate) struct Decoder<const N: usize> {
    stuffing: DecoderState,
    frame: Vec<u8, N>,
    /// `true` if the frame is longer than `N`.
    too_long: bool,
}

/// The frame is damaged, or longer than the memory for it.
pub(crate) struct Damaged;

impl<const N: usize> Decoder<N> {
    pub(crate) const fn new() -> Self {
        Self { stuffing: DecoderState::Idle, frame: Vec::new(), too_long: false }
    }

    /// Takes a byte. At the end of a frame with a correct checksum, returns its bytes without the checksum, at least
    /// [`HEADER`] of them.
    pub(crate) fn push(&mut self, byte: u8) -> Option<Result<&[u8], Damaged>> {
        match self.stuffing.feed(byte) {
            Ok(DecodeResult::DataStart) => {
                self.frame.clear();
                self.too_long = false;
                None
            }
            Ok(DecodeResult::DataContinue(byte)) => {
                self.too_long |= self.frame.push(byte).is_err();
                None
            }
            Ok(DecodeResult::DataComplete) if self.too_long => Some(Err(Damaged)),
            Ok(DecodeResult::DataComplete) => Some(checked(&self.frame).ok_or(Damaged)),
            // The zero came too early; it still ends this frame.
            Err(_) => Some(Err(Damaged)),
            Ok(DecodeResult::NoData) => None,
        }
    }
}

/// Returns the frame without its checksum, if the checksum is correct.
fn checked(frame: &[u8]) -> Option<&[u8]> {
    let (content, checksum) = frame.split_last_chunk::<CHECKSUM>()?;
    (content.len() >= HEADER && CRC.checksum(content) == u32::from_le_bytes(*checksum)).then_some(content)
}

//! From bytes to frames.

use cobs::{DecodeResult, DecoderState};

use crate::frame::{CHECKSUM, CRC, HEADER};

/// Finds frames in a stream of bytes. `N` is the length of the longest frame, before stuffing
/// ([`crate::frame::bytes`]).
///
/// Whatever came before, the frame behind the next zero is found.
#[derive(Debug)]
pub(crate) struct Decoder<const N: usize> {
    stuffing: DecoderState,
    frame: [u8; N],
    /// Bytes of the frame that came, also where `frame` has no room for them.
    len: usize,
}

/// The frame is damaged, or longer than the memory for it.
pub(crate) struct Damaged;

impl<const N: usize> Decoder<N> {
    pub(crate) const fn new() -> Self {
        Self { stuffing: DecoderState::Idle, frame: [0; N], len: 0 }
    }

    /// Takes a byte. At the end of a frame: its bytes without the checksum, which is right, at least [`HEADER`] of
    /// them.
    pub(crate) fn push(&mut self, byte: u8) -> Option<Result<&[u8], Damaged>> {
        match self.stuffing.feed(byte) {
            Ok(DecodeResult::DataContinue(byte)) => {
                if let Some(place) = self.frame.get_mut(self.len) {
                    *place = byte;
                }
                self.len = self.len.saturating_add(1);
                None
            }
            Ok(DecodeResult::DataComplete) => {
                let len = core::mem::take(&mut self.len);
                Some(self.frame.get(..len).and_then(checked).ok_or(Damaged))
            }
            // The zero came too early; it ends this frame all the same.
            Err(_) => {
                self.len = 0;
                Some(Err(Damaged))
            }
            Ok(DecodeResult::NoData | DecodeResult::DataStart) => None,
        }
    }
}

/// The frame without its checksum, if that is right.
fn checked(frame: &[u8]) -> Option<&[u8]> {
    let (content, checksum) = frame.split_last_chunk::<CHECKSUM>()?;
    (content.len() >= HEADER && CRC.checksum(content) == u32::from_le_bytes(*checksum)).then_some(content)
}

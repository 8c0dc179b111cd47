//! The frame: header, payload and checksum, before byte stuffing.
//!
//! | bytes | content |
//! |---|---|
//! | 1 | [`VERSION`] |
//! | 1 | the message's kind |
//! | 4 | sequence number, one more for every frame of a sender |
//! | 4 | time of the sender in µs; wraps |
//! | n | payload of the message, at most [`MAX_PAYLOAD`] |
//! | 4 | CRC-32 (ISO-HDLC) of all bytes before |
//!
//! Little-endian. COBS (Cheshire and Baker, 1999) stuffs the frame. It ends with a zero, the only one in it.

use crc::{CRC_32_ISO_HDLC, Crc};

/// Version of the frames and messages.
pub const VERSION: u8 = 1;

/// Bytes before the payload.
pub const HEADER: usize = 10;

/// Bytes after the payload.
pub const CHECKSUM: usize = 4;

/// Length of the longest payload in bytes: 1024 values of an observation. A receiver may have memory for less.
pub const MAX_PAYLOAD: usize = 4096;

/// CRC-32 (ISO-HDLC) with the only lookup table that a target needs.
pub static CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// Returns the bytes of a frame with `payload` bytes of payload before stuffing: the memory that a [`crate::Receiver`]
/// needs.
pub const fn bytes(payload: usize) -> usize {
    HEADER + payload + CHECKSUM
}

/// Returns the most bytes on the wire of a frame with `payload` bytes of payload: the memory that a [`crate::Sender`]
/// needs.
pub const fn wire_bytes(payload: usize) -> usize {
    cobs::max_encoding_length(bytes(payload)) + 1
}

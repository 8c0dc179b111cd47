//! The frame: header, payload and checksum, before byte stuffing.
//!
//! | bytes | what |
//! |---|---|
//! | 1 | [`VERSION`] |
//! | 1 | the message's kind |
//! | 4 | sequence number, one more for every frame of a sender |
//! | 4 | time of the sender in µs; wraps |
//! | n | payload of the message, at most [`MAX_PAYLOAD`] |
//! | 4 | CRC-32 (ISO-HDLC) of all bytes before |
//!
//! Little-endian. The frame is stuffed by COBS (Cheshire and Baker, 1999) and ends with a zero, which stands nowhere
//! else.

use crc::{CRC_32_ISO_HDLC, Crc};

/// Version of the frames and messages.
pub const VERSION: u8 = 1;

/// Bytes before the payload.
pub const HEADER: usize = 10;

/// Bytes behind the payload.
pub const CHECKSUM: usize = 4;

/// The longest payload in bytes: 1024 values of an observation. A receiver may have memory for less.
pub const MAX_PAYLOAD: usize = 4096;

/// CRC-32 (ISO-HDLC), and the one table of it that a target needs.
pub static CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// Bytes of a frame with so many bytes of payload, before stuffing: the memory that a [`crate::Receiver`] needs.
pub const fn bytes(payload: usize) -> usize {
    HEADER + payload + CHECKSUM
}

/// Bytes on the wire of a frame with so many bytes of payload, at most: the memory that a [`crate::Sender`] needs.
pub const fn wire_bytes(payload: usize) -> usize {
    cobs::max_encoding_length(bytes(payload)) + 1
}

//! The link over CAN: the bytes of the stuffed frames, some in each CAN frame.
//!
//! Each direction has an identifier of its own, and CAN frames of one identifier stay in order where the controller's
//! mailboxes are sent as a queue. No byte is spent on segmenting: zeros end the link's frames, and its checksum finds
//! what is lost, doubled or out of order. A CAN FD frame has one of few lengths; it is filled up with zeros, which are
//! no frames.

use embedded_can::{Frame, Id};

/// How much a CAN frame carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Payload {
    /// Up to 8 bytes.
    Classic,
    /// Up to 64 bytes.
    Fd,
}

impl Payload {
    /// The most bytes of a CAN frame.
    pub const fn most(self) -> usize {
        match self {
            Self::Classic => 8,
            Self::Fd => 64,
        }
    }

    /// The shortest data field for so many bytes (ISO 11898-1: up to 8 any length, then those of a 4-bit code).
    const fn field(self, len: usize) -> usize {
        match len {
            0..=8 => len,
            9..=24 => len.next_multiple_of(4),
            25..=32 => 32,
            33..=48 => 48,
            _ => 64,
        }
    }
}

/// Bytes of the link as CAN frames, the last of which may be shorter. Frames that `F` cannot hold are left out, and so
/// lost on the way as any other is.
pub fn segments<F: Frame>(id: Id, payload: Payload, bytes: &[u8]) -> impl Iterator<Item = F> {
    bytes.chunks(payload.most()).filter_map(move |chunk| {
        let mut field = [0; 64];
        field.get_mut(..chunk.len())?.copy_from_slice(chunk);
        F::new(id, field.get(..payload.field(chunk.len()))?)
    })
}

/// The link's bytes in a CAN frame: none where it is of another identifier, or a remote frame.
pub fn bytes<F: Frame>(id: Id, frame: &F) -> &[u8] {
    if frame.is_data_frame() && frame.id() == id { frame.data() } else { &[] }
}

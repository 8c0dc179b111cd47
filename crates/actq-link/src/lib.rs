//! Frames and messages between host and target. `docs/LINK.md` specifies the wire format.
//!
//! [`Sender`] makes frames of messages, [`Receiver`] finds messages in bytes. Both are pure state machines: they own no
//! port, no clock and no heap, and recover after any byte. The caller moves the bytes: over a UART or a socket.
//!
//! [`pipe`] is a simpler protocol: a simulator runs an image as its policy through standard input and output.
#![no_std]
#![forbid(unsafe_code)]

pub mod code;
mod decoder;
mod fields;
mod floats;
pub mod frame;
mod message;
pub mod pipe;
mod receiver;
pub mod report;
mod sender;
mod window;

/// Longest lifetime of a prefix that the application accepts, in seconds. A host sends the prefix again before its end.
pub const PREFIX_SECONDS: u32 = 10;

pub use floats::Floats;
pub use message::Message;
pub use pipe::{NO_ACTION, PREFIX, RESET, STEP};
pub use receiver::{Received, Receiver};
pub use sender::Sender;

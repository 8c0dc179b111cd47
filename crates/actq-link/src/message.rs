//! The messages and their payloads.

use crate::code::{Parameter, Refusal, Report};
use crate::fields::{Field, Reader, Writer};
use crate::floats::Floats;
use crate::report::{Breadcrumb, Status, Timing};

/// A message. A host's messages have kinds below 128, a controller's have kinds from 128.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Message<'a> {
    /// An observation. It is not acknowledged: the action is the answer.
    Observation(Floats<'a>),
    /// Lets the outputs follow the head.
    Arm {
        /// [`Status::token`] of the last status.
        token: u32,
    },
    /// Lets the outputs coast.
    Disarm,
    /// Asks for a parameter, which [`Self::Value`] answers.
    Get {
        /// The parameter.
        parameter: Parameter,
        /// The axis, for a parameter of an axis; else 0.
        axis: u8,
    },
    /// Sets a parameter.
    Set {
        /// [`Status::token`] of the last status.
        token: u32,
        /// The parameter.
        parameter: Parameter,
        /// The axis, for a parameter of an axis; else 0.
        axis: u8,
        /// The new value.
        value: f32,
    },
    /// Asks for a report.
    Ask(Report),
    /// Begins an image update: erases the slot that does not run.
    Begin {
        /// [`Status::token`] of the last status.
        token: u32,
        /// Bytes of the image; whole words.
        length: u32,
        /// CRC-32 (ISO-HDLC) of all bytes of the image. It differs from the one in the image's header, which excludes
        /// the words before it.
        crc: u32,
        /// Version of the image. It must not be lower than the version of an image that ran before.
        version: u32,
    },
    /// Some of the image's bytes.
    Chunk {
        /// Offset of the bytes in the image.
        offset: u32,
        /// The bytes.
        bytes: &'a [u8],
    },
    /// Ends an update: the image is checked, tested and then runs.
    Commit {
        /// Ed25519ph signature of image and version, if the build requires one.
        signature: Option<&'a [u8; 64]>,
    },
    /// Cancels an update.
    Abort,
    /// Begins the transfer of a prefix, the keys and values that the running image's attentions read.
    #[cfg(feature = "prefix")]
    BeginPrefix {
        /// [`Status::token`] of the last status.
        token: u32,
        /// [`Status::image`]: CRC-32 of the header of the image that reads it.
        image: u32,
        /// Bytes of the prefix.
        length: u32,
        /// CRC-32 (ISO-HDLC) of all bytes of the prefix.
        crc: u32,
        /// Control ticks, from the arrival of this request, for which the prefix may be used; at least 1.
        lifetime: u32,
    },
    /// Some of the prefix's bytes.
    #[cfg(feature = "prefix")]
    PrefixChunk {
        /// Offset of the bytes in the prefix.
        offset: u32,
        /// The bytes.
        bytes: &'a [u8],
    },
    /// Ends the transfer of a prefix: the head uses it from its next evaluation on.
    #[cfg(feature = "prefix")]
    CommitPrefix,
    /// The head's action for an observation.
    Action {
        /// Sequence number of the observation's frame.
        of: u32,
        /// `true` if the outputs follow the action.
        applied: bool,
        /// The values; after limits if the action is applied.
        values: Floats<'a>,
    },
    /// The state and counters.
    Status(Status),
    /// The measured times.
    Timing(Timing),
    /// The record that the firmware left before the last reset.
    Breadcrumb(Breadcrumb),
    /// The value of a parameter.
    Value {
        /// The parameter.
        parameter: Parameter,
        /// The axis.
        axis: u8,
        /// The current value.
        value: f32,
    },
    /// Answers a request.
    Ack {
        /// Sequence number of the request's frame.
        of: u32,
        /// Reason for a refusal; `None` if the request was done.
        refusal: Option<Refusal>,
        /// Bytes of the update that have been written; 0 if no update is in progress.
        written: u32,
    },
}

/// Declares each message's kind number and, in the order of the payload, its fields.
macro_rules! messages {
    ($($(#[$attribute:meta])? $message:ident $(($value:ident))? $({ $($field:ident),* })? = $kind:literal;)*) => {
        impl<'a> Message<'a> {
            /// The number of the message's kind in a frame.
            pub const fn kind(&self) -> u8 {
                match self {
                    $($(#[$attribute])? Self::$message { .. } => $kind,)*
                }
            }

            pub(crate) fn write(&self, w: &mut Writer<'_>) {
                match self {
                    $($(#[$attribute])? Self::$message $(($value))? $({ $($field),* })? => {
                        $($value.write(w);)?
                        $($($field.write(w);)*)?
                    })*
                }
            }

            /// Parses a payload of this kind; `None` if the kind is unknown or the payload does not match it.
            pub(crate) fn parse(kind: u8, payload: &'a [u8]) -> Option<Self> {
                let r = &mut Reader(payload);
                let message = match kind {
                    $($(#[$attribute])? $kind => {
                        $(let $value = r.field()?;)?
                        Self::$message $(($value))? $({ $($field: r.field()?),* })?
                    })*
                    _ => return None,
                };
                r.is_empty().then_some(message)
            }
        }
    };
}

messages! {
    Observation(values) = 1;
    Arm { token } = 2;
    Disarm = 3;
    Get { parameter, axis } = 4;
    Set { token, parameter, axis, value } = 5;
    Ask(report) = 6;
    Begin { token, length, crc, version } = 7;
    Chunk { offset, bytes } = 8;
    Commit { signature } = 9;
    Abort = 10;
    #[cfg(feature = "prefix")]
    BeginPrefix { token, image, length, crc, lifetime } = 11;
    #[cfg(feature = "prefix")]
    PrefixChunk { offset, bytes } = 12;
    #[cfg(feature = "prefix")]
    CommitPrefix = 13;
    Action { of, applied, values } = 128;
    Status(status) = 129;
    Timing(timing) = 130;
    Breadcrumb(breadcrumb) = 131;
    Value { parameter, axis, value } = 132;
    Ack { of, refusal, written } = 133;
}

//! The messages and their payloads.

use crate::code::{Parameter, Refusal, Report, optional};
use crate::fields::{Reader, Writer};
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
    /// The head's action for an observation.
    Action {
        /// Sequence number of the observation's frame.
        of: u32,
        /// `true` if the outputs follow the action.
        applied: bool,
        /// The values; after limits and rate limits if the action is applied.
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

/// Declares each message's kind number once: a constant to parse by, and [`Message::kind`].
macro_rules! kinds {
    ($($message:ident: $kind:ident = $number:literal;)*) => {
        $(const $kind: u8 = $number;)*

        impl Message<'_> {
            /// The number of the message's kind in a frame.
            pub const fn kind(&self) -> u8 {
                match self {
                    $(Self::$message { .. } => $kind,)*
                }
            }
        }
    };
}

kinds! {
    Observation: OBSERVATION = 1;
    Arm: ARM = 2;
    Disarm: DISARM = 3;
    Get: GET = 4;
    Set: SET = 5;
    Ask: ASK = 6;
    Begin: BEGIN = 7;
    Chunk: CHUNK = 8;
    Commit: COMMIT = 9;
    Abort: ABORT = 10;
    Action: ACTION = 128;
    Status: STATUS = 129;
    Timing: TIMING = 130;
    Breadcrumb: BREADCRUMB = 131;
    Value: VALUE = 132;
    Ack: ACK = 133;
}

impl<'a> Message<'a> {
    pub(crate) fn write(&self, w: &mut Writer<'_>) {
        match *self {
            Self::Observation(values) => values.iter().for_each(|value| w.f32(value)),
            Self::Arm { token } => w.u32(token),
            Self::Disarm | Self::Abort => {}
            Self::Get { parameter, axis } => {
                w.u8(parameter.code());
                w.u8(axis);
            }
            Self::Set { token, parameter, axis, value } => {
                w.u32(token);
                w.u8(parameter.code());
                w.u8(axis);
                w.f32(value);
            }
            Self::Ask(report) => w.u8(report.code()),
            Self::Begin { token, length, crc, version } => {
                [token, length, crc, version].into_iter().for_each(|n| w.u32(n));
            }
            Self::Chunk { offset, bytes } => {
                w.u32(offset);
                w.bytes(bytes);
            }
            Self::Commit { signature } => w.bytes(signature.map_or(&[], |bytes| bytes)),
            Self::Action { of, applied, values } => {
                w.u32(of);
                w.u8(applied.into());
                values.iter().for_each(|value| w.f32(value));
            }
            Self::Status(status) => status.write(w),
            Self::Timing(timing) => timing.write(w),
            Self::Breadcrumb(breadcrumb) => breadcrumb.write(w),
            Self::Value { parameter, axis, value } => {
                w.u8(parameter.code());
                w.u8(axis);
                w.f32(value);
            }
            Self::Ack { of, refusal, written } => {
                w.u32(of);
                w.u8(refusal.map_or(0, Refusal::code));
                w.u32(written);
            }
        }
    }

    /// Parses a payload of this kind; `None` if the kind is unknown or the payload does not match it.
    pub(crate) fn parse(kind: u8, payload: &'a [u8]) -> Option<Self> {
        let r = &mut Reader(payload);
        let message = match kind {
            OBSERVATION => Self::Observation(Floats::of_wire(r.rest())?),
            ARM => Self::Arm { token: r.u32()? },
            DISARM => Self::Disarm,
            GET => Self::Get { parameter: Parameter::from_code(r.u8()?)?, axis: r.u8()? },
            SET => {
                Self::Set { token: r.u32()?, parameter: Parameter::from_code(r.u8()?)?, axis: r.u8()?, value: r.f32()? }
            }
            ASK => Self::Ask(Report::from_code(r.u8()?)?),
            BEGIN => Self::Begin { token: r.u32()?, length: r.u32()?, crc: r.u32()?, version: r.u32()? },
            CHUNK => Self::Chunk { offset: r.u32()?, bytes: r.rest() },
            COMMIT => Self::Commit { signature: if r.is_empty() { None } else { Some(r.array()?) } },
            ABORT => Self::Abort,
            ACTION => Self::Action { of: r.u32()?, applied: flag(r.u8()?)?, values: Floats::of_wire(r.rest())? },
            STATUS => Self::Status(Status::read(r)?),
            TIMING => Self::Timing(Timing::read(r)?),
            BREADCRUMB => Self::Breadcrumb(Breadcrumb::read(r)?),
            VALUE => Self::Value { parameter: Parameter::from_code(r.u8()?)?, axis: r.u8()?, value: r.f32()? },
            ACK => Self::Ack { of: r.u32()?, refusal: optional(r.u8()?, Refusal::from_code)?, written: r.u32()? },
            _ => return None,
        };
        r.is_empty().then_some(message)
    }
}

fn flag(byte: u8) -> Option<bool> {
    match byte {
        0 => Some(false),
        1 => Some(true),
        _ => None,
    }
}

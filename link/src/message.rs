//! The messages and their payloads.

use crate::code::{Parameter, Refusal, Report, optional};
use crate::fields::{Reader, Writer};
use crate::floats::Floats;
use crate::report::{Breadcrumb, Status, Timing};

/// A message. Those of a host have kinds below 128, those of a controller from 128 on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Message<'a> {
    /// What the robot sees. Not acknowledged: the action is the answer.
    Observation(Floats<'a>),
    /// Lets the outputs follow the head.
    Arm {
        /// [`Status::token`].
        token: u32,
    },
    /// Lets the outputs coast.
    Disarm,
    /// Asks for a parameter, which [`Self::Value`] answers.
    Get {
        /// Which.
        parameter: Parameter,
        /// Whose, where it is that of an axis; else 0.
        axis: u8,
    },
    /// Sets a parameter.
    Set {
        /// [`Status::token`].
        token: u32,
        /// Which.
        parameter: Parameter,
        /// Whose, where it is that of an axis; else 0.
        axis: u8,
        /// To what.
        value: f32,
    },
    /// Asks for a report.
    Ask(Report),
    /// Begins an image update: erases the slot that does not run.
    Begin {
        /// [`Status::token`].
        token: u32,
        /// Bytes of the image; whole words.
        length: u32,
        /// CRC-32 (ISO-HDLC) of all bytes of the image. (Not the one in its header, which leaves out the words before
        /// it.)
        crc: u32,
        /// Version of the image, which must not be lower than one that ran before.
        version: u32,
    },
    /// Some of the image's bytes.
    Chunk {
        /// Where they stand in the image.
        offset: u32,
        /// The bytes.
        bytes: &'a [u8],
    },
    /// Ends an update: the image is checked, tested and then runs.
    Commit {
        /// Ed25519ph signature of image and version, where the build requires one.
        signature: Option<&'a [u8; 64]>,
    },
    /// Gives an update up.
    Abort,
    /// What the head made of an observation.
    Action {
        /// Sequence number of the observation's frame.
        of: u32,
        /// Whether the outputs follow it.
        applied: bool,
        /// The values, after limits and rate limits where it is applied.
        values: Floats<'a>,
    },
    /// State and counters.
    Status(Status),
    /// Times.
    Timing(Timing),
    /// What was left behind before the last reset.
    Breadcrumb(Breadcrumb),
    /// The value of a parameter.
    Value {
        /// Which.
        parameter: Parameter,
        /// Whose.
        axis: u8,
        /// What it is.
        value: f32,
    },
    /// Answers a request.
    Ack {
        /// Sequence number of the request's frame.
        of: u32,
        /// Why it was not done; `None` where it was.
        refusal: Option<Refusal>,
        /// Bytes of the update that are written; 0 where there is none.
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

    /// The message of a kind with this payload; `None` where the kind is unknown, or the payload is not one of that
    /// kind.
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

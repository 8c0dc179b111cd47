//! What a controller tells of itself.

use crate::code::{Crash, Fault, Refusal, ResetCause, State, optional};
use crate::fields::{Reader, Writer};

/// The number of [`Status::slot`] where the image is not in a slot but was built in.
pub const BUILT_IN: u8 = 255;

/// What a receiver has seen. The numbers wrap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Frames that gave a message.
    pub good: u32,
    /// Frames that were damaged or longer than the receiver's memory.
    pub damaged: u32,
    /// Undamaged frames of another version, of an unknown kind, or with a payload that is not one of their kind.
    pub malformed: u32,
    /// Frames that were here already, or came behind a newer one.
    pub repeated: u32,
    /// Sequence numbers that were left out.
    pub lost: u32,
}

/// State, and what there is to know for whoever wants to arm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Status {
    /// What the outputs do.
    pub state: State,
    /// What led to [`State::Latched`], the last time.
    pub fault: Option<Fault>,
    /// Why the controller cannot be armed now; the first of several reasons.
    pub refusal: Option<Refusal>,
    /// Why the processor started.
    pub reset: ResetCause,
    /// What a request that changes something has to name; another one after every change of the state and every start.
    pub token: u32,
    /// Ticks since the start; wraps.
    pub ticks: u32,
    /// CRC-32 in the image's header; 0 without an image.
    pub image: u32,
    /// The image's slot, 0 or 1, or [`BUILT_IN`].
    pub slot: u8,
    /// Axes, and values of an action.
    pub axes: u8,
    /// Values of an observation.
    pub observation: u16,
    /// The longest payload in bytes that the controller has memory for.
    pub payload: u16,
    /// Observations that the guard refused: length, finiteness, range or age.
    pub refused: u32,
    /// What the controller's receiver has seen.
    pub counters: Counters,
}

impl Status {
    pub(crate) fn write(&self, w: &mut Writer<'_>) {
        w.u8(self.state.code());
        w.u8(self.fault.map_or(0, Fault::code));
        w.u8(self.refusal.map_or(0, Refusal::code));
        w.u8(self.reset.code());
        w.u32(self.token);
        w.u32(self.ticks);
        w.u32(self.image);
        w.u8(self.slot);
        w.u8(self.axes);
        w.u16(self.observation);
        w.u16(self.payload);
        w.u32(self.refused);
        let Counters { good, damaged, malformed, repeated, lost } = self.counters;
        [good, damaged, malformed, repeated, lost].into_iter().for_each(|n| w.u32(n));
    }

    pub(crate) fn read(r: &mut Reader<'_>) -> Option<Self> {
        Some(Self {
            state: State::from_code(r.u8()?)?,
            fault: optional(r.u8()?, Fault::from_code)?,
            refusal: optional(r.u8()?, Refusal::from_code)?,
            reset: ResetCause::from_code(r.u8()?)?,
            token: r.u32()?,
            ticks: r.u32()?,
            image: r.u32()?,
            slot: r.u8()?,
            axes: r.u8()?,
            observation: r.u16()?,
            payload: r.u16()?,
            refused: r.u32()?,
            counters: Counters {
                good: r.u32()?,
                damaged: r.u32()?,
                malformed: r.u32()?,
                repeated: r.u32()?,
                lost: r.u32()?,
            },
        })
    }
}

/// What things take. What is not measured is 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Timing {
    /// Period of the control tick in ns.
    pub period: u32,
    /// The longest tick in ns, since the start.
    pub worst_tick: u32,
    /// The latest start of a tick behind its due time in ns, since the start.
    pub worst_jitter: u32,
    /// The longest step of the head in µs, from observation to action, since the start.
    pub worst_head: u32,
    /// Ticks that ended after the next one was due.
    pub overruns: u32,
    /// Bytes of stack that were in use at most.
    pub stack: u32,
}

impl Timing {
    pub(crate) fn write(&self, w: &mut Writer<'_>) {
        let Self { period, worst_tick, worst_jitter, worst_head, overruns, stack } = *self;
        [period, worst_tick, worst_jitter, worst_head, overruns, stack].into_iter().for_each(|n| w.u32(n));
    }

    pub(crate) fn read(r: &mut Reader<'_>) -> Option<Self> {
        Some(Self {
            period: r.u32()?,
            worst_tick: r.u32()?,
            worst_jitter: r.u32()?,
            worst_head: r.u32()?,
            overruns: r.u32()?,
            stack: r.u32()?,
        })
    }
}

/// What the firmware left behind before the last reset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Breadcrumb {
    /// Why the processor started.
    pub reset: ResetCause,
    /// What it died of; `None` where it left nothing behind.
    pub crash: Option<Crash>,
    /// Program counter at the crash; 0 where it is not known.
    pub pc: u32,
    /// A number that the crash adds: the fault status register, the line of a panic, what made no progress.
    pub detail: u32,
    /// Ticks since the start, at the crash.
    pub ticks: u32,
    /// Crashes since power came on.
    pub count: u32,
}

impl Breadcrumb {
    pub(crate) fn write(&self, w: &mut Writer<'_>) {
        w.u8(self.reset.code());
        w.u8(self.crash.map_or(0, Crash::code));
        [self.pc, self.detail, self.ticks, self.count].into_iter().for_each(|n| w.u32(n));
    }

    pub(crate) fn read(r: &mut Reader<'_>) -> Option<Self> {
        Some(Self {
            reset: ResetCause::from_code(r.u8()?)?,
            crash: optional(r.u8()?, Crash::from_code)?,
            pc: r.u32()?,
            detail: r.u32()?,
            ticks: r.u32()?,
            count: r.u32()?,
        })
    }
}

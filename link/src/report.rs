//! Reports of a controller about itself.

use crate::code::{Crash, Fault, Refusal, ResetCause, State, optional};
use crate::fields::{Reader, Writer};

/// Value of [`Status::slot`] for the built-in image, which is not in a slot.
pub const BUILT_IN: u8 = 255;

/// Counters of a receiver's frames. They wrap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Frames that gave a message.
    pub good: u32,
    /// Frames that were damaged or longer than the receiver's memory.
    pub damaged: u32,
    /// Undamaged frames of another version, of an unknown kind, or whose payload does not match their kind.
    pub malformed: u32,
    /// Frames that had arrived before, or that arrived after a newer one.
    pub repeated: u32,
    /// Missing sequence numbers.
    pub lost: u32,
}

/// State of the controller, and what a host must know before it arms.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Status {
    /// State of the outputs.
    pub state: State,
    /// Cause of the last transition to [`State::Latched`].
    pub fault: Option<Fault>,
    /// First reason why the controller cannot be armed now, if any.
    pub refusal: Option<Refusal>,
    /// Cause of the processor's last reset.
    pub reset: ResetCause,
    /// Token that a request must contain to change something. It changes with the state and with every start.
    pub token: u32,
    /// Ticks since the start; wraps.
    pub ticks: u32,
    /// CRC-32 from the image's header; 0 without an image.
    pub image: u32,
    /// The image's slot, 0 or 1, or [`BUILT_IN`].
    pub slot: u8,
    /// Number of axes, which is the length of an action.
    pub axes: u8,
    /// Length of an observation in values.
    pub observation: u16,
    /// Length of the longest payload that the controller has memory for, in bytes.
    pub payload: u16,
    /// Observations that the guard refused: length, finiteness, range or age.
    pub refused: u32,
    /// Counters of the controller's receiver.
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

/// Measured times and stack use; 0 for what is not measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Timing {
    /// Period of the control tick in ns.
    pub period: u32,
    /// The longest tick since the start, in ns.
    pub worst_tick: u32,
    /// The longest delay of a tick's start after its due time since the start, in ns.
    pub worst_jitter: u32,
    /// The longest step of the head since the start, from observation to action, in µs.
    pub worst_head: u32,
    /// Ticks that ended after the next tick was due.
    pub overruns: u32,
    /// Most bytes of stack in use since the start.
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

/// The record that the firmware left before the last reset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Breadcrumb {
    /// Cause of the processor's last reset.
    pub reset: ResetCause,
    /// Kind of the crash; `None` if the firmware left no record.
    pub crash: Option<Crash>,
    /// Program counter at the crash; 0 if unknown.
    pub pc: u32,
    /// Detail of the crash: the fault status register, the line of a panic, or the parts without progress.
    pub detail: u32,
    /// Ticks from the start to the crash.
    pub ticks: u32,
    /// Crashes since power-on.
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

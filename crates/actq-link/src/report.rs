//! Reports of a controller about itself.

use crate::code::{Crash, Fault, Refusal, ResetCause, State};
use crate::fields::{Field, Reader, Writer, record};

/// Value of [`Status::slot`] for the built-in image, which is not in a slot.
pub const BUILT_IN: u8 = 255;

record! {
    /// Counters of a receiver's frames. They wrap.
    #[derive(Default)]
    pub struct Counters {
        /// Frames that gave a message.
        pub good: u32,
        /// Frames that were damaged or longer than the receiver's memory.
        pub damaged: u32,
        /// Undamaged frames of another version, of an unknown kind, or whose payload does not match their kind.
        pub malformed: u32,
        /// Frames that had arrived before, that arrived after a newer one, or, while armed, whose number is too far ahead.
        pub repeated: u32,
        /// Missing sequence numbers.
        pub lost: u32,
    }
}

record! {
    /// State of the controller, and what a host must know before it arms.
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
}

record! {
    /// Measured times and stack use; 0 for what is not measured.
    #[derive(Default)]
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
}

record! {
    /// The record that the firmware left before the last reset.
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
}

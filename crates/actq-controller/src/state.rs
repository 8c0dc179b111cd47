//! The states, and the only transitions between them.
//!
//! Each state is a type, and each transition a function from one to the other; no other transition compiles. Arming
//! requires [`Ready`], which only passed checks give:
//!
//! ```compile_fail
//! # use actq_controller::state::{Armed, Disarmed};
//! let armed: Armed<1> = Disarmed::new().arm(); // not without a Ready
//! ```
//!
//! ```compile_fail
//! # use actq_controller::health::Ready;
//! let ready = Ready(()); // which cannot be made
//! ```
//!
//! ```compile_fail
//! # use actq_controller::state::Disarmed;
//! # use actq_link::code::Fault;
//! Disarmed::new().latch(Fault::Stale); // what is not armed does not latch
//! ```
//!
//! ```
//! # use actq_controller::health::{Check, Health};
//! # use actq_controller::state::{Armed, Disarmed};
//! let mut health = Health::default();
//! Check::ALL.into_iter().for_each(|check| health.set(check, true));
//! let armed: Armed<1> = Disarmed::new().arm(health.ready()?);
//! # Ok::<(), actq_link::code::Refusal>(())
//! ```

use actq_link::code::Fault;

use crate::axis::{Axis, Output};
use crate::health::Ready;
use crate::safety::mix;

/// The disarmed state: outputs coast.
#[derive(Debug)]
pub struct Disarmed {
    /// `true` if the outputs coast: after the first tick in this state.
    is_coasting: bool,
}

/// The armed state: outputs follow the actions.
#[derive(Debug)]
pub struct Armed<const AXES: usize> {
    /// The outputs of the last tick.
    last: [Output; AXES],
    /// Target of the last action; before the first action the outputs do not change.
    target: Option<[f32; AXES]>,
    /// Ticks since the last action, or since arming.
    since_action: u32,
}

/// The latched state: outputs do their safe actions.
#[derive(Debug)]
pub struct Latched<const AXES: usize> {
    last: [Output; AXES],
    fault: Fault,
}

impl Disarmed {
    /// Returns the initial state, with outputs that are off.
    pub const fn new() -> Self {
        Self { is_coasting: true }
    }

    /// Returns `true` if the outputs coast.
    pub(crate) const fn is_coasting(&self) -> bool {
        self.is_coasting
    }

    /// Returns the outputs of the next tick.
    pub(crate) fn tick<const AXES: usize>(&mut self) -> [Output; AXES] {
        self.is_coasting = true;
        [Output::Coast; AXES]
    }

    /// Goes to [`Armed`].
    pub fn arm<const AXES: usize>(self, _ready: Ready) -> Armed<AXES> {
        Armed { last: [Output::Coast; AXES], target: None, since_action: 0 }
    }
}

impl Default for Disarmed {
    fn default() -> Self {
        Self::new()
    }
}

impl<const AXES: usize> Armed<AXES> {
    /// Sets the outputs' target: finite values.
    pub(crate) fn follow(&mut self, target: [f32; AXES]) {
        self.target = Some(target);
        self.since_action = 0;
    }

    /// Ticks since the last action, or since arming.
    pub(crate) const fn since_action(&self) -> u32 {
        self.since_action
    }

    /// Returns the outputs of the next tick.
    pub(crate) fn tick(&mut self, axes: &[Axis; AXES]) -> [Output; AXES] {
        self.since_action = self.since_action.saturating_add(1);
        if let Some(target) = &self.target {
            for ((last, axis), target) in self.last.iter_mut().zip(axes).zip(target) {
                *last = axis.follow(*last, *target);
            }
        }
        self.last
    }

    /// Goes to [`Latched`].
    pub fn latch(self, fault: Fault) -> Latched<AXES> {
        Latched { last: self.last, fault }
    }

    /// Goes to [`Disarmed`].
    pub fn disarm(self) -> Disarmed {
        Disarmed { is_coasting: false }
    }
}

impl<const AXES: usize> Latched<AXES> {
    /// Returns the state after a loss of the last outputs: without any.
    pub(crate) const fn lost() -> Self {
        Self { last: [Output::Coast; AXES], fault: Fault::Memory }
    }

    /// Returns the cause.
    pub const fn fault(&self) -> Fault {
        self.fault
    }

    /// Returns the outputs of the next tick.
    pub(crate) fn tick(&mut self, axes: &[Axis; AXES]) -> [Output; AXES] {
        for (last, axis) in self.last.iter_mut().zip(axes) {
            *last = axis.rest(*last);
        }
        self.last
    }

    /// Goes to [`Armed`]. Outputs do not change until the first action, and continue from there.
    pub fn arm(self, _ready: Ready) -> Armed<AXES> {
        Armed { last: self.last, target: None, since_action: 0 }
    }

    /// Goes to [`Disarmed`].
    pub fn disarm(self) -> Disarmed {
        Disarmed { is_coasting: false }
    }
}

/// The state of a controller.
#[derive(Debug)]
pub enum State<const AXES: usize> {
    /// The disarmed state: outputs coast.
    Disarmed(Disarmed),
    /// The armed state: outputs follow the actions.
    Armed(Armed<AXES>),
    /// The latched state: outputs do their safe actions.
    Latched(Latched<AXES>),
}

impl<const AXES: usize> State<AXES> {
    /// Continues a checksum with the state.
    pub(crate) fn sum(&self, sum: u32) -> u32 {
        let (last, mut sum) = match self {
            Self::Disarmed(Disarmed { is_coasting }) => return mix(sum, u32::from(*is_coasting)),
            Self::Armed(Armed { last, target, since_action }) => {
                let mut sum = mix(mix(sum, *since_action), 2 + u32::from(target.is_some()));
                if let Some(target) = target {
                    for value in target {
                        sum = mix(sum, value.to_bits());
                    }
                }
                (last, sum)
            }
            Self::Latched(Latched { last, fault }) => (last, mix(sum, 4 + u32::from(fault.code()))),
        };
        for output in last {
            sum = output.sum(sum);
        }
        sum
    }
}

//! The states, and the only ways from one to another.
//!
//! Each state is a type, and each way a function that takes the one and gives the other: what is not here cannot be
//! written. A controller is not armed without [`Ready`], which only passed checks give:
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

/// Outputs coast.
#[derive(Debug)]
pub struct Disarmed {
    /// Whether they do: not before the tick that tells them.
    told: bool,
}

/// Outputs follow the actions.
#[derive(Debug)]
pub struct Armed<const AXES: usize> {
    /// What was last told.
    last: [Output; AXES],
    /// Where the last action leads; before the first one, outputs stay as they were.
    target: Option<[f32; AXES]>,
    /// Ticks since the last action, or since arming.
    since_action: u32,
}

/// Outputs do their safe actions.
#[derive(Debug)]
pub struct Latched<const AXES: usize> {
    last: [Output; AXES],
    fault: Fault,
}

impl Disarmed {
    /// Where everything begins: with outputs that are off.
    pub const fn new() -> Self {
        Self { told: true }
    }

    /// Whether the outputs coast by now.
    pub(crate) const fn told(&self) -> bool {
        self.told
    }

    /// The outputs of the next tick.
    pub(crate) fn tick<const AXES: usize>(&mut self) -> [Output; AXES] {
        self.told = true;
        [Output::Coast; AXES]
    }

    /// To [`Armed`].
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
    /// Where the outputs are to go from now on: finite values.
    pub(crate) fn follow(&mut self, target: [f32; AXES]) {
        self.target = Some(target);
        self.since_action = 0;
    }

    /// Ticks since the last action, or since arming.
    pub(crate) const fn since_action(&self) -> u32 {
        self.since_action
    }

    /// The outputs of the next tick.
    pub(crate) fn tick(&mut self, axes: &[Axis; AXES]) -> [Output; AXES] {
        self.since_action = self.since_action.saturating_add(1);
        if let Some(target) = &self.target {
            for ((last, axis), target) in self.last.iter_mut().zip(axes).zip(target) {
                *last = axis.follow(*last, *target);
            }
        }
        self.last
    }

    /// To [`Latched`].
    pub fn latch(self, fault: Fault) -> Latched<AXES> {
        Latched { last: self.last, fault }
    }

    /// To [`Disarmed`].
    pub fn disarm(self) -> Disarmed {
        Disarmed { told: false }
    }
}

impl<const AXES: usize> Latched<AXES> {
    /// What led here.
    pub const fn fault(&self) -> Fault {
        self.fault
    }

    /// The outputs of the next tick.
    pub(crate) fn tick(&mut self, axes: &[Axis; AXES]) -> [Output; AXES] {
        for (last, axis) in self.last.iter_mut().zip(axes) {
            *last = axis.rest(*last);
        }
        self.last
    }

    /// To [`Armed`]. Outputs stay as they are until the first action, and go on from there.
    pub fn arm(self, _ready: Ready) -> Armed<AXES> {
        Armed { last: self.last, target: None, since_action: 0 }
    }

    /// To [`Disarmed`].
    pub fn disarm(self) -> Disarmed {
        Disarmed { told: false }
    }
}

/// The state that a controller is in.
#[derive(Debug)]
pub enum State<const AXES: usize> {
    /// Outputs coast.
    Disarmed(Disarmed),
    /// Outputs follow the actions.
    Armed(Armed<AXES>),
    /// Outputs do their safe actions.
    Latched(Latched<AXES>),
}

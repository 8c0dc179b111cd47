//! The state, the limits and the deadline: what stands between actions and outputs.
//!
//! A control interrupt calls [`Safety::tick`]; everything else comes from below it, through [`Shared`]. Each call takes
//! time proportional to the number of axes at most.

use core::mem;
use core::ops::RangeInclusive;

use actq_link::code::{self, Fault, Refusal};

use crate::axis::{Axis, Output};
use crate::health::{Check, Health};
use crate::state::{Disarmed, State};

/// A [`Safety`] that a control interrupt uses, too: however the firmware locks it (RTIC's resource, a critical
/// section).
pub trait Shared<const AXES: usize> {
    /// Runs `work` on it while no interrupt does.
    fn with<R>(&mut self, work: impl FnOnce(&mut Safety<AXES>) -> R) -> R;
}

/// Where there is no interrupt.
impl<const AXES: usize> Shared<AXES> for Safety<AXES> {
    fn with<R>(&mut self, work: impl FnOnce(&mut Safety<AXES>) -> R) -> R {
        work(self)
    }
}

/// What a build allows at most.
#[derive(Clone, Debug)]
pub(crate) struct Built<const AXES: usize> {
    pub(crate) axes: [Axis; AXES],
    pub(crate) deadline: RangeInclusive<u32>,
}

/// Decides, every tick, what the outputs do.
#[derive(Debug)]
pub struct Safety<const AXES: usize> {
    pub(crate) axes: [Axis; AXES],
    /// Ticks without an observation, or an action, that are bearable.
    pub(crate) deadline: u32,
    /// What the build allows at most.
    pub(crate) built: Built<AXES>,
    health: Health,
    state: State<AXES>,
    /// The last fault.
    fault: Option<Fault>,
    /// Ticks since the last good observation; the largest number where there was none.
    since_observation: u32,
    ticks: u32,
    token: u32,
}

impl<const AXES: usize> Safety<AXES> {
    /// Disarmed. `deadline` in ticks: what may be set, at least 1 (0 is taken as 1), and what holds until then, its end.
    /// `seed` should be another one at every start, so that requests from before it are refused: a count of starts in
    /// memory that a reset keeps, or a free-running timer.
    pub fn new(axes: [Axis; AXES], deadline: RangeInclusive<u32>, seed: u32) -> Self {
        let (least, most) = (*deadline.start().max(&1), *deadline.end().max(&1));
        Self {
            axes,
            deadline: most,
            built: Built { axes, deadline: least..=most },
            health: Health::default(),
            state: State::Disarmed(Disarmed::new()),
            fault: None,
            since_observation: u32::MAX,
            ticks: 0,
            token: next_token(seed),
        }
    }

    /// What the outputs do from now to the next tick. To be called at every tick, and nowhere else.
    pub fn tick(&mut self) -> [Output; AXES] {
        self.ticks = self.ticks.wrapping_add(1);
        self.since_observation = self.since_observation.saturating_add(1);
        if let State::Armed(armed) = &self.state {
            // The tick that begins now is not counted in the action's age yet.
            let late = armed.since_action() >= self.deadline;
            if self.is_stale() {
                self.trip(Fault::Stale);
            } else if late {
                self.trip(Fault::Late);
            }
        }
        match &mut self.state {
            State::Disarmed(disarmed) => disarmed.tick(),
            State::Armed(armed) => armed.tick(&self.axes),
            State::Latched(latched) => latched.tick(&self.axes),
        }
    }

    /// Whether no good observation has come within the deadline.
    pub const fn is_stale(&self) -> bool {
        self.since_observation > self.deadline
    }

    /// A good observation has come.
    pub fn observed(&mut self) {
        self.since_observation = 0;
    }

    /// Takes an action of the head; what the outputs are led to by it, within the limits, where it is applied. That is
    /// only while armed.
    ///
    /// # Errors
    ///
    /// A fault where it has not one finite value for each axis. It latches.
    pub fn act(&mut self, action: &[f32]) -> Result<Option<[f32; AXES]>, Fault> {
        let fault = match <&[f32; AXES]>::try_from(action) {
            Err(_) => Fault::ActionLength,
            Ok(action) if !action.iter().all(|value| value.is_finite()) => Fault::ActionNotFinite,
            Ok(action) => {
                let State::Armed(armed) = &mut self.state else { return Ok(None) };
                let mut target = *action;
                target.iter_mut().zip(&self.axes).for_each(|(value, axis)| *value = axis.limit(*value));
                armed.follow(target);
                return Ok(Some(target));
            }
        };
        self.trip(fault);
        Err(fault)
    }

    /// Latches, where armed: the head has failed, a tick took too long, the break input was seen.
    pub fn trip(&mut self, fault: Fault) {
        self.state = match mem::replace(&mut self.state, State::Disarmed(Disarmed::new())) {
            State::Armed(armed) => {
                self.fault = Some(fault);
                self.renew();
                State::Latched(armed.latch(fault))
            }
            other => other,
        };
    }

    /// Notes the outcome of a check. One that has failed keeps from arming, and latches where armed.
    pub fn check(&mut self, check: Check, passed: bool) {
        self.health.set(check, passed);
        if !passed {
            self.trip(check.fault());
        }
    }

    /// Why arming would be refused now.
    pub fn refusal(&self) -> Option<Refusal> {
        if let State::Armed(_) = self.state {
            return Some(Refusal::Armed);
        }
        let limits = || self.axes.iter().any(Axis::is_still).then_some(Refusal::Limits);
        self.health.ready().err().or(self.is_stale().then_some(Refusal::Stale)).or_else(limits)
    }

    /// Arms.
    ///
    /// # Errors
    ///
    /// Where the token is not [`Self::token`], where armed already, where a check has failed or was not done, without a
    /// fresh observation, and with an axis without limits. Nothing changes then.
    pub fn arm(&mut self, token: u32) -> Result<(), Refusal> {
        if token != self.token {
            return Err(Refusal::Token);
        }
        if let Some(refusal) = self.refusal() {
            return Err(refusal);
        }
        let ready = self.health.ready()?;
        self.state = match mem::replace(&mut self.state, State::Disarmed(Disarmed::new())) {
            State::Disarmed(disarmed) => State::Armed(disarmed.arm(ready)),
            State::Latched(latched) => State::Armed(latched.arm(ready)),
            armed @ State::Armed(_) => armed,
        };
        self.renew();
        Ok(())
    }

    /// Disarms; never refused.
    pub fn disarm(&mut self) {
        self.state = match mem::replace(&mut self.state, State::Disarmed(Disarmed::new())) {
            State::Disarmed(disarmed) => State::Disarmed(disarmed),
            State::Armed(armed) => State::Disarmed(armed.disarm()),
            State::Latched(latched) => State::Disarmed(latched.disarm()),
        };
        self.renew();
    }

    /// Whether settings may change: while disarmed, and by who knows the state.
    ///
    /// # Errors
    ///
    /// [`Refusal::Token`] or [`Refusal::Armed`].
    pub fn may_change(&self, token: u32) -> Result<(), Refusal> {
        match self.state {
            _ if token != self.token => Err(Refusal::Token),
            State::Disarmed(_) => Ok(()),
            State::Armed(_) | State::Latched(_) => Err(Refusal::Armed),
        }
    }

    /// Whether the tick may stand still, as while flash is written: disarmed, and a tick has let the outputs coast.
    ///
    /// # Errors
    ///
    /// [`Refusal::Armed`], or [`Refusal::Busy`] up to the next tick.
    pub const fn may_stall(&self) -> Result<(), Refusal> {
        match &self.state {
            State::Disarmed(disarmed) if disarmed.told() => Ok(()),
            State::Disarmed(_) => Err(Refusal::Busy),
            State::Armed(_) | State::Latched(_) => Err(Refusal::Armed),
        }
    }

    /// The state's name.
    pub const fn state(&self) -> code::State {
        match self.state {
            State::Disarmed(_) => code::State::Disarmed,
            State::Armed(_) => code::State::Armed,
            State::Latched(_) => code::State::Latched,
        }
    }

    /// The last fault.
    pub const fn fault(&self) -> Option<Fault> {
        self.fault
    }

    /// Makes requests, observations and actions from before count no more.
    pub fn renew(&mut self) {
        self.token = next_token(self.token);
    }

    /// What requests have to name.
    pub const fn token(&self) -> u32 {
        self.token
    }

    /// Ticks since the start; wraps.
    pub const fn ticks(&self) -> u32 {
        self.ticks
    }

    /// The axes.
    pub const fn axes(&self) -> &[Axis; AXES] {
        &self.axes
    }
}

/// The next of 2^32 different numbers (a full-period linear congruential generator; Numerical Recipes' constants).
const fn next_token(token: u32) -> u32 {
    token.wrapping_mul(1_664_525).wrapping_add(1_013_904_223)
}

//! The state, the limits and the deadline between actions and outputs.
//!
//! A control interrupt calls [`Safety::tick`]. All other calls come from lower priorities, through [`Shared`]. A call
//! takes at most time proportional to the number of axes.

#[cfg(test)]
mod tests;

use core::mem;
use core::ops::RangeInclusive;

use actq_link::code::{self, Fault, Refusal};

use crate::axis::{Axis, Output};
use crate::health::{Check, Health};
use crate::state::{Disarmed, Latched, State};

/// A [`Safety`] shared with a control interrupt, with the firmware's kind of lock: RTIC's resource, a critical section.
pub trait Shared<const AXES: usize> {
    /// Runs `work` while no interrupt has access.
    fn with<R>(&mut self, work: impl FnOnce(&mut Safety<AXES>) -> R) -> R;
}

/// Access without an interrupt.
impl<const AXES: usize> Shared<AXES> for Safety<AXES> {
    fn with<R>(&mut self, work: impl FnOnce(&mut Safety<AXES>) -> R) -> R {
        work(self)
    }
}

/// Limits of the build.
#[derive(Clone, Debug)]
pub(crate) struct Built<const AXES: usize> {
    pub(crate) axes: [Axis; AXES],
    pub(crate) deadline: RangeInclusive<u32>,
}

/// Decides the outputs of every tick.
#[derive(Debug)]
pub struct Safety<const AXES: usize> {
    pub(crate) axes: [Axis; AXES],
    /// Ticks allowed without an observation, or without an action.
    pub(crate) deadline: u32,
    /// Limits of the build.
    pub(crate) built: Built<AXES>,
    health: Health,
    state: State<AXES>,
    fault: Option<Fault>,
    /// Ticks since the last valid observation; `u32::MAX` if there was none.
    since_observation: u32,
    ticks: u32,
    token: u32,
    /// The memory was changed by something else.
    is_lost: bool,
    /// [`Self::limits_sum`] and [`Self::sum`] after the last change.
    sums: [u32; 2],
}

impl<const AXES: usize> Safety<AXES> {
    /// Creates a disarmed controller. `deadline` is the range that may be set, in ticks, at least 1 (0 counts as 1) and
    /// less than `u32::MAX` (which counts as 1 less); its end applies until then. `seed` should differ at every start, so
    /// that requests from before the start are refused: a count of starts in memory that a reset preserves, or a
    /// free-running timer.
    pub fn new(axes: [Axis; AXES], deadline: RangeInclusive<u32>, seed: u32) -> Self {
        // Below the age that means that there was no observation.
        let (least, most) = (*deadline.start().max(&1), *deadline.end().clamp(&1, &(u32::MAX - 1)));
        let mut safety = Self {
            axes,
            deadline: most,
            built: Built { axes, deadline: least..=most },
            health: Health::default(),
            state: State::Disarmed(Disarmed::new()),
            fault: None,
            since_observation: u32::MAX,
            ticks: 0,
            token: next_token(seed),
            is_lost: false,
            sums: [0; 2],
        };
        safety.sums = [safety.limits_sum(), safety.sum()];
        safety
    }

    /// Makes a change, unless anything else has changed the state since the last one.
    fn change<R>(&mut self, make: impl FnOnce(&mut Self) -> R) -> R {
        self.verify(self.sums[0]);
        let result = make(self);
        self.sums[1] = self.sum();
        result
    }

    /// Makes a change of limits, unless anything else has changed them.
    pub(crate) fn change_limits<R>(&mut self, make: impl FnOnce(&mut Self) -> R) -> R {
        self.check_limits();
        let result = make(self);
        self.sums = [self.limits_sum(), self.sum()];
        result
    }

    /// Requires that nothing else has changed the limits or the state. Call it before [`Self::observed`], not within the
    /// same lock: its time delays a tick.
    pub fn check_limits(&mut self) {
        self.verify(self.limits_sum());
    }

    /// Requires these checksums: of the limits, and of the state now. With others, limits and last outputs mean nothing any
    /// more: outputs that brake brake, all others coast, and nothing arms again.
    #[inline(never)]
    fn verify(&mut self, limits: u32) {
        if self.sums != [limits, self.sum()] {
            self.is_lost = true;
            if !matches!(self.state, State::Disarmed(_)) {
                self.state = State::Latched(Latched::lost());
                self.fault = Some(Fault::Memory);
                self.token = next_token(self.token);
            }
            self.sums = [limits, self.sum()];
        }
    }

    /// Returns a checksum of the limits. Like [`Self::sum`], it differs after a change of any single bit. A tick takes it
    /// as unchanged, for its time: requests come often enough.
    #[inline(never)]
    fn limits_sum(&self) -> u32 {
        let mut sum = mix(mix(self.deadline, *self.built.deadline.start()), *self.built.deadline.end());
        for axes in [&self.axes, &self.built.axes] {
            for axis in axes {
                sum = axis.sum(sum);
            }
        }
        sum
    }

    /// Returns a checksum of everything else.
    #[inline(never)]
    fn sum(&self) -> u32 {
        let Self { health, state, fault, since_observation, ticks, token, is_lost, .. } = self;
        let fault = match fault {
            Some(fault) => fault.code(),
            None => 0,
        };
        let bits = u32::from_le_bytes([fault, u8::from(*is_lost), health.bits(), 0]);
        state.sum(mix(mix(mix(bits, *since_observation), *ticks), *token))
    }

    /// Returns the outputs from now to the next tick. Call it at every tick, and only there.
    pub fn tick(&mut self) -> [Output; AXES] {
        self.change(Self::next)
    }

    fn next(&mut self) -> [Output; AXES] {
        self.ticks = self.ticks.wrapping_add(1);
        self.since_observation = self.since_observation.saturating_add(1);
        if let State::Armed(armed) = &self.state {
            // The action's age does not include the tick that begins now.
            let late = armed.since_action() >= self.deadline;
            if self.is_stale() {
                self.latch(Fault::Stale);
            } else if late {
                self.latch(Fault::Late);
            }
        }
        match &mut self.state {
            State::Disarmed(disarmed) => disarmed.tick(),
            State::Armed(armed) => armed.tick(&self.axes),
            State::Latched(latched) => latched.tick(&self.axes),
        }
    }

    /// Returns `true` if no valid observation arrived within the deadline.
    pub const fn is_stale(&self) -> bool {
        self.since_observation > self.deadline
    }

    /// Records a valid observation.
    pub fn observed(&mut self) {
        self.change(|safety| safety.since_observation = 0);
    }

    /// Records that ticks may have been lost, as while flash was written: the age of the last observation is unknown.
    /// So arming needs a new one. No effect while armed, when nothing may hold up the tick.
    pub fn stalled(&mut self) {
        self.change(|safety| {
            if !matches!(safety.state, State::Armed(_)) {
                safety.since_observation = u32::MAX;
            }
        });
    }

    /// Takes an action of the head. While armed, applies it and returns the outputs' targets, within the limits.
    ///
    /// # Errors
    ///
    /// Returns a fault, and latches, unless the action has one finite value for each axis.
    pub fn act(&mut self, action: &[f32]) -> Result<Option<[f32; AXES]>, Fault> {
        self.change(|safety| {
            let fault = match <&[f32; AXES]>::try_from(action) {
                Err(_) => Fault::ActionLength,
                Ok(action) if !action.iter().all(|value| value.is_finite()) => Fault::ActionNotFinite,
                Ok(action) => {
                    let State::Armed(armed) = &mut safety.state else { return Ok(None) };
                    let mut target = *action;
                    target.iter_mut().zip(&safety.axes).for_each(|(value, axis)| *value = axis.limit(*value));
                    armed.follow(target);
                    return Ok(Some(target));
                }
            };
            safety.latch(fault);
            Err(fault)
        })
    }

    /// Latches if armed: after a failure of the head, an overlong tick, or a break input.
    pub fn trip(&mut self, fault: Fault) {
        self.change(|safety| safety.latch(fault));
    }

    fn latch(&mut self, fault: Fault) {
        self.state = match mem::replace(&mut self.state, State::Disarmed(Disarmed::new())) {
            State::Armed(armed) => {
                self.fault = Some(fault);
                self.token = next_token(self.token);
                State::Latched(armed.latch(fault))
            }
            other => other,
        };
    }

    /// Records the outcome of a check. A failed check prevents arming, and latches an armed controller.
    pub fn check(&mut self, check: Check, passed: bool) {
        // Most checks are made again and again. One that has failed has latched already.
        if passed == self.health.has_passed(check) {
            return;
        }
        self.change(|safety| {
            safety.health.set(check, passed);
            if !passed {
                safety.latch(check.fault());
            }
        });
    }

    /// Returns the reason why arming would be refused now.
    pub fn refusal(&self) -> Option<Refusal> {
        if let State::Armed(_) = self.state {
            return Some(Refusal::Armed);
        }
        // Only disarming clears these: the outputs then coast, whatever the safe action.
        let hardware = match &self.state {
            State::Latched(latched) => matches!(latched.fault(), Fault::Break | Fault::Overrun),
            _ => false,
        };
        let hardware = hardware || self.is_lost;
        let limits = || self.axes.iter().any(Axis::is_still).then_some(Refusal::Limits);
        let stale = self.is_stale().then_some(Refusal::Stale);
        self.health.ready().err().or(hardware.then_some(Refusal::Hardware)).or(stale).or_else(limits)
    }

    /// Arms the controller.
    ///
    /// # Errors
    ///
    /// Fails without any change if the token differs from [`Self::token`], or if the controller is already armed. The
    /// same holds after a failed or missing check, after a break or an overrun that latched until the controller is
    /// disarmed, without a recent observation, and with an axis without limits. After a disarm, returns
    /// [`Refusal::Busy`] until the next tick.
    pub fn arm(&mut self, token: u32) -> Result<(), Refusal> {
        // An axis that has not coasted would jump from its last value to its start value.
        if self.may_stall() == Err(Refusal::Busy) {
            return Err(Refusal::Busy);
        }
        if token != self.token {
            return Err(Refusal::Token);
        }
        self.check_limits();
        self.change(|safety| {
            // Unless the memory is lost.
            let ready = safety.refusal().map_or_else(|| safety.health.ready(), Err)?;
            safety.state = match mem::replace(&mut safety.state, State::Disarmed(Disarmed::new())) {
                State::Disarmed(disarmed) => State::Armed(disarmed.arm(ready)),
                State::Latched(latched) => State::Armed(latched.arm(ready)),
                armed @ State::Armed(_) => armed,
            };
            safety.token = next_token(safety.token);
            Ok(())
        })
    }

    /// Disarms the controller; never refused.
    pub fn disarm(&mut self) {
        self.change(|safety| {
            safety.state = match mem::replace(&mut safety.state, State::Disarmed(Disarmed::new())) {
                State::Disarmed(disarmed) => State::Disarmed(disarmed),
                State::Armed(armed) => State::Disarmed(armed.disarm()),
                State::Latched(latched) => State::Disarmed(latched.disarm()),
            };
            safety.token = next_token(safety.token);
        });
    }

    /// Checks that settings may change: the controller is disarmed, and the request's token is current.
    ///
    /// # Errors
    ///
    /// Returns [`Refusal::Token`] or [`Refusal::Armed`].
    pub fn may_change(&self, token: u32) -> Result<(), Refusal> {
        match self.state {
            _ if token != self.token => Err(Refusal::Token),
            State::Disarmed(_) => Ok(()),
            State::Armed(_) | State::Latched(_) => Err(Refusal::Armed),
        }
    }

    /// Checks that the tick may stall, as while flash is written: the controller is disarmed, and a tick has let the
    /// outputs coast.
    ///
    /// # Errors
    ///
    /// Returns [`Refusal::Armed`], or [`Refusal::Busy`] until the next tick.
    pub const fn may_stall(&self) -> Result<(), Refusal> {
        match &self.state {
            State::Disarmed(disarmed) if disarmed.is_coasting() => Ok(()),
            State::Disarmed(_) => Err(Refusal::Busy),
            State::Armed(_) | State::Latched(_) => Err(Refusal::Armed),
        }
    }

    /// Returns the state.
    pub const fn state(&self) -> code::State {
        match self.state {
            State::Disarmed(_) => code::State::Disarmed,
            State::Armed(_) => code::State::Armed,
            State::Latched(_) => code::State::Latched,
        }
    }

    /// Returns the last fault.
    pub const fn fault(&self) -> Option<Fault> {
        self.fault
    }

    /// Changes the token, so that earlier requests, observations and actions are no longer accepted.
    pub fn renew(&mut self) {
        self.change(|safety| safety.token = next_token(safety.token));
    }

    /// Returns the token that requests must contain.
    pub const fn token(&self) -> u32 {
        self.token
    }

    /// Returns the ticks since the start; wraps.
    pub const fn ticks(&self) -> u32 {
        self.ticks
    }

    /// Returns the axes, with the limits that apply now.
    pub const fn axes(&self) -> &[Axis; AXES] {
        &self.axes
    }

    /// Returns the axes of the build: what the outputs' units refer to. A host's stricter limits narrow the values that
    /// an output may have, and not their meaning.
    pub const fn built_axes(&self) -> &[Axis; AXES] {
        &self.built.axes
    }
}

/// Continues a checksum with a word.
#[inline(always)]
pub(crate) const fn mix(sum: u32, word: u32) -> u32 {
    sum.rotate_left(1) ^ word
}

/// Returns the next of 2^32 different numbers, by a full-period linear congruential generator with the constants of
/// Numerical Recipes.
const fn next_token(token: u32) -> u32 {
    token.wrapping_mul(1_664_525).wrapping_add(1_013_904_223)
}

//! The running image: its head in slices, and the scrub of its bytes.

use core::mem;
use core::task::Poll;

#[cfg(feature = "attention")]
use actq_controller::prefix::Transfer;
use actq_controller::scrub::Scrub;
use actq_controller::{Check, Endpoint, Shared};
use actq_kernels::{Head, StepError};
#[cfg(feature = "attention")]
use actq_link::code::Refusal;

#[cfg(feature = "attention")]
use crate::deadline::{prefix_lifetime, tick_hz};

/// Modelled instructions of a slice, unless an image needs more: about 0.17 ms of a Cortex-M4 at 168 MHz, as an
/// instruction of a network takes 1.4 cycles on average. Received bytes wait that long; the tick does not.
pub const SLICE: u32 = 20_000;

/// Bytes that the scrub reads per turn.
const SCRUB_BYTES: usize = 64;

/// A running image.
pub struct Running<'i, 's> {
    head: Head<'i, 's>,
    bytes: &'i [u8],
    scrub: Scrub,
    phase: Phase,
    /// Sequence number of the newest observation's frame.
    of: u32,
    /// Time of the step's beginning, in µs.
    begun: u32,
    /// `true` if the network has taken longer than from one observation to the next: it will again.
    is_slow: bool,
    /// `true` if a period has passed without an action, of which the head does not know yet.
    has_passed: bool,
    /// Longest step so far, in µs.
    longest_step: u32,
    /// The next prefix, and the lifetime of the head's.
    #[cfg(feature = "attention")]
    pub(crate) transfer: Transfer<'s>,
}

/// Phase of a step.
#[derive(Clone, Copy, PartialEq)]
enum Phase {
    /// There is none.
    Idle,
    Begun,
    /// The network runs.
    Runs,
    /// The network runs, and the newest observation's period is over for the head.
    Late,
    /// The action is ready, and is for the next period.
    Ready,
}

impl<'i, 's> Running<'i, 's> {
    /// Runs `head`, whose image is in `bytes`, with the memory for its next prefix; `sum` is the bytes' checksum for the
    /// scrub, from before their check.
    #[cfg_attr(not(feature = "attention"), allow(unused_variables, reason = "the memory is for a prefix"))]
    pub fn new((head, memory): (Head<'i, 's>, &'s mut [u32]), bytes: &'i [u8], sum: u32) -> Self {
        #[cfg(feature = "attention")]
        let transfer = {
            let lifetime = prefix_lifetime(tick_hz(cfg!(feature = "tick-8khz")));
            Transfer::new(bytemuck::must_cast_slice_mut(memory), head.image().crc(), lifetime)
        };
        Self {
            head,
            bytes,
            scrub: Scrub::new(sum),
            phase: Phase::Idle,
            of: 0,
            begun: 0,
            is_slow: false,
            has_passed: false,
            longest_step: 0,
            #[cfg(feature = "attention")]
            transfer,
        }
    }

    /// Gives the head a prefix that has arrived, if no step is being computed. Takes it away after its lifetime, also from
    /// a step; then, and as long as there is none, the controller does not arm, and latches.
    #[cfg(feature = "attention")]
    pub fn refresh<const AXES: usize>(&mut self, safety: &mut impl Shared<AXES>) {
        if self.phase == Phase::Idle
            && let Some(prefix) = self.transfer.whole()
        {
            let outcome = self.head.set_prefix(prefix).map_err(|_| Refusal::Range);
            self.transfer.installed(outcome);
        }
        let is_fresh = safety.with(|safety| {
            let is_fresh = self.transfer.is_fresh(safety.ticks());
            safety.check(Check::Prefix, is_fresh);
            is_fresh
        });
        if !is_fresh && self.head.has_prefix() {
            self.phase = Phase::Idle;
            self.head.clear_prefix();
        }
    }

    /// Longest step so far, in µs.
    pub const fn longest_step(&self) -> u32 {
        self.longest_step
    }

    /// Scrubs a piece of the image; a changed image prevents arming, and latches.
    pub fn scrub<const AXES: usize>(&mut self, safety: &mut impl Shared<AXES>) {
        if self.scrub.advance(self.bytes, SCRUB_BYTES) == Some(false) {
            safety.with(|safety| safety.check(Check::Image, false));
        }
    }

    /// Starts a step on the newest observation, or runs a slice of the current one; returns the frame to send, in
    /// `out`.
    ///
    /// If the image keeps the rest of a chunk while the network computes the next one (an overlap or an ensemble), then every
    /// observation stands for a control period: those that arrive meanwhile are answered with what the chunk before
    /// predicts for their periods, and a chunk that is ready late begins with its action for the next period.
    pub fn slice<'b, const AXES: usize, const OBS: usize, const N: usize>(
        &mut self,
        endpoint: &mut Endpoint<'_, OBS, N>,
        micros: u32,
        safety: &mut impl Shared<AXES>,
        out: &'b mut [u8],
    ) -> Option<&'b [u8]> {
        let takes = match self.phase {
            Phase::Idle | Phase::Ready => true,
            Phase::Begun => false,
            // Without a rest of the chunk before, the next observation waits for the action.
            Phase::Runs | Phase::Late => self.head.image().keeps_rest(),
        };
        let mut plays = self.phase == Phase::Runs && self.is_slow;
        if takes && let Some(step) = endpoint.step(safety) {
            self.of = step.of;
            if step.reset {
                self.head.reset();
                (self.phase, self.is_slow) = (Phase::Idle, false);
            }
            if self.phase == Phase::Idle {
                (self.phase, self.begun, self.has_passed) = (Phase::Begun, micros, false);
                if let Err(error) = self.head.begin(step.observation) {
                    self.phase = Phase::Idle;
                    return endpoint.acted(self.of, Err(error), micros, safety, out);
                }
                return None;
            }
            if self.phase != Phase::Ready {
                (plays, self.is_slow) = (true, true);
                self.has_passed |= self.phase == Phase::Runs;
            }
        } else if matches!(self.phase, Phase::Idle | Phase::Ready) {
            return None;
        }
        if mem::take(&mut self.has_passed) {
            self.head.pass(1);
        }
        let action = if plays {
            self.phase = Phase::Late;
            self.head.play().map(Poll::Ready)
        } else {
            let budget = SLICE.max(self.head.least_budget());
            self.head.poll(budget)
        };
        let action = match action {
            Ok(Poll::Pending) => {
                if self.phase == Phase::Begun {
                    self.phase = Phase::Runs;
                }
                return None;
            }
            Err(StepError::Stale) if plays => {
                self.has_passed = true;
                return None;
            }
            Ok(Poll::Ready(action)) => Ok(action),
            Err(error) => Err(error),
        };
        if !plays || action.is_err() {
            let was = mem::replace(&mut self.phase, Phase::Idle);
            if was != Phase::Ready {
                self.longest_step = self.longest_step.max(micros.wrapping_sub(self.begun));
                if was == Phase::Late && action.is_ok() {
                    self.phase = Phase::Ready;
                    return None;
                }
            }
        }
        endpoint.acted(self.of, action, micros, safety, out)
    }
}

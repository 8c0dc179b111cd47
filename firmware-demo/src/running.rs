//! The running image: its head in slices, and the scrub of its bytes.

use core::task::Poll;

#[cfg(feature = "attention")]
use actq_controller::prefix::Transfer;
use actq_controller::scrub::Scrub;
use actq_controller::{Check, Endpoint, Shared};
use actq_kernels::Head;
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
    step: Option<Started>,
    /// Longest step so far, in µs.
    longest_step: u32,
    /// The next prefix, and the lifetime of the head's.
    #[cfg(feature = "attention")]
    pub(crate) transfer: Transfer<'s>,
}

/// A started step.
#[derive(Clone, Copy)]
struct Started {
    /// Sequence number of the observation's frame.
    of: u32,
    micros: u32,
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
            step: None,
            longest_step: 0,
            #[cfg(feature = "attention")]
            transfer,
        }
    }

    /// Gives the head a prefix that has arrived, if no step is being computed. Takes it away after its lifetime, also from
    /// a step; then, and as long as there is none, the controller does not arm, and latches.
    #[cfg(feature = "attention")]
    pub fn refresh<const AXES: usize>(&mut self, safety: &mut impl Shared<AXES>) {
        if self.step.is_none()
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
            self.step = None;
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
    pub fn slice<'b, const AXES: usize, const OBS: usize, const N: usize>(
        &mut self,
        endpoint: &mut Endpoint<'_, OBS, N>,
        micros: u32,
        safety: &mut impl Shared<AXES>,
        out: &'b mut [u8],
    ) -> Option<&'b [u8]> {
        let Some(started) = self.step else {
            let step = endpoint.step(safety)?;
            if step.reset {
                self.head.reset();
            }
            let of = step.of;
            match self.head.begin(step.observation) {
                Ok(()) => self.step = Some(Started { of, micros }),
                Err(error) => return endpoint.acted(of, Err(error), micros, safety, out),
            }
            return None;
        };
        let budget = SLICE.max(self.head.least_budget());
        let action = match self.head.poll(budget) {
            Ok(Poll::Pending) => return None,
            Ok(Poll::Ready(action)) => Ok(action),
            Err(error) => Err(error),
        };
        self.step = None;
        self.longest_step = self.longest_step.max(micros.wrapping_sub(started.micros));
        endpoint.acted(started.of, action, micros, safety, out)
    }
}

//! The image that runs: its head in slices, and its bytes, read again and again.

use core::task::Poll;

use actq_controller::scrub::Scrub;
use actq_controller::{Check, Endpoint, Shared};
use actq_kernels::Head;

/// Modelled instructions of a slice, where an image needs no more: 0.12 ms of a Cortex-M4 at 168 MHz. Bytes that come
/// wait for as long; the tick does not.
pub const SLICE: u32 = 20_000;

/// Bytes that the scrub reads in a turn.
const SCRUBBED: usize = 64;

/// An image that may run.
pub struct Running<'i, 's> {
    head: Head<'i, 's>,
    bytes: &'i [u8],
    scrub: Scrub,
    step: Option<Begun>,
    /// Longest step so far, in µs.
    worst: u32,
}

/// A step that was begun.
#[derive(Clone, Copy)]
struct Begun {
    /// Number of its observation's frame.
    of: u32,
    micros: u32,
}

impl<'i, 's> Running<'i, 's> {
    /// The head of the image in `bytes`.
    pub fn new(head: Head<'i, 's>, bytes: &'i [u8]) -> Self {
        Self { head, bytes, scrub: Scrub::new(bytes), step: None, worst: 0 }
    }

    /// Longest step so far, in µs.
    pub const fn worst(&self) -> u32 {
        self.worst
    }

    /// Reads a piece of the image; one that has changed keeps from arming, and latches.
    pub fn scrub<const AXES: usize>(&mut self, safety: &mut impl Shared<AXES>) {
        if self.scrub.advance(self.bytes, SCRUBBED) == Some(false) {
            safety.with(|safety| safety.check(Check::Image, false));
        }
    }

    /// Begins a step on the newest observation, or runs a slice of the one that was begun; the frame to send, in `out`.
    pub fn slice<'b, const AXES: usize, const OBS: usize, const N: usize>(
        &mut self,
        endpoint: &mut Endpoint<'_, OBS, N>,
        micros: u32,
        safety: &mut impl Shared<AXES>,
        out: &'b mut [u8],
    ) -> Option<&'b [u8]> {
        let Some(begun) = self.step else {
            let step = endpoint.step(safety)?;
            if step.reset {
                self.head.reset();
            }
            let of = step.of;
            match self.head.begin(step.observation) {
                Ok(()) => self.step = Some(Begun { of, micros }),
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
        self.worst = self.worst.max(micros.wrapping_sub(begun.micros));
        endpoint.acted(begun.of, action, micros, safety, out)
    }
}

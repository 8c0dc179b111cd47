//! The loop below the tick: bytes of the serial port, slices of the head, the watchdog.

use core::task::Poll;

use actq_boards::port::Port;
use actq_boards::seams::Watchdog;
use actq_kernels::Head;
use embedded_io::{Read, ReadReady};

use crate::application::{Application, Status};
use crate::output::Output;
use crate::timing::Timing;

/// Modelled instructions of a slice, where an image needs no more: 0.12 ms of a Cortex-M4 at 168 MHz. Bytes that come wait for as
/// long; the tick does not.
pub const SLICE: u32 = 20_000;

/// Bytes that are taken from the port in one turn.
const BYTES: usize = 64;

/// What the loop works with.
pub struct Work<'p, 'i, 's, A, W> {
    /// The application.
    pub application: A,
    /// The serial port.
    pub port: &'p mut Port<'static>,
    /// The watchdog, which runs.
    pub watchdog: &'p mut W,
    /// The head, where there is an image that may run.
    pub head: Option<Head<'i, 's>>,
    /// Measures the bytes of stack that were in use at most.
    pub stack: fn() -> u32,
    step: Step,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Step {
    None,
    Running,
}

impl<'p, 'i, 's, A: Application, W: Watchdog> Work<'p, 'i, 's, A, W> {
    /// With nothing begun.
    pub fn new(
        application: A,
        port: &'p mut Port<'static>,
        watchdog: &'p mut W,
        head: Option<Head<'i, 's>>,
        stack: fn() -> u32,
    ) -> Self {
        Self { application, port, watchdog, head, stack, step: Step::None }
    }

    /// A turn of the loop: takes what has come, runs one slice of the head, and feeds the watchdog where all is well. A new action
    /// is put into `output` by `share`, which holds the tick off meanwhile.
    pub fn turn(&mut self, timing: Timing, share: impl FnOnce(&mut dyn FnMut(&mut Output))) {
        self.port.pump();
        if self.port.read_ready() == Ok(true) {
            let mut bytes = [0; BYTES];
            let Ok(len) = self.port.read(&mut bytes);
            let (lost, ready) = (self.port.lost(), self.head.is_some());
            let status = Status { timing, lost, stack: self.stack, ready };
            self.application.on_bytes(bytes.get(..len).unwrap_or_default(), &status, self.port);
        }
        self.slice(share);
        if self.application.is_well() {
            self.watchdog.feed();
        }
    }

    /// Begins a step, or runs a slice of the one that was begun.
    fn slice(&mut self, share: impl FnOnce(&mut dyn FnMut(&mut Output))) {
        let Some(head) = &mut self.head else { return };
        if self.step == Step::None {
            let Some(observation) = self.application.observation() else { return };
            match head.begin(observation) {
                Ok(()) => self.step = Step::Running,
                Err(error) => self.application.on_action(Err(error), self.port),
            }
            return;
        }
        let budget = SLICE.max(head.least_budget());
        let ended = match head.poll(budget) {
            Ok(Poll::Pending) => return,
            Ok(Poll::Ready(action)) => {
                share(&mut |output| output.set(action));
                Ok(action)
            }
            Err(error) => Err(error),
        };
        self.step = Step::None;
        self.application.on_action(ended, self.port);
    }
}

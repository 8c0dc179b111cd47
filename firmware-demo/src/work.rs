//! The loop below the tick: bytes of the link, slices of the head, pieces of an update, the watchdog.

use actq_boards::port::Port;
use actq_boards::seams::Watchdog;
use actq_controller::progress::Progress;
use actq_controller::slots::{Authority, Candidate};
use actq_controller::{Endpoint, Shared};
use embedded_io::{Read, ReadReady, Write};
use embedded_storage::nor_flash::NorFlash;

#[cfg(feature = "faults")]
use crate::faults::{Asked, Faults};
use crate::running::Running;
use crate::timing::{Rates, Timing};
use crate::updates::Updates;

/// Bytes that are taken from the port in one turn.
const BYTES: usize = 64;
/// Ticks between two looks at times and stack.
const LOOK: u32 = 100;

/// What the loop works with.
pub struct Work<'p, S, W, F, A: Authority, const AXES: usize, const OBS: usize, const N: usize> {
    /// The serial port.
    pub port: &'p mut Port<'static>,
    /// The watchdog, which runs.
    pub watchdog: &'p mut W,
    /// What decides about the outputs.
    pub safety: S,
    /// The link's end.
    pub endpoint: Endpoint<'static, OBS, N>,
    /// Image updates.
    pub updates: Updates<F, A>,
    /// The clock's rates.
    pub rates: Rates,
    /// Measures the bytes of stack that were in use at most.
    pub stack: fn() -> u32,
    /// Room for the longest frame that is sent.
    pub out: &'p mut [u8],
    /// What the loop has done since it fed the watchdog.
    pub state: State,
}

/// What the loop keeps from turn to turn.
#[derive(Debug, Default)]
pub struct State {
    progress: Progress,
    /// Ticks at the last turn.
    ticks: u32,
    /// Ticks at the last look at times and stack.
    looked: Option<u32>,
    #[cfg(feature = "faults")]
    faults: Faults,
    /// Progress that is hidden.
    #[cfg(feature = "faults")]
    hidden: u8,
}

impl State {
    /// What has made no progress since the watchdog was fed ([`Progress::missing`]).
    pub const fn missing(&self) -> u32 {
        self.progress.missing()
    }
}

impl<S, W, F, A, const AXES: usize, const OBS: usize, const N: usize> Work<'_, S, W, F, A, AXES, OBS, N>
where
    S: Shared<AXES>,
    W: Watchdog,
    F: NorFlash,
    A: Authority,
{
    /// A turn of the loop: takes what has come, runs one slice of the head, does a piece of an update, and feeds the watchdog where all
    /// has made progress. Gives the image that an update wants tested.
    pub fn turn(&mut self, running: &mut Option<Running<'_, '_>>, timing: &Timing) -> Option<Candidate> {
        let micros = self.rates.micros(timing.ticks);
        self.look(running, timing);
        self.port.pump();
        if self.port.read_ready() == Ok(true) {
            let mut bytes = [0; BYTES];
            let Ok(len) = self.port.read(&mut bytes);
            bytes.iter().take(len).for_each(|byte| self.take(*byte, micros));
        }
        self.state.progress.link = true;
        if let Some(frame) = self.endpoint.report(micros, &mut self.safety, self.out) {
            let Ok(()) = self.port.write_all(frame);
        }
        if let Some(running) = running {
            running.scrub(&mut self.safety);
            if let Some(frame) = running.slice(&mut self.endpoint, micros, &mut self.safety, self.out) {
                let Ok(()) = self.port.write_all(frame);
            }
        }
        self.state.progress.head = true;
        // A tick that has come to its end has told the outputs.
        self.state.progress.output |= timing.ticks != self.state.ticks;
        self.state.ticks = timing.ticks;
        #[cfg(feature = "faults")]
        self.hide();
        if self.state.progress.feed() {
            self.watchdog.feed();
        }
        self.updates.work()
    }

    fn take(&mut self, byte: u8, micros: u32) {
        #[cfg(feature = "faults")]
        match self.state.faults.push(byte) {
            Some(Asked::Hide(parts)) => self.state.hidden = parts,
            #[cfg(target_os = "none")]
            Some(Asked::Undefined) => cortex_m::asm::udf(),
            #[cfg(target_os = "none")]
            Some(Asked::Recursion) => drop(core::hint::black_box(crate::faults::recurse(0))),
            Some(Asked::Panic) => panic!("asked for"),
            _ => {}
        }
        let answer = self.endpoint.receive(byte, micros, &mut self.safety, &mut self.updates, self.out);
        if let Some(frame) = answer {
            let Ok(()) = self.port.write_all(frame);
        }
    }

    /// Tells the link times and stack anew, every now and then.
    fn look(&mut self, running: &Option<Running<'_, '_>>, timing: &Timing) {
        if self.state.looked.is_some_and(|looked| timing.ticks.wrapping_sub(looked) < LOOK) {
            return;
        }
        self.state.looked = Some(timing.ticks);
        let worst_head = running.as_ref().map_or(0, Running::worst);
        self.endpoint.facts.timing = self.rates.report(timing, worst_head, (self.stack)());
    }

    #[cfg(feature = "faults")]
    fn hide(&mut self) {
        let (progress, hidden) = (&mut self.state.progress, self.state.hidden);
        progress.link &= hidden & 1 == 0;
        progress.head &= hidden & 2 == 0;
        progress.output &= hidden & 4 == 0;
    }
}

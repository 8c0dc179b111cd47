//! The loop below the tick: bytes of the link, slices of the head, pieces of an update, the watchdog.

use actq_boards::port::Port;
use actq_boards::seams::Watchdog;
use actq_controller::progress::Progress;
use actq_controller::slots::{Authority, Candidate};
use actq_controller::{Check, Endpoint, Shared};
use embedded_io::{Read, ReadReady, Write};
use embedded_storage::nor_flash::NorFlash;

#[cfg(feature = "faults")]
use crate::faults::{Asked, Faults};
use crate::patience::PATIENCE;
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
    /// A turn of the loop: takes what has come, runs one slice of the head, does a piece of an update, and feeds the
    /// watchdog where all has made progress. Gives the image that an update wants tested.
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
        let fed = self.state.progress.feed();
        if fed {
            self.watchdog.feed();
        }
        if !self.updates.takes_long() {
            return self.updates.work();
        }
        // The watchdog waits anew for it, which it does only for what has made progress.
        if !fed {
            return None;
        }
        let _ = self.watchdog.start(PATIENCE.long);
        let candidate = self.updates.work();
        let watched = self.watchdog.start(PATIENCE.turn);
        self.safety.with(|safety| safety.check(Check::Watchdog, watched));
        candidate
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

#[cfg(test)]
pub(crate) mod tests {
    extern crate std;

    use std::boxed::Box;
    use std::vec::Vec;

    use actq_boards::port::Buffers;
    use actq_boards::ram::Ram;
    use actq_boards::seams::{Lost, Uart};
    use actq_controller::breadcrumb::Record;
    use actq_controller::endpoint::Facts;
    use actq_controller::slots::Anyone;
    use actq_controller::update::{Plan, Update as _};
    use actq_controller::{Axis, Guard, Safety, Settings};
    use actq_link::code::{Refusal, ResetCause};
    use actq_link::frame::CRC;
    use actq_link::report::BUILT_IN;

    use super::*;

    struct NoUart;

    impl Uart for NoUart {
        fn receive(&mut self) -> Option<Result<u8, Lost>> {
            None
        }

        fn transmit(&mut self, _: u8) -> bool {
            true
        }

        fn ask_for_room(&mut self, _: bool) {}
    }

    /// How often it was fed, and the times that it was given.
    #[derive(Default)]
    pub(crate) struct Fed(u32, Vec<u16>);

    impl Watchdog for Fed {
        fn start(&mut self, milliseconds: u16) -> bool {
            self.1.push(milliseconds);
            true
        }

        fn feed(&mut self) {
            self.0 += 1;
        }
    }

    /// The watchdog is fed, and waits for what takes long, only where all has made progress: not without a control
    /// tick.
    #[test]
    fn without_a_tick_nothing_is_fed_or_erased() {
        let (_, port) = Box::leak(Box::new(Buffers::new())).split(NoUart, || ());
        let (port, mut watchdog) = (Box::leak(Box::new(port)), Fed::default());
        let flash = Ram::<4, 512>::new(Box::leak(Box::new([0; 2048])));
        let (updates, _) = Updates::new(Ram::<4, 512>(flash.0), Some(Anyone), &mut Fed::default(), |_, _| false);
        let breadcrumb = Record::report(ResetCause::Power, None);
        let facts = Facts { image: 0, slot: BUILT_IN, timing: Default::default(), breadcrumb };
        let settings = Settings { status_period: 0, flash_while_armed: false };
        let mut work = Work {
            port,
            watchdog: &mut watchdog,
            safety: Safety::new([Axis::STILL; 1], 1..=10, 0),
            endpoint: Endpoint::<1, 64>::new(Guard::full(&[], 0), facts, settings),
            updates,
            rates: Rates::new(1_000_000, 1000),
            stack: || 0,
            out: &mut [],
            state: State::default(),
        };
        let image = [1; 4];
        let plan = Plan { length: 4, crc: CRC.checksum(&image), version: 0 };
        assert_eq!(work.updates.begin(plan), Err(Refusal::Busy));
        let erased = || flash.0.chunks(512).take_while(|sector| sector[0].get() == 0xff).count();
        let mut timing = Timing::default();
        for ticks in 0..=2 {
            timing.ticks = ticks;
            for _ in 0..3 {
                assert_eq!(work.turn(&mut None, &timing), None);
            }
            assert_eq!((work.watchdog.0, erased()), (ticks, ticks as usize));
        }
        assert_eq!(work.updates.begin(plan), Ok(()), "a slot of two sectors");
        assert_eq!([work.updates.chunk(0, &image), work.updates.commit(None)], [Ok(()), Err(Refusal::Busy)]);
        // The last block, which is the only one, and the test.
        let mut test = None;
        for ticks in 3..=4 {
            assert_eq!(work.turn(&mut None, &timing), None);
            timing.ticks = ticks;
            test = work.turn(&mut None, &timing);
        }
        assert_eq!(test.map(|candidate| candidate.length), Some(4));
        assert_eq!(work.watchdog.1, [PATIENCE.long, PATIENCE.turn].repeat(4));
    }
}

//! The loop below the tick: the link's bytes, slices of the head, update chunks, the watchdog.

use actq_boards::hal::Watchdog;
use actq_boards::port::Port;
use actq_controller::progress::Progress;
use actq_controller::slots::{Authority, Candidate};
use actq_controller::{Check, Endpoint, Shared};
use embedded_io::{Read, ReadReady};
use embedded_storage::nor_flash::NorFlash;

#[cfg(feature = "faults")]
use crate::faults::{Faults, Request};
use crate::running::Running;
use crate::timeouts::TIMEOUTS;
use crate::timing::{Rates, Timing};
#[cfg(feature = "attention")]
use crate::updates::Both;
use crate::updates::Updates;

/// Largest number of bytes taken from the port per turn.
const TURN_BYTES: usize = 64;
/// Ticks between two updates of times and stack.
const TIMING_PERIOD: u32 = 100;

/// The loop and its resources.
pub struct Work<'p, S, W, F, A: Authority, const AXES: usize, const OBS: usize, const N: usize, const LEN: usize> {
    /// The serial port. A frame that does not fit is dropped, because the loop waits for no host. The frame's number is
    /// used, so the host's receiver counts it as lost.
    pub port: &'p mut Port<'static, LEN>,
    /// The running watchdog.
    pub watchdog: &'p mut W,
    /// The state machine that decides the outputs.
    pub safety: S,
    /// The controller's end of the link.
    pub endpoint: Endpoint<'static, OBS, N>,
    /// Image updates.
    pub updates: Updates<F, A>,
    /// The rates of clock and tick.
    pub rates: Rates,
    /// Returns the most bytes of stack in use since the start.
    pub stack: fn() -> u32,
    /// Buffer for the longest frame sent.
    pub out: &'p mut [u8],
    /// The loop's state.
    pub state: State,
}

/// State of the loop between turns.
#[derive(Debug, Default)]
pub struct State {
    progress: Progress,
    /// Ticks at the last turn.
    ticks: u32,
    /// Ticks at the last update of times and stack.
    timed_at: Option<u32>,
    #[cfg(feature = "faults")]
    faults: Faults,
    /// Hidden progress, as bits.
    #[cfg(feature = "faults")]
    hidden_parts: u8,
}

impl State {
    /// Returns the parts without progress since the watchdog was fed ([`Progress::missing`]).
    pub const fn missing(&self) -> u32 {
        self.progress.missing()
    }
}

impl<S, W, F, A, const AXES: usize, const OBS: usize, const N: usize, const LEN: usize>
    Work<'_, S, W, F, A, AXES, OBS, N, LEN>
where
    S: Shared<AXES>,
    W: Watchdog,
    F: NorFlash,
    A: Authority,
{
    /// Runs a turn of the loop: takes received bytes, runs one slice of the head, does a piece of an update, and feeds
    /// the watchdog if all parts have made progress. Returns an image that waits for its test.
    pub fn turn(&mut self, running: &mut Option<Running<'_, '_>>, timing: &Timing) -> Option<Candidate> {
        let micros = self.rates.micros(timing.ticks);
        self.update_timing(running, timing);
        self.port.pump();
        if self.port.read_ready() == Ok(true) {
            let mut bytes = [0; TURN_BYTES];
            let Ok(len) = self.port.read(&mut bytes);
            bytes.iter().take(len).for_each(|byte| self.take(*byte, micros, running));
        }
        self.state.progress.link = true;
        if let Some(frame) = self.endpoint.report(micros, &mut self.safety, self.out) {
            let _ = self.port.send(frame);
        }
        if let Some(running) = running {
            running.scrub(&mut self.safety);
            #[cfg(feature = "attention")]
            running.refresh(&mut self.safety);
            if let Some(frame) = running.slice(&mut self.endpoint, micros, &mut self.safety, self.out) {
                let _ = self.port.send(frame);
            }
        }
        self.state.progress.head = true;
        // A completed tick has written the outputs.
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
        // Long work needs a new timeout, which is set only after progress of all parts.
        if !fed {
            return None;
        }
        let _ = self.watchdog.start(TIMEOUTS.long);
        let candidate = self.updates.work();
        let watched = self.watchdog.start(TIMEOUTS.turn);
        self.safety.with(|safety| safety.check(Check::Watchdog, watched));
        if self.endpoint.stalls() {
            // Nobody knows how long the bytes that wait have waited. The host repeats what it still wants.
            self.drop_input();
            self.safety.with(|safety| safety.stalled());
        }
        candidate
    }

    fn drop_input(&mut self) {
        self.port.pump();
        let mut bytes = [0; TURN_BYTES];
        while self.port.read_ready() == Ok(true) {
            let Ok(_) = self.port.read(&mut bytes);
        }
    }

    #[cfg_attr(not(feature = "attention"), allow(unused_variables, reason = "only a prefix is for the running image"))]
    fn take(&mut self, byte: u8, micros: u32, running: &mut Option<Running<'_, '_>>) {
        #[cfg(feature = "faults")]
        match self.state.faults.push(byte) {
            Some(Request::Hide(parts)) => self.state.hidden_parts = parts,
            #[cfg(target_os = "none")]
            Some(Request::Undefined) => actq_firmware_support::machine::undefined(),
            #[cfg(target_os = "none")]
            Some(Request::Recursion) => drop(core::hint::black_box(crate::faults::recurse(0))),
            Some(Request::Panic) => panic!("asked for"),
            _ => {}
        }
        #[cfg(not(feature = "attention"))]
        let updates = &mut self.updates;
        #[cfg(feature = "attention")]
        let updates = &mut Both { updates: &mut self.updates, running };
        let answer = self.endpoint.receive(byte, micros, &mut self.safety, updates, self.out);
        if let Some(frame) = answer {
            let _ = self.port.send(frame);
        }
    }

    /// Updates the link's times and stack use regularly.
    fn update_timing(&mut self, running: &Option<Running<'_, '_>>, timing: &Timing) {
        if self.state.timed_at.is_some_and(|timed_at| timing.ticks.wrapping_sub(timed_at) < TIMING_PERIOD) {
            return;
        }
        self.state.timed_at = Some(timing.ticks);
        let worst_head = running.as_ref().map_or(0, Running::longest_step);
        self.endpoint.facts.timing = self.rates.report(timing, worst_head, (self.stack)());
    }

    #[cfg(feature = "faults")]
    fn hide(&mut self) {
        let (progress, hidden_parts) = (&mut self.state.progress, self.state.hidden_parts);
        progress.link &= hidden_parts & 1 == 0;
        progress.head &= hidden_parts & 2 == 0;
        progress.output &= hidden_parts & 4 == 0;
    }
}

#[cfg(test)]
pub(crate) mod tests {
    extern crate std;

    use std::boxed::Box;
    use std::cell::RefCell;
    use std::collections::VecDeque;
    use std::rc::Rc;
    use std::vec::Vec;

    use actq_boards::hal::{Uart, UartError};
    use actq_boards::port::Buffers;
    use actq_boards::ram::Ram;
    use actq_controller::breadcrumb::Record;
    use actq_controller::endpoint::Facts;
    use actq_controller::slots::Anyone;
    use actq_controller::update::{Plan, Update as _};
    use actq_controller::{Axis, Guard, Safety, Settings};
    use actq_link::code::{Refusal, Report, ResetCause};
    use actq_link::frame::CRC;
    use actq_link::report::{BUILT_IN, Counters};
    use actq_link::{Message, Receiver, Sender};

    use super::*;

    const LEN: usize = 512;

    type Flash = Ram<'static, 4, 512>;
    type OneAxis<'p> = Work<'p, Safety<1>, WatchdogMock, Flash, Anyone, 1, 1, 64, LEN>;

    /// A line to a host, which reads `room` more bytes.
    #[derive(Default)]
    struct Line {
        sent: VecDeque<u8>,
        read: Vec<u8>,
        room: usize,
    }

    /// The board's end of a line.
    struct End(Rc<RefCell<Line>>);

    impl Uart for End {
        fn receive(&mut self) -> Option<Result<u8, UartError>> {
            self.0.borrow_mut().sent.pop_front().map(Ok)
        }

        fn transmit(&mut self, byte: u8) -> bool {
            let Line { read, room, .. } = &mut *self.0.borrow_mut();
            let has_room = *room > 0;
            if has_room {
                read.push(byte);
                *room -= 1;
            }
            has_room
        }

        fn set_transmit_interrupt(&mut self, _: bool) {}
    }

    /// A mock with the number of feedings and the timeouts set.
    #[derive(Default)]
    pub(crate) struct WatchdogMock(u32, Vec<u16>);

    impl WatchdogMock {
        pub(crate) fn feeds(&self) -> u32 {
            self.0
        }
    }

    impl Watchdog for WatchdogMock {
        fn start(&mut self, milliseconds: u16) -> bool {
            self.1.push(milliseconds);
            true
        }

        fn feed(&mut self) {
            self.0 += 1;
        }
    }

    fn work<'p>(
        port: &'p mut Port<'static, LEN>,
        watchdog: &'p mut WatchdogMock,
        flash: &Flash,
        status_period: u32,
        out: &'p mut [u8],
    ) -> OneAxis<'p> {
        let (updates, _) = Updates::new(Ram(flash.0), Some(Anyone), 0, &mut WatchdogMock::default(), |_, _| false);
        let breadcrumb = Record::report(ResetCause::Power, None);
        let facts = Facts { image: 0, slot: BUILT_IN, timing: Default::default(), breadcrumb };
        let settings = Settings { status_period, flash_while_armed: false, quiet: 1000 };
        let endpoint = Endpoint::new(Guard::full(&[], 0), facts, settings);
        let (safety, rates) = (Safety::new([Axis::STILL; 1], 1..=10, 0), Rates::new(1_000_000, 1000));
        Work { port, watchdog, safety, endpoint, updates, rates, stack: || 0, out, state: State::default() }
    }

    fn flash() -> Flash {
        Ram::new(Box::leak(Box::new([0; 2048])))
    }

    /// Without a control tick the watchdog is not fed, and gets no longer timeout for long work.
    #[test]
    fn without_a_tick_nothing_is_fed_or_erased() {
        let (_, mut port) = Box::leak(Box::new(Buffers::new())).split(End(Rc::default()), || ());
        let (flash, mut watchdog) = (flash(), WatchdogMock::default());
        let mut work = work(&mut port, &mut watchdog, &flash, 0, &mut []);
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
        // The last and only block, and the test.
        let mut test = None;
        for ticks in 3..=4 {
            assert_eq!(work.turn(&mut None, &timing), None);
            timing.ticks = ticks;
            test = work.turn(&mut None, &timing);
        }
        assert_eq!(test.map(|candidate| candidate.length), Some(4));
        assert_eq!(work.watchdog.1, [TIMEOUTS.long, TIMEOUTS.turn].repeat(4));
    }

    /// Ticks continue and the watchdog is fed even if the host does not read: it only loses whole frames, whose numbers
    /// it misses.
    #[test]
    fn a_host_that_stops_reading_loses_only_frames() {
        const TICKS: u32 = 3000;
        // Ticks between two statuses, requests per tick, bytes that the host reads per tick.
        for (status_period, requests, reads) in [(1, 0, 0), (0, 1, 0), (1, 3, 0), (1, 1, 40)] {
            let line = Rc::new(RefCell::new(Line::default()));
            let (mut wire, mut port) = Box::leak(Box::new(Buffers::new())).split(End(line.clone()), || ());
            let (flash, mut watchdog, mut out) = (flash(), WatchdogMock::default(), [0; 64]);
            let mut work = work(&mut port, &mut watchdog, &flash, status_period, &mut out);
            let (mut host, mut timing) = (Sender::new(0), Timing::default());
            let mut tick = |reads| {
                let mut buffer = [0; 64];
                for _ in 0..requests {
                    let request =
                        host.frame(&Message::Ask(Report::Timing), 0, &mut buffer).expect("the buffer is large enough");
                    line.borrow_mut().sent.extend(request);
                }
                line.borrow_mut().room += reads;
                wire.on_interrupt();
                timing.ticks += 1;
                work.safety.tick();
                assert_eq!(work.turn(&mut None, &timing), None);
                wire.on_interrupt();
            };
            (0..TICKS).for_each(|_| tick(reads));
            // The host reads again.
            (0..2).for_each(|_| tick(usize::MAX / 2));
            assert_eq!((work.safety.ticks(), work.watchdog.0), (TICKS + 2, TICKS + 2));
            let mut answers = Receiver::<64>::new();
            line.borrow().read.iter().for_each(|byte| _ = answers.push(*byte));
            let Counters { good, damaged, malformed, repeated, lost } = answers.counters();
            assert_eq!([damaged, malformed, repeated], [0; 3], "whole frames, in order");
            // The first token is reported without a request, even if the controller sends no other reports.
            let token = u32::from(status_period == 0);
            assert_eq!(good + lost, (TICKS + 2) * (status_period + requests) + token);
            assert!(lost > TICKS / 2 && good > 2, "{good} frames arrived, {lost} did not");
        }
    }
}

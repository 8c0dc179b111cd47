//! The loop below the tick: bytes of the link, slices of the head, pieces of an update, the watchdog.

use actq_boards::port::Port;
use actq_boards::seams::Watchdog;
use actq_controller::progress::Progress;
use actq_controller::slots::{Authority, Candidate};
use actq_controller::{Check, Endpoint, Shared};
use embedded_io::{Read, ReadReady};
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
pub struct Work<'p, S, W, F, A: Authority, const AXES: usize, const OBS: usize, const N: usize, const LEN: usize> {
    /// The serial port. A frame that it has no room for is dropped: the loop waits for no host. The frame's number is
    /// used up, so the host's receiver counts it as lost.
    pub port: &'p mut Port<'static, LEN>,
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

impl<S, W, F, A, const AXES: usize, const OBS: usize, const N: usize, const LEN: usize>
    Work<'_, S, W, F, A, AXES, OBS, N, LEN>
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
            let _ = self.port.send(frame);
        }
        if let Some(running) = running {
            running.scrub(&mut self.safety);
            if let Some(frame) = running.slice(&mut self.endpoint, micros, &mut self.safety, self.out) {
                let _ = self.port.send(frame);
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
            let _ = self.port.send(frame);
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
    use std::cell::RefCell;
    use std::collections::VecDeque;
    use std::rc::Rc;
    use std::vec::Vec;

    use actq_boards::port::Buffers;
    use actq_boards::ram::Ram;
    use actq_boards::seams::{Lost, Uart};
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
    type OneAxis<'p> = Work<'p, Safety<1>, Fed, Flash, Anyone, 1, 1, 64, LEN>;

    /// A line to a host, which still reads so many bytes.
    #[derive(Default)]
    struct Line {
        sent: VecDeque<u8>,
        read: Vec<u8>,
        room: usize,
    }

    /// The board's end of a line.
    struct End(Rc<RefCell<Line>>);

    impl Uart for End {
        fn receive(&mut self) -> Option<Result<u8, Lost>> {
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

    fn work<'p>(
        port: &'p mut Port<'static, LEN>,
        watchdog: &'p mut Fed,
        flash: &Flash,
        status_period: u32,
        out: &'p mut [u8],
    ) -> OneAxis<'p> {
        let (updates, _) = Updates::new(Ram(flash.0), Some(Anyone), &mut Fed::default(), |_, _| false);
        let breadcrumb = Record::report(ResetCause::Power, None);
        let facts = Facts { image: 0, slot: BUILT_IN, timing: Default::default(), breadcrumb };
        let settings = Settings { status_period, flash_while_armed: false };
        let endpoint = Endpoint::new(Guard::full(&[], 0), facts, settings);
        let (safety, rates) = (Safety::new([Axis::STILL; 1], 1..=10, 0), Rates::new(1_000_000, 1000));
        Work { port, watchdog, safety, endpoint, updates, rates, stack: || 0, out, state: State::default() }
    }

    fn flash() -> Flash {
        Ram::new(Box::leak(Box::new([0; 2048])))
    }

    /// The watchdog is fed, and waits for what takes long, only where all has made progress: not without a control
    /// tick.
    #[test]
    fn without_a_tick_nothing_is_fed_or_erased() {
        let (_, mut port) = Box::leak(Box::new(Buffers::new())).split(End(Rc::default()), || ());
        let (flash, mut watchdog) = (flash(), Fed::default());
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

    /// Ticks go on and the watchdog is fed, whatever the host does not read: that costs whole frames, whose numbers the
    /// host misses.
    #[test]
    fn a_host_that_does_not_read_costs_only_frames() {
        const TICKS: u32 = 3000;
        // Ticks between two statuses, requests in a tick, bytes that the host reads in a tick.
        for (status_period, requests, reads) in [(1, 0, 0), (0, 1, 0), (1, 3, 0), (1, 1, 40)] {
            let line = Rc::new(RefCell::new(Line::default()));
            let (mut wire, mut port) = Box::leak(Box::new(Buffers::new())).split(End(line.clone()), || ());
            let (flash, mut watchdog, mut out) = (flash(), Fed::default(), [0; 64]);
            let mut work = work(&mut port, &mut watchdog, &flash, status_period, &mut out);
            let (mut host, mut timing) = (Sender::new(0), Timing::default());
            let mut tick = |reads| {
                let mut buffer = [0; 64];
                for _ in 0..requests {
                    let request = host.frame(&Message::Ask(Report::Timing), 0, &mut buffer).expect("there is room");
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
            // It reads again.
            (0..2).for_each(|_| tick(usize::MAX / 2));
            assert_eq!((work.safety.ticks(), work.watchdog.0), (TICKS + 2, TICKS + 2));
            let mut answers = Receiver::<64>::new();
            line.borrow().read.iter().for_each(|byte| _ = answers.push(*byte));
            let Counters { good, damaged, malformed, repeated, lost } = answers.counters();
            assert_eq!([damaged, malformed, repeated], [0; 3], "whole frames, in order");
            // The first token is told unasked, also by a controller that otherwise reports nothing.
            let token = u32::from(status_period == 0);
            assert_eq!(good + lost, (TICKS + 2) * (status_period + requests) + token);
            assert!(lost > TICKS / 2 && good > 2, "{good} frames came, {lost} did not");
        }
    }
}

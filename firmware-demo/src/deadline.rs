//! The tick's rate, and the deadlines that a host may set.

use core::ops::RangeInclusive;

use actq_link::PREFIX_SECONDS;

/// Bits per second of the serial line.
pub const BAUD: u32 = 921_600;

/// Returns the ticks per second, with the feature `tick-8khz` (`is_fast`) or without it.
pub const fn tick_hz(is_fast: bool) -> u32 {
    if is_fast { 8000 } else { 1000 }
}

/// Returns the allowed ticks without an observation, or without an action, before the safe action: 10 ms to half a
/// second at `tick_hz` ticks per second. With less, a host that reads the status before it arms has no recent
/// observation, or the head no action: its first one after arming may wait for the current step.
pub const fn allowed(tick_hz: u32) -> RangeInclusive<u32> {
    tick_hz / 100..=tick_hz / 2
}

/// Returns the most ticks for which a host may let the head use a prefix, at `tick_hz` ticks per second.
pub const fn prefix_lifetime(tick_hz: u32) -> u32 {
    PREFIX_SECONDS * tick_hz
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::collections::VecDeque;
    use std::vec::Vec;

    use actq_controller::breadcrumb::Record;
    use actq_controller::endpoint::Facts;
    use actq_controller::update::NoUpdate;
    use actq_controller::{Axis, Check, Endpoint, Guard, SafeAction, Safety, Settings};
    use actq_link::code::{Parameter, Refusal, Report, ResetCause, State};
    use actq_link::report::BUILT_IN;
    use actq_link::{Floats, Message, Sender, frame};

    use super::*;

    const SECOND: u64 = 1_000_000_000;
    /// Time of a byte of ten bits, in ns.
    const BYTE: u64 = 10 * SECOND / BAUD as u64;
    /// Time of a step of the head, in ns.
    const STEP: u64 = 5_000_000;
    /// Time from a status to the host's next request, in ns: a USB frame.
    const TURN: u64 = 1_000_000;
    /// Observations before arming.
    const BEFORE_ARMING: u32 = 10;

    fn of_axis(tick_hz: u32) -> Safety<1> {
        let axis = Axis::new(-1.0, 1.0, 1.0, 0.0, SafeAction::Coast).expect("the axis is valid");
        let mut safety = Safety::new([axis], 1..=*allowed(tick_hz).end(), 0);
        Check::ALL.into_iter().for_each(|check| safety.check(check, true));
        safety
    }

    /// A host that sends observations in sequence, and requests and awaits the status before it arms.
    struct Host {
        sender: Sender,
        observations: u32,
        queue: VecDeque<u8>,
        waits_until: u64,
    }

    impl Host {
        fn send(&mut self, message: &Message<'_>) {
            let mut buffer = [0; 256];
            let frame = self.sender.frame(message, 0, &mut buffer).expect("the buffer is large enough");
            self.queue.extend([&[0], frame].concat());
        }

        fn send_next(&mut self, now: u64, token: u32) {
            self.observations += 1;
            if self.observations == BEFORE_ARMING {
                self.send(&Message::Ask(Report::Status));
                let bytes = self.queue.len() + frame::wire_bytes(46);
                self.waits_until = now + bytes as u64 * BYTE + TURN;
            } else {
                if self.observations == BEFORE_ARMING + 1 {
                    self.send(&Message::Arm { token });
                }
                self.send(&Message::Observation(Floats::Values(&[0.0; 32])));
            }
        }
    }

    /// Returns `true` if the host arms and the controller is still armed a tenth of a second later.
    fn stays_armed(deadline: u32, tick_hz: u32, phase: u64) -> bool {
        let mut safety = of_axis(tick_hz);
        safety.set(safety.token(), Parameter::Deadline, 0, deadline as f32).expect("any deadline is allowed here");
        let breadcrumb = Record::report(ResetCause::Power, None);
        let facts = Facts { image: 0, slot: BUILT_IN, timing: Default::default(), breadcrumb };
        let settings = Settings { status_period: 0, flash_while_armed: false, quiet: 1000 };
        let mut endpoint = Endpoint::<32, { frame::bytes(128) }>::new(Guard::full(&[], u32::MAX >> 1), facts, settings);
        let mut host = Host { sender: Sender::new(0), observations: 0, queue: VecDeque::new(), waits_until: 0 };
        let (mut ticked, mut step, mut out) = (phase, None, [0; 128]);
        for now in (0..SECOND / 10).step_by(BYTE as usize) {
            while ticked <= now {
                safety.tick();
                ticked += SECOND / u64::from(tick_hz);
            }
            let micros = (now / 1000) as u32;
            if host.queue.is_empty() && now >= host.waits_until {
                host.send_next(now, safety.token());
            }
            if let Some(byte) = host.queue.pop_front() {
                endpoint.receive(byte, micros, &mut safety, &mut NoUpdate, &mut out);
            }
            endpoint.report(micros, &mut safety, &mut out);
            match step {
                None => step = endpoint.step(&mut safety).map(|step| (step.of, now + STEP)),
                Some((of, ready)) if now >= ready => {
                    endpoint.acted(of, Ok::<_, ()>(&[0.0][..]), micros, &mut safety, &mut out);
                    step = None;
                }
                Some(_) => {}
            }
        }
        safety.state() == State::Armed
    }

    /// The shortest deadline suffices for a head that takes 5 ms, at any phase of the ticks. Half of it does not.
    #[test]
    fn the_shortest_deadline_arms_and_shorter_are_refused() {
        for tick_hz in [1000, 8000] {
            let least = *allowed(tick_hz).start();
            let period = SECOND / u64::from(tick_hz);
            let phases: Vec<u64> = (0..period).step_by(period as usize / 16).collect();
            assert!(phases.iter().all(|phase| stays_armed(least, tick_hz, *phase)), "{tick_hz}");
            assert!(phases.iter().any(|phase| !stays_armed(least / 2, tick_hz, *phase)), "{tick_hz}");
            let mut safety = Safety::new([Axis::STILL], allowed(tick_hz), 0);
            let mut set = |ticks: u32| safety.set(safety.token(), Parameter::Deadline, 0, ticks as f32);
            assert_eq!((set(least), set(least - 1)), (Ok(()), Err(Refusal::Range)));
        }
    }
}

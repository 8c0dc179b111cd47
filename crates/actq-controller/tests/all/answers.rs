//! A host that predicts every action of a controller over a line that repeats, loses and delays frames, with resets,
//! disarms and silences.

use std::collections::{HashMap, HashSet};

use actq_controller::breadcrumb::Record;
use actq_controller::endpoint::Facts;
use actq_controller::update::NoUpdate;
use actq_controller::{Axis, Check, Endpoint, Guard, SafeAction, Safety, Settings};
use actq_link::code::{ResetCause, State};
use actq_link::report::{BUILT_IN, Timing};
use actq_link::{Floats, Message, Receiver, Sender, frame};
use actq_testkit::{Line, Random};

/// [`Settings::quiet`].
const QUIET: u32 = 1000;
const FRAMES: usize = 1_000_000;
const FRAME: usize = frame::bytes(64);
const DEADLINE: u32 = 20;
/// Faults in a thousand frames from the host.
const FAULTS: usize = 300;

/// A head whose every action depends on all observations since its reset.
#[derive(Default)]
struct Head(u32);

impl Head {
    fn step(&mut self, observation: f32) -> f32 {
        self.0 = (self.0.rotate_left(5) ^ observation.to_bits()).wrapping_mul(0x9e37_79b1);
        (self.0 >> 8) as f32 / (1 << 24) as f32
    }
}

/// The firmware, with one turn of its loop in a tick.
struct Controller {
    safety: Safety<1>,
    endpoint: Endpoint<'static, 1, FRAME>,
    head: Head,
    /// The current step: its number, its action, and the turns until that is ready.
    step: Option<(u32, f32, usize)>,
}

impl Controller {
    fn new(seed: u32) -> Self {
        let axis = Axis::new(0.0, 1.0, 1.0, 0.0, SafeAction::Hold).expect("the axis is valid");
        let mut safety = Safety::new([axis], 1..=DEADLINE, seed);
        Check::ALL.into_iter().for_each(|check| safety.check(check, true));
        let breadcrumb = Record::report(ResetCause::Power, None);
        let facts = Facts { image: 0, slot: BUILT_IN, timing: Timing::default(), breadcrumb };
        let settings = Settings { status_period: 100, flash_while_armed: false, quiet: QUIET };
        let endpoint = Endpoint::new(Guard::full(&[], 50_000), facts, settings);
        Self { safety, endpoint, head: Head::default(), step: None }
    }

    /// Takes bytes and returns the bytes that it sends. A step that begins takes `turns` turns.
    fn turn(&mut self, bytes: &[u8], micros: u32, turns: usize) -> Vec<u8> {
        let Self { safety, endpoint, head, step } = self;
        let (mut out, mut sent) = ([0; 128], Vec::new());
        for byte in bytes {
            sent.extend(endpoint.receive(*byte, micros, safety, &mut NoUpdate, &mut out).unwrap_or_default());
        }
        sent.extend(endpoint.report(micros, safety, &mut out).unwrap_or_default());
        match step {
            None => {
                if let Some(new) = endpoint.step(safety) {
                    if new.reset {
                        *head = Head::default();
                    }
                    *step = Some((new.of, head.step(new.observation[0]), turns));
                }
            }
            Some((of, action, 0)) => {
                let action = Ok::<_, ()>(&[*action][..]);
                sent.extend(endpoint.acted(*of, action, micros, safety, &mut out).unwrap_or_default());
                *step = None;
            }
            Some((.., turns)) => *turns -= 1,
        }
        safety.tick();
        sent
    }
}

/// A host with an executor of its own. It has lost nothing of what the controller sent.
struct Host {
    sender: Sender,
    receiver: Receiver<FRAME>,
    token: Option<u32>,
    state: State,
    head: Head,
    /// Observations by their frame's number.
    observed: HashMap<u32, f32>,
    /// Numbers of arm and disarm requests.
    asked: HashSet<u32>,
    /// `true` if one of these requests was done since the last status.
    was_done: bool,
    done: u32,
    /// Numbers that were answered since the controller last reset the sequence numbers.
    answered: HashSet<u32>,
    applied: HashSet<u32>,
    tally: Tally,
}

#[derive(Debug, Default)]
struct Tally {
    actions: u32,
    armed: u32,
    latched: u32,
    relearned: u32,
    restarted: u32,
}

impl Host {
    fn hear(&mut self, bytes: &[u8]) {
        for byte in bytes {
            let Some(received) = self.receiver.push(*byte) else { continue };
            match received.message {
                Message::Status(status) if self.token != Some(status.token) => {
                    self.head = Head::default();
                    let tally = &mut self.tally;
                    tally.armed += u32::from(status.state == State::Armed);
                    tally.latched += u32::from((self.state, status.state) == (State::Armed, State::Latched));
                    if self.token.is_none() || self.state == status.state && !self.was_done {
                        self.answered.clear();
                        *if self.token.is_some() { &mut tally.relearned } else { &mut tally.restarted } += 1;
                    }
                    (self.token, self.state, self.was_done) = (Some(status.token), status.state, false);
                }
                Message::Ack { of, refusal: None, .. } if self.asked.contains(&of) => {
                    (self.was_done, self.done) = (true, of);
                }
                Message::Action { of, applied, values } => {
                    let expected = self.head.step(self.observed[&of]);
                    let actual: Vec<f32> = values.iter().collect();
                    assert_eq!(actual, [expected], "frame {of} after {:?}", self.tally);
                    assert!(self.answered.insert(of), "frame {of} is answered again after {:?}", self.tally);
                    assert!(!applied || self.applied.insert(of), "frame {of} is applied again");
                    let is_newer = of.wrapping_sub(self.done) < 1 << 31;
                    assert!(!applied || is_newer, "frame {of} from before frame {} is applied", self.done);
                    self.tally.actions += 1;
                }
                _ => {}
            }
        }
    }
}

/// Controller, line and host.
struct World {
    random: Random,
    controller: Controller,
    line: Line,
    host: Host,
    /// The controller's time. The host's clock runs 1 % slow, with an offset.
    micros: u64,
    offset: u32,
    /// Remaining ticks in which the host sends nothing.
    silent: u32,
    /// Extra turns of a step.
    slow: usize,
}

impl World {
    fn new() -> Self {
        let host = Host {
            sender: Sender::new(u32::MAX - 10_000),
            receiver: Receiver::new(),
            token: None,
            state: State::Disarmed,
            head: Head::default(),
            observed: HashMap::new(),
            asked: HashSet::new(),
            was_done: false,
            done: 0,
            answered: HashSet::new(),
            applied: HashSet::new(),
            tally: Tally::default(),
        };
        let (random, controller, line) = (Random::new(27), Controller::new(0), Line::new(28, FAULTS));
        Self { random, controller, line, host, micros: u64::from(u32::MAX) - 60_000_000, offset: 0, silent: 0, slow: 0 }
    }

    fn send(&mut self, message: &Message<'_>, out: &mut Vec<u8>) -> u32 {
        let (number, mut buffer) = (self.host.sender.next(), [0; 64]);
        let micros = self.offset.wrapping_add((self.micros * 99 / 100) as u32);
        let frame = self.host.sender.frame(message, micros, &mut buffer).expect("there is room");
        out.extend(self.line.carry(&[&[0], frame].concat()));
        number
    }

    /// Sends an observation, and sometimes a request.
    fn speak(&mut self, out: &mut Vec<u8>) {
        let observation = self.host.observed.len() as f32;
        let number = self.send(&Message::Observation(Floats::Values(&[observation])), out);
        assert_eq!(self.host.observed.insert(number, observation), None, "numbers of two hosts overlap");
        let request = match (self.random.below(1000), self.host.token) {
            (0, _) => Message::Disarm,
            (1..100, Some(token)) if self.host.state != State::Armed => Message::Arm { token },
            _ => return,
        };
        let number = self.send(&request, out);
        self.host.asked.insert(number);
    }

    /// Sometimes silences the host, or restarts host or controller.
    fn disturb(&mut self) {
        self.slow = 0;
        match self.random.below(10_000) {
            0..5 => self.silent = DEADLINE + 5,
            5 => {
                self.silent = QUIET + DEADLINE + 5;
                // Sometimes with a step that takes longer than the silence.
                self.slow = self.random.below(2) * 2 * QUIET as usize;
            }
            6 => {
                self.controller = Controller::new(self.random.bits() as u32);
                self.host.receiver.reopen();
                (self.host.token, self.host.state) = (None, State::Disarmed);
            }
            7 => {
                self.silent = QUIET + DEADLINE + 5;
                // Another host, whose line remembers nothing of the one before.
                (self.host.sender, self.line) =
                    (Sender::new(self.random.bits() as u32), Line::new(self.random.bits(), FAULTS));
                self.offset = self.random.bits() as u32;
            }
            _ => {}
        }
    }

    fn tick(&mut self) {
        self.micros += 1000;
        let mut arriving = Vec::new();
        if self.silent == 0 {
            self.speak(&mut arriving);
            self.disturb();
        } else {
            self.silent -= 1;
            if self.random.below(50) == 0 {
                arriving.extend(self.line.replayed());
            }
        }
        let turns = self.slow + self.random.below(3);
        let sent = self.controller.turn(&arriving, self.micros as u32, turns);
        self.host.hear(&sent);
    }
}

/// A million frames: each is answered at most once until the controller resets the sequence numbers. It is applied at
/// most once, and only if it was sent after the arm request. Each action, applied or not, equals that of the host's own
/// head, which is reset with every new token.
#[test]
fn the_host_predicts_every_action_once() {
    let mut world = World::new();
    while world.host.observed.len() < FRAMES {
        world.tick();
    }
    let Host { applied, tally, .. } = &world.host;
    assert!(applied.len() > 100_000 && tally.actions > 200_000, "{} applied, {tally:?}", applied.len());
    assert!(tally.armed > 500 && tally.latched > 300 && tally.relearned > 50 && tally.restarted > 50, "{tally:?}");
}

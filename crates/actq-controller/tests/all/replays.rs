//! Recorded frames that come again: after a pause, a restarted host and a new arm, none moves an output.

use std::collections::HashSet;

use actq_controller::breadcrumb::Record;
use actq_controller::endpoint::Facts;
use actq_controller::update::NoUpdate;
use actq_controller::{Axis, Check, Endpoint, Guard, SafeAction, Safety, Settings};
use actq_link::code::{ResetCause, State};
use actq_link::report::{BUILT_IN, Timing};
use actq_link::{Floats, Message, Sender, frame};
use actq_testkit::Random;

const TICK: u32 = 1000;
const QUIET: u32 = 1000;
const MAX_AGE: u32 = 20_000;

/// A frame as a recorder has it.
#[derive(Clone)]
struct Recorded {
    wire: Vec<u8>,
    /// Position of the frame among all that any host has sent; an observation holds it as its value.
    id: usize,
}

/// A controller, the present host, and a recorder of all that hosts have sent. The oracle is [`World::run_head`].
struct World {
    safety: Safety<1>,
    endpoint: Endpoint<'static, 1, { frame::bytes(64) }>,
    micros: u32,
    host: Sender,
    /// The host's time minus [`Self::micros`].
    offset: u32,
    sent: Vec<Recorded>,
    /// Frames on the way, which came out of order or late.
    held: Vec<Recorded>,
    applied: HashSet<usize>,
    /// The frame of the arm request that counts.
    armed_by: usize,
    replayed_while_armed: usize,
}

impl World {
    fn new() -> Self {
        let axis = Axis::new(-1e9, 1e9, 1e9, 0.0, SafeAction::Hold).expect("the axis is valid");
        let mut safety = Safety::new([axis], 3..=50, 77);
        Check::ALL.into_iter().for_each(|check| safety.check(check, true));
        let breadcrumb = Record::report(ResetCause::Power, None);
        let facts = Facts { image: 1, slot: BUILT_IN, timing: Timing::default(), breadcrumb };
        let settings = Settings { status_period: 0, flash_while_armed: false, quiet: QUIET };
        Self {
            safety,
            endpoint: Endpoint::new(Guard::full(&[], MAX_AGE), facts, settings),
            micros: 0,
            host: Sender::new(1 << 20),
            offset: 0,
            sent: Vec::new(),
            held: Vec::new(),
            applied: HashSet::new(),
            armed_by: 0,
            replayed_while_armed: 0,
        }
    }

    /// Sends a frame; the recorder keeps it.
    fn send(&mut self, message: impl Fn(usize) -> Message<'static>) -> Recorded {
        let (id, mut buffer) = (self.sent.len(), [0; 128]);
        let time = self.micros.wrapping_add(self.offset);
        let wire = self.host.frame(&message(id), time, &mut buffer).expect("a frame").to_vec();
        self.sent.push(Recorded { wire, id });
        self.sent[id].clone()
    }

    fn observation(&mut self) -> Recorded {
        self.send(|id| Message::Observation(Floats::Values(Box::leak(Box::new([id as f32])))))
    }

    fn deliver(&mut self, frame: &Recorded) {
        let mut out = [0; 128];
        for byte in &frame.wire {
            self.endpoint.receive(*byte, self.micros, &mut self.safety, &mut NoUpdate, &mut out);
        }
        self.run_head();
    }

    /// Runs a head that repeats the observation, and requires that an applied one is new and was sent after the arm
    /// request.
    fn run_head(&mut self) {
        let mut out = [0; 128];
        self.endpoint.report(self.micros, &mut self.safety, &mut out);
        let Some(step) = self.endpoint.step(&mut self.safety) else { return };
        let (of, action) = (step.of, step.observation[0]);
        let is_armed = self.safety.state() == State::Armed;
        self.endpoint.acted(of, Ok::<_, ()>(&[action]), self.micros, &mut self.safety, &mut out);
        if is_armed {
            let id = action as usize;
            assert!(self.applied.insert(id), "frame {id} is applied again");
            assert!(id > self.armed_by, "frame {id} was sent before the arm request {}", self.armed_by);
        }
    }

    fn ticks(&mut self, ticks: u32) {
        for _ in 0..ticks {
            self.micros = self.micros.wrapping_add(TICK);
            self.safety.tick();
            self.run_head();
        }
    }

    /// Sends and delivers an observation, then a request to arm.
    fn arm(&mut self) {
        let observation = self.observation();
        self.deliver(&observation);
        let token = self.safety.token();
        let request = self.send(|_| Message::Arm { token });
        let before = self.safety.state();
        // The oracle must know it before the first action.
        let armed_by = std::mem::replace(&mut self.armed_by, request.id);
        self.deliver(&request);
        if before == State::Armed || self.safety.state() != State::Armed {
            self.armed_by = armed_by;
        }
    }

    fn disarm(&mut self) {
        let request = self.send(|_| Message::Disarm);
        self.deliver(&request);
    }

    /// Delivers a run of recorded frames again.
    fn replay(&mut self, random: &mut Random) {
        let (all, from) = (self.sent.len(), random.below(self.sent.len().max(1)));
        for id in from..all.min(from + 1 + random.below(30)) {
            self.replayed_while_armed += usize::from(self.safety.state() == State::Armed);
            let frame = self.sent[id].clone();
            self.deliver(&frame);
        }
    }

    /// Restarts the host: it counts from any number, also one just below those of before, and may have another clock.
    fn restart(&mut self, random: &mut Random) {
        let last = self.host.next();
        let first = match random.below(4) {
            0 => random.bits() as u32,
            1 => last.wrapping_sub(random.below(2000) as u32),
            2 => last.wrapping_add(random.below(1 << 20) as u32),
            _ => 0,
        };
        self.host = Sender::new(first);
        // A host whose numbers may be those of an earlier run has a clock that does not begin anew.
        if random.below(2) == 0 {
            self.offset = random.bits() as u32;
        }
    }
}

#[test]
fn no_recorded_frame_is_applied() {
    let mut random = Random::new(1);
    let (mut applied, mut replayed) = (0, 0);
    for _ in 0..300 {
        let mut world = World::new();
        for _ in 0..120 {
            match random.below(16) {
                0 => world.ticks(QUIET + 100),
                1 => world.restart(&mut random),
                2 => {
                    world.ticks(QUIET + 100);
                    world.restart(&mut random);
                    if random.below(2) == 0 {
                        world.replay(&mut random);
                    }
                    world.arm();
                    world.replay(&mut random);
                }
                3 | 4 => world.arm(),
                5 => world.disarm(),
                6 | 7 => world.replay(&mut random),
                8 => {
                    let frame = world.observation();
                    world.held.push(frame);
                }
                9 => {
                    for frame in std::mem::take(&mut world.held).iter().rev() {
                        world.deliver(frame);
                    }
                }
                _ => {
                    for _ in 0..1 + random.below(20) {
                        let frame = world.observation();
                        if random.below(8) != 0 {
                            world.deliver(&frame);
                        }
                        world.ticks(1 + random.below(3) as u32);
                    }
                }
            }
        }
        applied += world.applied.len();
        replayed += world.replayed_while_armed;
    }
    assert!(applied > 20_000 && replayed > 5_000, "{applied} applied, {replayed} replayed while armed");
}

/// A frame of an earlier run far ahead of the present numbers, and a disarm that is as far ahead.
#[test]
fn far_numbers_only_disarm() {
    let mut world = World::new();
    let far = world.observation();
    let stop = world.send(|_| Message::Disarm);
    world.ticks(QUIET + 100);
    world.host = Sender::new((1 << 20) - 5000);
    world.arm();
    assert_eq!(world.safety.state(), State::Armed);
    world.deliver(&far);
    let own = world.observation();
    world.deliver(&own);
    assert_eq!(world.applied, HashSet::from([own.id]), "the host's own number still follows");
    world.deliver(&stop);
    assert_eq!(world.safety.state(), State::Disarmed);
}

/// A request to arm that was held up is refused, as an observation is.
#[test]
fn old_arm_requests_are_refused() {
    let mut world = World::new();
    let observation = world.observation();
    world.deliver(&observation);
    let token = world.safety.token();
    let request = world.send(|_| Message::Arm { token });
    world.ticks(40);
    world.deliver(&request);
    assert_eq!(world.safety.state(), State::Disarmed);
}

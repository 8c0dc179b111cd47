//! Messages to the controller, its answers and its outputs.

use actq_boards::stm32f405::flash::model::Model;
use actq_boards::stm32f405::flash::{Flash, LARGE};
use actq_controller::breadcrumb::Record;
use actq_controller::endpoint::Facts;
use actq_controller::slots::{Anyone, Layout, Slots, Updater, Work};
use actq_controller::update::{NoUpdate, Update};
use actq_controller::{Axis, Check, Endpoint, Guard, Output, SafeAction, Safety, Settings};
use actq_link::code::{Fault, Parameter, Refusal, Report, ResetCause, State};
use actq_link::frame::CRC;
use actq_link::report::{BUILT_IN, Status, Timing};
use actq_link::{Floats, Message, Receiver, Sender, frame};
use proptest::prelude::*;

/// [`Settings::quiet`].
const QUIET: u32 = 1000;
const FRAME: usize = frame::bytes(128);
const OBSERVATION: [f32; 3] = [0.5, -0.5, 0.0];
const DEADLINE: u32 = 10;
const MIN_DEADLINE: u32 = 3;

/// A controller and a host without a line between them.
struct Bench<U = NoUpdate> {
    update: U,
    safety: Safety<2>,
    endpoint: Endpoint<'static, 8, FRAME>,
    host: Sender,
    answers: Receiver<FRAME>,
    micros: u32,
}

impl Bench {
    fn new() -> Self {
        Self::of(Settings { status_period: 0, flash_while_armed: false, quiet: QUIET }, NoUpdate)
    }
}

impl<U: Update> Bench<U> {
    fn of(settings: Settings, update: U) -> Self {
        let axis = Axis::new(-1.0, 1.0, 0.1, 0.0, SafeAction::Hold).expect("the axis is valid");
        let mut safety = Safety::new([axis; 2], MIN_DEADLINE..=DEADLINE, 77);
        Check::ALL.into_iter().for_each(|check| safety.check(check, true));
        let breadcrumb = Record::report(ResetCause::Watchdog, None);
        let facts = Facts { image: 0xabcd, slot: BUILT_IN, timing: Timing::default(), breadcrumb };
        let guard = Guard::new(3, &[], 50_000).expect("there is enough memory");
        let endpoint = Endpoint::new(guard, facts, settings);
        Self { update, safety, endpoint, host: Sender::new(9), answers: Receiver::new(), micros: 0 }
    }

    fn bytes(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut out = [0; 256];
        let mut answers = Vec::new();
        for byte in bytes {
            let sent = self.endpoint.receive(*byte, self.micros, &mut self.safety, &mut self.update, &mut out);
            answers.extend(sent.unwrap_or_default());
        }
        answers
    }

    fn parse<T>(&mut self, bytes: &[u8], then: impl FnOnce(Message<'_>) -> T) -> Option<T> {
        let last = bytes.len().checked_sub(1)?;
        bytes[..last].iter().for_each(|byte| assert_eq!(self.answers.push(*byte), None));
        self.answers.push(bytes[last]).map(|received| then(received.message))
    }

    fn send<T>(&mut self, message: &Message<'_>, then: impl FnOnce(Message<'_>) -> T) -> Option<T> {
        let wire = self.frame(message);
        let answer = self.bytes(&wire);
        self.parse(&answer, then)
    }

    fn frame(&mut self, message: &Message<'_>) -> Vec<u8> {
        let mut buffer = [0; 256];
        self.host.frame(message, self.micros, &mut buffer).expect("there is enough memory").to_vec()
    }

    /// Sends a request and returns its outcome.
    fn ask(&mut self, message: &Message<'_>) -> Result<(), Refusal> {
        let number = self.host.next();
        let acknowledged = self.send(message, |answer| match answer {
            Message::Ack { of, refusal, .. } => (of, refusal),
            other => panic!("{other:?}"),
        });
        let (of, refusal) = acknowledged.expect("the controller answers");
        assert_eq!(of, number);
        refusal.map_or(Ok(()), Err)
    }

    fn status(&mut self) -> Status {
        let status = self.send(&Message::Ask(Report::Status), |answer| match answer {
            Message::Status(status) => status,
            other => panic!("{other:?}"),
        });
        status.expect("the controller answers")
    }

    fn observe(&mut self) {
        assert_eq!(self.send(&Message::Observation(Floats::Values(&OBSERVATION)), |_| ()), None);
    }

    fn arm(&mut self) {
        self.observe();
        let token = self.status().token;
        assert_eq!(self.ask(&Message::Arm { token }), Ok(()));
    }

    /// Reports, then returns the next step: number, reset and values.
    fn step(&mut self) -> Option<(u32, bool, Vec<f32>)> {
        let mut out = [0; 256];
        self.endpoint.report(self.micros, &mut self.safety, &mut out);
        let step = self.endpoint.step(&mut self.safety)?;
        Some((step.of, step.reset, step.observation.to_vec()))
    }

    fn act(&mut self, of: u32, action: &[f32]) -> Option<(u32, bool, Vec<f32>)> {
        let mut out = [0; 256];
        let action = Ok::<_, ()>(action);
        let sent = self.endpoint.acted(of, action, self.micros, &mut self.safety, &mut out)?.to_vec();
        self.parse(&sent, |answer| match answer {
            Message::Action { of, applied, values } => Some((of, applied, values.iter().collect())),
            _ => None,
        })?
    }
}

#[test]
fn an_observation_becomes_an_action_and_an_output() {
    let mut bench = Bench::new();
    bench.arm();
    assert_eq!(bench.step(), None, "the observation from before arming");
    for reset in [true, false] {
        let of = bench.host.next();
        bench.observe();
        assert_eq!(bench.step(), Some((of, reset, OBSERVATION.to_vec())));
        assert_eq!(bench.step(), None, "it is returned once");
        assert_eq!(bench.act(of, &[0.25, -7.0]), Some((of, true, vec![0.25, -1.0])));
    }
    assert_eq!(bench.safety.tick(), [Output::Drive(0.1), Output::Drive(-0.1)]);
}

#[test]
fn actions_of_steps_before_arming_are_dropped() {
    let mut bench = Bench::new();
    bench.observe();
    let (of, ..) = bench.step().expect("an observation is waiting");
    assert_eq!(bench.act(of, &[0.25, 0.5]), Some((of, false, vec![0.25, 0.5])), "disarmed");
    bench.observe();
    let (of, ..) = bench.step().expect("an observation is waiting");
    bench.arm();
    assert_eq!(bench.act(of, &[0.25, 0.5]), None);
    assert_eq!(bench.safety.tick(), [Output::Coast; 2]);
}

#[test]
fn non_finite_actions_and_failed_heads_latch() {
    let mut bench = Bench::new();
    bench.arm();
    bench.observe();
    bench.step();
    assert_eq!(bench.act(1, &[f32::NAN, 0.0]), None, "a status is sent instead");
    assert_eq!((bench.status().state, bench.status().fault), (State::Latched, Some(Fault::ActionNotFinite)));
    bench.arm();
    let mut out = [0; 256];
    let sent = bench.endpoint.acted(1, Err(()), 0, &mut bench.safety, &mut out).expect("a status").to_vec();
    let fault = bench.parse(&sent, |answer| if let Message::Status(status) = answer { status.fault } else { None });
    assert_eq!(fault, Some(Some(Fault::Head)));
}

/// A disarm has no token, so a host that has read nothing ends the safe actions with it. `docs/SAFETY.md` says so.
#[test]
fn anyone_may_disarm_and_then_outputs_coast() {
    let mut bench = Bench::new();
    let axis = |safe| Axis::new(-1.0, 1.0, 0.1, 0.0, safe).expect("the axis is valid");
    bench.safety = Safety::new([SafeAction::Hold, SafeAction::Brake].map(axis), MIN_DEADLINE..=DEADLINE, 77);
    Check::ALL.into_iter().for_each(|check| bench.safety.check(check, true));
    for fault in Fault::ALL {
        bench.arm();
        bench.safety.act(&[0.1, 0.1]).expect("the action is valid");
        bench.safety.tick();
        bench.safety.trip(*fault);
        assert_eq!(bench.safety.tick(), [Output::Drive(0.1), Output::Brake]);
        assert_eq!((bench.ask(&Message::Disarm), bench.safety.state()), (Ok(()), State::Disarmed), "{fault:?}");
        assert_eq!(bench.safety.tick(), [Output::Coast; 2]);
    }
}

#[test]
fn parameters_only_become_stricter_while_disarmed() {
    let mut bench = Bench::new();
    let get = |bench: &mut Bench, parameter, axis| {
        bench.send(&Message::Get { parameter, axis }, |answer| match answer {
            Message::Value { value, .. } => Ok(value),
            Message::Ack { refusal, .. } => Err(refusal),
            other => panic!("{other:?}"),
        })
    };
    let built = [(Parameter::Deadline, 10.0), (Parameter::MaxAge, 50_000.0), (Parameter::StatusPeriod, 0.0)];
    let axis = [(Parameter::Low, -1.0), (Parameter::High, 1.0), (Parameter::Rate, 0.1), (Parameter::Start, 0.0)];
    for (parameter, value) in built.into_iter().chain(axis) {
        assert_eq!(get(&mut bench, parameter, 1), Some(Ok(value)), "{parameter}");
    }
    assert_eq!(get(&mut bench, Parameter::Low, 2), Some(Err(Some(Refusal::Parameter))));
    let token = bench.status().token;
    let set = |parameter, axis, value| Message::Set { token, parameter, axis, value };
    let cases = [
        (set(Parameter::Deadline, 0, 3.0), Ok(())),
        (set(Parameter::Deadline, 0, 9.0), Ok(())),
        (set(Parameter::Deadline, 0, 2.0), Err(Refusal::Range)),
        (set(Parameter::Deadline, 0, 11.0), Err(Refusal::Range)),
        (set(Parameter::Deadline, 0, 5.5), Err(Refusal::Range)),
        (set(Parameter::Deadline, 0, f32::NAN), Err(Refusal::Range)),
        (set(Parameter::MaxAge, 0, 20_000.0), Ok(())),
        (set(Parameter::MaxAge, 0, 50_001.0), Err(Refusal::Range)),
        (set(Parameter::StatusPeriod, 0, 100.0), Ok(())),
        (set(Parameter::StatusPeriod, 0, -1.0), Err(Refusal::Range)),
        (set(Parameter::Low, 1, -0.5), Ok(())),
        (set(Parameter::Low, 1, -1.5), Err(Refusal::Range)),
        (set(Parameter::Low, 1, f32::NEG_INFINITY), Err(Refusal::Range)),
        (set(Parameter::High, 1, 0.5), Ok(())),
        (set(Parameter::High, 1, 1.5), Err(Refusal::Range)),
        (set(Parameter::High, 1, -0.75), Err(Refusal::Range)),
        (set(Parameter::Rate, 1, 0.05), Ok(())),
        (set(Parameter::Rate, 1, 0.2), Err(Refusal::Range)),
        (set(Parameter::Rate, 1, 0.0), Err(Refusal::Range)),
        (set(Parameter::Start, 1, 0.25), Ok(())),
        (set(Parameter::Start, 1, 0.75), Err(Refusal::Range)),
        (set(Parameter::Low, 2, 0.0), Err(Refusal::Parameter)),
        (set(Parameter::Low, 255, 0.0), Err(Refusal::Parameter)),
    ];
    for (message, outcome) in cases {
        assert_eq!(bench.ask(&message), outcome, "{message:?}");
    }
    assert_eq!(get(&mut bench, Parameter::Low, 1), Some(Ok(-0.5)));
    assert_eq!(get(&mut bench, Parameter::Start, 1), Some(Ok(0.25)));
    assert_eq!(get(&mut bench, Parameter::Deadline, 0), Some(Ok(9.0)));
    bench.arm();
    let changed = Message::Set { token: bench.status().token, parameter: Parameter::Low, axis: 0, value: -0.1 };
    assert_eq!(bench.ask(&changed), Err(Refusal::Armed));
    assert_eq!(bench.ask(&set(Parameter::Low, 0, -0.1)), Err(Refusal::Token), "an old token");
}

#[test]
fn old_requests_and_unsupported_updates_are_refused() {
    let mut bench = Bench::new();
    bench.observe();
    let token = bench.status().token;
    assert_eq!(bench.ask(&Message::Arm { token: token ^ 1 }), Err(Refusal::Token));
    assert_eq!(bench.ask(&Message::Disarm), Ok(()));
    assert_eq!(bench.ask(&Message::Arm { token }), Err(Refusal::Token), "it was disarmed meanwhile");
    let token = bench.status().token;
    let begin = Message::Begin { token, length: 4, crc: 0, version: 0 };
    assert_eq!(bench.ask(&begin), Err(Refusal::Unsupported));
    assert_eq!(bench.ask(&Message::Chunk { offset: 0, bytes: &[0; 4] }), Err(Refusal::Unsupported));
    assert_eq!(bench.ask(&Message::Commit { signature: None }), Err(Refusal::Unsupported));
    assert_eq!(bench.ask(&Message::Abort), Ok(()));
    bench.arm();
    let begin = Message::Begin { token: bench.status().token, length: 4, crc: 0, version: 0 };
    assert_eq!(bench.ask(&begin), Err(Refusal::Armed));
    assert_eq!(bench.ask(&Message::Commit { signature: None }), Err(Refusal::Armed));
}

/// In every state, with the token of the present one, and not if it was held up.
#[cfg(feature = "prefix")]
#[test]
fn a_prefix_arrives_in_every_state() {
    let bytes: [u8; 8] = std::array::from_fn(|i| i as u8);
    let memory = Box::leak(Box::new([0; 8]));
    let transfer = Some(actq_controller::prefix::Transfer::new(memory, 0xabcd, 100));
    let settings = Settings { status_period: 0, flash_while_armed: false, quiet: QUIET };
    let mut bench = Bench::of(settings, crate::receives::Receives { transfer });
    let begin =
        |token| Message::BeginPrefix { token, image: 0xabcd, length: 8, crc: CRC.checksum(&bytes), lifetime: 10 };
    for state in [State::Disarmed, State::Armed, State::Latched] {
        match state {
            State::Disarmed => bench.observe(),
            State::Armed => bench.arm(),
            State::Latched => bench.safety.trip(Fault::Head),
        }
        assert_eq!(bench.safety.state(), state);
        let token = bench.status().token;
        assert_eq!(bench.ask(&begin(token ^ 1)), Err(Refusal::Token));
        let wire = bench.frame(&begin(token));
        bench.micros += 100_000;
        let answer = bench.bytes(&wire);
        let late = bench.parse(&answer, |answer| matches!(answer, Message::Ack { refusal: Some(Refusal::Stale), .. }));
        assert_eq!(late, Some(true), "{state:?}");
        assert_eq!(bench.ask(&begin(token)), Ok(()), "{state:?}");
        assert_eq!(bench.ask(&Message::PrefixChunk { offset: 5, bytes: &bytes[5..] }), Err(Refusal::Offset));
        let written = bench.send(&Message::PrefixChunk { offset: 0, bytes: &bytes }, |answer| match answer {
            Message::Ack { refusal: None, written, .. } => written,
            other => panic!("{other:?}"),
        });
        assert_eq!(written, Some(8));
        assert_eq!(bench.ask(&Message::CommitPrefix), Err(Refusal::Busy));
        let transfer = bench.update.transfer.as_mut().expect("a transfer");
        assert_eq!(transfer.whole(), Some(&bytes[..]));
        transfer.installed(Ok(()));
        assert_eq!(bench.ask(&Message::CommitPrefix), Ok(()));
    }
}

/// A prefix whose lifetime is over latches with its own fault, and nothing arms without one.
#[cfg(feature = "prefix")]
#[test]
fn without_a_prefix_nothing_arms() {
    let mut bench = Bench::new();
    bench.arm();
    bench.safety.check(Check::Prefix, false);
    let status = bench.status();
    assert_eq!(
        (status.state, status.fault, status.refusal),
        (State::Latched, Some(Fault::Prefix), Some(Refusal::Prefix))
    );
    assert_eq!(bench.ask(&Message::Disarm), Ok(()));
    // The outputs coast.
    bench.safety.tick();
    bench.observe();
    let token = bench.status().token;
    assert_eq!(bench.ask(&Message::Arm { token }), Err(Refusal::Prefix));
    bench.safety.check(Check::Prefix, true);
    assert_eq!(bench.ask(&Message::Arm { token }), Ok(()));
    // No image, no prefix.
    let begin = Message::BeginPrefix { token: bench.status().token, image: 0xabcd, length: 0, crc: 0, lifetime: 1 };
    assert_eq!(bench.ask(&begin), Err(Refusal::Unsupported));
    assert_eq!(bench.ask(&Message::CommitPrefix), Err(Refusal::Unsupported));
}

/// The age of an arm request is the last reason, after those of the state, and counts for the clocks all the same.
#[test]
fn an_old_arm_request_is_refused_for_the_first_reason() {
    let late = |bench: &mut Bench, token| {
        bench.observe();
        let wire = bench.frame(&Message::Arm { token });
        bench.micros += 100_000;
        let answer = bench.bytes(&wire);
        bench.parse(&answer, |answer| if let Message::Ack { refusal, .. } = answer { refusal } else { None }).flatten()
    };
    let mut bench = Bench::new();
    let token = bench.status().token;
    assert_eq!(late(&mut bench, token ^ 1), Some(Refusal::Token));
    assert_eq!(late(&mut bench, token), Some(Refusal::Stale));
    for (check, refusal) in [(Check::Image, Refusal::Image), (Check::Hardware, Refusal::Hardware)] {
        bench.safety.check(check, false);
        assert_eq!(late(&mut bench, token), Some(refusal));
        bench.safety.check(check, true);
    }
    bench.arm();
    let token = bench.status().token;
    assert_eq!(late(&mut bench, token), Some(Refusal::Armed));
    // An arm request is the fastest frame so far.
    let mut bench = Bench::new();
    let token = bench.status().token;
    assert_eq!(bench.ask(&Message::Arm { token }), Err(Refusal::Stale), "no observation");
    let wire = bench.frame(&Message::Observation(Floats::Values(&OBSERVATION)));
    bench.micros += 100_000;
    bench.bytes(&wire);
    assert!(bench.safety.is_stale(), "older than the request");
}

/// If writing to flash stalls the tick, no request reaches the update unless disarmed. A commit never does.
#[test]
fn an_update_that_stalls_the_tick_needs_disarming() {
    let requests = |token| {
        let begin = Message::Begin { token, length: 4, crc: 0, version: 0 };
        [begin, Message::Chunk { offset: 0, bytes: &[0; 4] }, Message::Commit { signature: None }]
    };
    for flash_while_armed in [false, true] {
        let mut bench = Bench::of(Settings { status_period: 0, flash_while_armed, quiet: QUIET }, NoUpdate);
        assert_eq!(bench.endpoint.stalls(), !flash_while_armed);
        let outcomes = |bench: &mut Bench| requests(bench.status().token).map(|request| bench.ask(&request));
        let (done, armed) = (Err(Refusal::Unsupported), Err(Refusal::Armed));
        assert_eq!(outcomes(&mut bench), [done; 3]);
        bench.observe();
        bench.arm();
        assert_eq!(outcomes(&mut bench), if flash_while_armed { [done, done, armed] } else { [armed; 3] });
        for _ in 0..=DEADLINE {
            bench.safety.tick();
        }
        assert_eq!(bench.status().state, State::Latched);
        assert_eq!(
            outcomes(&mut bench),
            if flash_while_armed { [done, done, armed] } else { [armed; 3] },
            "outputs do their safe action"
        );
        assert_eq!(bench.ask(&Message::Disarm), Ok(()));
        let waits = Err(Refusal::Busy);
        assert_eq!(outcomes(&mut bench), [if flash_while_armed { done } else { waits }; 3], "outputs do not coast yet");
        bench.safety.tick();
        assert_eq!(outcomes(&mut bench), [done; 3]);
    }
}

/// A disarm and the next request may arrive in one read, with the power stage still on, which an STM32F405's flash
/// driver refuses. The update waits for the tick and continues.
#[test]
fn an_update_continues_after_a_disarm() {
    let begin = (1 << 20) - 2 * LARGE;
    let flash = Flash::new(Model::new(vec![0; 2 * LARGE as usize], begin, 1), begin);
    let layout = Layout::new(&flash, 0..LARGE, LARGE..2 * LARGE).expect("the slots are valid");
    let updater = Updater::new(Slots::new(flash, layout, Anyone, 0), None);
    let mut bench = Bench::of(Settings { status_period: 0, flash_while_armed: false, quiet: QUIET }, updater);
    // Arms, then makes a request after a disarm.
    let after_a_disarm = |bench: &mut Bench<Updater<Flash<Model>, Anyone>>, request: fn(u32) -> Message<'static>| {
        bench.arm();
        bench.update.slots().flash().part.is_driving = true;
        assert_eq!(bench.ask(&request(bench.safety.token())), Err(Refusal::Armed));
        let disarm = bench.frame(&Message::Disarm);
        // The token has already changed.
        bench.bytes(&disarm);
        assert_eq!(bench.ask(&request(bench.safety.token())), Err(Refusal::Busy));
        assert_eq!(bench.update.work(), Work::Idle);
        assert_eq!(bench.safety.tick(), [Output::Coast; 2]);
        bench.update.slots().flash().part.is_driving = false;
        bench.ask(&request(bench.safety.token()))
    };
    let announced = |token| Message::Begin { token, length: 8, crc: CRC.checksum(b"an image"), version: 0 };
    assert_eq!(after_a_disarm(&mut bench, announced), Err(Refusal::Busy), "the slot is being erased");
    bench.observe();
    assert_eq!(bench.ask(&Message::Arm { token: bench.safety.token() }), Err(Refusal::Busy));
    while bench.update.work() == Work::More {}
    assert_eq!(bench.ask(&announced(bench.safety.token())), Ok(()));
    assert_eq!(after_a_disarm(&mut bench, |_| Message::Chunk { offset: 0, bytes: b"an i" }), Ok(()));
    let again = bench.send(&Message::Chunk { offset: 0, bytes: b"an i" }, |answer| match answer {
        Message::Ack { refusal: None, written, .. } => written,
        other => panic!("{other:?}"),
    });
    assert_eq!(again, Some(4), "all that was written");
    assert_eq!(after_a_disarm(&mut bench, |_| Message::Chunk { offset: 4, bytes: b"mage" }), Ok(()));
    assert_eq!(
        after_a_disarm(&mut bench, |_| Message::Commit { signature: None }),
        Err(Refusal::Busy),
        "the image is being checked"
    );
    while bench.update.work() == Work::More {}
    assert!(bench.update.tested(Ok(())));
    assert_eq!(bench.ask(&Message::Commit { signature: None }), Ok(()));
}

#[test]
fn periodic_status_and_a_new_host_after_silence() {
    let mut bench = Bench::new();
    let token = bench.status().token;
    let set = Message::Set { token, parameter: Parameter::StatusPeriod, axis: 0, value: 50.0 };
    assert_eq!(bench.ask(&set), Ok(()));
    let mut out = [0; 256];
    let mut reports = 0;
    for _ in 0..500 {
        bench.safety.tick();
        reports += u32::from(bench.endpoint.report(0, &mut bench.safety, &mut out).is_some());
    }
    assert_eq!(reports, 10);
    // Another host, with lower numbers.
    bench.host = Sender::new(3);
    bench.observe();
    assert!(bench.safety.is_stale(), "ignored: its number is old");
    for _ in 0..=QUIET {
        bench.safety.tick();
        bench.endpoint.report(0, &mut bench.safety, &mut out);
    }
    bench.observe();
    assert!(!bench.safety.is_stale());
}

#[test]
fn without_a_period_only_a_new_token_is_reported() {
    let (mut bench, mut out) = (Bench::new(), [0; 256]);
    let mut is_reported = |bench: &mut Bench| {
        bench.safety.tick();
        bench.endpoint.report(0, &mut bench.safety, &mut out).is_some()
    };
    for _ in 0..2 {
        assert_eq!([0; 3].map(|_| is_reported(&mut bench)), [true, false, false]);
        bench.safety.renew();
    }
    let status = bench.status();
    assert_eq!((status.axes, status.observation), (2, 3));
    assert!(!is_reported(&mut bench), "a status that was asked for has the token, too");
}

#[test]
fn a_host_is_forgotten_after_the_last_quiet_tick() {
    let (mut bench, mut out) = (Bench::new(), [0; 256]);
    let token = bench.status().token;
    for tick in 1..=QUIET + 1 {
        bench.safety.tick();
        bench.endpoint.report(0, &mut bench.safety, &mut out);
        assert_eq!(bench.safety.token() == token, tick <= QUIET, "{tick}");
    }
}

/// The sender's time jumps back by a second.
#[test]
fn a_stale_controller_learns_the_clock_anew() {
    let (mut bench, mut out) = (Bench::new(), [0; 256]);
    bench.micros = 1_000_000;
    let wire = bench.frame(&Message::Observation(Floats::Values(&OBSERVATION)));
    bench.micros = 0;
    bench.bytes(&wire);
    bench.observe();
    assert_eq!(bench.status().refused, 1);
    (0..=DEADLINE).for_each(|_| _ = bench.safety.tick());
    assert!(bench.safety.is_stale());
    bench.endpoint.report(0, &mut bench.safety, &mut out);
    bench.observe();
    assert!(!bench.safety.is_stale());
}

/// Nor does a disarm: a new host's numbers may be far ahead.
#[test]
fn an_arm_request_that_is_refused_bounds_no_numbers() {
    let mut bench = Bench::new();
    assert_eq!(bench.ask(&Message::Arm { token: bench.safety.token() ^ 1 }), Err(Refusal::Token));
    assert_eq!(bench.ask(&Message::Disarm), Ok(()));
    bench.host = Sender::new(1 << 20);
    bench.observe();
    assert!(!bench.safety.is_stale());
}

/// Returns a frame of any kind and content, with a correct checksum.
fn frame_of(kind: u8, sequence: u32, payload: &[u8]) -> Vec<u8> {
    let content = [&[frame::VERSION, kind][..], &sequence.to_le_bytes(), &[0; 4], payload].concat();
    let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&content);
    let content = [&content[..], &crc.to_le_bytes()].concat();
    let mut wire = vec![0; cobs::max_encoding_length(content.len())];
    let len = cobs::encode(&content, &mut wire);
    wire.truncate(len);
    wire.push(0);
    wire
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(5000))]

    /// No frame without the current token changes the controller, well-formed or not, except a disarm and a valid
    /// observation.
    #[test]
    fn frames_without_the_token_change_only_counters(
        armed: bool, kind in prop_oneof![0..12u8, 126..136u8, any::<u8>()],
        payload in prop::collection::vec(any::<u8>(), 0..80), skip in 1..1000u32,
    ) {
        prop_assume!(kind != 3);
        let mut bench = Bench::new();
        if armed { bench.arm(); }
        let sequence = bench.host.next().wrapping_add(skip);
        let before = format!("{:?}", bench.safety);
        // The drawn payload must not contain the bench's token.
        let token = bench.safety.token().to_le_bytes();
        prop_assume!(payload.first_chunk() != Some(&token));
        bench.bytes(&frame_of(kind, sequence, &payload));
        let after = format!("{:?}", bench.safety);
        let observation = kind == 1 && payload.len() == 12;
        prop_assert!(before == after || observation, "{}\n{}", before, after);
    }

    /// Noise does not stop the controller.
    #[test]
    fn noise_changes_only_counters(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let mut bench = Bench::new();
        bench.arm();
        let before = format!("{:?}", bench.safety);
        prop_assert_eq!(bench.bytes(&bytes), Vec::<u8>::new());
        prop_assert_eq!(before, format!("{:?}", bench.safety));
        bench.bytes(&[0]);
        prop_assert_eq!(bench.status().state, State::Armed);
    }
}

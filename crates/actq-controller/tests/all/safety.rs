//! Invariants under any sequence of events.

use std::collections::{HashSet, VecDeque};

use actq_controller::{Axis, Check, Output, SafeAction, Safety};
use actq_link::code::{Fault, Refusal, State};
use proptest::prelude::*;

#[derive(Clone, Debug)]
enum Event {
    Tick,
    Ticks(u8),
    Observed,
    Stalled,
    Act(Vec<f32>),
    Trip(usize),
    Check(usize, bool),
    Arm { right_token: bool },
    Disarm,
}

fn events() -> impl Strategy<Value = Event> {
    let value = prop_oneof![-2.0..2.0f32, any::<f32>(), Just(f32::NAN), Just(f32::MAX), Just(f32::NEG_INFINITY)];
    prop_oneof![
        8 => Just(Event::Tick),
        1 => (0..30u8).prop_map(Event::Ticks),
        6 => Just(Event::Observed),
        1 => Just(Event::Stalled),
        6 => prop::collection::vec(-2.0..2.0f32, 2).prop_map(Event::Act),
        1 => prop::collection::vec(value, 0..4).prop_map(Event::Act),
        1 => (0..Fault::ALL.len()).prop_map(Event::Trip),
        3 => (0..Check::ALL.len(), prop::bool::weighted(0.9)).prop_map(|(check, passed)| Event::Check(check, passed)),
        4 => prop::bool::weighted(0.8).prop_map(|right_token| Event::Arm { right_token }),
        1 => Just(Event::Disarm),
    ]
}

fn safe_actions() -> impl Strategy<Value = SafeAction> {
    prop_oneof![
        Just(SafeAction::Hold),
        Just(SafeAction::Brake),
        Just(SafeAction::Coast),
        (0.001..1.0f32).prop_map(|step| SafeAction::Ramp { step }),
    ]
}

/// Draws limits around 0, from tiny to almost the range of f32.
fn axes() -> impl Strategy<Value = Axis> {
    let limit = prop_oneof![4 => 0.01..2.0f32, 1 => Just(f32::MAX), 1 => Just(0.0)];
    let rate = prop_oneof![4 => 0.001..1.0f32, 1 => Just(f32::INFINITY), 1 => Just(f32::MAX)];
    (limit.clone(), limit, rate, safe_actions()).prop_map(|(low, high, rate, safe)| {
        let least = f32::EPSILON * low.max(high);
        let safe = match safe {
            SafeAction::Ramp { step } => SafeAction::Ramp { step: step.max(least) },
            other => other,
        };
        Axis::new(-low, high, rate.max(least), 0.0, safe).expect("the axis is valid")
    })
}

/// Returns the largest change of an axis in a tick, including rounding.
fn largest(axis: &Axis, step: f32, from: f32) -> f64 {
    let rounding = f64::from(from.abs().max(axis.high()).max(-axis.low())) * f64::from(f32::EPSILON);
    f64::from(step) + rounding
}

/// Checks the outputs of a tick against those of the previous tick.
fn check_outputs(safety: &Safety<2>, before: &[Output; 2], now: &[Output; 2]) -> Result<(), TestCaseError> {
    for ((axis, before), now) in safety.axes().iter().zip(before).zip(now) {
        if let Output::Drive(value) = now {
            prop_assert!((axis.low()..=axis.high()).contains(value), "{value} outside {axis:?}");
        }
        match safety.state() {
            State::Disarmed => prop_assert_eq!(*now, Output::Coast),
            State::Armed => {
                let from = if let Output::Drive(value) = before { *value } else { axis.start() };
                if let Output::Drive(value) = now {
                    let change = (f64::from(*value) - f64::from(from)).abs();
                    prop_assert!(change <= largest(axis, axis.rate(), from), "{from} to {value} by {axis:?}");
                }
            }
            State::Latched => match (axis.safe(), before, now) {
                (SafeAction::Hold, before, now) => prop_assert_eq!(before, now),
                (SafeAction::Brake, _, now) => prop_assert_eq!(*now, Output::Brake),
                (SafeAction::Coast, _, now) => prop_assert_eq!(*now, Output::Coast),
                (SafeAction::Ramp { step }, Output::Drive(from), Output::Drive(to)) => {
                    let step = step.min(axis.rate());
                    prop_assert!(to.abs() <= from.abs());
                    prop_assert!(f64::from(from - to).abs() <= largest(axis, step, *from));
                    prop_assert!(*to == 0.0 || to != from || from.abs() > step * 1e6);
                }
                (SafeAction::Ramp { .. }, before, now) => prop_assert_eq!(before, now),
            },
        }
    }
    Ok(())
}

/// A controller, and the facts that bind it.
struct Watched {
    safety: Safety<2>,
    deadline: u32,
    passed: [bool; Check::ALL.len()],
    /// The outputs of the last tick, which are those of the motors.
    outputs: [Output; 2],
    since_observation: u32,
    since_action: u32,
}

impl Watched {
    fn new(axes: [Axis; 2], deadline: u32, seed: u32) -> Self {
        Self {
            safety: Safety::new(axes, 1..=deadline, seed),
            deadline,
            // An image without a prefix needs none.
            #[cfg(feature = "prefix")]
            passed: Check::ALL.map(|check| check == Check::Prefix),
            #[cfg(not(feature = "prefix"))]
            passed: [false; Check::ALL.len()],
            outputs: [Output::Coast; 2],
            since_observation: u32::MAX,
            since_action: 0,
        }
    }

    fn tick(&mut self) -> Result<(), TestCaseError> {
        self.since_observation = self.since_observation.saturating_add(1);
        self.since_action += 1;
        let now = self.safety.tick();
        check_outputs(&self.safety, &self.outputs, &now)?;
        self.outputs = now;
        if self.safety.state() == State::Armed {
            prop_assert!(self.since_observation <= self.deadline && self.since_action <= self.deadline);
        }
        Ok(())
    }

    /// Applies an event, and checks all that holds after it.
    fn apply(&mut self, event: &Event) -> Result<(), TestCaseError> {
        let Self { safety, passed, .. } = self;
        let (state, token, fault) = (safety.state(), safety.token(), safety.fault());
        match event {
            Event::Tick => self.tick()?,
            Event::Ticks(n) => (0..*n).try_for_each(|_| self.tick())?,
            Event::Observed => {
                safety.observed();
                self.since_observation = 0;
            }
            Event::Stalled => {
                safety.stalled();
                if state != State::Armed {
                    self.since_observation = u32::MAX;
                }
            }
            Event::Act(action) => {
                let good = action.len() == 2 && action.iter().all(|value| value.is_finite());
                prop_assert_eq!(safety.act(action).is_ok(), good);
                if good {
                    self.since_action = 0;
                }
            }
            Event::Trip(fault) => safety.trip(Fault::ALL[*fault]),
            Event::Check(check, outcome) => {
                safety.check(Check::ALL[*check], *outcome);
                passed[*check] = *outcome;
            }
            Event::Arm { right_token } => {
                let (refusal, may_stall) = (safety.refusal(), safety.may_stall());
                let armed = safety.arm(if *right_token { token } else { token ^ 0x10 });
                let hardware = matches!(fault, Some(Fault::Break | Fault::Overrun));
                let passed = *passed == [true; Check::ALL.len()] && !(state == State::Latched && hardware);
                let is_ready = state != State::Armed && passed && self.since_observation <= self.deadline;
                let may = *right_token && is_ready && may_stall != Err(Refusal::Busy);
                prop_assert_eq!(armed.is_ok(), may);
                if *right_token && may_stall != Err(Refusal::Busy) {
                    prop_assert_eq!(armed.err(), refusal, "the status names the refusal of arming");
                }
                if may {
                    self.since_action = 0;
                }
            }
            Event::Disarm => safety.disarm(),
        }
        let Self { safety, passed, outputs, .. } = self;
        let now = safety.state();
        if now == State::Armed {
            prop_assert_eq!(*passed, [true; Check::ALL.len()]);
        }
        let off = now == State::Disarmed && *outputs == [Output::Coast; 2];
        prop_assert!(off || safety.may_stall().is_err());
        if now != state {
            prop_assert_ne!(safety.token(), token);
            prop_assert!((state, now) != (State::Disarmed, State::Latched));
            let asked = matches!(event, Event::Arm { right_token: true });
            prop_assert!(now != State::Armed || asked);
        }
        match event {
            Event::Trip(i) if state == State::Armed => prop_assert_eq!(safety.fault(), Some(Fault::ALL[*i])),
            _ => prop_assert!(safety.fault() == fault || state == State::Armed, "the first fault stays"),
        }
        Ok(())
    }

    /// Returns the whole state of the controller, without its clock and token, and with ages that are all too old as one.
    fn key(&self) -> (String, u32) {
        let text = format!("{:?}", self.safety);
        let (_, state) = text.split_once("health: ").expect("a field");
        let (state, rest) = state.split_once(", since_observation: ").expect("a field");
        let age: u32 = rest.split_once(',').and_then(|(age, _)| age.parse().ok()).expect("a number");
        (state.to_owned(), age.min(self.deadline + 1))
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn limits_hold_and_arming_needs_all_conditions(
        first in axes(), second in axes(), deadline in 1..10u32, seed: u32,
        events in prop::collection::vec(events(), 1..200),
    ) {
        let mut watched = Watched::new([first, second], deadline, seed);
        events.iter().try_for_each(|event| watched.apply(event))?;
    }
}

/// Applies every event in every state that any sequence of events reaches, breadth first, with two axes and a deadline
/// of two ticks. Changes are halves, so outputs are few and exact. Three of the checks change; all are treated alike.
#[test]
fn invariants_hold_in_every_reachable_state() {
    let actions = [&[1.0, -1.0][..], &[-9.0, 0.25], &[f32::NAN, 0.0], &[0.0]];
    let mut events = vec![Event::Tick, Event::Observed, Event::Stalled, Event::Disarm];
    events.extend([true, false].map(|right_token| Event::Arm { right_token }));
    events.extend(actions.map(|action| Event::Act(action.to_vec())));
    // Of the faults, one that only a disarm ends and one that an arm ends; all others are treated alike.
    let tripped = |fault: &usize| [Fault::Head, Fault::Break].contains(&Fault::ALL[*fault]);
    events.extend((0..Fault::ALL.len()).filter(tripped).map(Event::Trip));
    let changing = |check: &usize| [Check::Image, Check::Clock, Check::Hardware].contains(&Check::ALL[*check]);
    let changes =
        (0..Check::ALL.len()).filter(changing).flat_map(|i| [true, false].map(|passed| Event::Check(i, passed)));
    events.extend(changes);
    for (safe, expected) in [
        ([SafeAction::Hold, SafeAction::Ramp { step: 0.75 }], (9_510, 29)),
        ([SafeAction::Brake, SafeAction::Coast], (8_056, 30)),
    ] {
        let axes = safe.map(|safe| Axis::new(-1.0, 1.0, 0.5, 0.5, safe).expect("the axis is valid"));
        let named = |path: &[u8]| path.iter().map(|i| &events[usize::from(*i)]).collect::<Vec<_>>();
        let replay = |path: &[u8]| {
            let mut watched = Watched::new(axes, 2, 0);
            let passed = (0..Check::ALL.len()).filter(|check| !changing(check)).map(|i| Event::Check(i, true));
            passed.for_each(|event| watched.apply(&event).expect("the controller is new"));
            named(path).into_iter().try_for_each(|event| watched.apply(event)).expect("applied before");
            watched
        };
        let (mut seen, mut next) = (HashSet::from([replay(&[]).key()]), VecDeque::from([Vec::new()]));
        let mut longest = 0;
        while let Some(path) = next.pop_front() {
            longest = path.len();
            let mut watched = replay(&path);
            let before = watched.key();
            for (i, event) in events.iter().enumerate() {
                let outcome = watched.apply(event);
                outcome.unwrap_or_else(|error| panic!("{error} at {event:?} after {:?}", named(&path)));
                let key = watched.key();
                // Most events change nothing.
                if key == before {
                    continue;
                }
                if seen.insert(key) {
                    next.push_back([&path[..], &[i as u8]].concat());
                }
                watched = replay(&path);
            }
        }
        assert_eq!((seen.len(), longest), expected, "states, and events to the farthest");
    }
}

/// For every deadline and every tick of the last observation, the output moves until the deadline, and not at the tick
/// after it.
#[test]
fn a_broken_cable_latches_after_the_deadline() {
    for deadline in 1..50 {
        let axis = Axis::new(-1e6, 1e6, 1.0, 0.0, SafeAction::Brake).expect("the axis is valid");
        let mut safety = Safety::new([axis], 1..=deadline, 0);
        Check::ALL.into_iter().for_each(|check| safety.check(check, true));
        safety.observed();
        safety.arm(safety.token()).expect("the controller may be armed");
        for _ in 0..7 {
            safety.observed();
            safety.act(&[1e6]).expect("the action is valid");
            safety.tick();
        }
        safety.observed();
        for tick in 1..=deadline {
            safety.act(&[1e6]).expect("the head still gives actions");
            assert!(matches!(safety.tick(), [Output::Drive(_)]), "deadline {deadline}, tick {tick}");
        }
        assert_eq!(safety.tick(), [Output::Brake], "deadline {deadline}");
        for _ in 0..100 {
            // A late observation does not unlatch.
            safety.observed();
            assert_eq!(safety.act(&[1e6]), Ok(None));
            assert_eq!(safety.tick(), [Output::Brake]);
        }
        assert_eq!(safety.fault(), Some(Fault::Stale));
    }
}

#[test]
fn a_silent_head_latches_after_the_deadline() {
    let axis = Axis::new(-1.0, 1.0, 1.0, 0.0, SafeAction::Coast).expect("the axis is valid");
    let mut safety = Safety::new([axis], 1..=10, 0);
    Check::ALL.into_iter().for_each(|check| safety.check(check, true));
    safety.observed();
    safety.arm(safety.token()).expect("the controller may be armed");
    safety.act(&[1.0]).expect("the action is valid");
    for _ in 0..10 {
        safety.observed();
        assert_eq!(safety.tick(), [Output::Drive(1.0)]);
    }
    safety.observed();
    assert_eq!(safety.tick(), [Output::Coast]);
    assert_eq!(safety.fault(), Some(Fault::Late));
}

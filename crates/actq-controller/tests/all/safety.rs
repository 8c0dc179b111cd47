//! Invariants under any sequence of events.

use actq_controller::{Axis, Check, Output, SafeAction, Safety};
use actq_link::code::{Fault, State};
use proptest::prelude::*;

#[derive(Clone, Debug)]
enum Event {
    Tick,
    Ticks(u8),
    Observed,
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

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn limits_hold_and_arming_needs_all_conditions(
        first in axes(), second in axes(), deadline in 1..10u32, seed: u32,
        events in prop::collection::vec(events(), 1..200),
    ) {
        let mut safety = Safety::new([first, second], 1..=deadline, seed);
        let mut passed = [false; Check::ALL.len()];
        let (mut outputs, mut since_observation, mut since_action) = ([Output::Coast; 2], u32::MAX, 0u32);
        for event in events {
            let (state, token) = (safety.state(), safety.token());
            let ticks = match event { Event::Tick => 1, Event::Ticks(n) => n, _ => 0 };
            for _ in 0..ticks {
                since_observation = since_observation.saturating_add(1);
                since_action += 1;
                let now = safety.tick();
                check_outputs(&safety, &outputs, &now)?;
                outputs = now;
                if safety.state() == State::Armed {
                    prop_assert!(since_observation <= deadline && since_action <= deadline);
                }
            }
            match &event {
                Event::Tick | Event::Ticks(_) => {}
                Event::Observed => {
                    safety.observed();
                    since_observation = 0;
                }
                Event::Act(action) => {
                    let good = action.len() == 2 && action.iter().all(|value| value.is_finite());
                    prop_assert_eq!(safety.act(action).is_ok(), good);
                    if good { since_action = 0; }
                }
                Event::Trip(fault) => safety.trip(Fault::ALL[*fault]),
                Event::Check(check, outcome) => {
                    safety.check(Check::ALL[*check], *outcome);
                    passed[*check] = *outcome;
                }
                Event::Arm { right_token } => {
                    let refusal = safety.refusal();
                    let armed = safety.arm(if *right_token { token } else { token ^ 0x10 });
                    let hardware = matches!(safety.fault(), Some(Fault::Break | Fault::Overrun));
                    let passed = passed == [true; 5] && !(state == State::Latched && hardware);
                    let may = *right_token && state != State::Armed && passed && since_observation <= deadline;
                    prop_assert_eq!(armed.is_ok(), may);
                    if *right_token { prop_assert_eq!(armed.err(), refusal, "the status names the refusal of arming"); }
                    if may { since_action = 0; }
                }
                Event::Disarm => {
                    safety.disarm();
                    outputs = [Output::Coast; 2];
                }
            }
            let now = safety.state();
            if now == State::Armed {
                prop_assert_eq!(passed, [true; 5]);
            }
            if now != state {
                prop_assert_ne!(safety.token(), token);
                prop_assert!((state, now) != (State::Disarmed, State::Latched));
                let asked = matches!(event, Event::Arm { right_token: true });
                prop_assert!(now != State::Armed || asked);
            }
        }
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

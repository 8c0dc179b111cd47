//! Every event in every state, against the table of docs/SAFETY.md.

use actq_controller::{Axis, Check, Output, SafeAction, Safety};
use actq_link::code::{Fault, Parameter, Refusal, State};

const DEADLINE: u32 = 5;

/// Returns a controller of one axis that may be armed.
pub(super) fn ready(safe: SafeAction) -> Safety<1> {
    let axis = Axis::new(-1.0, 1.0, 0.1, 0.0, safe).expect("the axis is valid");
    let mut safety = Safety::new([axis], 1..=DEADLINE, 1);
    Check::ALL.into_iter().for_each(|check| safety.check(check, true));
    safety.observed();
    safety
}

/// Returns a controller in `state`, after an output of 0.3 if the state has outputs.
pub(super) fn in_state(state: State, safe: SafeAction) -> Safety<1> {
    let mut safety = ready(safe);
    if state != State::Disarmed {
        safety.arm(safety.token()).expect("the controller may be armed");
        safety.act(&[0.3]).expect("the action is valid");
        for _ in 0..3 {
            safety.observed();
            safety.tick();
        }
    }
    if state == State::Latched {
        safety.trip(Fault::Head);
    }
    assert_eq!(safety.state(), state);
    safety.observed();
    safety
}

type Event = fn(&mut Safety<1>);

const ARM: Event = |s| {
    let _ = s.arm(s.token());
};
const STALE: Event = |s| {
    for _ in 0..=DEADLINE {
        s.tick();
    }
};

/// Events, each with the states after Disarmed, Armed and Latched.
const TABLE: [(&str, Event, [State; 3]); 15] = {
    use State::{Armed, Disarmed, Latched};
    [
        ("arm", ARM, [Armed, Armed, Armed]),
        ("arm with another token", |s| _ = s.arm(s.token() ^ 1), [Disarmed, Armed, Latched]),
        ("disarm", Safety::disarm, [Disarmed, Disarmed, Disarmed]),
        ("tick", |s| _ = s.tick(), [Disarmed, Armed, Latched]),
        ("deadline passed", STALE, [Disarmed, Latched, Latched]),
        (
            "no action within the deadline",
            |s| {
                for _ in 0..=DEADLINE {
                    s.observed();
                    s.tick();
                }
            },
            [Disarmed, Latched, Latched],
        ),
        ("action", |s| _ = s.act(&[0.5]), [Disarmed, Armed, Latched]),
        ("action outside the limits", |s| _ = s.act(&[-7.0]), [Disarmed, Armed, Latched]),
        ("action that is NaN", |s| _ = s.act(&[f32::NAN]), [Disarmed, Latched, Latched]),
        ("action that is infinite", |s| _ = s.act(&[f32::INFINITY]), [Disarmed, Latched, Latched]),
        ("action without values", |s| _ = s.act(&[]), [Disarmed, Latched, Latched]),
        ("action of two values", |s| _ = s.act(&[0.0; 2]), [Disarmed, Latched, Latched]),
        ("the head fails", |s| s.trip(Fault::Head), [Disarmed, Latched, Latched]),
        ("a check passes", |s| s.check(Check::Clock, true), [Disarmed, Armed, Latched]),
        ("the image decays", |s| s.check(Check::Image, false), [Disarmed, Latched, Latched]),
    ]
};

#[test]
fn every_transition_is_that_of_the_table() {
    for (name, event, to) in TABLE {
        for (from, to) in State::ALL.iter().zip(to) {
            let mut safety = in_state(*from, SafeAction::Hold);
            let token = safety.token();
            event(&mut safety);
            assert_eq!(safety.state(), to, "{name} in {from:?}");
            if *from != to {
                assert_ne!(safety.token(), token, "{name} in {from:?}: an earlier request must not be accepted");
            }
        }
    }
}

#[test]
fn each_fault_latches_and_is_reported() {
    for fault in Fault::ALL {
        let mut safety = in_state(State::Armed, SafeAction::Hold);
        safety.trip(*fault);
        assert_eq!((safety.state(), safety.fault()), (State::Latched, Some(*fault)));
        // The first fault stays.
        safety.trip(Fault::Head);
        assert_eq!(safety.fault(), Some(*fault));
    }
    let faults = [(Check::Image, Fault::Image), (Check::SelfTest, Fault::Image), (Check::Clock, Fault::Clock)];
    for (check, fault) in
        faults.into_iter().chain([(Check::Watchdog, Fault::Watchdog), (Check::Hardware, Fault::Break)])
    {
        let mut safety = in_state(State::Armed, SafeAction::Hold);
        safety.check(check, false);
        assert_eq!((safety.state(), safety.fault()), (State::Latched, Some(fault)));
    }
}

#[test]
fn a_break_or_an_overrun_latches_until_disarmed() {
    for fault in Fault::ALL {
        let mut safety = in_state(State::Armed, SafeAction::Coast);
        safety.trip(*fault);
        safety.check(Check::Hardware, true);
        safety.observed();
        let needs_a_disarm = matches!(fault, Fault::Break | Fault::Overrun);
        let expected = if needs_a_disarm { Err(Refusal::Hardware) } else { Ok(()) };
        assert_eq!(safety.arm(safety.token()), expected, "{fault:?}");
        safety.disarm();
        assert_eq!(safety.arm(safety.token()), Err(Refusal::Busy), "the outputs do not coast yet");
        safety.tick();
        assert_eq!(safety.arm(safety.token()), Ok(()), "{fault:?}");
    }
}

#[test]
fn arming_after_lost_ticks_needs_a_new_observation() {
    for state in [State::Disarmed, State::Latched] {
        let mut safety = in_state(state, SafeAction::Hold);
        safety.stalled();
        assert_eq!(safety.arm(safety.token()), Err(Refusal::Stale));
        safety.observed();
        assert_eq!(safety.arm(safety.token()), Ok(()));
        safety.stalled();
        safety.tick();
        assert_eq!(safety.state(), State::Armed, "nothing holds up the tick of an armed controller");
    }
}

/// A host's smaller rate holds for the ramp, too.
#[test]
fn a_ramp_keeps_the_rate() {
    let axis = Axis::new(-1.0, 1.0, 1.0, 0.0, SafeAction::Ramp { step: 1.0 }).expect("the axis is valid");
    let mut safety = Safety::new([axis], 1..=DEADLINE, 1);
    Check::ALL.into_iter().for_each(|check| safety.check(check, true));
    safety.set(safety.token(), Parameter::Rate, 0, 0.25).expect("stricter");
    safety.observed();
    safety.arm(safety.token()).expect("armed");
    safety.act(&[0.5]).expect("an action");
    assert_eq!([safety.tick(), safety.tick()], [[Output::Drive(0.25)], [Output::Drive(0.5)]]);
    safety.trip(Fault::Head);
    assert_eq!([safety.tick(), safety.tick()], [[Output::Drive(0.25)], [Output::Drive(0.0)]]);
}

#[test]
fn arming_requires_every_check() {
    let refusals = [Refusal::Image, Refusal::SelfTest, Refusal::Clock, Refusal::Watchdog, Refusal::Hardware];
    for (check, refusal) in Check::ALL.into_iter().zip(refusals) {
        for state in [State::Disarmed, State::Latched] {
            let mut safety = in_state(state, SafeAction::Hold);
            safety.check(check, false);
            assert_eq!(safety.refusal(), Some(refusal));
            assert_eq!(safety.arm(safety.token()), Err(refusal));
            assert_eq!(safety.state(), state);
            safety.check(check, true);
            assert_eq!(safety.arm(safety.token()), Ok(()));
        }
    }
    let axis = Axis::new(-1.0, 1.0, 0.1, 0.0, SafeAction::Coast).expect("the axis is valid");
    let mut new = Safety::new([axis], 1..=DEADLINE, 1);
    new.observed();
    for (check, refusal) in Check::ALL.into_iter().zip(refusals) {
        assert_eq!(new.arm(new.token()), Err(refusal), "a check that was not made counts as failed");
        new.check(check, true);
    }
    assert_eq!(new.arm(new.token()), Ok(()));
}

#[test]
fn arming_requires_a_recent_observation_and_token() {
    let mut safety = ready(SafeAction::Hold);
    STALE(&mut safety);
    assert_eq!(safety.arm(safety.token()), Err(Refusal::Stale));
    safety.observed();
    let token = safety.token();
    assert_eq!(safety.arm(token), Ok(()));
    assert_eq!(safety.arm(token), Err(Refusal::Token), "the same request again");
    assert_eq!(safety.arm(safety.token()), Err(Refusal::Armed));
}

#[test]
fn the_longest_deadline_needs_an_observation() {
    let axis = Axis::new(-1.0, 1.0, 0.1, 0.0, SafeAction::Hold).expect("the axis is valid");
    let mut safety = Safety::new([axis], 1..=u32::MAX, 1);
    Check::ALL.into_iter().for_each(|check| safety.check(check, true));
    assert_eq!(safety.arm(safety.token()), Err(Refusal::Stale));
    safety.observed();
    safety.tick();
    assert_eq!(safety.arm(safety.token()), Ok(()));
}

#[test]
fn an_axis_without_limits_prevents_arming() {
    let axis = Axis::new(0.0, 0.0, 1.0, 0.0, SafeAction::Hold).expect("an axis with one value");
    for (axes, refusal) in [([axis, Axis::STILL], Some(Refusal::Limits)), ([axis; 2], None)] {
        let mut safety = Safety::new(axes, 1..=DEADLINE, 1);
        Check::ALL.into_iter().for_each(|check| safety.check(check, true));
        assert_eq!(safety.refusal(), Some(Refusal::Stale), "the first reason");
        safety.observed();
        assert_eq!(safety.refusal(), refusal);
        assert_eq!(safety.arm(safety.token()).err(), refusal);
    }
}

#[test]
fn safe_actions_give_their_outputs() {
    let after = |safe, ticks| {
        let mut safety = in_state(State::Latched, safe);
        (0..ticks).map(|_| safety.tick()[0]).last().expect("at least one tick")
    };
    let Output::Drive(held) = after(SafeAction::Hold, 1) else { panic!("hold drives") };
    assert!((held - 0.3).abs() < 1e-6);
    assert_eq!(after(SafeAction::Hold, 10_000), Output::Drive(held));
    assert_eq!(after(SafeAction::Brake, 1), Output::Brake);
    assert_eq!(after(SafeAction::Coast, 1), Output::Coast);
    let Output::Drive(on_the_way) = after(SafeAction::Ramp { step: 0.1 }, 1) else { panic!("a ramp drives") };
    assert!((on_the_way - 0.2).abs() < 1e-6);
    assert_eq!(after(SafeAction::Ramp { step: 0.1 }, 4), Output::Drive(0.0));
}

#[test]
fn rearmed_outputs_continue_from_their_value() {
    let mut safety = in_state(State::Latched, SafeAction::Hold);
    safety.arm(safety.token()).expect("the controller may be armed");
    let Output::Drive(held) = safety.tick()[0] else { panic!("it holds until the first action") };
    safety.act(&[-1.0]).expect("the action is valid");
    let Output::Drive(next) = safety.tick()[0] else { panic!("it drives") };
    assert!((held - next - 0.1).abs() < 1e-6);
}

#[test]
fn invalid_axes_are_refused() {
    let new = Axis::new;
    let cases = [
        new(f32::NAN, 1.0, 1.0, 0.0, SafeAction::Hold),
        new(-1.0, f32::INFINITY, 1.0, 0.0, SafeAction::Hold),
        new(1.0, -1.0, 1.0, 0.0, SafeAction::Hold),
        new(-1.0, 1.0, 0.0, 0.0, SafeAction::Hold),
        new(-1.0, 1.0, f32::NAN, 0.0, SafeAction::Hold),
        new(0.0, 0.0, 0.0, 0.0, SafeAction::Hold),
        new(-1.0, 1.0, 1.0, 2.0, SafeAction::Hold),
        new(-1.0, 1.0, 1.0, f32::NAN, SafeAction::Hold),
        new(-1.0, 1.0, 1.0, 0.0, SafeAction::Ramp { step: 0.0 }),
        new(-1.0, 1.0, 1.0, 0.0, SafeAction::Ramp { step: f32::INFINITY }),
        new(0.5, 1.0, 1.0, 0.5, SafeAction::Ramp { step: 0.1 }),
    ];
    for (i, case) in cases.into_iter().enumerate() {
        let error = case.expect_err(&i.to_string());
        assert!(!error.to_string().is_empty());
    }
}

#[test]
fn only_a_driven_value_may_be_outside_the_limits() {
    let axis = Axis::new(-1.0, 0.5, 1.0, 0.0, SafeAction::Hold).expect("the axis is valid");
    let is_within = |value| Output::Drive(value).is_within(&axis);
    assert!([-1.0, 0.0, 0.5].into_iter().all(is_within));
    assert!(![-1.1, 0.6, f32::NAN, f32::NEG_INFINITY].into_iter().any(is_within));
    assert!(Output::Brake.is_within(&axis) && Output::Coast.is_within(&axis));
}

#[test]
fn actions_are_limited_on_both_sides() {
    let mut safety = in_state(State::Armed, SafeAction::Hold);
    for (action, target) in [(7.0, 1.0), (-7.0, -1.0), (0.5, 0.5)] {
        assert_eq!(safety.act(&[action]), Ok(Some([target])));
    }
}

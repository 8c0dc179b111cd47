//! Changes of the controller's memory by something else, as a bit flip or a wild write.

use super::*;
use crate::axis::SafeAction;

type Change = fn(&mut Safety<2>);

fn axis(high: f32, safe: SafeAction) -> Axis {
    Axis::new(-1.0, high, 0.25, 0.0, safe).expect("the axis is valid")
}

/// Returns an armed controller with outputs of 0.5.
fn armed() -> Safety<2> {
    let mut safety = Safety::new([axis(1.0, SafeAction::Hold), axis(1.0, SafeAction::Brake)], 1..=9, 1);
    Check::ALL.into_iter().for_each(|check| safety.check(check, true));
    safety.observed();
    safety.arm(safety.token()).expect("the controller may be armed");
    safety.act(&[0.5; 2]).expect("the action is valid");
    safety.tick();
    assert_eq!(safety.tick(), [Output::Drive(0.5); 2]);
    safety
}

/// One change of each field.
const CHANGES: [(&str, Change); 13] = [
    ("limit", |safety| safety.axes[1] = axis(1.0 + f32::EPSILON, SafeAction::Brake)),
    ("safe action", |safety| safety.axes[0] = axis(1.0, SafeAction::Coast)),
    ("limit of the build", |safety| safety.built.axes[0] = axis(2.0, SafeAction::Hold)),
    ("deadline", |safety| safety.deadline ^= 1 << 31),
    ("deadline of the build", |safety| safety.built.deadline = 1..=11),
    ("check", |safety| safety.health.set(Check::Watchdog, false)),
    ("state", |safety| safety.state = State::Disarmed(Disarmed::new())),
    ("target", |safety| {
        if let State::Armed(armed) = &mut safety.state {
            armed.follow([0.5, -0.5]);
        }
    }),
    ("output", |safety| {
        if let State::Armed(armed) = &mut safety.state {
            armed.tick(&[axis(0.25, SafeAction::Hold); 2]);
        }
    }),
    ("fault", |safety| safety.fault = Some(Fault::Late)),
    ("age", |safety| safety.since_observation ^= 1),
    ("ticks", |safety| safety.ticks ^= 1 << 7),
    ("token", |safety| safety.token ^= 1 << 20),
];

#[test]
fn a_change_of_any_field_ends_the_outputs_until_a_restart() {
    for (name, change) in CHANGES {
        let mut safety = armed();
        change(&mut safety);
        // A tick does not compare the limits.
        if matches!(name, "limit" | "safe action" | "limit of the build" | "deadline" | "deadline of the build") {
            safety.check_limits();
        }
        let outputs = safety.tick();
        if name == "state" {
            assert_eq!(outputs, [Output::Coast; 2]);
        } else {
            assert_eq!(outputs, [Output::Coast, Output::Brake], "{name}");
            assert_eq!((safety.state(), safety.fault()), (code::State::Latched, Some(Fault::Memory)), "{name}");
        }
        assert_eq!(safety.act(&[0.5; 2]), Ok(None), "{name}");
        Check::ALL.into_iter().for_each(|check| safety.check(check, true));
        safety.observed();
        assert_eq!(safety.arm(safety.token()), Err(Refusal::Hardware), "{name}");
        safety.disarm();
        safety.tick();
        assert_eq!(safety.arm(safety.token()), Err(Refusal::Hardware), "{name}");
    }
}

/// A request is not what hides a change.
#[test]
fn every_request_finds_a_change() {
    let requests: [(&str, Change); 8] = [
        ("observation", Safety::observed),
        ("stall", Safety::stalled),
        ("action", |safety| assert_eq!(safety.act(&[0.5; 2]), Ok(None))),
        ("fault", |safety| safety.trip(Fault::Head)),
        ("check", |safety| safety.check(Check::Clock, false)),
        ("disarm", Safety::disarm),
        ("token", Safety::renew),
        ("parameter", |safety| {
            safety.disarm();
            let _ = safety.set(safety.token(), code::Parameter::Deadline, 0, 5.0);
        }),
    ];
    for (name, request) in requests {
        let mut safety = armed();
        safety.ticks ^= 1;
        request(&mut safety);
        assert_eq!(safety.fault(), Some(Fault::Memory), "{name}");
        assert!(!safety.tick().iter().any(|output| matches!(output, Output::Drive(_))), "{name}");
    }
}

/// Limits are compared before a controller arms, and before they change.
#[test]
fn neither_arming_nor_a_parameter_hides_a_changed_limit() {
    for (name, change) in CHANGES.iter().take(5) {
        for sets_first in [false, true] {
            let mut safety = armed();
            safety.disarm();
            safety.tick();
            safety.observed();
            change(&mut safety);
            if sets_first {
                let _ = safety.set(safety.token(), code::Parameter::Rate, 1, 0.125);
            }
            assert_eq!(safety.arm(safety.token()), Err(Refusal::Hardware), "{name}");
        }
    }
}

/// A single bit never cancels out: each word is only rotated by the words after it.
#[test]
fn a_checksum_differs_after_a_change_of_any_bit() {
    let words = [0u32, u32::MAX, 0x1234_5678, 7];
    let sum = |words: [u32; 4]| words.into_iter().fold(0, mix);
    for (word, bit) in (0..4).flat_map(|word| (0..32).map(move |bit| (word, bit))) {
        let mut changed = words;
        changed[word] ^= 1 << bit;
        assert_ne!(sum(changed), sum(words));
    }
}

//! Observations at their rate, and the log of the actions.

use std::cell::Cell;
use std::sync::atomic::Ordering;
use std::time::Duration;

use actq_client::log::{Log, Row};
use actq_client::stream::{Pace, stream};
use actq_controller::Output;
use actq_controller::slots::Anyone;
use actq_link::code::State;

use crate::simulated::{OBSERVATION, Simulated};

const PACE: Pace = Pace { period: Duration::from_millis(10), arm: true };

/// Observations of ten minutes: a late controller has stopped the stream long before.
const MANY: usize = 60_000;

fn observations(count: usize) -> impl Iterator<Item = Vec<f32>> {
    (0..count).map(|i| vec![0.5, -0.25, i as f32, 0.0])
}

#[test]
fn a_streamed_recording_is_logged_with_its_actions() {
    let controller = Simulated::start(50, || Anyone);
    let (mut client, mut log) = (controller.client(), Log::default());
    // A late controller reports later that it has followed the actions.
    let moved = Cell::new(false);
    let seen = |status: &actq_link::report::Status| {
        let followed = controller.outputs() == [Output::Drive(0.25), Output::Drive(-0.125)];
        moved.set(moved.get() || followed && status.state == State::Armed);
    };
    let sent = observations(MANY).enumerate().take_while(|(i, _)| *i < 100 || !moved.get()).map(|(_, values)| values);
    stream(&mut client, sent, |_| None, &PACE, &mut log, seen).expect("losing one in twenty frames stops nothing");
    assert!(moved.get());
    assert_eq!(client.status().expect("the controller answers").state, State::Disarmed);
    let rows = log.rows();
    assert!(rows.len() >= 100);
    let answers: Vec<_> = rows.iter().filter_map(|row| Some((row.sent, row.answer.as_ref()?))).collect();
    assert!(answers.len() > 70, "{}", answers.len());
    assert_eq!(log.latencies().len(), answers.len());
    for (i, row) in rows.iter().enumerate() {
        assert_eq!((row.observation.len(), row.observation[2]), (OBSERVATION, i as f32));
    }
    for (sent, answer) in &answers {
        assert_eq!(answer.action, [0.25, -0.125]);
        assert!(answer.received_at >= *sent);
    }
    let applied = |rows: &[Row]| rows.iter().filter(|row| row.answer.as_ref().is_some_and(|a| a.applied)).count();
    assert!(applied(rows) > 60 && applied(&rows[..5]) == 0, "armed after the first five");
}

#[test]
fn a_stopped_controller_ends_the_stream() {
    let controller = Simulated::start(0, || Anyone);
    let (mut client, mut log) = (controller.client(), Log::default());
    let cut = observations(MANY).enumerate().map(|(i, values)| {
        if i == 30 {
            controller.control.cut.store(true, Ordering::Relaxed);
            controller.control.miss_the_deadline(std::thread::yield_now);
            controller.control.cut.store(false, Ordering::Relaxed);
        }
        values
    });
    let error = stream(&mut client, cut, |_| None, &PACE, &mut log, |_| ()).expect_err("it has latched");
    assert!(error.to_string().contains("no valid observation arrived within the deadline"), "{error:#}");
    // A controller that is late loses the last answers with the connection, but not that to the observation before
    // arming.
    assert!(log.rows().len() >= 30 && !log.latencies().is_empty());
}

/// It is late by more than the wait for the last action.
#[test]
fn a_late_controller_loses_no_last_action() {
    for arm in [false, true] {
        let controller = Simulated::start(0, || Anyone);
        let (mut client, mut log) = (controller.client(), Log::default());
        let late = observations(20).enumerate().map(|(i, values)| {
            if i == 19 {
                controller.control.stall(300);
            }
            values
        });
        stream(&mut client, late, |_| None, &Pace { arm, ..PACE }, &mut log, |_| ()).expect("the controller answers");
        let answer = log.rows()[19].answer.as_ref().expect("the last observation has its action");
        assert_eq!((&answer.action[..], answer.applied), (&[0.25, -0.125][..], arm));
    }
}

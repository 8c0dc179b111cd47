//! Observations at their rate, and the log of the actions.

use std::io::Cursor;
use std::sync::atomic::Ordering;
use std::time::Duration;

use actq_client::log::Log;
use actq_client::stream::{Pace, stream};
use actq_controller::Output;
use actq_controller::slots::Anyone;
use actq_link::code::State;
use ndarray::{Array1, Array2};
use ndarray_npy::NpzReader;

use crate::simulated::{OBSERVATION, Simulated};

const PACE: Pace = Pace { period: Duration::from_millis(10), arm: true };

fn observations(count: usize) -> impl Iterator<Item = Vec<f32>> {
    (0..count).map(|i| vec![0.5, -0.25, i as f32, 0.0])
}

#[test]
fn a_streamed_recording_is_logged_with_its_actions() {
    let controller = Simulated::start(50, || Anyone);
    let (mut client, mut log, mut armed) = (controller.client(), Log::default(), 0);
    let mut moved = false;
    let seen = |status: &actq_link::report::Status| {
        armed += u32::from(status.state == State::Armed);
        moved |= controller.outputs() == [Output::Drive(0.25), Output::Drive(-0.125)];
    };
    stream(&mut client, observations(100), &PACE, &mut log, seen).expect("losing one in twenty frames stops nothing");
    assert!(armed > 0 && moved);
    assert_eq!(client.status().expect("the controller answers").state, State::Disarmed);
    let mut npz =
        NpzReader::new(Cursor::new(log.npz().expect("the actions have one length"))).expect("the log is a zip file");
    let sent: Array2<f32> = npz.by_name("obs").expect("an array");
    let actions: Array2<f32> = npz.by_name("action").expect("an array");
    let applied: Array1<u8> = npz.by_name("applied").expect("an array");
    let times: [Array1<f64>; 2] = ["sent", "received"].map(|name| npz.by_name(name).expect("an array"));
    assert_eq!((sent.dim(), actions.dim()), ((100, OBSERVATION), (100, 2)));
    let answered: Vec<usize> = (0..100).filter(|row| !actions[[*row, 0]].is_nan()).collect();
    assert!(answered.len() > 70, "{}", answered.len());
    assert_eq!(log.latencies().len(), answered.len());
    for row in 0..100 {
        assert_eq!(sent[[row, 2]], row as f32);
        assert_eq!(times[1][row].is_nan(), !answered.contains(&row));
    }
    for row in &answered {
        assert_eq!([actions[[*row, 0]], actions[[*row, 1]]], [0.25, -0.125]);
        assert!(times[1][*row] >= times[0][*row]);
    }
    assert!(applied.sum() > 60 && applied.slice(ndarray::s![..5]).sum() == 0, "armed after the first five");
}

#[test]
fn a_stopped_controller_ends_the_stream_with_its_reason() {
    let controller = Simulated::start(0, || Anyone);
    let (mut client, mut log) = (controller.client(), Log::default());
    let cut = observations(400).enumerate().map(|(i, values)| {
        if i == 30 {
            controller.control.cut.store(true, Ordering::Relaxed);
            controller.control.miss_the_deadline(std::thread::yield_now);
            controller.control.cut.store(false, Ordering::Relaxed);
        }
        values
    });
    let error = stream(&mut client, cut, &PACE, &mut log, |_| ()).expect_err("it has latched");
    assert!(error.to_string().contains("no valid observation arrived within the deadline"), "{error:#}");
    assert!(log.observations() >= 30 && log.latencies().len() >= 25);
}

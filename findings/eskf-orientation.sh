#!/bin/sh
# eskf 0.2.0, nalgebra 0.25.4 (crates.io, error-state Kalman filter of an IMU): observe_orientation() multiplies the measured orientation by its own one, where the inverse of its own belongs. So a measurement moves the filter away: one
# that agrees with it, at a yaw of 0.5 rad, is taken for an error of 1.0 and puts it at 1.49, and ten of one orientation from 0 on leave it 2.5 rad off, while the uncertainty that it states shrinks to 0.01 rad. At the identity, where a body
# rests in a test, nothing is seen; 0.01 rad beside it the error grows with each observation. The gravity that predict() takes off the accelerometer is wrong with it: a body that rests, at a roll of 0.5 rad, moves at 18 m/s
# after one second. There is no error.
# Seen on 2026-11-30:  identity: 0, 0, 0   yaw of 0.5, observed ten times: 0.50, 0.99, 1.49, 1.98, 2.48, ... 2.95, uncertainty 0.011   known before: 1.49   of 0.01: 0.010, 0.020, ... 0.099   roll of 0.5: 2.95, 18.5 m/s after 1 s
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "orientation"
version = "0.0.0"
edition = "2021"

[dependencies]
eskf = "=0.2.0"
nalgebra = "=0.25.4"
TOML
cat > src/main.rs <<'RS'
use eskf::{Builder, ESKF};
use nalgebra::{UnitQuaternion, Vector3};
use std::time::Duration;

/// The angles that the filter shows after each of ten observations of one orientation, and its last uncertainty.
fn observed(true_angles: [f32; 3], known: bool) -> (Vec<[f32; 3]>, f32, f32) {
    let truth = UnitQuaternion::from_euler_angles(true_angles[0], true_angles[1], true_angles[2]);
    let mut filter = Builder::new().acceleration_variance(0.01).rotation_variance(0.01).initial_covariance(0.1).build();
    if known {
        filter.orientation = truth;
    }
    let shown = (0..10).map(|_| {
        filter.observe_orientation(truth, ESKF::variance_from_element(0.001)).unwrap();
        let (roll, pitch, yaw) = filter.orientation.euler_angles();
        [roll, pitch, yaw]
    }).collect();
    let uncertainty = filter.orientation_uncertainty().max();
    // The body rests for one second: its accelerometer shows the support against gravity.
    let gravity = filter.gravity;
    let held = truth.inverse_transform_vector(&-gravity);
    for _ in 0..100 {
        filter.predict(held, Vector3::zeros(), Duration::from_millis(10));
    }
    (shown, uncertainty, filter.velocity.norm())
}

fn main() {
    let (rest, _, still) = observed([0.0, 0.0, 0.0], false);
    let (small, _, _) = observed([0.0, 0.0, 0.01], false);
    let (yaw, uncertainty, _) = observed([0.0, 0.0, 0.5], false);
    let (known, _, _) = observed([0.0, 0.0, 0.5], true);
    let (roll, _, speed) = observed([0.5, 0.0, 0.0], false);
    let yaws = |shown: &[[f32; 3]]| shown.iter().map(|angles| angles[2]).collect::<Vec<_>>();
    println!("SEEN identity: {:.2?}, {still:.2} m/s; yaw of 0.01: {:.3?}; of 0.5: {:.2?}, uncertainty {uncertainty:.3}; known before: {:.2?}; roll of 0.5: {:.2}, {speed:.1} m/s after 1 s", rest[9], yaws(&small), yaws(&yaw), yaws(&known), roll[9][0]);
    assert!(rest[9].iter().all(|angle| angle.abs() < 1e-3) && still < 0.01);
    assert!((known[0][2] - 1.49).abs() < 0.02 && (yaw[9][2] - 0.5).abs() > 1.0 && uncertainty < 0.02);
    assert!((small[9][2] - 0.01).abs() > (small[0][2] - 0.01).abs() && (roll[9][0] - 0.5).abs() > 1.0 && speed > 10.0);
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }

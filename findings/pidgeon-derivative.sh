#!/bin/sh
# pidgeon 0.3.1 (crates.io, PID controller): its derivative filter is 1.6 Hz by default, whatever the loop's rate and gains. derivative_filter_coeff (N, 10) is documented three ways: a cutoff of N / 2 pi relative to the sample rate, N / 2 pi
# times the controller's bandwidth, and the textbook's filter, whose time is kd / (kp N); it is 1 / N seconds. At 1 kHz a joint's damping arrives 100 ms late: with kp = 1600 and kd = 80, which damp a mass of 1 kg critically, a step
# overshoots by 41 % and rings for 2 s; with the textbook's filter it does not. And in DerivativeMode::OnError the derivative is taken of the error after the deadband, where "the derivative term still sees the full signal": in a deadband of
# 0.1 rad a joint that moves at 1 rad/s gets no damping, with OnMeasurement all of it. There is no error.
# Seen on 2026-11-30:  ramp of 1 rad/s at 1 kHz, after 10, 100, 500 ms: 0.09, 0.63, 0.99   at 100 Hz: 0.09, 0.61, 0.99   overshoot of a step: 41 % (textbook's filter: 0 %)   in the deadband: OnError 0.00, OnMeasurement -1.00
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "derivative"
version = "0.0.0"
edition = "2021"

[dependencies]
pidgeon = { version = "=0.3.1", default-features = false }
TOML
cat > src/main.rs <<'RS'
use pidgeon::{pid_compute, ControllerConfig, DerivativeMode, PidState};

fn config(kp: f64, kd: f64, setpoint: f64) -> pidgeon::ControllerConfigBuilder {
    ControllerConfig::builder().with_kp(kp).with_ki(0.0).with_kd(kd).with_setpoint(setpoint).with_output_limits(-1e6, 1e6)
}

/// The derivative's share (-1 is all of it) of a measurement that rises by 1 rad/s, after a time.
fn ramp(rate: f64, time: f64) -> f64 {
    let config = config(0.0, 1.0, 0.0).build().unwrap();
    let (mut state, mut output) = (PidState::default(), 0.0);
    for step in 0..=(time * rate).round() as u32 {
        (output, state) = pid_compute(&config, &state, f64::from(step) / rate, 1.0 / rate).unwrap();
    }
    -output
}

/// The overshoot of a mass of 1 kg after a step of 1 rad, with the package's derivative, or one whose filter's time is kd / (kp * 10).
fn overshoot(textbook: bool) -> f64 {
    let (kp, kd, dt) = (1600.0, 80.0, 1e-3);
    let config = config(kp, kd, 1.0).build().unwrap();
    let (mut state, mut x, mut v, mut most) = (PidState::default(), 0.0f64, 0.0f64, 0.0f64);
    let (mut filtered, mut last) = (0.0, 0.0);
    for _ in 0..3000 {
        let (output, next) = pid_compute(&config, &state, x, dt).unwrap();
        state = next;
        let time = kd / (kp * 10.0);
        filtered += dt / (time + dt) * ((last - x) / dt - filtered);
        last = x;
        v += dt * if textbook { kp * (1.0 - x) + kd * filtered } else { output };
        x += dt * v;
        most = most.max(x);
    }
    most - 1.0
}

/// The output in a deadband, once the filter has settled, of a joint that moves at 1 rad/s.
fn deadband(mode: DerivativeMode) -> f64 {
    let config = config(0.0, 1.0, 0.0).with_deadband(0.1).with_derivative_mode(mode).with_derivative_filter_coeff(1e6).build().unwrap();
    let (mut state, mut output) = (PidState::default(), 0.0);
    for step in 0..100 {
        (output, state) = pid_compute(&config, &state, f64::from(step) * 1e-3 - 0.05, 1e-3).unwrap();
    }
    output
}

fn main() {
    assert_eq!(ControllerConfig::builder().with_output_limits(-1.0, 1.0).build().unwrap().derivative_filter_coeff(), 10.0);
    let fast = [0.01, 0.1, 0.5].map(|time| ramp(1000.0, time));
    let slow = [0.01, 0.1, 0.5].map(|time| ramp(100.0, time));
    let (package, textbook) = (overshoot(false), overshoot(true));
    let (error, measurement) = (deadband(DerivativeMode::OnError), deadband(DerivativeMode::OnMeasurement));
    println!("SEEN ramp at 1 kHz {fast:.2?}, at 100 Hz {slow:.2?}; overshoot {:.1} %, textbook {:.1} %; deadband: OnError {error:.2}, OnMeasurement {measurement:.2}", package * 100.0, textbook * 100.0);
    let expected = |time: f64| 1.0 - (-10.0 * time).exp();
    for (index, time) in [0.01, 0.1, 0.5].into_iter().enumerate() {
        assert!((fast[index] - expected(time)).abs() < 0.01 && (slow[index] - expected(time)).abs() < 0.03);
    }
    assert!((package - 0.41).abs() < 0.02 && textbook < 0.01);
    assert!(error == 0.0 && (measurement + 1.0).abs() < 0.01);
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }

#!/bin/sh
# piddiy 0.1.2 (crates.io, PID controllers): compute_dt(), "adjusting for a variable time step", divides the integral by the time step and multiplies
# the derivative by it, where the sum of the errors has to be multiplied and their difference divided. With calculate_integral() and
# calculate_derivative(), the plain sum and difference, a loop of 100 Hz has an integral that is 10,000 times too large and a derivative that is
# 10,000 times too small; at 10 Hz it is 100 times each, so that gains from one rate do not hold at another. With the _dt and _backward helpers the
# step cancels out, and the result is the plain sum and difference: the integral still grows with the rate and not with the time. A step of zero gives
# an output of zero, and not the last one. compute() with those helpers, as in the README, is right. There is no error.
# Seen on 2026-11-30:  error 1 for 1 s, Ki 1, integral: 10 Hz 100, 100 Hz 10000, 1 kHz 1000000 (1)   with the _dt helper 10, 100, 1000   ramp of 1/s,
# Kd 1: 100 Hz 0.0001 (1)   compute() and the helpers: 1, 1
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "step"
version = "0.0.0"
edition = "2021"

[dependencies]
piddiy = "=0.1.2"
TOML
cat > src/main.rs <<'RS'
use piddiy::PidController;

/// The measurement and the time step.
type Data = (f64, f64);
type Terms = fn(&mut PidController<f64, Data>, Data) -> (f64, f64, f64);

fn plain(pid: &mut PidController<f64, Data>, data: Data) -> (f64, f64, f64) {
    let error = pid.calculate_error(data.0);
    (error, pid.calculate_integral(error), pid.calculate_derivative(error))
}

fn timed(pid: &mut PidController<f64, Data>, data: Data) -> (f64, f64, f64) {
    let error = pid.calculate_error(data.0);
    (error, pid.calculate_integral_dt(error, data.1), pid.calculate_derivative_backward(error, data.1))
}

/// The integral's part of the output after 1 s of an error of 1, and the derivative's part at an error that grows by 1 per second.
fn parts(rate: u32, terms: Terms, with_step: bool) -> (f64, f64) {
    let step = 1.0 / f64::from(rate);
    let run = |ki: f64, kd: f64, error: fn(f64) -> f64| {
        let mut pid = PidController::new();
        pid.compute_fn(terms).set_point(0.0).kp(0.0).ki(ki).kd(kd);
        (1..=rate)
            .map(|update| {
                let data = (-error(f64::from(update) * step), step);
                if with_step {
                    pid.compute_dt(data, step)
                } else {
                    pid.compute(data)
                }
            })
            .last()
            .unwrap()
    };
    (run(1.0, 0.0, |_| 1.0), run(0.0, 1.0, |time| time))
}

fn main() {
    let close = |got: f64, expected: f64| (got - expected).abs() < 1e-6 * expected;
    for rate in [10, 100, 1000] {
        let (sum, difference) = parts(rate, plain, true);
        let (sum_dt, difference_dt) = parts(rate, timed, true);
        let right = parts(rate, timed, false);
        println!("SEEN {rate} Hz, integral and derivative: compute_dt {sum:.0}, {difference:.6}; with the helpers {sum_dt:.0}, {difference_dt:.4}");
        println!("SEEN {rate} Hz, compute and the helpers: {:.2}, {:.2}", right.0, right.1);
        let rate = f64::from(rate);
        assert!(close(sum, rate * rate) && close(difference, 1.0 / rate / rate));
        assert!(close(sum_dt, rate) && close(difference_dt, 1.0 / rate) && close(right.0, 1.0) && close(right.1, 1.0));
    }
    let mut pid = PidController::new();
    pid.compute_fn(plain).set_point(1.0).kp(5.0).ki(0.0).kd(0.0);
    let zero = (pid.compute_dt((0.0, 0.1), 0.1), pid.compute_dt((0.0, 0.0), 0.0));
    println!("SEEN a proportional output, then one with a step of zero: {zero:?}");
    assert_eq!(zero, (5.0, 0.0));
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }

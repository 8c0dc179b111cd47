#!/bin/sh
# discrete_pid 0.3.0 (crates.io): the default values of its PidConfigBuilder are documented as identical to those of PidConfig::default(), and the integral gain is not: PidConfig::default() holds 0.01 per step of 10 ms, that is 1.0 per second,
# and the builder takes its 0.01 for per second. By the way that a controller's configuration is made, an error of 1 has an integral of 10.0 or 0.1 after 10 s; all other values are the same. A controller tuned with the one and moved to the
# other, for a field that only the builder checks, does not settle. There is no error.
# Seen on 2026-11-30:  ki: default 1.00, builder 0.01   output after 10 s of an error of 1: 11.0 and 1.1   kp, kd, time constant and time step: equal
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "defaults"
version = "0.0.0"
edition = "2021"

[dependencies]
discrete_pid = "=0.3.0"
TOML
cat > src/main.rs <<'RS'
use discrete_pid::pid::{PidConfig, PidConfigBuilder, PidController};
use discrete_pid::time::Millis;

/// The output after 10 s of an error of 1.
fn after(config: PidConfig<f64>) -> f64 {
    let mut pid = PidController::<Millis, f64>::new_uninit(config);
    (0..=1000).map(|step| pid.compute(0.0, 1.0, Millis(step * 10), None)).last().unwrap()
}

fn main() {
    let (one, two) = (PidConfig::<f64>::default(), PidConfigBuilder::<f64>::default().build().unwrap());
    let outputs = [after(one), after(two)];
    println!("SEEN ki {:.2} and {:.2}; after 10 s {outputs:.2?}", one.ki(), two.ki());
    assert_eq!((one.kp(), one.kd(), one.filter_tc(), one.sample_time()), (two.kp(), two.kd(), two.filter_tc(), two.sample_time()));
    assert!((one.ki() - 1.0).abs() < 1e-9 && (two.ki() - 0.01).abs() < 1e-9);
    assert!((outputs[0] - 11.0).abs() < 0.05 && (outputs[1] - 1.1).abs() < 0.05);
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }

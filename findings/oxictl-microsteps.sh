#!/bin/sh
# oxictl 0.1.1 (crates.io, control of motors), MicroStepDriver: by its documentation the electrical angle advances by 2 pi / (4 N) with each of the N
# micro-steps of a full step; the code divides a turn by all micro-steps of a revolution. A full step of a motor with 200 of them moves the currents
# by 1.8 degrees instead of 90. The field turns once where it has to turn 50 times, the shaft makes 1/50 of the way, and position_rad() reports all
# of it. There is no error.
# Seen on 2026-11-30:  200 full steps of 16: one full step moves the field by 1.80 degrees (90)   a whole revolution: position 360 degrees, field 360
# (18000), shaft 7.2
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "microsteps"
version = "0.0.0"
edition = "2021"

[dependencies]
oxictl = { version = "=0.1.1", default-features = false, features = ["std", "pid", "motor"] }
TOML
cat > src/main.rs <<'RS'
use oxictl::motor::stepper::micro_step::MicroStepDriver;

fn main() {
    let (full, micro) = (200, 16);
    let mut motor = MicroStepDriver::<f64>::new(full, micro, 1.0);
    motor.step(micro as i32);
    let step = motor.electrical_angle().to_degrees();
    let currents = motor.coil_currents();
    println!("SEEN one full step: field turned by {step:.2} degrees, coils {:.3} and {:.3} (0 and 1 after 90 degrees)", currents.0, currents.1);
    motor.reset();
    motor.step((full * micro) as i32);
    let (field, position) = (motor.electrical_angle().to_degrees(), motor.position_rad().to_degrees());
    // A motor of 200 full steps has 50 turns of the field in one of the shaft.
    let shaft = field / (full as f64 / 4.0);
    println!("SEEN one revolution by position_rad(), {position:.1} degrees: field {field:.1}, shaft {shaft:.1}");
    assert!((step - 1.8).abs() < 1e-6 && (position - 360.0).abs() < 1e-6 && (field - 360.0).abs() < 1e-6);
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }

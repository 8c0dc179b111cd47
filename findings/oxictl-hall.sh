#!/bin/sh
# oxictl 0.1.1 (crates.io, control of motors), HallSensor: is_fault(), "Check for invalid Hall state (fault)", never is true: update() returns before
# it stores a state of 0 or 7, so that a torn cable looks like a motor in its last sector. When the motor turns backwards, the angle between two
# edges is still counted up from the lower end of the sector: theta_e() rises while the rotor falls, wrong by up to 60 degrees, where a
# field-oriented drive has half of its torque left. A motor that stops keeps its last speed for ever, as omega_e() changes at edges only. There is no
# error.
# Seen on 2026-11-30:  fault after the states 0 and 7: false, false   backwards at -104.7 rad/s: rotor 300 to 246, theta 240 to 294   10 s at
# standstill: omega -104.7
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "hall"
version = "0.0.0"
edition = "2021"

[dependencies]
oxictl = { version = "=0.1.1", default-features = false, features = ["std", "pid", "motor"] }
TOML
cat > src/main.rs <<'RS'
use oxictl::motor::encoder::hall::HallSensor;

fn main() {
    let mut sensor = HallSensor::<f64>::new(4, 1.0);
    let (mut worst, mut first, mut last, mut rotor): (f64, f64, f64, f64) = (0.0, 0.0, 0.0, 0.0);
    // Backwards through the sectors 5, 4, 3, 2, 1, 0, 5, 4: 60 degrees in 10 ms.
    for (turn, hall) in [4u8, 6, 2, 3, 1, 5, 4, 6].into_iter().enumerate() {
        let sector = 5 - (turn as i32) % 6;
        for tick in 0..10 {
            sensor.update(hall, 0.001);
            if turn == 7 {
                rotor = 60.0 * f64::from(sector + 1) - 6.0 * f64::from(tick);
                last = sensor.theta_e().to_degrees();
                first = if tick == 0 { last } else { first };
                worst = worst.max((last - rotor).abs());
            }
        }
    }
    let speed = sensor.omega_e();
    println!("SEEN backwards at {speed:.1} rad/s: rotor 300 to {rotor:.0}, theta {first:.0} to {last:.0}, off by up to {worst:.0} degrees");
    assert!(speed < -100.0 && last > first + 50.0 && worst > 50.0);
    for _ in 0..10_000 {
        sensor.update(6, 0.001);
    }
    println!("SEEN after 10 s at standstill: omega {:.1}", sensor.omega_e());
    assert!(sensor.omega_e() < -100.0);
    let faults = [0u8, 7].map(|hall| {
        sensor.update(hall, 0.001);
        sensor.is_fault()
    });
    println!("SEEN is_fault() after the states 0 and 7: {faults:?}");
    assert_eq!(faults, [false, false]);
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }

#!/bin/sh
# stepgen 0.1.3 (crates.io, ramps of a stepper motor): at a speed that needs no ramp, current_speed() and is_at_speed() are wrong. A target below the
# speed of the first step of the ramp (33 steps/s at 1,000 steps/s^2) is driven at once, at the right rate, but the generator does not note it: from
# rest, current_speed() is 0 and is_at_speed() false for as long as the motor turns, and after a ramp down to it, current_speed() stays at the ramp's
# last value, 33 for 20 steps/s. The documentation says "estimated current speed" and "If we are running at target speed". A loop that waits until the
# speed is reached waits until the target step, and one that takes 0 for standing still lets go of a brake or an enable line in motion. There is no
# error.
# Seen on 2026-12-01:  target 20 steps/s from rest: delay 50000 us, current_speed 0, at speed false   after 400 steps/s: delay 50000 us, 33, false
#                      target 400 steps/s: delay 2500 us, 400, true
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "slow"
version = "0.0.0"
edition = "2021"

[dependencies]
stepgen = "=0.1.3"
TOML
cat > src/main.rs <<'RS'
use stepgen::Stepgen;

/// The delay in us, current_speed() in steps/s and is_at_speed() after so many steps.
fn after(motor: &mut Stepgen, steps: usize) -> (u32, u32, bool) {
    let delay = motor.nth(steps - 1).unwrap();
    (delay >> 8, motor.current_speed() >> 8, motor.is_at_speed())
}

fn main() {
    let target = |motor: &mut Stepgen, speed: u32| motor.set_target_speed(speed << 8).unwrap();
    let start = |speed| {
        let mut motor = Stepgen::new(1_000_000);
        motor.set_acceleration(1000 << 8).unwrap();
        target(&mut motor, speed);
        motor.set_target_step(2000).unwrap();
        motor
    };
    let mut motor = start(20);
    let slow = after(&mut motor, 100);
    println!("SEEN target 20 steps/s from rest: delay {} us, current_speed {}, at speed {}", slow.0, slow.1, slow.2);
    assert_eq!(slow, (50_000, 0, false));

    let mut motor = start(400);
    let fast = after(&mut motor, 300);
    target(&mut motor, 20);
    let down = after(&mut motor, 300);
    println!("SEEN target 400: delay {} us, current_speed {}, at speed {}   then 20: {} us, {}, {}", fast.0, fast.1, fast.2, down.0, down.1, down.2);
    assert_eq!(fast, (2_500, 400, true));
    assert_eq!((down.0, down.2), (50_000, false));
    assert!((32..=34).contains(&down.1));

    // A slow target above the first step's speed is right.
    let mut motor = start(50);
    let above = after(&mut motor, 100);
    println!("SEEN target 50 steps/s: delay {} us, current_speed {}, at speed {}", above.0, above.1, above.2);
    assert_eq!(above, (20_000, 50, true));
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }

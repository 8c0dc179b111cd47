#!/bin/sh
# accel-stepper 0.1.0 (crates.io, a port of Arduino's AccelStepper): the direction of a step comes from where the goal is, not from the sign of the speed. A motor that runs forward at 500 steps/s and gets a goal on its other side takes
# its next step backward, 500 steps/s the other way within one step, where the original brakes first, with the acceleration that was set: 5 s at 100 steps/s^2. A stepper that loses steps there loses its position. And
# a constant speed has no direction: after set_speed(50.0), "the desired constant speed", poll_at_constant_speed() takes one step backward and the next one forward, for ever, as it does after set_speed(-50.0). There is no error.
# Seen on 2026-11-30:  at +500 steps/s, new goal 0: next step backward after 2.0 ms (braking at 100 steps/s^2 takes 1,250 steps)   set_speed(50), 100 steps: positions 0 and -1   set_speed(-50): 0 and -1
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "direction"
version = "0.0.0"
edition = "2021"

[dependencies]
accel-stepper = "=0.1.0"
TOML
cat > src/main.rs <<'RS'
use accel_stepper::{func_device, Driver, SystemClock};
use std::cell::Cell;
use std::time::Duration;

/// A clock that a test sets.
struct Clock(Cell<u64>);

impl SystemClock for Clock {
    fn elapsed(&self) -> Duration {
        Duration::from_micros(self.0.get())
    }
}

/// The least and the greatest position of 100 steps at a constant speed.
fn constant(speed: f32) -> (i64, i64) {
    let (clock, mut axis) = (Clock(Cell::new(1_000_000)), Driver::new());
    axis.set_max_speed(500.0);
    axis.set_speed(speed);
    let (mut steps, mut least, mut most) = (0, 0, 0);
    while steps < 100 {
        clock.0.set(clock.0.get() + 100);
        if axis.poll_at_constant_speed(func_device(|| (), || ()), &clock).unwrap() {
            steps += 1;
        }
        (least, most) = (axis.current_position().min(least), axis.current_position().max(most));
    }
    (least, most)
}

fn main() {
    let (clock, mut axis) = (Clock(Cell::new(0)), Driver::new());
    axis.set_max_speed(500.0);
    axis.set_acceleration(100.0);
    axis.move_to(100_000);
    // One device throughout: it counts the steps by their direction.
    let steps = Cell::new(0i64);
    let mut device = func_device(|| steps.set(steps.get() + 1), || steps.set(steps.get() - 1));
    let mut poll = |axis: &mut Driver, most: u64| -> Option<i64> {
        let (from, before) = (clock.0.get(), steps.get());
        while steps.get() == before && clock.0.get() - from < most {
            clock.0.set(clock.0.get() + 50);
            axis.poll(&mut device, &clock).unwrap();
        }
        (steps.get() != before).then_some(steps.get() - before)
    };
    while axis.current_position() < 5_000 {
        assert_eq!(poll(&mut axis, 10_000_000), Some(1));
    }
    let speed = axis.speed();
    axis.move_to(0);
    let from = clock.0.get();
    let step = poll(&mut axis, 10_000_000).unwrap();
    let after = (clock.0.get() - from) as f64 / 1e3;
    let mut reversed = 0;
    for _ in 0..100 {
        reversed += poll(&mut axis, 10_000_000).unwrap();
    }
    let took = (clock.0.get() - from) as f64 / 1e6;
    let braking = f64::from(speed).powi(2) / (2.0 * 100.0);
    let (positive, negative) = (constant(50.0), constant(-50.0));
    println!("SEEN at {speed:.0} steps/s, new goal 0: step {step} after {after:.1} ms, {reversed} steps by {took:.2} s (braking takes {braking:.0} steps); constant speed 50, positions in 100 steps: {positive:?}, -50: {negative:?}");
    assert!((speed - 500.0).abs() < 1.0 && step == -1 && after < 2.2 && reversed == -100);
    assert!(positive == (-1, 0) && negative == (-1, 0));
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }

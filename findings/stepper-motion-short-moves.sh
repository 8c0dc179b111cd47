#!/bin/sh
# stepper-motion 0.1.1 (crates.io): a move that is too short to reach the highest speed reaches it all the same. The two halves of its triangle run
# from the first interval to that of max_velocity, whatever the way, where the peak is sqrt(a * way): 20 steps at 1000 steps/s2 go up to 10000
# steps/s instead of 141, within 10 steps, and a real motor falls out of step on each small correction. With unlike rates the halves are swapped: the
# faster acceleration gets the longer way. estimated_duration_secs() counts the whole ramp to max_velocity, 20 s. There is no error.
# Seen on 2026-11-30:  20 steps, 10000 steps/s, 1000 steps/s2: peak 10000 steps/s, 95700900 steps/s2   intervals 0.225 s, estimate 20.0 s   rates
# 4000 and 1000: 16 and 4 steps
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "short"
version = "0.0.0"
edition = "2021"

[dependencies]
stepper-motion = "=0.1.1"
TOML
cat > src/main.rs <<'RS'
use stepper_motion::MotionProfile;

fn main() {
    let (steps, top, rate) = (20, 10_000.0, 1000.0);
    let profile = MotionProfile::symmetric_trapezoidal(steps, top, rate);
    let intervals: Vec<u32> = (0..steps as u32).map(|step| profile.interval_at(step)).collect();
    let shortest = *intervals.iter().min().unwrap();
    let (peak, fits) = (1e9 / f64::from(shortest), (f64::from(rate) * steps as f64).sqrt());
    let total = intervals.iter().map(|&interval| f64::from(interval) / 1e9).sum::<f64>();
    println!("SEEN {steps} steps: {} up, {} down, peak {peak:.0} steps/s; {fits:.0} fit", profile.accel_steps, profile.decel_steps);
    println!("SEEN sum of the intervals {total:.3} s, estimate {:.1} s", profile.estimated_duration_secs());
    // The change of speed from one step to the next asks for an acceleration far above the limit.
    let asked = intervals.windows(2).map(|pair| {
        let (before, after) = (1e9 / f64::from(pair[0]), 1e9 / f64::from(pair[1]));
        ((after - before) / (f64::from(pair[0]) / 1e9)).abs()
    });
    let asked = asked.fold(0.0, f64::max);
    println!("SEEN acceleration asked for: {asked:.0} steps/s2, limit {rate}");
    assert!(peak > 9000.0 && fits < 142.0 && asked > 1000.0 * f64::from(rate) && profile.estimated_duration_secs() > 19.0);

    let quick = MotionProfile::asymmetric_trapezoidal(steps, top, 4000.0, 1000.0);
    println!("SEEN acceleration 4000, deceleration 1000: {} steps up, {} down", quick.accel_steps, quick.decel_steps);
    assert_eq!((quick.accel_steps, quick.decel_steps), (16, 4));
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }

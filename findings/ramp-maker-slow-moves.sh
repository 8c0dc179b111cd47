#!/bin/sh
# ramp-maker 0.2.0 (crates.io, the profiles of the crate stepper): "the velocity will always be equal to or less than the maximum velocity", and a slow move is a fast one: below the root of twice the acceleration, which is its first
# step's velocity, the trapezoidal profile does not go. With 6,000 steps/s^2 each maximum below 109.5 steps/s is 109.5: a homing move at 10 steps/s, toward a switch, goes at 11 times that, from the first step to the last; with
# 50,000 it is 316. The higher the acceleration, the faster the slowest move. Flat, the other profile, keeps to the maximum. There is no error.
# Seen on 2026-11-30:  at 6000 steps/s^2, maximum 10, 50, 109, 200: 109.5, 109.5, 109.5, 200.0 steps/s   at 50000, maximum 10: 316.2   200 steps at 10 steps/s: 1.83 s (20 s)   Flat, maximum 10: 10.0
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "slow"
version = "0.0.0"
edition = "2021"

[dependencies]
ramp-maker = { version = "=0.2.0", features = ["libm"] }
TOML
cat > src/main.rs <<'RS'
use ramp_maker::{Flat, MotionProfile, Trapezoidal};

/// The greatest velocity of a move of 200 steps, the number of its steps and its time.
fn moved<P: MotionProfile<Velocity = f32, Delay = f32>>(mut profile: P, most: f32) -> (f32, usize, f32) {
    profile.enter_position_mode(most, 200);
    let mut delays = Vec::new();
    while let Some(delay) = profile.next_delay() {
        delays.push(delay);
    }
    (delays.iter().map(|delay| 1.0 / delay).fold(0.0, f32::max), delays.len(), delays.iter().sum())
}

fn main() {
    let most = [10.0, 50.0, 109.0, 200.0].map(|most| moved(Trapezoidal::<f32>::new(6000.0), most));
    let steep = moved(Trapezoidal::<f32>::new(50000.0), 10.0);
    let flat = moved(Flat::<f32>::new(), 10.0);
    println!("SEEN maximum 10, 50, 109, 200 (steps/s, steps, s): {most:.1?}; at 50000 steps/s^2, 10: {steep:.1?}; flat: {flat:.1?}");
    assert!(most[..3].iter().all(|seen| (seen.0 - 12000f32.sqrt()).abs() < 0.1) && (most[3].0 - 200.0).abs() < 0.1);
    assert!(most.iter().all(|seen| seen.1 == 200) && (most[0].2 - 1.83).abs() < 0.01);
    assert!((steep.0 - 316.2).abs() < 0.1 && (flat.0 - 10.0).abs() < 1e-3 && (flat.2 - 20.0).abs() < 0.01);
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }

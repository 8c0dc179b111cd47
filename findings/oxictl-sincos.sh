#!/bin/sh
# oxictl 0.1.1 (crates.io, control of motors), SincosEncoder: the calibration "as the encoder rotates through a full cycle" does not wait for a
# cycle. As soon as a channel has moved by 0.1, the ends of that piece are taken for the ends of the sine, and the search starts over. A perfect pair
# of sine and cosine is read rightly at first; within one turn the gains go to 1000 and the offsets follow the signal, and the angle is off by up to
# 169 degrees from then on, in each turn. The documentation has it converge "over several full rotations", and it cannot be switched off. There is no
# error.
# Seen on 2026-11-30:  1000 samples a turn, turns 2 to 5: worst error 168.9 degrees   36 degrees read as 121.2, 72 as 121.6, 108 as -120.3   speed
# from -25.9 to 189.1 rad/s, true 6.28
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "encoder"
version = "0.0.0"
edition = "2021"

[dependencies]
oxictl = { version = "=0.1.1", default-features = false, features = ["std", "pid", "motor"] }
TOML
cat > src/main.rs <<'RS'
use oxictl::motor::encoder::sincos::SincosEncoder;
use std::f64::consts::{PI, TAU};

fn main() {
    let mut encoder = SincosEncoder::<f64>::new(100.0);
    let (mut worst, mut slowest, mut fastest): (f64, f64, f64) = (0.0, f64::MAX, f64::MIN);
    for sample in 0..5000 {
        let angle = TAU * f64::from(sample) / 1000.0;
        encoder.update(angle.sin(), angle.cos(), 0.001);
        let off = (encoder.angle - angle + PI).rem_euclid(TAU) - PI;
        if sample >= 1000 {
            worst = worst.max(off.abs());
            slowest = slowest.min(encoder.velocity);
            fastest = fastest.max(encoder.velocity);
        }
        if sample == 1 || (1000..1500).contains(&sample) && sample % 100 == 0 {
            let (offset, gain) = (encoder.sin_offset, encoder.sin_gain);
            println!("SEEN {:.1} degrees read as {:.1}; offset {offset:.2}, gain {gain:.0}", angle.to_degrees() % 360.0, encoder.angle_deg());
        }
    }
    println!("SEEN worst error {:.1} degrees; speed from {slowest:.1} to {fastest:.1} rad/s, true 6.28", worst.to_degrees());
    assert!(worst.to_degrees() > 150.0 && slowest < 0.0 && fastest > 100.0);
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }

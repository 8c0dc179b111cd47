#!/bin/sh
# servo-pio 0.2.1 (crates.io, servos on the RP2040), of its Rust file calibration.rs as it is: a servo with the README's calibration never turns to a
# negative angle. In AngularCalibration::default() the lowest point and the middle one are exchanged: "min" is 0 degrees at 1500 us and "mid" -90 at
# 500. With limit_lower(), which the README sets and Calibration::new() too, everything below the lowest point is put on it: each angle from -90 to 0
# becomes 0 degrees, 1500 us. Without limit_lower() the same angles are right. mid_value(), the middle of the range, is 45. pulse_to_value(1000) gives
# 0 degrees. ContinuousCalibration::default() is exchanged as well: a wheel that is told to turn backward stands still. Positive values are right.
# There is no error, and a joint that should swing to both sides swings to one.
# Seen on 2026-12-01:  README's calibration: -80 degrees 1500 us, -45 1500, 45 2000   no limits: -80 611, -45 1000   mid_value 45   continuous: -0.5
#                      1500, 0.5 2000
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "negative"
version = "0.0.0"
edition = "2021"

# The package builds for the RP2040 only, so that it is fetched here, and its file without hardware is taken from it.
[target.'cfg(target_os = "none")'.dependencies]
servo-pio = "=0.2.1"
TOML
cat > src/main.rs <<'RS'
#[allow(dead_code, unexpected_cfgs)]
mod calibration;

use calibration::{AngularCalibration, Calibration, ContinuousCalibration};

fn main() {
    let readme = Calibration::builder(AngularCalibration::default()).limit_lower().limit_upper().build();
    let free = Calibration::builder(AngularCalibration::default()).build();
    let angles = [-80.0, -45.0, -1.0, 0.0, 45.0];
    let limited = angles.map(|angle| readme.value_to_pulse(angle).pulse.round());
    let unlimited = angles.map(|angle| free.value_to_pulse(angle).pulse.round());
    println!("SEEN pulses for {angles:?}: README's calibration {limited:?}, no limits {unlimited:?}");
    assert_eq!(limited, [1500.0, 1500.0, 1500.0, 1500.0, 2000.0]);
    assert_eq!(unlimited, [611.0, 1000.0, 1489.0, 1500.0, 2000.0]);

    let back = readme.pulse_to_value(1000.0).unwrap().value;
    println!("SEEN mid_value {}, pulse_to_value(1000) {back}", readme.mid_value());
    assert_eq!((readme.mid_value(), back), (45.0, 0.0));

    let wheel = Calibration::builder(ContinuousCalibration::default()).limit_lower().limit_upper().build();
    let speeds = [-1.0, -0.5, 0.0, 0.5].map(|speed| wheel.value_to_pulse(speed).pulse);
    println!("SEEN pulses of a wheel for -1, -0.5, 0, 0.5: {speeds:?}");
    assert_eq!(speeds, [1500.0, 1500.0, 1500.0, 2000.0]);
}
RS
cargo fetch -q 2>err.txt || { tail -n 20 err.txt; exit 1; }
manifest=$(cargo metadata -q --format-version 1 | python3 -c 'import json, sys
print(next(package["manifest_path"] for package in json.load(sys.stdin)["packages"] if package["name"] == "servo-pio"))')
cp "${manifest%Cargo.toml}src/calibration.rs" src/
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }

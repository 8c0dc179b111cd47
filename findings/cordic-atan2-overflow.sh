#!/bin/sh
# cordic 0.1.5, fixed 1.31.0 (crates.io): atan2(y, x) divides y by x first, in the same fixed-point type, and near 90 degrees the quotient does not fit. In a release build, as on a microcontroller, it wraps: in I4F28, which holds
# all angles, 472 of 3600 directions of a unit vector are off by more than 0.01 rad, most by 1 to 3.3 rad: -89.95 degrees becomes +100. In I8F24 there are 28. A Park angle or a heading jumps there. atan() of a large number
# overflows too: atan(-127) in I8F24 is -0.75, and atan(-20220) in I16F16 -1.74, beyond -90 degrees. A build with overflow checks stops instead. I16F16 is right for all directions of a unit vector.
# Seen on 2026-11-30:  off by more than 0.01 rad, of 3600: I4F28 472, I8F24 28, I16F16 0   atan2 at -89.95 degrees, I4F28: 99.9 degrees   atan(-127) I8F24: -0.755   atan(-20220) I16F16: -1.743
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "direction"
version = "0.0.0"
edition = "2024"

[dependencies]
cordic = "=0.1.5"
fixed = "=1.31.0"
TOML
cat > src/main.rs <<'RS'
use cordic::{CordicNumber, atan, atan2};
use fixed::types::{I4F28, I8F24, I16F16};

/// Directions, of 3600, whose angle is off by more than 0.01 rad.
fn off<T: CordicNumber + fixed::traits::Fixed>() -> usize {
    let directions = (0..3600).map(|step| (f64::from(step) - 1799.5).to_radians() / 10.0);
    directions.filter(|angle| {
        let (y, x) = (T::from_num(angle.sin()), T::from_num(angle.cos()));
        (atan2(y, x).to_num::<f64>() - angle).abs() > 0.01
    }).count()
}

fn main() {
    let counts = [off::<I4F28>(), off::<I8F24>(), off::<I16F16>()];
    let angle = (-89.95_f64).to_radians();
    let jumped = atan2(I4F28::from_num(angle.sin()), I4F28::from_num(angle.cos())).to_num::<f64>().to_degrees();
    let steep = [atan(I8F24::from_num(-127)).to_num::<f64>(), atan(I16F16::from_num(-20220)).to_num::<f64>()];
    println!("SEEN off: {counts:?}, -89.95 degrees: {jumped:.1}, atan: {:.3}, {:.3}", steep[0], steep[1]);
    assert_eq!(counts, [472, 28, 0]);
    assert!((jumped - 99.9).abs() < 0.1);
    assert!((steep[0] + 0.755).abs() < 0.001 && (steep[1] + 1.743).abs() < 0.001);
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }

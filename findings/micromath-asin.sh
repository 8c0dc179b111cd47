#!/bin/sh
# micromath 2.1.0 (crates.io): asin is off by up to 1 degree, and acos with it, where atan2 of the same angle is right to 0.2 degrees: a pitch or a knee's angle by asin(0.5) is 30.75 degrees (30), and acos(0.5) 60.09 (60). They use the crate's
# approximate square root, of 1.5 for 2. atan2(0, 0) is NaN, and 0 in libm and C: a heading of a vector at rest, as of a joystick or a stopped wheel, turns all that is computed from it into NaN. atan2(-0, -1) is +180 degrees,
# and round, floor and ceil of a number beyond 2^31 stay at 2^31, where trunc gives the number. There is no error.
# Seen on 2026-11-30:  asin(0.5) 30.75, acos(0.5) 60.09, sum 90.85 degrees   worst asin 1.03 degrees, atan2 0.16   sqrt(2) 1.5   atan2(0, 0) NaN   floor(3e9) 2147483648, trunc(3e9) 3000000000
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "angles"
version = "0.0.0"
edition = "2021"

[dependencies]
micromath = "=2.1.0"
TOML
cat > src/main.rs <<'RS'
use micromath::F32Ext;

/// The largest error in degrees over the angles from -90 to 90 degrees.
fn worst(angle: impl Fn(f32, f32) -> f32) -> f32 {
    let angles = (-900..=900).map(|step| (step as f32 / 10.0).to_radians());
    angles.map(|right| (angle(f32::sin(right), f32::cos(right)) - right).to_degrees().abs()).fold(0.0, f32::max)
}

fn main() {
    let (asin, acos) = (F32Ext::asin(0.5_f32).to_degrees(), F32Ext::acos(0.5_f32).to_degrees());
    let errors = (worst(|sin, _| F32Ext::asin(sin)), worst(|sin, cos| F32Ext::atan2(sin, cos)));
    let rest = F32Ext::atan2(0.0_f32, 0.0);
    let reversed = F32Ext::atan2(-0.0_f32, -1.0).to_degrees();
    let (floor, trunc) = (F32Ext::floor(3e9_f32), F32Ext::trunc(3e9_f32));
    println!("SEEN asin {asin:.2}, acos {acos:.2}, sum {:.2}, worst {errors:.2?}, sqrt(2) {}, atan2(0, 0) {rest}, atan2(-0, -1) {reversed:.0}, floor {floor}, trunc {trunc}", asin + acos, F32Ext::sqrt(2.0_f32));
    assert!((asin - 30.75).abs() < 0.01 && (acos - 60.09).abs() < 0.01);
    assert!(errors.0 > 1.0 && errors.1 < 0.25);
    assert_eq!(F32Ext::sqrt(2.0_f32), 1.5);
    assert!(rest.is_nan() && reversed > 179.0);
    assert!(floor < 2.2e9 && trunc == 3e9);
}
RS
cargo run -q 2>err.txt || { tail -n 20 err.txt; exit 1; }

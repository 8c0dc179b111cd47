#!/bin/sh
# oxictl 0.1.1 (crates.io, control of motors), feature fixed_point "for PID-style control on MCUs without FPU": fixed_from_f32_saturating(),
# "saturating on overflow", does not saturate. With the release profile 40000 becomes -25536 and 65536 becomes 0; with the development profile the
# program panics. The same holds for q15_16_from_int(), "saturating if out of range", and for the other two formats. A setpoint or a measurement just
# above the range reaches the controller with the other sign, while the operators of the same types do saturate.
# Seen on 2026-11-30:  release: 40000 -> -25536   -40000 -> 25536   65536 -> 0   q15_16_from_int(40000) -> -25536   Q3_29 of 5.0 -> -3   sum 32767 +
# 7233 -> 32768
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "saturating"
version = "0.0.0"
edition = "2021"

[dependencies]
oxictl = { version = "=0.1.1", default-features = false, features = ["std", "pid", "fixed_point"] }
TOML
cat > src/main.rs <<'RS'
use oxictl::core::fixed_point::convert::{q15_16_from_int, q3_29_from_f32, q3_29_to_f32};
use oxictl::core::fixed_point::{fixed_from_f32_saturating, fixed_to_f32};

fn main() {
    let values = [32767.0, 40000.0, -40000.0, 65536.0].map(|value| fixed_to_f32(fixed_from_f32_saturating(value)));
    let (whole, small) = (fixed_to_f32(q15_16_from_int(40_000)), q3_29_to_f32(q3_29_from_f32(5.0)));
    let sum = fixed_to_f32(fixed_from_f32_saturating(32767.0) + fixed_from_f32_saturating(7233.0));
    println!("SEEN 32767, 40000, -40000, 65536 become {values:?}; 40000 as an integer {whole}; Q3_29 of 5.0: {small}; 32767 + 7233: {sum}");
    assert_eq!((values, whole, small), ([32767.0, -25536.0, 25536.0, 0.0], -25536.0, -3.0));
    assert!(sum > 32767.9);
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }

#!/bin/sh
# float8 0.7.0 (crates.io, numbers of 8 bits for quantized weights): the largest finite numbers are its infinities. E4M3 ends at 448 and E5M2 at
# 57,344; F8E4M3::MAX is 416 and F8E5M2::MAX 49,152, and for the numbers above them is_infinite() is true and is_finite() false. A tensor that is
# scaled to its largest weight, as all are, has such a number, and a check for broken weights finds it; clamp() to MIN and MAX makes it 7 % smaller.
# The true infinity of E5M2, 0x7C as other packages write it, has is_infinite() false and is_finite() true, while to_f32() gives an infinity. By the
# documentation, a number that is too large becomes an infinity: 1e6 and f32's infinity become 448, so that the overflow of a network is a usual
# number afterwards. There is no error.
# Seen on 2026-11-30:  448: is_infinite true, to_f32 448   MAX 416 (448), 49152 (57344)   from f32's infinity: 448   E5M2 0x7C: is_infinite false,
# is_finite true, to_f32 inf
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "infinity"
version = "0.0.0"
edition = "2021"

[dependencies]
float8 = "=0.7.0"
half = "=2.7.1"
TOML
cat > src/main.rs <<'RS'
use float8::{F8E4M3, F8E5M2};

fn main() {
    let (largest, wide) = (F8E4M3::from_f32(448.0), F8E5M2::from_f32(57_344.0));
    println!(
        "SEEN 448: {} is_infinite {} is_finite {}; 57344: {} is_infinite {}",
        largest.to_f32(),
        largest.is_infinite(),
        largest.is_finite(),
        wide.to_f32(),
        wide.is_infinite()
    );
    println!(
        "SEEN MAX {} and {}, INFINITY {} and {}",
        F8E4M3::MAX.to_f32(),
        F8E5M2::MAX.to_f32(),
        F8E4M3::INFINITY.to_f32(),
        F8E5M2::INFINITY.to_f32()
    );
    let clamped = largest.clamp(F8E4M3::MIN, F8E4M3::MAX).to_f32();
    let overflow = [1e6, f32::INFINITY, f32::NEG_INFINITY].map(|value| F8E4M3::from_f32(value).to_f32());
    println!("SEEN 448 clamped: {clamped}; 1e6 and the infinities: {overflow:?}, E5M2: {}", F8E5M2::from_f32(f32::INFINITY).to_f32());
    let foreign = F8E5M2::from_bits(0x7C);
    println!(
        "SEEN E5M2 0x7C: to_f32 {} is_infinite {} is_finite {} is_nan {}",
        foreign.to_f32(),
        foreign.is_infinite(),
        foreign.is_finite(),
        foreign.is_nan()
    );
    // A tensor that is scaled to its largest weight.
    let weights = [0.3f32, -1.7, 0.02, 1.1];
    let scale = weights.iter().fold(0.0f32, |most, weight| most.max(weight.abs())) / 448.0;
    let broken = weights.iter().filter(|&weight| !F8E4M3::from_f32(weight / scale).is_finite()).count();
    println!("SEEN weights that are not finite: {broken} of {}", weights.len());
    assert!(largest.to_f32() == 448.0 && largest.is_infinite() && !largest.is_finite() && wide.is_infinite() && wide.to_f32() == 57_344.0);
    assert!(F8E4M3::MAX.to_f32() == 416.0 && F8E5M2::MAX.to_f32() == 49_152.0 && clamped == 416.0 && overflow == [448.0, 448.0, -448.0]);
    assert!(foreign.to_f32() == f32::INFINITY && !foreign.is_infinite() && foreign.is_finite() && broken == 1);
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }

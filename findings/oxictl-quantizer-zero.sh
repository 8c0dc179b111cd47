#!/bin/sh
# oxictl 0.1.1 (crates.io, control of motors), UniformQuantizer, "Uniform (mid-tread) quantizer with 2^bits levels": a mid-tread quantizer has a
# level at zero, and this one has none for any range that is symmetric about it. The 2^bits levels go from end to end, zero lies between the middle
# two, and the upper one is taken: quantize(0.0) of -1 .. 1 is 1/3 with 2 bits and 1/7 with 3. A motor whose command is zero runs with a third of its
# range, and for -0.01 with a third the other way. There is no error.
# Seen on 2026-11-30:  quantize(0.0), quantize(-0.01) of -1 .. 1: 1 bit 1, -1   2 bits 0.333, -0.333   3 bits 0.143, -0.143   4 bits 0.067, -0.067
# 8 bits 0.004, -0.012
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "quantizer"
version = "0.0.0"
edition = "2021"

[dependencies]
oxictl = { version = "=0.1.1", default-features = false, features = ["std", "comm"] }
TOML
cat > src/main.rs <<'RS'
use oxictl::comm::quantizer::UniformQuantizer;

fn main() {
    for bits in [1u8, 2, 3, 4, 8] {
        let quantizer = UniformQuantizer::<f64>::new(bits, -1.0, 1.0).unwrap();
        let (zero, below) = (quantizer.quantize(0.0), quantizer.quantize(-0.01));
        println!("SEEN {bits} bits: 0.0 becomes {zero:.3}, -0.01 becomes {below:.3}, step {:.3}", quantizer.delta());
        assert!((zero - quantizer.delta() / 2.0).abs() < 1e-9);
        assert!(bits == 8 || (below + quantizer.delta() / 2.0).abs() < 1e-9);
    }
}
RS
cargo run --release -q 2>err.txt || { tail -n 20 err.txt; exit 1; }

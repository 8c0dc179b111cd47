#!/bin/sh
# ml_dtypes 0.6.0, numpy 2.4.6, half 2.7.1 (crates.io): a float64 just above the middle of two small floats has to become the upper one. numpy's float16 does; ml_dtypes rounds to float32 first, where the rest vanishes, and the middle
# then goes to the even one: an array's astype() to float8, float6, float4 or bfloat16 takes the lower one, while the scalar constructor (but for bfloat16) takes the upper one: one value has two codes in one package.
# half drops the low 32 bits of the float64 in from_f64_const() and rounds to float32 first in from_f64() where the processor converts: 65519.9999999 is 65504 by the one and infinity by the other. There is no error.
# Seen on 2026-11-30:  float8_e4m3fn of 1.0625 + 2^-40: array 1.0, scalar 1.125   float8_e5m2 1.0, 1.25   float4_e2m1fn 1.0, 1.5   bfloat16 1.0, 1.0 (1.0078)   f16 of 1 + 2^-11 + 2^-30: half 1, numpy 1.001   65519.9999999: 65504 and inf
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q ml_dtypes==0.6.0 numpy==2.4.6
v/bin/python -W ignore - <<'PY'
import ml_dtypes
import numpy as np

for name, bits in (("float8_e4m3fn", 3), ("float8_e5m2", 2), ("float8_e4m3fnuz", 3), ("float6_e2m3fn", 3), ("float4_e2m1fn", 1), ("bfloat16", 7)):
    kind = getattr(ml_dtypes, name)
    value, upper = 1 + 2.0 ** -(bits + 1) + 2.0**-40, 1 + 2.0**-bits
    array, scalar = float(np.array([value]).astype(kind)[0]), float(kind(value))
    print(f"SEEN {name}: array {array}, scalar {scalar}, right {upper}")
    assert array == 1.0
    assert scalar == (1.0 if name == "bfloat16" else upper)
assert float(np.array([1 + 2.0**-11 + 2.0**-40]).astype(np.float16)[0]) == 1 + 2.0**-10
assert float(np.float64(65519.9999999).astype(np.float16)) == 65504
PY
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "rounding"
version = "0.0.0"
edition = "2021"

[dependencies]
half = "=2.7.1"
TOML
cat > src/main.rs <<'RS'
use half::f16;

fn main() {
    let above = 1.0 + 2_f64.powi(-11) + 2_f64.powi(-30);
    let (plain, constant) = (f16::from_f64(above).to_f64(), f16::from_f64_const(above).to_f64());
    let largest = [f16::from_f64(65519.9999999), f16::from_f64_const(65519.9999999)].map(f16::to_f64);
    println!("SEEN half: 1 + 2^-11 + 2^-30: {plain} and {constant}, 65519.9999999: {largest:?}");
    assert_eq!([plain, constant], [1.0, 1.0]);
    assert_eq!(largest[1], 65504.0);
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("f16c") {
        assert_eq!(largest[0], f64::INFINITY);
    }
}
RS
cargo run -q 2>err.txt || { tail -n 20 err.txt; exit 1; }

#!/bin/sh
# fixed 1.31.0 (crates.io), fxpmath 0.4.10, apytypes 0.5.1, spfpm 1.8.0, numpy 2.4.6: four packages make other codes of one value in one fixed-point format (8 bits, 4 of them after the point), as they are by
# default. fixed rounds to the nearest, halves to even; apytypes and spfpm halves up; fxpmath toward zero. Beyond the largest value, 7.94, fxpmath stays there, fixed and spfpm refuse, and apytypes wraps without
# an error: 8.5 is -7.5, and 7.99, less than a step beyond, is -8. Weights or gains that were converted in Python and those that firmware converts differ by a code, or by the sign.
# Seen on 2026-11-29:  -0.3 1/32 3/32 7.99 8.5: fixed -5 0 2 refused refused   spfpm -5 1 2 refused refused   apytypes -5 1 2 -128 -120   fxpmath -4 0 1 127 127
# It needs cargo.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
mkdir src; cat > Cargo.toml <<'TOML'
[package]
name = "codes"
version = "0.0.0"
edition = "2024"

[dependencies]
fixed = "=1.31.0"
TOML
cat > src/main.rs <<'RS'
use fixed::types::I4F4;

fn main() {
    for value in [-0.3, 1.0 / 32.0, 3.0 / 32.0, 7.99, 8.5] {
        println!("{}", I4F4::checked_from_num(value).map_or("refused".into(), |code| code.to_bits().to_string()));
    }
}
RS
cargo run -q > fixed.txt 2>err.txt || { tail -n 20 err.txt; exit 1; }
python3 -m venv v && v/bin/pip install -q fxpmath==0.4.10 apytypes==0.5.1 spfpm==1.8.0 numpy==2.4.6
v/bin/python -W ignore - <<'PY'
import FixedPoint
from apytypes import APyFixed
from fxpmath import Fxp


def spfpm(value):
    try:
        return FixedPoint.FXnum(value, FixedPoint.FXfamily(4, 4)).scaledval
    except FixedPoint.FXoverflowError:
        return "refused"


values = (-0.3, 1 / 32, 3 / 32, 7.99, 8.5)
seen = {
    "fixed": [word if word == "refused" else int(word) for word in open("fixed.txt").read().split()],
    "spfpm": [spfpm(value) for value in values],
    "apytypes": [round(float(APyFixed.from_float(value, int_bits=4, frac_bits=4)) * 16) for value in values],
    "fxpmath": [int(Fxp(value, signed=True, n_word=8, n_frac=4).val) for value in values],
}
for name, codes in seen.items():
    print(f"{name}:", *codes)
assert seen == {"fixed": [-5, 0, 2, "refused", "refused"], "spfpm": [-5, 1, 2, "refused", "refused"], "apytypes": [-5, 1, 2, -128, -120], "fxpmath": [-4, 0, 1, 127, 127]}
PY

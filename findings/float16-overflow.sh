#!/bin/sh
# float16 0.0.1 (npm, conversion of half-precision numbers, as in weights and sensor frames): a number that does not fit comes back with another value
# and the other sign. float16ToByte() makes a NaN of 65,568 to 131,071; from 131,072 on it counts past the exponent, into the sign: 200,000 is read
# back as -0.000032. -200,000 gets more than 16 bits, and what a buffer keeps of them is 0.000032. The standard and @petamoriken/float16 3.9.3 give an
# infinity of the same sign. Ties go up and not to even: 1 + 1/2048 is 1.0009765625 here and 1 there. There is no error.
# Seen on 2026-11-30:  65,504: 65,504   70,000: NaN (Infinity)   131,072: -0   200,000: -0.0000321 (Infinity)   -200,000: 0.0000321, of 0x1021b
# (-Infinity)   1e7: -0.00233   1 + 1/2048: 1.0009765625 (1)
# It needs node and npm.
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
npm install --silent --no-audit --no-fund float16@0.0.1 @petamoriken/float16@3.9.3 >/dev/null
cat > half.js <<'JS'
const assert = require("node:assert");
const { float16ToByte, byteToFloat16 } = require("float16");
const { f16round } = require("@petamoriken/float16");

// The number that a reader of 16 bits gets.
const stored = (value) => byteToFloat16(Uint16Array.of(float16ToByte(value))[0]);
const values = [65504, 65520, 70000, 131072, 200000, -200000, 1e7, 1 + 1 / 2048, 1e-5];
const seen = new Map(values.map((value) => [value, stored(value)]));
for (const [value, got] of seen) console.log(`SEEN ${value}: ${got} (${f16round(value)})`);
assert(seen.get(65504) === 65504 && seen.get(65520) === Infinity && seen.get(1e-5) === f16round(1e-5));
assert(Number.isNaN(seen.get(70000)) && Object.is(seen.get(131072), -0) && seen.get(200000) < 0 && seen.get(-200000) > 0 && seen.get(1e7) < 0);
assert(float16ToByte(-200000) > 0xffff && seen.get(1 + 1 / 2048) === 1 + 1 / 1024 && f16round(1 + 1 / 2048) === 1);
assert(f16round(200000) === Infinity && f16round(-200000) === -Infinity);
JS
node half.js

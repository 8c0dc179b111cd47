#!/bin/sh
# cmsisdsp 1.10.3, numpy 2.4.6: CMSIS-DSP's conversions to 8-bit codes, as inputs of a quantized network, round neither to the nearest nor in one direction: from f32 to q7 toward zero, from q15 and q31 to q7 down. One value
# gets two codes by its way: -0.002 (a quarter of a code) is 0 from f32 and -1 by way of q15. From f32 the code 0 has two codes' width, so that small values of both signs vanish; by way of q15 all are half of a code too low in the
# mean, an offset that a network's layers add up. The option that rounds is a macro of the C build, which the package is built without. There is no error.
# Seen on 2026-11-30:  -0.002: 0 and -1   mean error, in codes, of values from -1 to 1: f32 0.00, by way of q15 -0.50, rounded 0.00   greatest: 1.00, 1.00, 0.50   codes 0 of 10,001 values: 79, 40, 39
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q cmsisdsp==1.10.3 numpy==2.4.6
v/bin/python - <<'PY'
import cmsisdsp as dsp
import numpy as np

values = np.linspace(-0.99, 0.99, 10_001).astype(np.float32)


def ways(x):
    x = np.asarray(x, np.float32)
    direct = np.asarray(dsp.arm_float_to_q7(x)).astype(int)
    by_q15 = np.asarray(dsp.arm_q15_to_q7(dsp.arm_float_to_q15(x))).astype(int)
    by_q31 = np.asarray(dsp.arm_q31_to_q7(dsp.arm_float_to_q31(x))).astype(int)
    return {"direct": direct, "q15": by_q15, "q31": by_q31, "nearest": np.rint(x.astype(float) * 128).astype(int)}


small = {name: int(codes[0]) for name, codes in ways([-0.002, 0.0]).items()}
seen = {}
for name, codes in ways(values).items():
    error = codes - values.astype(float) * 128
    seen[name] = error.mean(), np.abs(error).max(), int((codes == 0).sum())
    print(f"SEEN {name}: -0.002 is {small[name]}, mean error {seen[name][0]:.2f}, greatest {seen[name][1]:.2f}, zeros {seen[name][2]}")
assert small["direct"] == 0 and small["q15"] == small["q31"] == -1 and small["nearest"] == 0
assert abs(seen["direct"][0]) < 0.01 and abs(seen["nearest"][0]) < 0.01
assert abs(seen["q15"][0] + 0.5) < 0.01 and abs(seen["q31"][0] + 0.5) < 0.01
assert seen["direct"][2] > 1.9 * seen["nearest"][2]
PY

#!/bin/sh
# gguf 0.19.0, numpy 2.4.6: the package's ternary types TQ1_0 and TQ2_0 take the largest weight of 256 as the step, so that every weight below half of it is 0: of normally distributed weights, as a trained policy
# has, 87 % are gone, and the error is 0.81 of the weights' deviation, which is little less than with no weights at all. The best step for the same codes gives 0.44. There is no error and no
# warning; the types are meant for weights that have three values already, which quantize() does not say. TQ2_0 is also 2.06 bits wide, for three of its four codes. The types of 4 and more bits are as expected.
# Seen on 2026-11-29:  weights 0 beside the deviation of all: TQ2_0 and TQ1_0 87 % zeros, error 0.81   best step, same codes: 45 % zeros, 0.44   Q4_0 0.09   Q8_0 0.005
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q gguf==0.19.0 numpy==2.4.6
v/bin/python -W ignore - <<'PY'
import numpy as np
from gguf import GGMLQuantizationType, quants

weights = np.random.default_rng(0).standard_normal((64, 256)).astype(np.float32)
error = lambda other: float(np.sqrt(np.square(weights - other).mean() / np.square(weights).mean()))
seen = {}
for name in ("TQ1_0", "TQ2_0", "Q4_0", "Q8_0"):
    kind = GGMLQuantizationType[name]
    packed = quants.quantize(weights, kind)
    read = quants.dequantize(packed, kind)
    seen[name] = error(read)
    print(f"{name}: {packed.nbytes * 8 / weights.size:.2f} bits a weight, {(read == 0).mean():.0%} zeros, error {seen[name]:.3f}")
    if name.startswith("TQ"):
        assert (read == 0).mean() > 0.8 and len(np.unique(read[0])) <= 3


def with_step(step):
    return np.clip(np.round(weights / step), -1, 1) * step


best = min((with_step(step) for step in np.linspace(0.5, 3, 100)), key=error)
print(f"best step for all: {(best == 0).mean():.0%} zeros, error {error(best):.3f}")
assert seen["TQ1_0"] > 0.7 and seen["TQ2_0"] > 0.7 and error(best) < 0.5 and seen["Q4_0"] < 0.1 and seen["Q8_0"] < 0.01
PY

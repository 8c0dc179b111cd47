#!/bin/sh
# safetensors 0.8.0, numpy 2.4.6: safetensors.numpy.save takes an array that is not in C order (a transposed one, one with a step, one in Fortran order) and
# writes the bytes as they lie in memory under the array's shape: what load gives has other numbers at other places. There is no error. (safetensors.torch
# refuses such a tensor.) For instance keras kernels transposed for a Linear layer.
# Seen on 2026-11-28:  C order: kept   transposed: changed   every second column: changed   Fortran order: changed
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q safetensors==0.8.0 numpy==2.4.6
v/bin/python -W error - <<'PY'
import numpy as np
from safetensors.numpy import load, save

a = np.arange(6, dtype=np.float32).reshape(2, 3)
seen = {}
for name, array in {"C order": a, "transposed": a.T, "every second column": a[:, ::2], "Fortran order": np.asfortranarray(a)}.items():
    got = load(save({"w": array}))["w"]
    assert got.shape == array.shape and got.dtype == array.dtype
    seen[name] = bool(np.array_equal(got, array))
    print(f"{name}: {'kept' if seen[name] else 'changed'}")
assert seen == {"C order": True, "transposed": False, "every second column": False, "Fortran order": False}, seen
PY

#!/bin/sh
# safetensors 0.8.0, ml_dtypes 0.6.0, numpy 2.4.6: safetensors.numpy.save takes bfloat16 and eight-bit floats, but load does not read what save gave: it raises
# a bare KeyError. load_file of the same bytes in a file reads bfloat16 but not the eight-bit floats (numpy has no attribute of that name).
# Seen on 2026-11-28:  float16: load reads, load_file reads   bfloat16: load KeyError, load_file reads   float8_e4m3fn: load KeyError, load_file AttributeError
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q safetensors==0.8.0 ml_dtypes==0.6.0 numpy==2.4.6
v/bin/python - <<'PY'
import ml_dtypes, numpy as np
from safetensors.numpy import load, load_file, save

seen = {}
for kind in (np.float16, ml_dtypes.bfloat16, ml_dtypes.float8_e4m3fn):
    array = np.array([1, -2, 0.5], dtype=kind)
    data = save({"w": array})
    with open("w.safetensors", "wb") as file:
        file.write(data)
    tried = []
    for read, source in ((load, data), (load_file, "w.safetensors")):
        try:
            got = read(source)["w"]
            assert got.dtype == array.dtype and np.array_equal(got, array)
            tried.append("reads")
        except (KeyError, AttributeError) as error:
            tried.append(type(error).__name__)
    seen[array.dtype.name] = tried
    print(f"{array.dtype.name}: load {tried[0]}, load_file {tried[1]}")
assert seen == {"float16": ["reads"] * 2, "bfloat16": ["KeyError", "reads"], "float8_e4m3fn": ["KeyError", "AttributeError"]}, seen
PY

#!/bin/sh
# ml_dtypes 0.6.0, numpy 2.4.6: means and sums of its types are computed in the type itself, where numpy takes a wider one for its own small types. The mean of 1,000 ones in bfloat16 is 0.256,
# in float8_e4m3fn 0.0156, and that of 7, 7, 7 in int4 is 1; there is no error and no warning. mean(dtype=numpy.float32) is right. Statistics of recordings or weights that are held so are
# wrong by a factor that grows with their number. And the type of a result depends on how it is written: 7 times 2 of int4 is 14 (int8), 7 times an array of 2 is -2 (int4), and a
# product of matrices is -109 (int8), where a dot product is 3 (int4), of 147.
# Seen on 2026-11-29:  mean of 1,000 ones: float16 1.0, bfloat16 0.256, float8_e4m3fn 0.0156, float4_e2m1fn 0.0   mean of 7 7 7: int8 7.0, int4 1
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q ml_dtypes==0.6.0 numpy==2.4.6
v/bin/python -W error - <<'PY'
import ml_dtypes, numpy as np

means = {}
for kind in ("float16", "bfloat16", "float8_e4m3fn", "float4_e2m1fn"):
    ones = np.ones(1000, getattr(ml_dtypes, kind, kind))
    means[kind] = round(float(ones.mean()), 4)
    print("mean of 1,000 ones,", kind, means[kind], " in float32", ones.mean(dtype=np.float32))
    assert ones.mean(dtype=np.float32) == 1
assert means == {"float16": 1.0, "bfloat16": 0.2559, "float8_e4m3fn": 0.0156, "float4_e2m1fn": 0.0}, means
int4 = lambda *values: np.array(values, ml_dtypes.int4)
assert np.array([7, 7, 7], np.int8).mean() == 7 and float(int4(7, 7, 7).mean()) == 1 and int4(7, 7, 7).mean(dtype=np.float32) == 7
assert np.array([7, 7, 7], np.int8).sum() == 21 and float(int4(7, 7, 7).sum()) == 5
row = int4(7, 7, 7)
results = {"7 times 2": int4(7) * 2, "7 times an array of 2": int4(7) * int4(2), "matrices": row[None] @ row[:, None], "dot": np.dot(row, row)}
found = {name: (int(np.asarray(value).ravel()[0]), str(value.dtype)) for name, value in results.items()}
print("mean of 7 7 7 in int4:", int4(7, 7, 7).mean(), " int4:", *(f"{name}: {value[0]} ({value[1]})," for name, value in found.items()))
assert found == {"7 times 2": (14, "int8"), "7 times an array of 2": (-2, "int4"), "matrices": (-109, "int8"), "dot": (3, "int4")}, found
PY

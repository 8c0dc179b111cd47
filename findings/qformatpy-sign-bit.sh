#!/bin/sh
# qformatpy 1.0.2 (fixed-point formats, numba 0.68.1, numpy 2.4.6): qformat(x, qi, qf) has the sign bit inside qi, and its documentation has it
# outside: qi is the "Number of integer bits (excluding sign bit if signed=True)", with an "Optional sign bit" besides, so that Q3.4 takes 8 bits and
# goes from -8 to 7.9375. It goes from -4 to 3.9375 in 7 bits, as in the notation of ARM, which the text names as well; as the default is to wrap,
# 5.0 becomes -3.0, 7.9 becomes -0.125 and -8.0 becomes 0. qi 0, the Q0.7 of audio and motor libraries, has 7 bits and makes -0.5 of 0.5. There is no
# error; ovf_method=SAT gives 3.9375.
# Seen on 2026-11-30:  qformat(5.0, 3, 4) -3.0 (5.0)   7.9: -0.125 (7.875)   -8.0: 0.0 (-8.0)   5.0 with SAT 3.9375   qformat(0.5, 0, 7) -0.5 (0.5)
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q qformatpy==1.0.2 numba==0.68.1 numpy==2.4.6
cat > run.py <<'PY'
import numpy as np
from qformatpy import ERROR, SAT, qformat

# Q3.4 by the documentation: 3 integer bits, 4 fractional ones, and a sign.
values = np.array([5.0, 7.9, -8.0, 3.9375, -4.0])
wrapped = qformat(values, 3, 4)
saturated = qformat(5.0, 3, 4, ovf_method=SAT)
half = qformat(0.5, 0, 7)
print("SEEN Q3.4:", dict(zip(values.tolist(), wrapped.tolist())), "5.0 with SAT:", saturated, "Q0.7 of 0.5:", half)
assert wrapped.tolist() == [-3.0, -0.125, 0.0, 3.9375, -4.0] and saturated == 3.9375 and half == -0.5
try:
    qformat(5.0, 3, 4, ovf_method=ERROR)
    raise SystemExit("no overflow")
except OverflowError as error:
    print("SEEN 5.0 with ERROR:", error)
PY
v/bin/python run.py

#!/bin/sh
# casadi 3.8.2, numpy 2.4.6: numpy's functions work on casadi's symbols, so that one Python function is run on numbers and compiled for an optimizer or, as C, for a controller. Some compute another thing then, with no error:
# np.rint and np.round take halves away from zero, where numpy takes them to the even number: 0.5, 1.5 and 2.5 are 1, 2, 3, and 0, 2, 2 in numpy. A policy that rounds to codes of a half scale has other codes. np.clip and np.maximum
# lose a NaN: np.clip(x, -1, 1) of it is -1, and np.maximum(x, 0) is 0, where numpy gives NaN: a broken sensor becomes full torque to one side. np.mod, np.sign, np.trunc and np.floor are numpy's.
# Seen on 2026-11-30:  rint of -2.5, -0.5, 0.5, 1.5, 2.5: casadi -3, -1, 1, 2, 3   numpy -2, 0, 0, 2, 2   of NaN: clip -1, maximum 0   numpy NaN, NaN
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q casadi==3.8.2 numpy==2.4.6
v/bin/python -W ignore - <<'PY'
import casadi
import numpy as np


def both(function, values):
    """The function's results on casadi's two kinds of symbols, and on numbers."""
    results = []
    for kind in (casadi.SX, casadi.MX):
        x = kind.sym("x")
        compiled = casadi.Function("f", [x], [function(x)])
        results.append([float(compiled(value)) for value in values])
    assert np.array_equal(results[0], results[1], equal_nan=True)
    return results[0], [float(function(np.float64(value))) for value in values]


halves = [-2.5, -0.5, 0.5, 1.5, 2.5]
for function in (np.rint, np.round):
    compiled, plain = both(function, halves)
    print(f"SEEN {function.__name__} {halves}: casadi {compiled}, numpy {plain}")
    assert compiled == [-3, -1, 1, 2, 3] and plain == [-2, 0, 0, 2, 2]
for name, function, lost in (("clip", lambda x: np.clip(x, -1, 1), -1.0), ("maximum", lambda x: np.maximum(x, 0), 0.0)):
    compiled, plain = both(function, [np.nan])
    print(f"SEEN {name} of NaN: casadi {compiled}, numpy {plain}")
    assert compiled == [lost] and np.isnan(plain[0])
for function in (np.sign, np.trunc, np.floor, lambda x: np.mod(x, 2)):
    compiled, plain = both(function, halves)
    assert compiled == plain
PY

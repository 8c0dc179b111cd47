#!/bin/sh
# casadi 3.8.2, numpy 2.4.6, scipy 1.17.1: outside of its grid, casadi's interpolant "linear" goes on along its last piece, and "bspline" is 0: a table of a motor's torque over its speed, with 0.8 Nm at the last speed, ends in
# a step to no torque at all, by the name of the method alone. numpy.interp stays at the last value, and scipy's make_interp_spline goes on along the polynomial: four answers. There is no error and no warning. At the end itself
# all have the table's value, so that a test on the grid sees nothing.
# Seen on 2026-11-30:  table 2.0, 1.9, 1.6, 1.2, 0.8 at 0 to 4, asked at 4.5: linear 0.60, bspline 0.00, numpy.interp 0.80, make_interp_spline 0.63   at 4.0: 0.80 by all
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q casadi==3.8.2 numpy==2.4.6 scipy==1.17.1
v/bin/python -W error - <<'PY'
import casadi
import numpy as np
from scipy.interpolate import make_interp_spline

speeds, torques = [0.0, 1.0, 2.0, 3.0, 4.0], [2.0, 1.9, 1.6, 1.2, 0.8]
tables = {
    "linear": casadi.interpolant("table", "linear", [speeds], torques),
    "bspline": casadi.interpolant("table", "bspline", [speeds], torques),
    "numpy.interp": lambda speed: np.interp(speed, speeds, torques),
    "make_interp_spline": make_interp_spline(speeds, torques),
}
inside = {name: float(table(4.0)) for name, table in tables.items()}
outside = {name: float(table(4.5)) for name, table in tables.items()}
print("SEEN", inside, outside)
assert all(abs(value - 0.8) < 1e-9 for value in inside.values())
assert abs(outside["linear"] - 0.6) < 1e-9 and outside["bspline"] == 0.0 and outside["numpy.interp"] == 0.8
assert 0.3 < outside["make_interp_spline"] < 0.79
PY

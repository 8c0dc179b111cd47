#!/bin/sh
# filterpy 2.0.0, bayesian-filters 1.4.5, filterpy 1.4.5: kinematic_kf() makes a Kalman filter of positions and velocities for several axes. In filterpy 2.0.0 and in bayesian-filters, a fork of it, each
# row of the measurement matrix H adds all axes: the filter of two axes takes each measured coordinate for x + y, with no error. With dim_z left at its default of 1 there is one row, and with dim_z = 2 two equal rows.
# Neither axis can be observed: a point at rest at (1, -3) is estimated at (-0.5, -0.5). In 1.4.5 of filterpy, H has one row for each axis, whatever dim_z is, and the estimate is right.
# Seen on 2026-11-30:  filterpy 2.0.0 and bayesian-filters: H [[1, 0, 1, 0], [1, 0, 1, 0]], estimate (-0.50, -0.50)   filterpy 1.4.5: H [[1, 0, 0, 0], [0, 0, 1, 0]], estimate (1.00, -3.00)
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
cat > axes.py <<'PY'
import importlib, sys
import numpy as np

package, right = sys.argv[1], sys.argv[2] == "right"
kinematic_kf = importlib.import_module(f"{package}.common").kinematic_kf
kf = kinematic_kf(dim=2, order=1, dt=0.1, dim_z=2)
for _ in range(50):
    kf.predict()
    kf.update([1.0, -3.0])
x, y = kf.x[0, 0], kf.x[2, 0]
print(f"SEEN {package}: H {kf.H.astype(int).tolist()}, estimate ({x:.2f}, {y:.2f})")
rows = len(kinematic_kf(dim=2, order=1, dt=0.1).H)
assert kf.H.tolist() == ([[1, 0, 0, 0], [0, 0, 1, 0]] if right else [[1, 0, 1, 0], [1, 0, 1, 0]])
assert rows == (2 if right else 1)
assert (abs(x - 1) < 0.05 and abs(y + 3) < 0.05) if right else (abs(x - y) < 1e-6 and y > -1.1)
PY
python3 -m venv v && v/bin/pip install -q filterpy==2.0.0 bayesian-filters==1.4.5 numpy==2.4.6 scipy==1.17.1
v/bin/python -W ignore axes.py filterpy wrong
v/bin/python -W ignore axes.py bayesian_filters wrong
python3 -m venv old && old/bin/pip install -q setuptools wheel && old/bin/pip install -q filterpy==1.4.5 numpy==2.4.6 scipy==1.17.1
old/bin/python -W ignore axes.py filterpy right

#!/bin/sh
# filterpy 2.0.0, bayesian-filters 1.4.5, filterpy 1.4.5: KalmanFilter.update(z, H=H), for a measurement matrix of this step, does not bring z into a column in filterpy 2.0.0 and bayesian-filters: with z as a list or an
# array of two values, the state of four values becomes a matrix of 4 x 2, whose columns each believe that one of the two values was measured in all places. There is no error, and x.ravel()[:2], a position, is something
# else. predict() goes on with it. Without H the same z is right, as it was with H in filterpy 1.4.5. The documentation of 2.0.0 says that z has to be a column with H; its own default does not.
# Seen on 2026-11-30:  z = [1, 2], H given: filterpy 2.0.0 and bayesian-filters: 4 x 2, rows 0 and 2 both [0.67, 1.33]   without H, and filterpy 1.4.5 in both ways: 4 x 1, 0.67 and 1.33
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
cat > shape.py <<'PY'
import importlib, sys
import numpy as np

package, right = sys.argv[1], sys.argv[2] == "right"
KalmanFilter = importlib.import_module(f"{package}.kalman").KalmanFilter
H = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0]])


def update(**arguments):
    kf = KalmanFilter(dim_x=4, dim_z=2)
    kf.F, kf.H = np.eye(4), H
    kf.predict()
    kf.update([1.0, 2.0], **arguments)
    kf.predict()
    return kf.x


plain, given = update(), update(H=H)
print(f"SEEN {package}: without H {plain[[0, 2]].round(2).tolist()}, with H {given[[0, 2]].round(2).tolist()}")
assert plain.shape == (4, 1) and np.allclose(plain[[0, 2], 0], [2 / 3, 4 / 3])
if right:
    assert np.allclose(given, plain)
else:
    assert given.shape == (4, 2) and np.allclose(given[[0, 2]], [2 / 3, 4 / 3])
PY
python3 -m venv v && v/bin/pip install -q filterpy==2.0.0 bayesian-filters==1.4.5 numpy==2.4.6 scipy==1.17.1
v/bin/python -W ignore shape.py filterpy wrong
v/bin/python -W ignore shape.py bayesian_filters wrong
python3 -m venv old && old/bin/pip install -q setuptools wheel && old/bin/pip install -q filterpy==1.4.5 numpy==2.4.6 scipy==1.17.1
old/bin/python -W ignore shape.py filterpy right

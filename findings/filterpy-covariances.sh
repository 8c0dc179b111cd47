#!/bin/sh
# filterpy 1.4.5 and 2.0.0: in 1.4.5, which was the newest for eight years, SquareRootKalmanFilter.P, Q and R do not give back what was set: from the root L of P = L L' the getter makes L' L. With P = [[2, 1], [1, 2]] it is
# [[2.50, 0.87], [0.87, 1.50]]. The states are right, and the covariance of the first position after three updates is five times that of KalmanFilter. SimplexSigmaPoints, for an unscented filter, takes the root the other way
# round too, and there the filter's numbers are wrong: its points for P = [[2, 1], [1, 2]] have the covariance [[2.50, 0.87], [0.87, 1.50]]. There is no error. 2.0.0 has both right.
# Seen on 2026-11-30:  1.4.5: P [[2.5, 0.866], [0.866, 1.5]], simplex [[2.5, 0.866], [0.866, 1.5]], position's covariance 0.269 for 0.052   2.0.0: [[2, 1], [1, 2]] twice, 0.052
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
cat > covariances.py <<'PY'
import sys
import numpy as np
from filterpy.kalman import KalmanFilter, SimplexSigmaPoints, SquareRootKalmanFilter

right = sys.argv[1] == "right"
P = np.array([[2.0, 1.0], [1.0, 2.0]])
filters = [SquareRootKalmanFilter(2, 1), KalmanFilter(2, 1)]
for kf in filters:
    kf.F, kf.H = np.array([[1.0, 0.1], [0.0, 1.0]]), np.array([[1.0, 0.0]])
    kf.P, kf.Q, kf.R = P.copy(), np.array([[0.02, 0.01], [0.01, 0.03]]), 0.1 * np.eye(1)
read = filters[0].P
for z in (1.0, 2.0, 1.5):
    for kf in filters:
        kf.predict()
        kf.update(np.array([[z]]))
root, plain = filters

points = SimplexSigmaPoints(2)
sigmas = points.sigma_points(np.zeros(2), P)
simplex = (sigmas.T * points.Wc) @ sigmas
print(f"SEEN P {read.round(3).tolist()}, simplex {simplex.round(3).tolist()}, covariance {root.P[0, 0]:.3f} for {plain.P[0, 0]:.3f}")
wrong = np.array([[2.5, np.sqrt(0.75)], [np.sqrt(0.75), 1.5]])
assert np.allclose(root.x, plain.x)
assert np.allclose(read, P if right else wrong)
assert np.allclose(simplex, P if right else wrong)
assert np.isclose(root.P[0, 0] / plain.P[0, 0], 1.0 if right else 5.185, atol=0.01)
PY
for version in 1.4.5 2.0.0; do
    python3 -m venv $version && $version/bin/pip install -q setuptools wheel && $version/bin/pip install -q filterpy==$version numpy==2.4.6 scipy==1.17.1
done
1.4.5/bin/python -W ignore covariances.py wrong
2.0.0/bin/python -W ignore covariances.py right

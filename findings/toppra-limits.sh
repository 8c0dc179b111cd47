#!/bin/sh
# toppra 0.6.10: a trajectory as the package makes it by default goes beyond the acceleration limits that it was computed for: path and constraints are kept at the grid points, and between these the default parametrizer
# ("ParametrizeSpline") fits a spline. With limits of 2 rad/s^2, a path through three points has 2.16 with the grid that the package chooses, and 2.32 with 11 points. There is no error and no warning. With
# parametrizer="ParametrizeConstAccel" and the default discretization_scheme the limit holds: 2.00. With the other scheme, Collocation, that parametrizer has 2.15 and 3.92.
# Seen on 2026-11-30:  default grid, 11 points: default 2.16, 2.32   ParametrizeConstAccel 2.00, 2.00   ParametrizeConstAccel and Collocation 2.15, 3.92
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q toppra==0.6.10 numpy==2.4.6 scipy==1.17.1
v/bin/python -W error - <<'PY'
import numpy as np
import toppra
from toppra import SplineInterpolator
from toppra.algorithm import TOPPRA
from toppra.constraint import DiscretizationType, JointAccelerationConstraint, JointVelocityConstraint

toppra.setup_logging("ERROR")
path = SplineInterpolator([0, 0.5, 1], [[0, 0], [0.3, 0.6], [1, 0]])
LIMIT = np.array([[-2.0, 2.0], [-2.0, 2.0]])


def greatest(points, scheme={}, **options):
    limits = [JointVelocityConstraint(LIMIT / 2), JointAccelerationConstraint(LIMIT, **scheme)]
    grid = None if points is None else np.linspace(0, 1, points)
    trajectory = TOPPRA(limits, path, gridpoints=grid, **options).compute_trajectory()
    return np.abs(trajectory(np.linspace(0, trajectory.duration, 2001), 2)).max()


steps = dict(parametrizer="ParametrizeConstAccel")
collocation = dict(discretization_scheme=DiscretizationType.Collocation)
plain = [greatest(points) for points in (None, 11)]
constant = [greatest(points, **steps) for points in (None, 11)]
collocated = [greatest(points, collocation, **steps) for points in (None, 11)]
print("SEEN", *(f"{name} {values[0]:.2f}, {values[1]:.2f}  " for name, values in (("default", plain), ("constant", constant), ("collocation", collocated))))
assert 2.1 < plain[0] < plain[1] < 2.5
assert max(constant) <= 2.0
assert 2.1 < collocated[0] < collocated[1]
PY

#!/bin/sh
# filterpy 2.0.0 and 1.4.5, numpy 2.4.6: FadingMemoryFilter keeps its state in the type of x0. With x0=[0, 0], whole numbers, each estimate is cut to a whole number and goes into the next one: a joint that moves at 2 rad/s is tracked
# with a velocity of 6 rad/s, and one that accelerates at 3 rad/s^2 with 1 rad/s^2; a motion by less than 1 rad is not seen at all. There is no error and no warning. With x0=[0.0, 0.0], or x0=0, the filter is right.
# The package's Kalman filters take whole numbers and are right, too.
# Seen on 2026-11-30:  2 rad/s for 20 s: x0=[0, 0] gives 39, 6   x0=[0., 0.] and x0=0 give 39.80, 2.00   a motion of 0.5 rad: 0, 0
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
cat >seen.py <<'PY'
import numpy as np
from filterpy.kalman import KalmanFilter
from filterpy.memory import FadingMemoryFilter


def tracked(x0, order, positions):
    tracker = FadingMemoryFilter(x0=x0, dt=0.1, order=order, beta=0.6)
    for position in positions:
        tracker.update(position)
    return [round(float(number), 2) for number in tracker.x]


times = 0.1 * np.arange(200)
whole, real, scalar = (tracked(x0, 1, 2 * times) for x0 in ([0, 0], [0.0, 0.0], 0))
faster, small = tracked([0, 0, 0], 2, 1.5 * times**2), tracked([0, 0], 1, 0.5 * times / times[-1])
print("SEEN 2 rad/s: whole numbers", whole, "  floats", real, "  x0=0", scalar, "  3 rad/s^2: whole numbers", faster, "  0.5 rad:", small)
assert whole == [39, 6] and real == scalar == [39.8, 2.0] and faster == [594, 60, 1] and small == [0, 0]
assert np.allclose(tracked([0.0, 0.0, 0.0], 2, 1.5 * times**2), [594.015, 59.7, 3.0], atol=0.01)

kalman = KalmanFilter(2, 1)
kalman.x, kalman.F, kalman.H = np.array([[0], [0]]), np.array([[1, 0.1], [0, 1]]), np.array([[1, 0]])
for position in 2 * times:
    kalman.predict()
    kalman.update(position)
assert abs(float(kalman.x[1, 0]) - 2) < 0.01
PY
for version in 2.0.0 1.4.5; do
    python3 -m venv v$version && v$version/bin/pip install -q filterpy==$version numpy==2.4.6 scipy==1.17.1
    echo "filterpy $version"
    v$version/bin/python -W ignore seen.py
done

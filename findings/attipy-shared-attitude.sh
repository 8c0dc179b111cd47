#!/bin/sh
# attipy 0.0.7, numba 0.68.1, numpy 2.4.6, scipy 1.17.1 (attitude filter, newest for Python 3.11): AHRS(q_nb=...) takes "a unit quaternion or an
# Attitude object" as its initial attitude, and turns the caller's own object with each step: an Attitude, and also a quaternion in a NumPy array of
# float64, which is then no initial attitude any more, but the current one. A reset with it does nothing. Two filters that start from the same object
# (two sensors of one arm, or a second filter with other noise) are one: each adds its turn, and both show twice the angle of either. Of all other
# initial values (bias, velocity, covariance) it keeps a copy, and a tuple or a list is safe. Attitude(array) holds the array too. There is no error.
# Seen on 2026-12-01:  0.5 rad/s about z for 1 s, two filters: from one tuple 0.495, 0.495   from one array 0.99, 0.99   from one Attitude 0.99, 0.99
#                      the array after it: heading 0.99, and a third filter made from it starts there
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q attipy==0.0.7 numba==0.68.1 numpy==2.4.6 scipy==1.17.1
cat > run.py <<'PY'
import numpy as np
from attipy import AHRS, Attitude


def heading(attitude):
    return float(attitude.as_euler()[2])


def two(start):
    """The headings of two filters from one start after a turn of 1 s at 0.5 rad/s, level and at rest otherwise."""
    filters = AHRS(100.0, q_nb=start), AHRS(100.0, q_nb=start)
    for _ in range(100):
        for each in filters:
            each.update([0.0, 0.0, -9.80665], [0.0, 0.0, 0.5])
    return [heading(each.attitude) for each in filters]


level = 1.0, 0.0, 0.0, 0.0
array, attitude = np.array(level), Attitude(level)
turned = [two(start) for start in (level, array, attitude)]
for name, angles in zip(("tuple", "array", "Attitude"), turned):
    print(f"SEEN two filters from one {name}:", np.round(angles, 4))
assert np.allclose(turned[0], 0.495, atol=1e-6) and np.allclose(turned[1:], 0.99, atol=1e-6)

third = heading(AHRS(100.0, q_nb=array).attitude)
print("SEEN the array after it:", np.round(array, 4), "  a filter made from it starts at", round(third, 4))
assert abs(third - 0.99) < 1e-6

bias = np.zeros(3)
AHRS(100.0, bg_b=bias).update([0.0, 0.0, -9.80665], [0.0, 0.0, 0.5], yaw=0.3, yaw_var=1e-6)
assert not bias.any()
PY
v/bin/python run.py

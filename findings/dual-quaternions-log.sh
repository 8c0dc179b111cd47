#!/bin/sh
# dual-quaternions 0.4.0, pyquaternion 0.9.9, numpy 2.4.6 (rigid motions as dual quaternions): exp(log(x)), the way into the tangent space and back, is another motion. The logarithm of a pure translation is 0, so that the translation is
# lost; with a turn of 60 degrees, 1 m across the axis comes back as 0.5 m in another direction, and 1 m along the axis as 0. And a motion whose quaternion has a negative real part, as two turns of 100 degrees multiplied
# have, is mirrored by screw() and pow(): the turn of 200 degrees to the power of 1 is one of 160, and one of 350 is 10, about the axis the other way round. The translation stays right, and there is no error.
# Seen on 2026-11-30:  exp(log): 1, 2, 3 m: 0, 0, 0   60 degrees and 1, 0, 0 m: 0.25, 0.43, 0   60 degrees and 0, 0, 1 m: 0, 0, 0   x to the power of 1: 160: 160, 200 (-160): 160, 260 (-100): 100, 350 (-10): 10 degrees
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps dual-quaternions==0.4.0 pyquaternion==0.9.9 numpy==2.4.6
cat > run.py <<'PY'
import numpy as np
from dual_quaternions import DualQuaternion


def motion(degrees, *translation):
    """A turn about z and then a translation."""
    half = np.radians(degrees) / 2
    return DualQuaternion.from_quat_pose_array([np.cos(half), 0, 0, np.sin(half), *translation])


def shown(dq):
    matrix = dq.homogeneous_matrix()
    return np.degrees(np.arctan2(matrix[1, 0], matrix[0, 0])), matrix[:3, 3].round(4)


def back(*x):
    """The translation of exp(log(x))."""
    angle, translation = shown(motion(*x).log().exp())
    assert abs(angle - x[0]) < 1e-6
    return translation


lost, across, along = back(0, 1, 2, 3), back(60, 1, 0, 0), back(60, 0, 0, 1)
powers = {}
for degrees in (160, 200, 260, 350):
    # Two turns of half the angle, one after the other.
    x = motion(degrees / 2, 0, 0, 0) * motion(degrees / 2, 0, 0, 0)
    powers[degrees] = round(float(shown(x)[0])), round(float(shown(x.pow(1.0))[0]))
    axis, _, theta, _ = x.screw()
    assert abs(axis[2] * np.degrees(theta) - powers[degrees][1]) < 1e-6 and abs(axis[2]) > 0.999
print("SEEN exp(log):", lost, across, along, " angle, and that of the power of 1:", powers)
assert np.allclose(lost, 0) and np.allclose(across, [0.25, 0.433, 0]) and np.allclose(along, 0)
assert powers == {160: (160, 160), 200: (-160, 160), 260: (-100, 100), 350: (-10, 10)}
PY
v/bin/python run.py

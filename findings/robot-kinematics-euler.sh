#!/bin/sh
# robot-kinematics 1.1.0 (numpy 2.4.6, scipy 1.17.1): the two functions of the Euler convention "zyx" do not undo each other:
# euler_to_rotation_matrix() and back turns the sign of all three angles. The matrix is the inverse of that of "xyz", which is none of scipy's two
# zyx conventions, and rotation_matrix_to_euler() reads it as its transpose. With 0.3, 0.2, 0.1 the way there and back ends 43 degrees off. "xyz",
# the default, is right. There is no error.
# Seen on 2026-11-30:  0.3, 0.2, 0.1: xyz and back the same   zyx and back -0.3, -0.2, -0.1, 42.6 degrees off   zyx matrix = inverse of xyz: True
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q numpy==2.4.6 scipy==1.17.1 matplotlib==3.11.2
v/bin/pip install -q --no-deps robot-kinematics==1.1.0
cat > run.py <<'PY'
import math

import numpy as np
from robot_kinematics.core.transforms import euler_to_rotation_matrix, rotation_matrix_to_euler

ANGLES = np.array([0.3, 0.2, 0.1])
off = {}
for convention in ("xyz", "zyx"):
    matrix = euler_to_rotation_matrix(ANGLES, convention)
    back = rotation_matrix_to_euler(matrix, convention)
    again = euler_to_rotation_matrix(back, convention)
    off[convention] = math.degrees(math.acos(min(1.0, (np.trace(matrix.T @ again) - 1) / 2)))
    print(f"SEEN {convention}: {ANGLES.tolist()} there and back {np.round(back, 6).tolist()}, {off[convention]:.1f} degrees off")
assert off["xyz"] < 0.01 and off["zyx"] > 30
assert np.allclose(back, -ANGLES) and np.allclose(matrix.T, euler_to_rotation_matrix(ANGLES, "xyz"))
PY
v/bin/python run.py

#!/bin/sh
# robot-kinematics 1.1.0 (numpy 2.4.6, scipy 1.17.1): PandaManipulator, "with accurate DH parameters", is another arm: its table is Franka's, which
# has the modified convention of Craig, and it is multiplied by the standard one. At Franka's usual pose the flange is at 0.116, 0.545, 0.395
# instead of 0.307, 0.000, 0.590, more than half a metre to the side, though the arm is in its plane of symmetry. The same table by the modified
# convention gives the right place. UR5Manipulator, whose table is a standard one, is right. There is no error.
# Seen on 2026-11-30:  joints 0, -45, 0, -135, 0, 90, 45 degrees: 0.116, 0.545, 0.395   the same table by the modified convention: 0.307, 0.000,
# 0.590; 0.61 m apart
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q numpy==2.4.6 scipy==1.17.1 matplotlib==3.11.2
v/bin/pip install -q --no-deps robot-kinematics==1.1.0
cat > run.py <<'PY'
import math

import numpy as np
from robot_kinematics.robots.serial import PandaManipulator

Q = np.radians([0, -45, 0, -135, 0, 90, 45])
arm = PandaManipulator()
seen = arm.forward_kinematics(Q).position


def modified(row, joint):
    """The transform of a row by the modified convention: alpha and a come before theta and d."""
    (ca, sa), (ct, st) = ((math.cos(x), math.sin(x)) for x in (row["alpha"], row["theta"] + joint))
    return np.array([
        [ct, -st, 0, row["a"]],
        [st * ca, ct * ca, -sa, -row["d"] * sa],
        [st * sa, ct * sa, ca, row["d"] * ca],
        [0, 0, 0, 1],
    ])


pose = np.eye(4)
for row, joint in zip(arm.config["dh_parameters"], Q):
    pose = pose @ modified(row, joint)
right = pose[:3, 3]
apart = math.dist(seen, right)
print("SEEN flange", np.round(seen, 3).tolist(), "by the modified convention", np.round(right, 3).tolist(), f"{apart:.2f} m apart")
assert abs(right[1]) < 1e-6 and abs(right[0] - 0.307) < 1e-3 and abs(seen[1]) > 0.5
PY
v/bin/python run.py

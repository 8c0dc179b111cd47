#!/bin/sh
# robot-kinematics 1.1.0 (numpy 2.4.6, scipy 1.17.1): the Jacobian of its arms is that of other axes: each column takes the z axis and the origin of
# the frame after the joint, where the standard DH tables that its arms have turn about the one before. For the UR5 the velocity of the hand is off
# by up to 1 m/s per rad/s, in all columns but the last. With a damping the pseudo-inverse is none: the damped product is multiplied, not inverted,
# and the smallest damping changes the answer at once: of 0.1 m/s asked for in x its own Jacobian gives 0.010 back, where it gives 0.099 without a
# damping. There is no error.
# Seen on 2026-11-30:  UR5: columns off by 1.0, 0.42, 0.39, 1.04, 0.96, 0.0   0.1 m/s in x: damping 0 0.099   1e-12 0.0104   0.01 0.0104
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q numpy==2.4.6 scipy==1.17.1 matplotlib==3.11.2
v/bin/pip install -q --no-deps robot-kinematics==1.1.0
cat > run.py <<'PY'
import numpy as np
from robot_kinematics.core.jacobian import Jacobian
from robot_kinematics.robots.serial import UR5Manipulator

Q = np.array([0.1, -0.2, 0.3, 0.4, 0.5, 0.6])
arm = UR5Manipulator()
# The pose of the arm itself is right: all joints at 0 are the data sheet's -0.817, -0.191, -0.005.
assert np.allclose(arm.forward_kinematics(np.zeros(6)).position, [-0.81725, -0.19145, -0.005491], atol=1e-5)


def differences(place):
    """A column of the Jacobian from forward_kinematics()."""
    step = np.eye(6)[place] * 1e-6
    ahead, back, here = (arm.forward_kinematics(Q + shift).matrix for shift in (step, -step, 0 * step))
    change = (ahead - back) / 2e-6
    turn = change[:3, :3] @ here[:3, :3].T
    return np.array([*change[:3, 3], turn[2, 1], turn[0, 2], turn[1, 0]])


jacobian = Jacobian(arm, Q)
matrix = jacobian.compute()
off = [round(float(np.abs(matrix[:, place] - differences(place)).max()), 2) for place in range(6)]
print("SEEN largest difference of each column:", off)
assert min(off[:5]) > 0.3 and off[5] == 0

asked = np.array([0.1, 0, 0, 0, 0, 0])
got = {}
for damping in (0, 1e-12, 0.01):
    got[damping] = round(float((matrix @ jacobian.redundancy_resolution(asked, damping=damping))[0]), 4)
print("SEEN velocity in x by its own Jacobian for 0.1 m/s asked for, by the damping:", got)
assert got[0] > 0.095 and got[1e-12] < 0.02 and got[0.01] < 0.02
wrong = matrix.T @ matrix @ matrix.T
assert np.allclose(jacobian.pseudo_inverse(1e-12), wrong, atol=1e-9)
PY
v/bin/python run.py

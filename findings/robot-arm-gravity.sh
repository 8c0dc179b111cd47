#!/bin/sh
# robot-arm-kinematics 1.0.2 (numba 0.68.1, numpy 2.4.6): get_gravity_torque(), "Gravity compensation torques for all n joints", has gravity along -y
# of the base, where z is up in the UR, KUKA and Doosan arms that it ships. For its own DoosanM0609Config, stretched out to the front, it gives 0.0
# Nm to the shoulder, which needs 85 Nm, and -85 Nm to the vertical axis, which needs none: an arm held by it falls and turns. The sign is that of
# gravity's own pull besides, not of its compensation. It also prints each product of the sum, some hundred lines a call. There is no error.
# Seen on 2026-11-30:  Doosan M0609, joints 0, 90, 0, 0, 0, 0: reported -85.47, 0.0, 0.0, ... Nm   from the energy, gravity along -z: 0.0, -85.47,
# -24.35, 4.29, ...   along -y: 85.47, 0.0, 0.0, ...
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q numpy==2.4.6 numba==0.68.1 scipy==1.17.1 matplotlib==3.11.2
v/bin/pip install -q --no-deps robot-arm-kinematics==1.0.2
cat > run.py <<'PY'
import contextlib
import os

import numpy as np
from robot_arm_kinematics.config.doosan_m0609 import DoosanM0609Config
from robot_arm_kinematics.core.robot import RobotArmKinematics

config = DoosanM0609Config()
arm = RobotArmKinematics(config)
Q = np.radians([0.0, 90.0, 0.0, 0.0, 0.0, 0.0])


def energy(joints, axis):
    """The potential energy of all links, for gravity against an axis of the base."""
    frames = arm.get_link_matrix(joints)[0]
    links = zip(config.masses, frames, config.link_cog)
    return sum(9.81 * mass * (frame @ np.append(point, 1))[axis] for mass, frame, point in links)


def holding(axis):
    """The torques that hold the arm: the change of the energy with each joint."""
    steps = np.eye(6) * 1e-6
    return np.round([(energy(Q + step, axis) - energy(Q - step, axis)) / 2e-6 for step in steps], 2)


# The compiled code prints past Python, so the output goes to a file.
kept = os.dup(1)
with open("printed.txt", "w") as file:
    os.dup2(file.fileno(), 1)
    reported = np.round(arm.get_gravity_torque(Q), 2)
    os.fsync(1)
os.dup2(kept, 1)
up, side = holding(2), holding(1)
print("SEEN reported", reported.tolist(), "holds against -z", up.tolist(), "against -y", side.tolist())
assert abs(up[0]) < 0.01 and abs(up[1]) > 20 and abs(reported[0]) > 20 and abs(reported[1]) < 1
assert np.allclose(reported, -side, atol=0.05)
PY
v/bin/python run.py

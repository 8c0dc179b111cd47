#!/bin/sh
# robot-kinematics 1.1.0 (numpy 2.4.6, scipy 1.17.1): StewartPlatform, "6-DOF parallel manipulator", knows no rotation: inverse_kinematics() of a
# pose tilted by 20 degrees gives the six lengths of the level platform, and forward_kinematics() of any lengths gives a level one: for legs that no
# level platform fits it returns the nearest as if it were the pose, with lengths off by up to 17 mm of 0.3 m. MobileManipulator leaves its arm out:
# the hand is the base, at height 0, whatever the arm's joints are. There is no error.
# Seen on 2026-11-30:  legs level and tilted by 20 degrees: 0.3162 six times, both   legs 0.25, 0.3, 0.3, 0.35, 0.3, 0.3: level, off by up to 0.0175
# mobile arm: hand at 1, 2, 0 for all joints
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q numpy==2.4.6 scipy==1.17.1 matplotlib==3.11.2
v/bin/pip install -q --no-deps robot-kinematics==1.1.0
cat > run.py <<'PY'
import math

import numpy as np
from robot_kinematics.core.transforms import Transform
from robot_kinematics.robots.mobile import MobileManipulator
from robot_kinematics.robots.parallel import StewartPlatform

platform = StewartPlatform({"n_joints": 6, "joint_types": ["prismatic"] * 6, "joint_limits": [(0, 1)] * 6})
cosine, sine = math.cos(math.radians(20)), math.sin(math.radians(20))
tilt = np.array([[1, 0, 0], [0, cosine, -sine], [0, sine, cosine]])
level = platform.inverse_kinematics(Transform(position=[0, 0, 0.3]))
tilted = platform.inverse_kinematics(Transform(position=[0, 0, 0.3], rotation=tilt))
# The lengths of the tilted pose from the attachments of the package.
ends = [tilt @ end + [0, 0, 0.3] for end in platform.platform_attachments]
right = [round(math.dist(end, base), 4) for end, base in zip(ends, platform.base_attachments)]
print("SEEN legs level", np.round(level, 4).tolist(), "tilted", np.round(tilted, 4).tolist(), "right", right)
assert np.array_equal(level, tilted) and max(right) - min(right) > 0.04

legs = np.array([0.25, 0.3, 0.3, 0.35, 0.3, 0.3])
pose = platform.forward_kinematics(legs)
off = np.abs(platform.inverse_kinematics(pose) - legs).max()
print(f"SEEN pose of unequal legs: lengths off by up to {off:.4f}, rotation", pose.rotation.tolist())
assert np.array_equal(pose.rotation, np.eye(3)) and off > 0.01

robot = MobileManipulator({"n_joints": 5, "joint_types": ["revolute"] * 5, "joint_limits": [(-7, 7)] * 5})
hands = [robot.forward_kinematics(np.array([1.0, 2.0, 0.5, *joints])).position.tolist() for joints in ((0.0, 0.0), (1.0, -1.5))]
print("SEEN hand of the mobile arm with joints 0, 0 and 1, -1.5:", hands)
assert hands[0] == hands[1] == [1.0, 2.0, 0.0]
PY
v/bin/python run.py

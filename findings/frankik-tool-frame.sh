#!/bin/sh
# frankik 1.0.1, numpy 2.4.6 (closed inverse kinematics of Franka's Panda and FR3): forward() and inverse() of one class speak of different frames, unless both get the package's own FrankaHandTCPOffset, as the README's example does. Without
# tcp_offset, the default, forward() gives the flange, and inverse() takes the pose for that of the hand's tool: the pose that forward() gave leads to joints whose flange is turned by 45 degrees and 0.1 m
# away. And forward() with a tool of 0.2 m has it on the wrong side, behind the flange: it multiplies by the inverse of tcp_offset, and by the hand's offset, whatever the tool is; the identity, no tool, moves the pose by 0.1 m. The
# documentation calls tcp_offset the transformation "representing the tool center point offset". There is no error; where the shifted pose is out of reach, inverse() gives None.
# Seen on 2026-11-30:  home, no tool: forward z 0.487; inverse() of it: flange 0.103 m and 45 degrees off   identity: z 0.383   tool of 0.2 m, hand pointing down: z 0.583 (0.287)   hand offset: right, z 0.487
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps frankik==1.0.1 numpy==2.4.6
cat > run.py <<'PY'
import math

import numpy as np
from frankik import FrankaKinematics, RobotType

arm = FrankaKinematics(RobotType.FR3)
home = np.array([0.0, -np.pi / 4, 0.0, -3 * np.pi / 4, 0.0, np.pi / 2, np.pi / 4])
hand, tool = arm.FrankaHandTCPOffset, np.eye(4)
tool[2, 3] = 0.2


def apart(one, other):
    """The distance of two poses in m, and their angle in degrees."""
    cosine = (np.trace(one[:3, :3].T @ other[:3, :3]) - 1) / 2
    return math.dist(one[:3, 3], other[:3, 3]), math.degrees(math.acos(max(-1.0, min(1.0, cosine))))


flange = arm.forward(home)
joints = arm.inverse(flange, q0=home, q7=home[6])
distance, angle = apart(flange, arm.forward(joints))
again = arm.inverse(arm.forward(home, tcp_offset=hand), q0=home, tcp_offset=hand, q7=home[6])
heights = {name: float(arm.forward(home, tcp_offset=offset)[2, 3]) for name, offset in (("none", None), ("identity", np.eye(4)), ("tool of 0.2 m", tool), ("hand", hand))}
right = float((flange @ tool)[2, 3])
print(f"SEEN inverse(forward()) without a tool: {distance:.3f} m and {angle:.1f} degrees off; with the hand's offset: joints off by {np.abs(again - home).max():.0e}")
print("SEEN height by forward():", {name: round(height, 3) for name, height in heights.items()}, f"tool of 0.2 m by the flange's pose: {right:.3f}")
assert angle > 40 and np.abs(again - home).max() < 1e-6
assert abs(heights["none"] - heights["identity"] - 0.1034) < 1e-3
assert abs(heights["tool of 0.2 m"] - heights["none"] - 0.0966) < 1e-3 and abs(right - heights["none"] + 0.2) < 1e-6
PY
v/bin/python run.py

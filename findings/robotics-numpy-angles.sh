#!/bin/sh
# robotics-numpy 0.1.0 (rotations of arms, numpy 2.4.6): three ways to lose a rotation between its own pairs of functions. r2eul(R, "ZYX") gives
# roll, pitch, yaw, and eul2r(.., "ZYX") takes yaw, pitch, roll: the pair gives another rotation for all angles. r2rpy() at a pitch of +90 degrees
# has the wrong sign of yaw; at -90 it is right. r2eul(R, "ZYZ") with the middle angle at 180 degrees, a tool turned over, is off by half a turn.
# Each gives valid angles, and the documentation names one convention for both ways. There is no error.
# Seen on 2026-11-30:  eul2r(r2eul(R)) ZYX: 17.7 degrees off   rpy 0, 90, 28.6: yaw -28.6, 57.3 degrees off; pitch -90: 0.0   ZYZ with 180: 180.0
# degrees off; with 0: 0.0
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps robotics-numpy==0.1.0 numpy==2.4.6
cat > run.py <<'PY'
import math

import numpy as np
from robotics_numpy.transforms.rotations import eul2r, r2eul, r2rpy, rpy2r


def apart(one, other):
    """The angle between two rotations in degrees."""
    return math.degrees(math.acos(max(-1.0, min(1.0, (np.trace(one.T @ other) - 1) / 2))))


given = eul2r(0.3, 0.2, 0.1, "ZYX")
order = apart(given, eul2r(*r2eul(given, "ZYX"), "ZYX"))
print("SEEN ZYX of 0.3, 0.2, 0.1:", [round(float(angle), 3) for angle in r2eul(given, "ZYX")], f"back: {order:.1f} degrees off")
assert order > 10

down = {}
for pitch in (90, -90):
    rotation = rpy2r(0.0, math.radians(pitch), 0.5)
    angles = r2rpy(rotation)
    down[pitch] = apart(rotation, rpy2r(*angles))
    shown = [round(math.degrees(angle), 1) for angle in angles]
    print(f"SEEN roll 0, pitch {pitch}, yaw 28.6: {shown}, {down[pitch]:.1f} degrees off")
assert abs(down[90] - 57.3) < 0.1 and down[-90] < 0.1

over = {}
for middle in (180, 0):
    rotation = eul2r(0.2, math.radians(middle), 0.5)
    over[middle] = apart(rotation, eul2r(*r2eul(rotation)))
print("SEEN ZYZ with the middle angle 180 and 0, degrees off:", {middle: round(value, 1) for middle, value in over.items()})
assert over[180] > 179 and over[0] < 0.1
PY
v/bin/python run.py

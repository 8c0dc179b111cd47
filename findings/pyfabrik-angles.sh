#!/bin/sh
# pyfabrik 0.4.0 (inverse kinematics by FABRIK, vectormath 0.2.2, numpy 1.26.4): angles and angles_deg of Fabrik3D, which the README's 3D example
# prints, leave out z: an upright arm and one along x have the same angles, all 0, and one that moves to 12, 0, 9 keeps them at
# 0, while its hand is there. The first angle is that of the second joint's place, not of the link, so that with a base that is not at the origin a
# straight arm has 18.4 and -18.4 degrees; solvable() measures from the origin too and refuses a point 19 from the base of an arm of 20. Angles
# between links are not wrapped: 343 degrees for -17. There is no error.
# Seen on 2026-11-30:  hand at 12.0, 0.0, 9.0: angles 0, 0, 0   upright arm: 0, 0, 0   straight arm from 5, 5: 18.43, -18.43   solvable 19 from the
# base: False   link angle 342.98
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q vectormath==0.2.2 numpy==1.26.4 pyfabrik==0.4.0
cat > run.py <<'PY'
import math

import pyfabrik
from vectormath import Vector2, Vector3

arm = pyfabrik.Fabrik3D([Vector3(0, 0, 0), Vector3(10, 0, 0), Vector3(20, 0, 0)], 0.001)
arm.move_to(Vector3(12, 0, 9))
hand = tuple(round(float(value), 2) for value in arm.joints[-1])
up = pyfabrik.Fabrik3D([Vector3(0, 0, 0), Vector3(0, 0, 10), Vector3(0, 0, 20)], 0.001)
print("SEEN hand", hand, "angles", list(arm.angles_deg), "upright arm", up.angles_deg)
assert math.dist(hand, (12, 0, 9)) < 0.01 and list(arm.angles_deg) == [0.0, 0.0, 0.0] == list(up.angles_deg)

# A straight arm along x, whose base is at 5, 5: all its angles are 0.
moved = pyfabrik.Fabrik2D([Vector2(5, 5), Vector2(15, 5), Vector2(25, 5)], 0.001)
angles = [round(angle, 2) for angle in moved.angles_deg]
print("SEEN straight arm from 5, 5:", angles, "solvable at 24, 5:", bool(moved.solvable(Vector2(24, 5))))
assert angles == [18.43, -18.43, 0.0] and not moved.solvable(Vector2(24, 5))

bent = pyfabrik.Fabrik2D([Vector2(0, 0), Vector2(-10, -1), Vector2(-20, 1)], 0.001)
print("SEEN second link of an arm along -x:", round(bent.angles_deg[1], 2))
assert abs(bent.angles_deg[1] - 342.98) < 0.01
PY
v/bin/python run.py

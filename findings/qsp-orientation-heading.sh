#!/bin/sh
# qsp-orientation 0.1.1, numpy 2.4.6: of its three filters, with one form of quaternion and the same arguments, two get the heading wrong. mahony_update() with a magnetometer takes the field for one along y, where madgwick_update() has it along x:
# a level body that looks north is at 90 degrees, and where the field dips by 60 degrees, as in Europe, the body at rest is pitched by 30 degrees down or up, with a true accelerometer. complementary_filter() blends with a tilt whose yaw
# is 0, so that each step takes a part of the heading away: a body that rests at a yaw of 90 degrees is at 33 after 50 steps and at 12 after 100 (alpha 0.98). There is no error. A policy that observes gravity leans over.
# Seen on 2026-11-30:  at rest and level, yaw 0: madgwick 0 0 0   mahony, field without a dip: 0 0 90, with a dip of 60: 0 -30 90   yaw 60, dip of 60: madgwick 0 0 60, mahony -27 -14 154   complementary, yaw 90: 54, 33, 20, 12 after 25, 50, 75, 100 steps
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q qsp-orientation==0.1.1 numpy==2.4.6
v/bin/python - <<'PY'
import math

import numpy as np
from qsp.orientation import complementary_filter, euler_to_quaternion, integrate_gyro, madgwick_update, mahony_update, quaternion_to_euler, quaternion_to_rotation_matrix

AT_REST, UP = np.zeros(3), np.array([0.0, 0.0, 9.81])
degrees = lambda q: [round(math.degrees(angle)) + 0 for angle in quaternion_to_euler(q)]


def settled(yaw, dip):
    """Where both filters end (roll, pitch, yaw) for a level body at rest."""
    yaw, dip = math.radians(yaw), math.radians(dip)
    body = quaternion_to_rotation_matrix(euler_to_quaternion(0, 0, yaw))
    field = body.T @ np.array([math.cos(dip), 0, -math.sin(dip)])
    one = two = np.array([1.0, 0, 0, 0])
    integral = None
    for _ in range(20_000):
        one = madgwick_update(one, AT_REST, UP, dt=0.01, mag=field)
        two, integral = mahony_update(two, AT_REST, UP, dt=0.01, integral_error=integral, mag=field)
    return degrees(one), degrees(two)


seen = {(yaw, dip): settled(yaw, dip) for yaw, dip in ((0, 0), (0, 60), (60, 60))}
q, decay = euler_to_quaternion(0, 0, math.pi / 2), []
for step in range(1, 101):
    q = complementary_filter(integrate_gyro(q, AT_REST, 0.01), UP, 0.98)
    decay += [degrees(q)[2]] if step % 25 == 0 else []
print("SEEN yaw, dip: madgwick, mahony:", seen, "complementary", decay)
for (yaw, dip), (one, two) in seen.items():
    assert max(abs(a - b) for a, b in zip(one, (0, 0, yaw))) <= 1
near = lambda found, wanted: max(abs(a - b) for a, b in zip(found, wanted)) <= 1
assert near(seen[0, 0][1], (0, 0, 90)) and near(seen[0, 60][1], (0, -30, 90)) and near(seen[60, 60][1], (-27, -14, 154))
assert near(decay, (54, 33, 20, 12))
PY

#!/bin/sh
# py-imu 0.1.0, numpy 2.4.6: Madgwick(frequency=100.0) takes a frequency or a time step and uses neither. update(gyr, acc) without dt, whose default is documented as None, starts anew from the accelerometer in each call: the gyroscope is
# never used, the yaw is 0 for ever, and a push of 3 m/s^2 tilts the body by 17 degrees at once. With dt=0.01 in each call, the same filter turns and holds. There is no error. A policy that observes gravity gets the raw accelerometer, as if it
# had a filter.
# Seen on 2026-11-30:  1 rad/s of yaw for 2 s at 100 Hz: update(gyr, acc) 0.00 rad, update(gyr, acc, dt=0.01) 2.00 rad   pushed for 0.5 s: -17.0 and -1.9 degrees of pitch
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q py-imu==0.1.0 numpy==2.4.6
v/bin/python - 2>err.txt <<'PY' || { tail -n 20 err.txt; exit 1; }
import math

import loguru
from py_imu.fusion.madgwick import Madgwick
from py_imu.fusion.quaternion import Vector3D
from py_imu.fusion.utilities import q2rpy

loguru.logger.remove()


def ends(samples, **step):
    """Roll, pitch and yaw after the samples (gyroscope and accelerometer) at 100 Hz."""
    made = Madgwick(frequency=100.0)
    made.update(Vector3D(0, 0, 0), Vector3D(0, 0, 9.81))
    for gyroscope, accelerometer in samples:
        q = made.update(Vector3D(*gyroscope), Vector3D(*accelerometer), **step)
    return q2rpy(q)


turning = [((0, 0, 1.0), (0, 0, 9.81))] * 200
pushed = [((0, 0, 0), (3.0, 0, 9.81))] * 50
yaws = [ends(turning, **step).z for step in ({}, {"dt": 0.01})]
pitches = [math.degrees(ends(pushed, **step).y) for step in ({}, {"dt": 0.01})]
print(f"SEEN yaw {yaws[0]:.2f} and {yaws[1]:.2f} rad; pitch {pitches[0]:.1f} and {pitches[1]:.1f} degrees")
assert abs(yaws[0]) < 1e-9 and abs(yaws[1] - 2.0) < 0.02
assert abs(pitches[0] + 17.0) < 0.1 and abs(pitches[1]) < 2
PY

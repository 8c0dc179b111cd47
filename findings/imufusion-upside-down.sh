#!/bin/sh
# imufusion 1.3.3: a body that starts upside down, with an accelerometer of exactly (0, 0, -1) g as a simulator has it, is level for the filter, for ever: the angle between where gravity is and where it is expected has its
# greatest error and no direction, and the filter takes that as no error. get_gravity() gives (0, 0, 1), and the linear acceleration is -2 g. There is no error and no flag. With 0.001 g of noise, or of tilt, it is upside down
# after the start. A policy that learns to get up, tested in a simulator with this filter, sees itself on its feet. With acceleration_rejection switched on it is the same.
# Seen on 2026-11-30:  (0, 0, -1), 30 s: roll 0.0, gravity (0, 0, 1), linear acceleration (0, 0, -2)   (0, 0.001, -1): roll 179.9, gravity (0, 0, -1)   with rejection of 10 degrees: roll 0.0
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q imufusion==1.3.3 numpy==2.4.6
v/bin/python - <<'PY'
import imufusion
import numpy as np


def rest(accelerometer, rejection=0.0):
    ahrs, settings = imufusion.Ahrs(), imufusion.AhrsSettings()
    settings.acceleration_rejection = rejection
    if rejection:
        settings.rejection_timeout = 5.0
    ahrs.set_settings(settings)
    for _ in range(3000):
        ahrs.update_no_magnetometer(np.zeros(3), np.array(accelerometer))
    roll = imufusion.quaternion_to_euler(ahrs.get_quaternion())[0]
    return roll, ahrs.get_gravity(), ahrs.get_linear_acceleration()


exact, tilted, rejecting = rest((0.0, 0.0, -1.0)), rest((0.0, 0.001, -1.0)), rest((0.0, 0.0, -1.0), rejection=10.0)
for name, (roll, gravity, linear) in (("exact", exact), ("tilted", tilted), ("rejecting", rejecting)):
    print(f"SEEN {name}: roll {roll:.1f}, gravity {np.round(gravity, 2).tolist()}, linear {np.round(linear, 2).tolist()}")
for roll, gravity, linear in (exact, rejecting):
    assert abs(roll) < 0.1 and gravity[2] > 0.999 and linear[2] < -1.99
assert abs(abs(tilted[0]) - 180) < 0.2 and tilted[1][2] < -0.999
PY

#!/bin/sh
# AHRS 0.4.0: filters of one package give the same measurements opposite orientations. A gyroscope at rest and an accelerometer of a body that is rolled by 0.5 rad:
# Madgwick, Mahony, EKF, Complementary, UKF and Tilt roll it by +0.5, AQUA by -0.5. With a magnetometer, FQA has the body upside down. The quaternions are in the
# same form, and all functions take the same arguments: a policy that observes gravity falls to the other side when the filter is exchanged.
# Seen on 2026-11-29:  roll of Madgwick, Mahony, EKF, Complementary, UKF, Tilt: 0.5 rad   AQUA: -0.5 rad   z of FQA: down
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q AHRS==0.4.0 numpy==2.4.6
v/bin/python -W ignore - <<'PY'
import ahrs, numpy as np
from ahrs import filters

steps, roll = 2000, 0.5
acc = np.tile(9.81 * np.array([0, np.sin(roll), np.cos(roll)]), (steps, 1))
mag, still = np.tile([30.0, 0.0, -40.0], (steps, 1)), np.zeros((steps, 3))
seen = {name: getattr(filters, name)(gyr=still, acc=acc).Q[-1] for name in ("Madgwick", "Mahony", "EKF", "Complementary", "UKF", "AQUA")}
seen |= {"Tilt": filters.Tilt(acc=acc).Q[-1], "FQA": filters.FQA(acc=acc, mag=mag).Q[-1]}
# The direction of the measured acceleration in the body, by each quaternion (w, x, y, z).
up = {name: ahrs.Quaternion(q).to_DCM().T @ [0, 0, 1] for name, q in seen.items()}
for name, (x, y, z) in up.items():
    print(f"{name}: up is {x:.2f} {y:.2f} {z:.2f} in the body, roll {np.arctan2(y, z):.2f}")
rolls = {name: np.arctan2(y, z) for name, (_, y, z) in up.items()}
assert all(abs(rolls[name] - roll) < 0.03 for name in ("Madgwick", "Mahony", "EKF", "Complementary", "UKF", "Tilt"))
assert abs(rolls["AQUA"] + roll) < 0.03 and up["FQA"][2] < -0.8
PY

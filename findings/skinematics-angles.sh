#!/bin/sh
# scikit-kinematics 0.10.4, scipy 1.17.1, numpy 2.4.6 (orientations of sensors and bodies): quat2seq() has angles only to 90 degrees. A heading of 120
# degrees comes back as 60, 180 as 0 and -150 as -30, by 'nautical', the default, and a roll of 120 as 60: the angles are taken by arcsin, and the
# docstring says nothing of a range. 'Helmholtz' is the same. With 'Euler' ("Rz * Rx * Rz") the first angle is wrong almost everywhere: 30 comes back
# as 150, and -100 as -80; the second argument of arctan2 lacks its sign, so that only 90 and -90, as in the docstring's example, are right.
# seq2quat(), the other way, is right for all: a heading that goes there and back is another one. There is no error.
# Seen on 2026-11-30:  nautical: 80: 80   95: 85   120: 60   180: 0   -150: -30   roll 120: 60   Euler 30, 20, 10: 150, 20, 10   90, 20, 10: 90, 20,
# 10   Helmholtz 120, 20, 10: 60, 20, 10
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps scikit-kinematics==0.10.4 numpy==2.4.6 scipy==1.17.1
cat > run.py <<'PY'
import sys
from unittest.mock import MagicMock

import numpy as np
from scipy.spatial.transform import Rotation

# The package imports these for its plots, file dialogs, tables and symbols, which are not used here.
for name in ("matplotlib", "matplotlib.pyplot", "pandas", "sympy", "tkinter", "tkinter.filedialog", "pygame"):
    sys.modules[name] = MagicMock()

from skinematics import quat, rotmat


def back(angles, name="nautical"):
    """The angles after the way to a quaternion and back, and what scipy makes of the same quaternion."""
    made = rotmat.seq2quat(angles, name)
    axes = {"nautical": "ZYX", "Euler": "ZXZ", "Helmholtz": "YZX"}[name]
    right = Rotation.from_quat(np.roll(made[0], -1)).as_euler(axes, degrees=True)
    return tuple(quat.quat2seq(made, name)[0].round(6) + 0.0), tuple(right.round(6) + 0.0)


seen = {}
for name, rows in {
    "nautical": ([80, 20, 10], [95, 20, 10], [120, 20, 10], [180, 0, 0], [-150, 10, 5], [10, 20, 120]),
    "Euler": ([30, 20, 10], [90, 20, 10], [-100, 20, 10]),
    "Helmholtz": ([20, 30, 10], [120, 20, 10]),
}.items():
    for angles in rows:
        got, right = back(angles, name)
        seen[name, tuple(angles)] = tuple(float(value) for value in got)
        print("SEEN", name, angles, "back:", [float(value) for value in got], "scipy:", [float(value) for value in right])
        assert np.allclose((np.array(right) - angles + 180) % 360, 180, atol=1e-4), "seq2quat() is right"
assert np.allclose(seen["nautical", (80, 20, 10)], (80, 20, 10)) and np.allclose(seen["nautical", (120, 20, 10)], (60, 20, 10))
assert (
    np.allclose(seen["nautical", (180, 0, 0)], 0, atol=1e-5)
    and np.allclose(seen["nautical", (-150, 10, 5)], (-30, 10, 5))
    and np.allclose(seen["nautical", (10, 20, 120)], (10, 20, 60))
)
assert (
    np.allclose(seen["Euler", (30, 20, 10)], (150, 20, 10))
    and np.allclose(seen["Euler", (90, 20, 10)], (90, 20, 10))
    and np.allclose(seen["Euler", (-100, 20, 10)], (-80, 20, 10))
)
assert np.allclose(seen["Helmholtz", (20, 30, 10)], (20, 30, 10)) and np.allclose(seen["Helmholtz", (120, 20, 10)], (60, 20, 10))
PY
v/bin/python run.py

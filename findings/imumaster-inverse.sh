#!/bin/sh
# imumaster 0.0.2, numpy 2.4.6 (orientation from an IMU): with scalar_first=False, that is for quaternions x, y, z, w as in ROS and SciPy, the property inv of a quaternion gives its parts in the wrong order: the whole conjugate is
# reversed, w, -x, -y, -z to -z, -y, -x, w, where only w should move to the end: x and z are exchanged. A turn about x has an inverse about z, and the product of the two is no identity: for a quarter turn about x it turns by 120 degrees.
# For turns about y, and for those with x = z, it is right, so that a test with one of them sees nothing. conj and the static Quaternion.inverse(), of the same numbers, are right. There is no error. A vector or a relative orientation that is taken
# back by inv, as of a tool or a second IMU, ends up about another axis.
# Seen on 2026-12-01:  a turn by 90 degrees about x (0.707, 0, 0, 0.707): inv 0, 0, -0.707, 0.707; inverse() -0.707, 0, 0, 0.707; q * inv turns by 120 degrees   about y: inv right   scalar first: right
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps imumaster==0.0.2 numpy==2.4.6
cat > run.py <<'PY'
import math

import numpy as np
from imumaster.math import Quaternion

half = math.sqrt(0.5)
rests = {}
for name, axis in {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}.items():
    for first in (False, True):
        vector = [half * a for a in axis]
        numbers = [half, *vector] if first else [*vector, half]
        turn = Quaternion(first, *numbers)
        sound = Quaternion.inverse(numbers, first)
        product = Quaternion.multiply(turn.value, turn.inv, first)
        rest = math.degrees(2 * math.acos(min(1.0, abs(product[0 if first else 3]))))
        rests[name, first] = rest
        print(f"SEEN 90 degrees about {name}, scalar {'first' if first else 'last'}: inv {np.round(turn.inv, 3)}, inverse() {np.round(sound, 3)}: q * inv turns by {rest:.0f} degrees")
        assert np.allclose(Quaternion.multiply(turn.value, sound, first), [1, 0, 0, 0] if first else [0, 0, 0, 1])
        assert np.allclose(turn.conj, sound)
assert abs(rests["x", False] - 120) < 0.1 and abs(rests["z", False] - 120) < 0.1
assert rests["y", False] < 0.1 and all(rests[name, True] < 0.1 for name in "xyz")
PY
v/bin/python run.py

#!/bin/sh
# quatlib 0.1.0 (conversions between quaternions, rotation matrices and Euler angles), numpy 2.4.6, scipy 1.17.1: a rotation comes back as its inverse. rotMat2quatern() gives the quaternion of the matrix, as scipy does, and
# quatern2rotMat() and quatern2euler() take a quaternion for the inverse: there and back, a turn of 30 degrees about z is -30 degrees, and roll, pitch and yaw of 0.1, 0.2 and 0.3 rad become -0.04, -0.22 and -0.29: not only with other
# signs, as the order of the turns is the other one, too. euler2rotMat() and rotMat2euler() agree with each other, and with scipy. One convention for all is documented, and there is no error.
# Seen on 2026-11-30:  30 degrees about z, to a quaternion and back: -30.0   0.1, 0.2, 0.3 rad: by the matrix 0.100, 0.200, 0.300, by the quaternion -0.038, -0.220, -0.286
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps quatlib==0.1.0 numpy==2.4.6 scipy==1.17.1
cat > run.py <<'PY'
import numpy as np
import quatlib
from scipy.spatial.transform import Rotation

turn = Rotation.from_euler("z", 30, degrees=True)
back = quatlib.quatern2rotMat(quatlib.rotMat2quatern(turn.as_matrix()))
angle = np.degrees(np.arctan2(back[1, 0], back[0, 0]))
angles = np.array([0.1, 0.2, 0.3])
matrix = quatlib.euler2rotMat(*angles)
by_matrix = quatlib.rotMat2euler(matrix)
quaternion = quatlib.rotMat2quatern(matrix)
by_quaternion = quatlib.quatern2euler(quaternion)
x, y, z, w = Rotation.from_euler("ZYX", angles[::-1]).as_quat()
print(f"SEEN 30 degrees about z, there and back: {angle:.1f}; 0.1, 0.2, 0.3: by the matrix", by_matrix.round(3), "by the quaternion", by_quaternion.round(3))
assert np.allclose(matrix, Rotation.from_euler("ZYX", angles[::-1]).as_matrix()) and np.allclose(quaternion, [w, x, y, z])
assert np.allclose(by_matrix, angles) and np.allclose(back, turn.as_matrix().T) and abs(angle + 30) < 1e-9
inverse = Rotation.from_quat([x, y, z, w]).inv().as_euler("ZYX")[::-1]
assert np.allclose(by_quaternion, inverse) and by_quaternion[0] < 0 and by_quaternion[2] < 0
PY
v/bin/python run.py

#!/bin/sh
# fastquat 0.5.2, jax 0.10.2, numpy 2.4.6, scipy 1.17.1 (quaternions of jax): from_rotation_matrix(), "the normalized Quaternion tensor representing the rotation matrix", has one formula for all matrices, which divides by the real part: of a half turn it
# makes inf and NaN, and near one it is not normalized: at 179.97 degrees its length is 1.07 or 0.88, by the axis. A gripper that points down is a half turn from one that points up: its pose, as most of a robot's table, is one of these; by a hair beside
# it the quaternion of an observation or a label has another length in each sample. There is no error. The formula is usual for small turns only (scipy's chooses among four by the largest part), and tests up to 170 degrees see nothing: there the
# length is right to 1e-6. to_rotation_matrix() and rotate_vector() normalize or divide, so that a test of the way there and back is right to 0.01 degrees, except at the half turn itself.
# Seen on 2026-12-01:  about x: 170 degrees: length 1.000   179.9: 0.991   179.97: 1.072   180: 0, inf, nan, nan   about (0.6, 0, 0.8): 179.97: 0.876   scipy: 1 and 1, 0, 0, 0
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q fastquat==0.5.2 jax==0.10.2 jaxlib==0.10.2 numpy==2.4.6 scipy==1.17.1
cat > run.py <<'PY'
import jax.numpy as jnp
import numpy as np
from fastquat import Quaternion
from scipy.spatial.transform import Rotation

lengths = {}
for name, axis in {"x": (1.0, 0.0, 0.0), "tilted": (0.6, 0.0, 0.8)}.items():
    for degrees in (90, 170, 179.9, 179.97, 180):
        matrix = Rotation.from_rotvec(np.radians(degrees) * np.array(axis)).as_matrix()
        read = np.asarray(Quaternion.from_rotation_matrix(jnp.asarray(matrix, jnp.float32)).wxyz)
        other = Rotation.from_matrix(matrix.astype(np.float32)).as_quat(scalar_first=True)
        lengths[name, degrees] = length = float(np.linalg.norm(read))
        print(f"SEEN {degrees} degrees, axis {name}: {np.round(read, 3)}, length {length:.3f}; scipy {np.round(other, 3)}, {np.linalg.norm(other):.3f}")
        assert abs(np.linalg.norm(other) - 1) < 1e-6
assert all(abs(lengths[name, degrees] - 1) < 1e-5 for name in ("x", "tilted") for degrees in (90, 170))
assert abs(lengths["x", 179.97] - 1) > 0.05 and abs(lengths["tilted", 179.97] - 1) > 0.05
# The matrix of a gripper that points down, without any rounding.
down = np.asarray(Quaternion.from_rotation_matrix(jnp.diag(jnp.array([1.0, -1.0, -1.0]))).wxyz)
print(f"SEEN diag(1, -1, -1): {down}")
assert down[0] == 0 and not np.isfinite(down[1:]).any()
PY
v/bin/python run.py

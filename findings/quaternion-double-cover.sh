#!/bin/sh
# scipy 1.17.1, numpy-quaternion 2024.0.13, transforms3d 0.4.2, pyquaternion 0.9.9, pytransform3d 3.17.0: q and -q are one orientation, and filters and simulators change between them. The
# rotation vector of a turn by 40 degrees is 40 degrees long for scipy and pytransform3d in both cases, and 320 degrees for numpy-quaternion and transforms3d in the second one: an
# orientation's error, as a controller or a reward takes it, jumps. Halfway between q and -q's neighbor, pytransform3d's quaternion_slerp is 180 degrees beside the other three.
# Seen on 2026-11-29:  length for q and -q: scipy 40 40, pytransform3d 40 40, pyquaternion 40 40, numpy-quaternion 40 320, transforms3d 40 320 degrees
#                      halfway from 0 to 40 degrees, written as q and -q: scipy, numpy-quaternion, pyquaternion 20 20, pytransform3d 20 -160
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q numpy==2.4.6 scipy==1.17.1 numpy-quaternion==2024.0.13 transforms3d==0.4.2 pyquaternion==0.9.9
v/bin/pip install -q --no-deps pytransform3d==3.17.0
v/bin/python -W ignore - <<'PY'
import numpy as np, quaternion
from pyquaternion import Quaternion
from pytransform3d import rotations
from scipy.spatial.transform import Rotation, Slerp
from transforms3d.quaternions import quat2axangle

# All packages but scipy write w first.
start, end = np.array([1.0, 0, 0, 0]), np.array([np.cos(np.radians(20)), 0, 0, np.sin(np.radians(20))])
last = lambda q: np.roll(q, -1)
about_z = lambda q: np.degrees(2 * np.arctan2(q[3], q[0]))
lengths = {
    "scipy": lambda q: np.degrees(np.linalg.norm(Rotation.from_quat(last(q)).as_rotvec())),
    "pytransform3d": lambda q: np.degrees(rotations.axis_angle_from_quaternion(q)[3]),
    "pyquaternion": lambda q: abs(Quaternion(q).degrees),
    "numpy-quaternion": lambda q: np.degrees(np.linalg.norm(quaternion.as_rotation_vector(quaternion.quaternion(*q)))),
    "transforms3d": lambda q: np.degrees(quat2axangle(q)[1]),
}
halfway = {
    "scipy": lambda q: about_z(np.roll(Slerp([0, 1], Rotation.from_quat([last(start), last(q)]))(0.5).as_quat(canonical=True), 1)),
    "numpy-quaternion": lambda q: about_z(quaternion.as_float_array(quaternion.slerp_evaluate(quaternion.quaternion(*start), quaternion.quaternion(*q), 0.5))),
    "pyquaternion": lambda q: about_z(Quaternion.slerp(Quaternion(start), Quaternion(q), 0.5).elements),
    "pytransform3d": lambda q: about_z(rotations.quaternion_slerp(start, q, 0.5)),
}
seen = {}
for what, packages in (("length", lengths), ("halfway", halfway)):
    for name, compute in packages.items():
        # An angle of -340 degrees is 20.
        seen[what, name] = [(round(float(compute(q))) + 179) % 360 - 179 if what == "halfway" else round(float(compute(q))) for q in (end, -end)]
        print(what, name, *seen[what, name])
for name in lengths:
    assert seen["length", name] == [40, 320 if name in ("numpy-quaternion", "transforms3d") else 40]
for name in halfway:
    assert seen["halfway", name] == [20, -160 if name == "pytransform3d" else 20]
PY

#!/bin/sh
# AHRS 0.4.0, numpy 2.4.6: two classes of one package take the argument rpy (roll, pitch, yaw) in opposite orders: Quaternion(rpy=[0.3, 0, 0]) rolls by 0.3 rad, DCM(rpy=[0.3, 0, 0]) yaws by 0.3 rad. DCM.to_rpy(), which documents "roll-
# pitch-yaw angles", gives neither back: of DCM(rpy=[0.3, 0.5, 0.7]) it makes -0.65, -0.57, 0.08, the angles of the opposite rotation (the transpose), and of a plain roll it has the wrong sign. The way through
# to_quaternion() and Quaternion.to_angles() gives the right ones. There is no error. A tilt in a policy's observation that goes through the matrix falls to the other side.
# Seen on 2026-11-30:  rpy=[0.3, 0, 0]: Quaternion rolls, DCM yaws   body rolled by +0.3: DCM.to_rpy -0.3 0 0, by its quaternion 0.3 0 0   DCM(rpy=[0.3, 0.5, 0.7]).to_rpy(): -0.65 -0.57 0.08
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q AHRS==0.4.0 numpy==2.4.6 scipy==1.17.1
v/bin/python - <<'PY'
import numpy as np
from ahrs import DCM, Quaternion
from scipy.spatial.transform import Rotation

roll, yaw = Rotation.from_euler("x", 0.3).as_matrix(), Rotation.from_euler("z", 0.3).as_matrix()
assert np.allclose(Quaternion(rpy=np.array([0.3, 0.0, 0.0])).to_DCM(), roll)
assert np.allclose(DCM(rpy=[0.3, 0.0, 0.0]), yaw)
rolled = DCM(roll)
direct, through = rolled.to_rpy(), Quaternion(rolled.to_quaternion()).to_angles()
print("SEEN rolled by +0.3: DCM.to_rpy", (direct + 0.0).round(2), "  through its quaternion", through.round(2))
assert np.allclose(direct, [-0.3, 0.0, 0.0]) and np.allclose(through, [0.3, 0.0, 0.0])
there = [0.3, 0.5, 0.7]
back = DCM(rpy=there).to_rpy()
print("SEEN DCM(rpy=[0.3, 0.5, 0.7]).to_rpy():", back.round(2))
opposite = Rotation.from_matrix(DCM(rpy=there).T).as_euler("ZYX")[::-1]
assert np.allclose(back, [-0.647, -0.5713, 0.0822], atol=1e-3) and np.allclose(back, opposite)
assert np.allclose(Quaternion(rpy=np.array(there)).to_angles(), there)
PY

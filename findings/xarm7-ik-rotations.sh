#!/bin/sh
# xarm7-ik 0.3.2, nlopt 2.11.0, numba 0.68.1 (inverse kinematics of UFACTORY's xArm7): the README's rotation_repr has no effect: the constructor puts
# the name over the value that the method compares, so that the input is always a quaternion (w, x, y, z). An axis and an angle, four numbers as well,
# are normalized to one: a quarter turn about x is solved as one of 115 degrees about z. inverse_kinematics() and forward_kinematics() of one object
# speak of frames that are turned by 180 degrees about x: the pose that forward_kinematics() gives, put in again at the same joints, is half a turn
# away; the solver does not leave its start then, and returns these joints as the solution. The lower limit of joint 4 is -1.9198 rad, and -0.19198,
# -11 degrees, in the arm's manual: solutions are up to 61 degrees beyond the stop. There is no error.
# Seen on 2026-11-30:  "axis-angle" (1, 0, 0), 90 degrees: 115 degrees about z, 135 off   forward pose put in again: joints the same, 180 degrees off
# 2 of 56 solutions with joint 4 at -72 and -54 degrees (-11)
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps xarm7-ik==0.3.2 nlopt==2.11.0 numba==0.68.1 llvmlite==0.50.0 numpy==2.4.6 scipy==1.17.1
cat > run.py <<'PY'
import numpy as np
from scipy.spatial.transform import Rotation
from xarm7_ik.solver import InverseKinematicsSolver

LOWER_4 = np.radians(-11)  # joint 4, manual of the arm
home = np.array([0, -0.3, 0, 0.9, 0, 1.2, 0.0])


def turn(wxyz):
    return Rotation.from_quat(np.roll(wxyz, -1))


def apart(one, other):
    return np.degrees((one.inv() * other).magnitude())


solver = InverseKinematicsSolver()
# The frame of the input: the gripper's, half a turn about x from the one of forward_kinematics().
flip = Rotation.from_quat([1, 0, 0, 0])
rng = np.random.default_rng(1)
low, high = [-3, -1.5, -3, 0.2, -3, -1.2, -3], [3, 1.5, 3, 3.0, 3, 2.8, 3]
solved, beyond = 0, []
for _ in range(60):
    position, rotation = solver.forward_kinematics(rng.uniform(low, high))
    target = np.roll((flip.inv() * turn(rotation)).as_quat(), 1)
    joints = solver.inverse_kinematics(home.copy(), position, target)
    reached, got = solver.forward_kinematics(joints)
    if np.linalg.norm(reached - position) < 1e-3 and apart(turn(got), turn(rotation)) < 0.1:
        solved += 1
        if joints[3] < LOWER_4:
            beyond.append(round(float(np.degrees(joints[3])), 1))
print(f"SEEN solved {solved} of 60, joint 4 below -11 degrees: {beyond}; lower limit of the package {np.degrees(solver.lower_bounds[3]):.1f}")

position, rotation = solver.forward_kinematics(home)
again = solver.inverse_kinematics(home.copy(), position, rotation)
_, got = solver.forward_kinematics(again)
print(
    f"SEEN forward pose put in again: joints changed by {np.abs(again - home).max():.1g}, {apart(flip * turn(rotation), turn(got)):.0f} degrees off"
)

axis = InverseKinematicsSolver(rotation_repr="axis-angle")
joints = axis.inverse_kinematics(home.copy(), position, np.array([1.0, 0.0, 0.0, np.pi / 2]))
solution = flip.inv() * turn(axis.forward_kinematics(joints)[1])
asked = Rotation.from_euler("x", 90, degrees=True)
print(
    "SEEN quarter turn about x by axis and angle: solved for",
    solution.as_rotvec(degrees=True).round(1) + 0.0,
    f"degrees, {apart(asked, solution):.0f} degrees off",
)
assert solved > 50 and len(beyond) > 0 and abs(solver.lower_bounds[3] + 1.9198) < 1e-9
assert np.abs(again - home).max() < 1e-6 and apart(flip * turn(rotation), turn(got)) > 179
assert apart(asked, solution) > 130 and abs(solution.as_rotvec(degrees=True)[2] - 115) < 0.1
PY
v/bin/python run.py

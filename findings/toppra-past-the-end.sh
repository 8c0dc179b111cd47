#!/bin/sh
# toppra 0.6.10, ruckig 0.19.4: asked for a time past the end of a trajectory, which a loop's last steps and a late one do, toppra goes on along its polynomial and leaves the goal: of a motion that ends at rest at (1, 0) rad, 0.5 s
# later the target is (0.81, 0.26), and 1 s later it moves at 2.2 rad/s where the limit is 1. Before the start it is worse: with parametrizer="ParametrizeConstAccel" the target 0.1 s before is (0.96, -6.56) for a start at (0, 0).
# ruckig stays at the goal after the end, and goes on before the start as toppra does: 0.1 s before, -0.05 rad for a start at 0.5 rad/s. There is no error and no warning. Times have to be limited by the caller.
# Seen on 2026-11-30:  toppra 0.5 s after the end: (0.81, 0.26), 1 s after: 2.2 rad/s   0.1 s before the start: (0.00, 0.01), ConstAccel (0.96, -6.56)   ruckig after the end: at the goal
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q toppra==0.6.10 ruckig==0.19.4 numpy==2.4.6 scipy==1.17.1
v/bin/python -W error - <<'PY'
import numpy as np
import ruckig, toppra
from toppra import SplineInterpolator
from toppra.algorithm import TOPPRA
from toppra.constraint import JointAccelerationConstraint, JointVelocityConstraint

toppra.setup_logging("ERROR")
path = SplineInterpolator([0, 0.5, 1], [[0, 0], [0.3, 0.6], [1, 0]])
limit = np.array([[-1.0, 1.0], [-1.0, 1.0]])
constraints = [JointVelocityConstraint(limit), JointAccelerationConstraint(2 * limit)]
plain, constant = (TOPPRA(constraints, path, parametrizer=name).compute_trajectory() for name in ("ParametrizeSpline", "ParametrizeConstAccel"))

end = plain.duration
later, speed = plain(end + 0.5), np.abs(plain(end + 1.0, 1)).max()
before = plain(-0.1), constant(-0.1)
print(f"SEEN toppra: after {later.round(2).tolist()}, speed {speed:.2f}, before {before[0].round(2).tolist()}, {before[1].round(2).tolist()}")
assert np.allclose(plain(end), [1, 0], atol=1e-6) and np.allclose(plain(end, 1), 0, atol=1e-6)
assert np.allclose(later, [0.81, 0.26], atol=0.01) and speed > 2
assert np.allclose(before[0], [0, 0.01], atol=0.01) and before[1][1] < -5

joint = ruckig.InputParameter(1)
joint.current_position, joint.current_velocity, joint.current_acceleration = [0.0], [0.5], [0.0]
joint.target_position, joint.max_velocity, joint.max_acceleration, joint.max_jerk = [1.0], [1.0], [2.0], [10.0]
trajectory = ruckig.Trajectory(1)
ruckig.Ruckig(1).calculate(joint, trajectory)
after, early = (trajectory.at_time(time)[0][0] for time in (trajectory.duration + 1.0, -0.1))
print(f"SEEN ruckig: after {after:.3f}, before {early:.3f}")
assert abs(after - 1) < 1e-6 and -0.1 < early < -0.03
PY

#!/bin/sh
# robot-ik 0.4.0 (toolkit of arms with six joints), profiles of a move. trapezoidal_velocity_profile() with more time than the move needs runs it with
# a peak that does not fit: the deceleration goes on after the stop, the joint turns back, faster than v_max, and the last sample jumps to the goal. A
# move of 2 rad in 10 s, with limits of 1 rad/s and 1 rad/s2, goes to 2 rad, back to -2.57 rad at -3 rad/s, and is at 2 rad in the next sample. By its
# documentation it "Adjusts peak velocity to match the specified duration while respecting limits". With too little time (2 s for a move of 3 s) the
# joint is at 1 rad and then at 2. s_curve_profile() uses none of v_max, a_max and j_max: it is a quintic over the duration, "7-segment S-curve
# velocity profile with jerk limitation" by its documentation, with 1.9 times the speed, 2.9 times the acceleration and 7.5 times the jerk of the
# limits. There is no error.
# Seen on 2026-11-30:  2 rad in 10 s: back to -2.57 at -3.02 rad/s, then 2.00   in 6 s: 0.89, then 2.00   in 2 s: 1.00, then 2.00   S-curve in 2 s,
# limits 1, 1, 2: 1.88 rad/s, 2.89 rad/s2, jerk 15 rad/s3; the same for limits of 0.01
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps robot-ik==0.4.0 numpy==2.4.6
cat > run.py <<'PY'
import numpy as np
from robot_ik.trajectory.module import s_curve_profile, trapezoidal_velocity_profile

start, goal = np.zeros(1), np.full(1, 2.0)
limits = [np.ones(1), np.ones(1)]
seen = {}
for duration in (2.0, 3.0, 4.0, 6.0, 10.0):
    move = trapezoidal_velocity_profile(start, goal, duration, *limits)
    positions, speeds = move.joint_positions[:, 0], move.joint_velocities[:, 0]
    seen[duration] = positions[-2], positions[-1], speeds.min()
    print(
        f"SEEN 2 rad in {duration:.0f} s: last samples {positions[-2]:.2f} and {positions[-1]:.2f} rad,"
        f" speed {speeds.min():.2f} to {speeds.max():.2f} rad/s, farthest {positions.max():.2f}"
    )
assert abs(seen[3.0][0] - 2) < 1e-3, "the duration that fits"
assert seen[10.0][0] < -2.5 and seen[10.0][2] < -3 and seen[6.0][0] < 1 and seen[2.0][0] < 1.02
assert all(end == 2.0 for _, end, _ in seen.values())


def s_curve(speed, acceleration, jerk):
    move = s_curve_profile(start, goal, 2.0, np.full(1, speed), np.full(1, acceleration), np.full(1, jerk), dt=0.001)
    return move, [
        float(np.abs(values).max()) for values in (move.joint_velocities, move.joint_accelerations, np.diff(move.joint_accelerations[:, 0]) / 0.001)
    ]


move, reached = s_curve(1.0, 1.0, 2.0)
tiny, _ = s_curve(0.01, 0.01, 0.01)
print(
    "SEEN S-curve in 2 s, limits of 1, 1 and 2: speed, acceleration, jerk",
    [round(value, 2) for value in reached],
    "the same with limits of 0.01:",
    bool((move.joint_positions == tiny.joint_positions).all()),
)
assert reached[0] > 1.8 and reached[1] > 2.8 and reached[2] > 14 and (move.joint_positions == tiny.joint_positions).all()
PY
v/bin/python run.py

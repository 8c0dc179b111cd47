#!/bin/sh
# amp-rsl-rl 2.2.3, torch 2.15.0, rsl-rl-lib 5.5.1, numpy 2.4.6, scipy 1.17.1 (policies of legged robots that imitate recorded motions, Adversarial Motion Priors): slow_down_factor, documented as "integer factor to slow down original data" and in the
# runner as "slowdown applied to real motion data", makes the motion faster: the time step of the recording is divided by it, where it should be multiplied. With 2, a recorded walk of 2 m/s that lasts 2 s becomes one of 4 m/s that lasts 1 s, with joint
# velocities twice those of the recording, and with 4 it is 8 m/s. The discriminator then rewards the robot for running, and the resets start at these speeds; a user who slows a human's motion down because the robot can't follow makes it worse, by the
# square of the factor to what was meant. There is no error. With a factor of 1 and a finer step of the simulation, a recording of n frames is 1/n too slow (11 frames at 50 Hz: 1.86 m/s for 2), since n frames are spread over n steps of time, not n - 1.
# Seen on 2026-12-01:  walk of 2 m/s, 101 frames at 50 Hz:  factor 1: 2.00 m/s, 101 frames   2: 4.08 m/s, 50   4: 8.33 m/s, 25   11 frames, simulation at 200 Hz, factor 1: 1.86 m/s
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q amp-rsl-rl==2.2.3 torch==2.15.0 rsl-rl-lib==5.5.1 numpy==2.4.6 scipy==1.17.1
cat > run.py <<'PY'
from pathlib import Path

import numpy as np
from amp_rsl_rl.utils.motion_loader import AMPLoader


def walk(frames, factor, step):
    """The speed, the joint's velocity and the length of a recorded walk of 2 m/s with a joint at 1 rad/s."""
    times = np.arange(frames) / 50
    np.save("walk.npy", {
        "joints_list": ["knee"],
        "joint_positions": [np.array([t]) for t in times],
        "root_position": [np.array([2 * t, 0.0, 0.8]) for t in times],
        "root_quaternion": [np.array([0.0, 0.0, 0.0, 1.0]) for _ in times],
        "fps": 50.0,
    }, allow_pickle=True)
    data = AMPLoader("cpu", Path("."), {"walk": 1.0}, step, factor).motion_data[0]
    speed, joint = float(data.base_lin_velocities_local[1, 0]), float(data.joint_velocities[1, 0])
    print(f"SEEN walk of 2 m/s, joint at 1 rad/s, {frames} frames at 50 Hz, simulation at {1 / step:.0f} Hz, slow_down_factor {factor}: {speed:.2f} m/s, {joint:.2f} rad/s, {len(data)} frames")
    return speed, joint, len(data)


same = walk(101, 1, 0.02)
assert abs(same[0] - 2) < 0.01 and abs(same[1] - 1) < 0.01
for factor in (2, 4):
    speed, joint, frames = walk(101, factor, 0.02)
    assert 0 < speed / (2 * factor) - 1 < 0.05 and abs(joint - speed / 2) < 1e-3 and frames == 101 // factor
assert abs(walk(11, 1, 0.005)[0] - 1.86) < 0.005
PY
v/bin/python run.py

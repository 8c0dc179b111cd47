#!/bin/sh
# robotics-numpy 0.1.0 (kinematics of arms, numpy 2.4.6): jacob0() of a DHRobot with a tool counts the tool's offset twice: the pose of the last link
# that it starts from has the tool in it already, and the offset is added once more. A robot with a tool of 0.2 m is led by the Jacobian of one with
# 0.4 m: the velocities of the hand are off by up to 0.17 m/s per rad/s, and a step by it misses by as much. fkine() is right, and without a tool, or
# with one that only turns, so is jacob0(). There is no error.
# Seen on 2026-11-30:  largest difference of jacob0() and the differences of fkine(): no tool 1e-10   tool that turns 0.7 rad 1e-10   tool of 0.2 m
# 0.165 m/s, the same as a tool of 0.4 m to 1e-10
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps robotics-numpy==0.1.0 numpy==2.4.6
cat > run.py <<'PY'
import contextlib
import io

import numpy as np
from robotics_numpy.models import DHRobot
from robotics_numpy.models.dh_link import create_6dof_revolute_arm
from robotics_numpy.transforms import SE3

Q = np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.6])


def robot(tool):
    # The package prints each limit.
    with contextlib.redirect_stdout(io.StringIO()):
        return DHRobot(create_6dof_revolute_arm(), tool=tool)


def differences(arm):
    """The linear part of the Jacobian from fkine()."""
    columns = []
    for place in range(6):
        step = np.eye(6)[place] * 1e-6
        columns.append((arm.fkine(Q + step).t - arm.fkine(Q - step).t) / 2e-6)
    return np.array(columns).T


def apart(one, other):
    return float(np.abs(one - other).max())


none, turned, short, long = (robot(tool) for tool in (SE3(), SE3.Ry(0.7), SE3.Trans(0, 0, 0.2), SE3.Trans(0, 0, 0.4)))
arms = {"no tool": none, "tool that turns": turned, "tool of 0.2 m": short}
off = {name: apart(arm.jacob0(Q)[:3], differences(arm)) for name, arm in arms.items()}
twice = apart(short.jacob0(Q)[:3], differences(long))
print("SEEN jacob0() and fkine() apart by (m/s per rad/s):", {name: f"{value:.3g}" for name, value in off.items()})
print(f"SEEN jacob0() with a tool of 0.2 m and fkine() with one of 0.4 m: {twice:.1g}")
assert off["no tool"] < 1e-8 and off["tool that turns"] < 1e-8 and off["tool of 0.2 m"] > 0.1 and twice < 1e-8
PY
v/bin/python run.py

#!/bin/sh
# forwardkinematics 1.2.3, casadi 3.6.7, numpy 1.26.4, urdf-parser-py 0.0.4 (symbolic kinematics of a URDF file, for model predictive control): with base_type="diffdrive", the state is x, y and heading of the base and then the joints (n() counts
# 3 more), and the joints are read one place too early: the first joint of the arm takes the heading, and the last joint is not read at all. And numpy() and casadi(), two ways to one function, differ: casadi() ignores
# parent_link, and link_transformation, the tool's place in the last link's frame, is multiplied on the other side by numpy(), in the frame of the root: a tool 0.2 m along the hand of an arm that points to y is found 0.2 m along
# x. An optimizer's plan and the check of it disagree. There is no error.
# Seen on 2026-11-30:  base turned by 90 degrees, joints 0, 0: hand at -2.0, 0.0 (0, 2)   joint b from 0 to 90 degrees: no change   joint at 90 degrees, tool 0.2 m: casadi 0.0, 2.2, numpy 0.2, 2.0   hand in the forearm's frame: casadi 0.0, 2.0, numpy 1.0, 0.0
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q forwardkinematics==1.2.3 casadi==3.6.7 numpy==1.26.4 urdf-parser-py==0.0.4
cat > run.py <<'PY'
import math

import casadi as ca
import numpy as np
from forwardkinematics.urdfFks.urdfFk import URDFForwardKinematics

URDF = """<robot name="arm"><link name="base"/><link name="upper"/><link name="forearm"/><link name="hand"/>
<joint name="a" type="continuous"><parent link="base"/><child link="upper"/><axis xyz="0 0 1"/><origin xyz="0 0 0" rpy="0 0 0"/></joint>
<joint name="b" type="continuous"><parent link="upper"/><child link="forearm"/><axis xyz="0 0 1"/><origin xyz="1 0 0" rpy="0 0 0"/></joint>
<joint name="c" type="fixed"><parent link="forearm"/><child link="hand"/><origin xyz="1 0 0" rpy="0 0 0"/></joint>
</robot>"""
RIGHT = math.pi / 2


def place(matrix):
    return [round(float(number), 6) + 0.0 for number in np.array(matrix)[:2, 3]]


moving = URDFForwardKinematics(URDF, "base", ["hand"], base_type="diffdrive")
seen = {
    "turned base": place(moving.numpy(np.array([0.0, 0.0, RIGHT, 0.0, 0.0]), "hand")),
    "joint a": place(moving.numpy(np.array([0.0, 0.0, 0.0, RIGHT, 0.0]), "hand")),
    "joint b": place(moving.numpy(np.array([0.0, 0.0, 0.0, 0.0, RIGHT]), "hand")),
}
print("SEEN moving base, hand at:", seen, "states:", moving.n())
assert moving.n() == 5
assert seen == {"turned base": [-2.0, 0.0], "joint a": [1.0, 1.0], "joint b": [2.0, 0.0]}

fixed = URDFForwardKinematics(URDF, "base", ["hand"])
q = ca.SX.sym("q", 2)
state = np.array([RIGHT, 0.0])
tool = np.eye(4)
tool[0, 3] = 0.2


def both(**arguments):
    symbolic = ca.Function("f", [q], [fixed.casadi(q, "hand", **arguments)])(state)
    return place(symbolic), place(fixed.numpy(state, "hand", **arguments))


plain, tooled, relative = both(), both(link_transformation=tool), both(parent_link="forearm")
print("SEEN casadi and numpy: hand", plain, "tool", tooled, "hand in the forearm's frame", relative)
assert plain == ([0.0, 2.0], [0.0, 2.0])
assert tooled == ([0.0, 2.2], [0.2, 2.0])
assert relative == ([0.0, 2.0], [1.0, 0.0])
PY
v/bin/python run.py

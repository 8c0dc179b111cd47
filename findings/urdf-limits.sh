#!/bin/sh
# mujoco 4.0.0, yourdfpy 0.0.60, pin 4.1.0, pybullet 3.2.7, ikpy 4.2.1: five readers of one URDF file disagree about a joint's limits in two places where the format leaves something out. A revolute
# joint whose <limit> has effort and velocity only is locked by the format (lower and upper default to 0): Pinocchio has 0 to 0, MuJoCo and ikpy no limit, PyBullet 0 to -1, yourdfpy None.
# A continuous joint has no limits whatever its <limit> says: yourdfpy and PyBullet give them, and an action that is scaled by them covers half a turn. Pinocchio's continuous joint
# is two numbers (cosine and sine) with limits of 1.01, which moves all later joints by one place in q.
# Seen on 2026-11-29:  revolute: mujoco not limited, pin 0 0, yourdfpy None None, pybullet 0 -1, ikpy -inf inf   continuous with -1 2: mujoco not limited, pin -1.01 1.01 twice,
#                      yourdfpy -1 2, pybullet -1 2, ikpy -inf inf
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q mujoco==4.0.0 yourdfpy==0.0.60 pin==4.1.0 pybullet==3.2.7 ikpy==4.2.1 numpy==2.4.6
v/bin/python -W ignore - >out.txt 2>err.txt <<'PY' || { tail -n 20 out.txt err.txt; exit 1; }
import math

import mujoco, pinocchio, pybullet, yourdfpy
from ikpy.chain import Chain

INERTIA = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'


def limits(kind, limit):
    joint = f'<joint name="j" type="{kind}"><origin xyz="0 0 1" rpy="0 0 0"/><parent link="base"/><child link="tip"/><axis xyz="0 0 1"/>{limit}</joint>'
    open("robot.urdf", "w").write(f'<robot name="r"><link name="base">{INERTIA}</link><link name="tip">{INERTIA}</link>{joint}</robot>')
    model = mujoco.MjModel.from_xml_path("robot.urdf")
    own = pinocchio.buildModelFromUrdf("robot.urdf")
    described = yourdfpy.URDF.load("robot.urdf").actuated_joints[0].limit
    pybullet.connect(pybullet.DIRECT)
    simulated = pybullet.getJointInfo(pybullet.loadURDF("robot.urdf", useFixedBase=True), 0)[8:10]
    pybullet.disconnect()
    return {
        "mujoco": tuple(model.jnt_range[0]) if model.jnt_limited[0] else "not limited",
        "pin": (*own.lowerPositionLimit.round(2), *own.upperPositionLimit.round(2)),
        "yourdfpy": (described.lower, described.upper),
        "pybullet": simulated,
        "ikpy": Chain.from_urdf_file("robot.urdf", base_elements=["base"]).links[1].bounds,
    }


endless = (-math.inf, math.inf)
plain = limits("revolute", '<limit lower="-1" upper="2" effort="5" velocity="3"/>')
missing = limits("revolute", '<limit effort="5" velocity="3"/>')
continuous = limits("continuous", '<limit lower="-1" upper="2" effort="5" velocity="3"/>')
for name, found in (("revolute -1 2", plain), ("revolute without lower and upper", missing), ("continuous with -1 2", continuous)):
    print("SEEN", name, *(f"{reader} {value}  " for reader, value in found.items()))
assert all(value == (-1, 2) for value in plain.values())
assert missing == {"mujoco": "not limited", "pin": (0, 0), "yourdfpy": (None, None), "pybullet": (0, -1), "ikpy": endless}
assert continuous == {"mujoco": "not limited", "pin": (-1.01, -1.01, 1.01, 1.01), "yourdfpy": (-1, 2), "pybullet": (-1, 2), "ikpy": endless}
PY
grep SEEN out.txt

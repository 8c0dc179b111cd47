#!/bin/sh
# mink 1.3.0, mujoco 4.0.0: solve_ik() keeps joints within the model's ranges as long as no limits are passed. limits=[VelocityLimit(...)], which bounds the speed, takes the place of that: the ranges are not kept any more, and a joint with a
# range of 1 rad is sent to 1.66. There is no error, and no warning. Without limits, on the other hand, speeds are not bounded, 15 rad/s for a target that is not reached. Both are needed in the list. VelocityLimit has no message for a
# joint that its dictionary does not name: that one is not bounded.
# Seen on 2026-11-30:  ranges of -1 to 1: limits=None: 1.00 1.00, 15.2 rad/s   [VelocityLimit]: 1.12 1.66, 1.0 rad/s   both: 1.00 1.00, 1.0 rad/s   VelocityLimit of one joint: the other one 13 rad/s
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q mink==1.3.0 mujoco==4.0.0 numpy==2.4.6 daqp==0.11.0 qpsolvers==4.13.0
v/bin/python -W ignore - <<'PY'
import mink, mujoco
import numpy as np

ARM = """<mujoco><compiler angle="radian" autolimits="true"/><worldbody><body><joint name="a" axis="0 0 1" range="-1 1"/><geom type="capsule" fromto="0 0 0 0.4 0 0" size="0.02"/>
<body pos="0.4 0 0"><joint name="b" axis="0 0 1" range="-1 1"/><geom type="capsule" fromto="0 0 0 0.4 0 0" size="0.02"/><site name="tip" pos="0.4 0 0"/></body></body></worldbody></mujoco>"""
model = mujoco.MjModel.from_xml_string(ARM)


def solved(limits):
    """The joints after 10 s on the way to a target beyond the ranges, and the greatest speed of each."""
    arm = mink.Configuration(model)
    arm.update(np.array([0.2, 0.3]))
    task = mink.FrameTask("tip", "site", position_cost=1.0, orientation_cost=0.0)
    task.set_target(mink.SE3.from_translation(np.array([-0.2, 0.5, 0.0])))
    fastest = np.zeros(2)
    for _ in range(200):
        velocity = mink.solve_ik(arm, [task], 0.05, solver="daqp", limits=limits)
        fastest = np.maximum(fastest, np.abs(velocity))
        arm.integrate_inplace(velocity, 0.05)
    return arm.q, fastest


ranges, speeds = mink.ConfigurationLimit(model), mink.VelocityLimit(model, {"a": 1.0, "b": 1.0})
seen = {name: solved(limits) for name, limits in {"None": None, "speeds": [speeds], "both": [ranges, speeds], "one speed": [ranges, mink.VelocityLimit(model, {"a": 1.0})]}.items()}
for name, (joints, fastest) in seen.items():
    print(f"SEEN {name}: joints", joints.round(2), "  greatest speeds", fastest.round(1))
assert seen["None"][0].max() < 1.001 and seen["None"][1].max() > 10
assert seen["speeds"][0].max() > 1.6 and seen["speeds"][1].max() < 1.001
assert seen["both"][0].max() < 1.001 and seen["both"][1].max() < 1.001
assert seen["one speed"][1][0] < 1.001 and seen["one speed"][1][1] > 5
PY

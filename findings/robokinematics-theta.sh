#!/bin/sh
# RoboKinematics 1.0.2 (numpy 2.4.6, scipy 1.17.1, matplotlib 3.11.2): the parameter theta of a revolute joint, and the offset of a prismatic one,
# which each row of its table must name, are overwritten by the joint's value instead of added to it: f_kin([0, 0]) of an arm whose table has theta
# 90 gives the pose of theta 0, and a table from a data sheet, where offsets of 90 degrees are usual, describes another robot, in f_kin(), jacobian()
# and i_kin(). And quintic_trajectory() ends elsewhere when an acceleration at an end is not 0: three coefficients have those of the two ends
# exchanged. There is no error.
# Seen on 2026-11-30:  arm of 1 + 1 m, theta 90 and 0: hand at 2.0, 0.0 (0.0, 2.0)   quintic 0 to 1 in 1 s with a final acceleration of 1: ends at
# 0.5, speed -1.0; with an initial one of 2: 2.0, 2.0
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q RoboKinematics==1.0.2 numpy==2.4.6 scipy==1.17.1 matplotlib==3.11.2
cat > run.py <<'PY'
from RoboKinematics import CreateKinematicModel


def link(theta):
    return {"frame_name": "link", "joint_type": "r", "link_length": 1.0, "twist": 0.0, "offset": 0.0, "theta": theta}


hands = {}
for theta in (0.0, 90.0):
    arm = CreateKinematicModel([link(theta), link(0.0)], robot_name="arm")
    arm.f_kin([0, 0])
    hands[theta] = [round(float(value), 6) for value in arm.get_tcp()]
print("SEEN hand at joints 0, 0 by theta of the first row:", hands)
assert hands[90.0] == hands[0.0] == [2.0, 0.0, 0.0]

ends = {}
for name, (first, last) in {"no accelerations": (0, 0), "final 1": (0, 1), "initial 2": (2, 0)}.items():
    end = CreateKinematicModel.quintic_trajectory(0, 1, [0, 1], 0, 0, first, last, 1.0)
    ends[name] = [round(float(value), 6) for value in end]
print("SEEN place, speed, acceleration at the end of 0 to 1:", ends)
assert ends == {"no accelerations": [1.0, 0.0, 0.0], "final 1": [0.5, -1.0, -1.0], "initial 2": [2.0, 2.0, 4.0]}
PY
v/bin/python run.py

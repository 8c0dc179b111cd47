#!/bin/sh
# mujoco 4.0.0, yourdfpy 0.0.60, pin 4.1.0, pybullet 3.2.7: four readers of one URDF file give its joints three orders. MuJoCo and PyBullet go down each leg before
# they go to the next one; yourdfpy keeps the order of the file; Pinocchio goes down each leg, but takes the legs by their names' alphabet, so that another name
# changes the order. A policy's observation or action that goes from one to the other without names moves another joint.
# Seen on 2026-11-29:  mujoco, pybullet: right_hip right_ankle left_hip left_ankle   yourdfpy: right_hip left_hip right_ankle left_ankle
#                      pin: left_hip left_ankle right_hip right_ankle, and with the right hip named a_hip: a_hip right_ankle left_hip left_ankle
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q mujoco==4.0.0 yourdfpy==0.0.60 pin==4.1.0 pybullet==3.2.7 numpy==2.4.6
v/bin/python -W ignore - >out.txt 2>err.txt <<'PY' || { tail -n 20 out.txt err.txt; exit 1; }
import mujoco, pinocchio, pybullet, yourdfpy

inertia = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
link = '<link name="{}">' + inertia + "</link>"
joint = """<joint name="{}" type="revolute"><parent link="{}"/><child link="{}"/><axis xyz="0 1 0"/>
    <limit lower="-1" upper="1" effort="9" velocity="9"/></joint>"""


def orders(path, right_hip):
    links = ["base", "right_leg", "left_leg", "right_foot", "left_foot"]
    joints = [
        (right_hip, "base", "right_leg"), ("left_hip", "base", "left_leg"),
        ("right_ankle", "right_leg", "right_foot"), ("left_ankle", "left_leg", "left_foot"),
    ]
    body = "".join(link.format(name) for name in links) + "".join(joint.format(*names) for names in joints)
    open(path, "w").write(f'<robot name="r">{body}</robot>')
    model = mujoco.MjModel.from_xml_path(path)
    body = pybullet.loadURDF(path)
    return {
        "mujoco": [model.joint(i).name for i in range(model.njnt)],
        "pybullet": [pybullet.getJointInfo(body, i)[1].decode() for i in range(pybullet.getNumJoints(body))],
        "yourdfpy": list(yourdfpy.URDF.load(path).actuated_joint_names),
        "pin": list(pinocchio.buildModelFromUrdf(path).names)[1:],
    }


pybullet.connect(pybullet.DIRECT)
seen, renamed = orders("r.urdf", "right_hip"), orders("a.urdf", "a_hip")
for name, names in seen.items():
    print("SEEN", name, *names)
print("SEEN pin, with the right hip named a_hip:", *renamed["pin"])
down = ["right_hip", "right_ankle", "left_hip", "left_ankle"]
assert seen["mujoco"] == seen["pybullet"] == down
assert seen["yourdfpy"] == ["right_hip", "left_hip", "right_ankle", "left_ankle"]
assert seen["pin"] == ["left_hip", "left_ankle", "right_hip", "right_ankle"]
assert renamed["pin"] == ["a_hip", "right_ankle", "left_hip", "left_ankle"]
assert renamed["mujoco"] == ["a_hip", *down[1:]]
PY
grep SEEN out.txt

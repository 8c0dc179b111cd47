#!/bin/sh
# mujoco 4.0.0, yourdfpy 0.0.60, pin 4.1.0, pybullet 3.2.7: a gripper whose second finger mimics the first one has one joint for yourdfpy, and two for the others. MuJoCo
# couples the two by a constraint; Pinocchio (without mimic=True, which is not its default) and PyBullet do not couple them: told to close, one finger closes.
# A policy's observation has another length and other places from one to the other. MuJoCo also merges links at fixed joints: the IMU's is gone.
# Seen on 2026-11-29:  joints: yourdfpy 1, mujoco 2 with 1 constraint, pin 2 (mimic=True: 1), pybullet 2   second finger: yourdfpy -0.04 m, pin 0, pybullet 0
#                      mujoco's bodies: world left_finger right_finger
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q mujoco==4.0.0 yourdfpy==0.0.60 pin==4.1.0 pybullet==3.2.7 numpy==2.4.6
v/bin/python -W ignore - >out.txt 2>err.txt <<'PY' || { tail -n 20 out.txt err.txt; exit 1; }
import mujoco, numpy as np, pinocchio, pybullet, yourdfpy

inertia = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
links = "".join(f'<link name="{name}">{inertia}</link>' for name in ("base", "left_finger", "right_finger", "imu"))
joint = """<joint name="{0}" type="prismatic"><parent link="base"/><child link="{0}_finger"/><axis xyz="0 {1} 0"/>
    <limit lower="0" upper="0.04" effort="9" velocity="9"/>{2}</joint>"""
fixed = '<joint name="mount" type="fixed"><origin xyz="0.1 0 0.2"/><parent link="base"/><child link="imu"/></joint>'
joints = joint.format("left", 1, "") + joint.format("right", -1, '<mimic joint="left" multiplier="1"/>') + fixed
open("gripper.urdf", "w").write(f'<robot name="gripper">{links}{joints}</robot>')

model = mujoco.MjModel.from_xml_path("gripper.urdf")
bodies = [model.body(i).name for i in range(model.nbody)]
robot = yourdfpy.URDF.load("gripper.urdf")
robot.update_cfg({"left": 0.04})
places = {"yourdfpy": robot.get_transform("right_finger")[1, 3]}
plain = pinocchio.buildModelFromUrdf("gripper.urdf")
data = plain.createData()
pinocchio.forwardKinematics(plain, data, np.array([0.04, 0.0]))
places["pin"] = data.oMi[plain.getJointId("right")].translation[1]
mimic = pinocchio.buildModelFromUrdf("gripper.urdf", mimic=True)
pybullet.connect(pybullet.DIRECT)
body = pybullet.loadURDF("gripper.urdf", useFixedBase=True)
moving = [i for i in range(pybullet.getNumJoints(body)) if pybullet.getJointInfo(body, i)[2] != pybullet.JOINT_FIXED]
pybullet.setJointMotorControl2(body, 0, pybullet.POSITION_CONTROL, targetPosition=0.04, force=9)
pybullet.setJointMotorControl2(body, 1, pybullet.VELOCITY_CONTROL, force=0)
for _ in range(2000):
    pybullet.stepSimulation()
places["pybullet"] = -pybullet.getJointState(body, 1)[0]
first = pybullet.getJointState(body, 0)[0]
counts = {"yourdfpy": robot.num_actuated_joints, "mujoco": model.njnt, "pin": plain.nq, "pin, mimic=True": mimic.nq, "pybullet": len(moving)}
print("SEEN joints", counts, "constraints of mujoco", model.neq)
print("SEEN second finger at", {name: round(float(place), 3) for name, place in places.items()}, "first of pybullet", round(first, 3))
print("SEEN mujoco's bodies", *bodies)
assert counts == {"yourdfpy": 1, "mujoco": 2, "pin": 2, "pin, mimic=True": 1, "pybullet": 2} and model.neq == 1
assert abs(places["yourdfpy"] + 0.04) < 1e-6 and abs(places["pin"]) < 1e-9 and abs(places["pybullet"]) < 1e-3 and abs(first - 0.04) < 1e-3
assert bodies == ["world", "left_finger", "right_finger"]
PY
grep SEEN out.txt

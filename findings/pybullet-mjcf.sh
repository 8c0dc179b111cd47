#!/bin/sh
# pybullet 3.2.7, mujoco 4.0.0: PyBullet's loadMJCF leaves out what it does not know, without an error: of a body's orientation it reads quat, but not euler, axisangle or zaxis; a joint's range and
# ref are ignored (its limits are 1 to 0, which means none), and so are childclass and its defaults: masses are those of the default density. Each joint is also two links, of which one has no mass,
# so that the numbers of joints are twice those of MuJoCo. Positions, quat, joint positions and inertias are read right.
# Seen on 2026-11-29:  hand with euler 10 20 30: MuJoCo 0.280 0.284 0.661, PyBullet 0.218 0.300 0.682, as without; quat: equal   range -1 1: 1 0   density 100 by childclass: 4.8 kg, PyBullet 48
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q mujoco==4.0.0 pybullet==3.2.7 numpy==2.4.6
v/bin/python -W ignore - >out.txt 2>err.txt <<'PY' || { tail -n 20 out.txt err.txt; exit 1; }
import mujoco, numpy as np, pybullet

ROBOT = """<mujoco><compiler angle="{angle}"/><default><default class="light"><geom density="100"/></default></default>
<worldbody><body name="arm" pos="0.1 0.2 0.3" {body}><joint name="shoulder" type="hinge" axis="0 1 0" {joint}/><geom type="box" size=".1 .2 .3" pos=".05 0 .1"/>
  <body name="hand" pos="0 0.1 0.4"><joint name="wrist" type="hinge" axis="1 0 0"/><geom type="capsule" size=".05 .2"/></body>
</body></worldbody></mujoco>"""


def read(body="", joint="", angle="degree"):
    """Where the hand is, the mass of the arm and the limits of the shoulder, in MuJoCo and in PyBullet."""
    open("robot.xml", "w").write(ROBOT.format(body=body, joint=joint, angle=angle))
    model = mujoco.MjModel.from_xml_path("robot.xml")
    data = mujoco.MjData(model)
    data.qpos[:] = angles = 0.3, 0.2
    mujoco.mj_forward(model, data)
    pybullet.connect(pybullet.DIRECT)
    robot = pybullet.loadMJCF("robot.xml")[0]
    joints = [pybullet.getJointInfo(robot, i) for i in range(pybullet.getNumJoints(robot))]
    moving = [info for info in joints if info[2] != pybullet.JOINT_FIXED]
    links = {info[12].decode(): info[0] for info in joints}
    for info, value in zip(moving, angles):
        pybullet.resetJointState(robot, info[0], value)
    hand = pybullet.getLinkState(robot, links["hand"], computeForwardKinematics=True)[4]
    mass = pybullet.getDynamicsInfo(robot, links["arm"])[0]
    pybullet.disconnect()
    assert len(joints) == 4 and len(moving) == model.njnt == 2
    ours = data.body("hand").xpos, model.body("arm").mass[0], tuple(model.jnt_range[0])
    return ours, (np.array(hand), mass, moving[0][8:10])


plain = read()[1][0]
for parts in ({}, {"body": 'quat="1 2 3 4"'}, {"joint": 'pos=".05 .1 -.2"'}):
    there, found = read(**parts)
    assert np.abs(there[0] - found[0]).max() < 1e-5 and abs(there[1] - found[1]) < 1e-3
for parts in ({"body": 'euler="10 20 30"'}, {"body": 'axisangle="0 0 1 40"'}, {"body": 'zaxis="1 1 1"'}, {"joint": 'ref="30"'}):
    there, found = read(**parts)
    print("SEEN", *parts.values(), "hand: MuJoCo", there[0].round(3), "PyBullet", found[0].round(3))
    assert np.abs(there[0] - found[0]).max() > 0.02 and np.abs(found[0] - plain).max() < 1e-6
there, found = read(joint='range="-1 1"', angle="radian")
print("SEEN range -1 1: MuJoCo", *map(float, there[2]), "PyBullet", *map(float, found[2]))
assert there[2] == (-1, 1) and found[2] == (1, 0)
there, found = read(body='childclass="light"')
print(f"SEEN childclass of density 100: MuJoCo {there[1]:.1f} kg, PyBullet {found[1]:.1f} kg")
assert abs(there[1] - 4.8) < 1e-6 and abs(found[1] - 48) < 1e-3
PY
grep SEEN out.txt

#!/bin/sh
# mujoco 4.0.0, pin 4.1.0, urchin 0.0.30, yourdfpy 0.0.60, kinpy 0.6.1, ikpy 4.2.1: six readers of one URDF file disagree about an axis that is not of length 1, such as "1 1 0", which the format asks to be normalized. A slide of 0.5 m
# along it moves 0.5 m in MuJoCo, Pinocchio and urchin, and 0.71 m in yourdfpy, kinpy and ikpy. For a turn about "0 0 2", all are right but ikpy, whose matrix then is no rotation: it stretches what comes after the joint,
# here by 1.37 along the axis and 1.30 across it, so that a tool 1 m away is 1.3 m away. ikpy's inverse kinematics use that, too. There is no error and no warning.
# Seen on 2026-11-30:  slide of 0.5: 0.500 m mujoco, pin, urchin   0.707 m yourdfpy, kinpy, ikpy   tool at 1 m, after the turn: 1.000 m, ikpy 1.300 m, determinant 2.310
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q mujoco==4.0.0 pin==4.1.0 urchin==0.0.30 yourdfpy==0.0.60 kinpy==0.6.1 ikpy==4.2.1 numpy==2.4.6 scipy==1.17.1
v/bin/python -W ignore - <<'PY'
import ikpy.chain, kinpy, mujoco, pinocchio, urchin, yourdfpy
import numpy as np

mass = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
limit = '<limit lower="-1" upper="1" effort="1" velocity="1"/>'
urdf = f"""<robot name="arm"><link name="base"/><link name="carriage">{mass}</link><link name="hand">{mass}</link>
<joint name="slide" type="prismatic"><parent link="base"/><child link="carriage"/><axis xyz="1 1 0"/>{limit}</joint>
<joint name="turn" type="revolute"><parent link="carriage"/><child link="hand"/><axis xyz="0 0 2"/>{limit}</joint></robot>"""
open("arm.urdf", "w").write(urdf)
names, values = ("slide", "turn"), np.array([0.5, 0.5])
state = dict(zip(names, values))


def by_mujoco():
    model = mujoco.MjModel.from_xml_string(urdf)
    data = mujoco.MjData(model)
    data.qpos[:] = values
    mujoco.mj_kinematics(model, data)
    return data.xmat[-1].reshape(3, 3), data.xpos[-1]


def by_pinocchio():
    model = pinocchio.buildModelFromXML(urdf)
    data = model.createData()
    pinocchio.forwardKinematics(model, data, values)
    return data.oMi[2].rotation, data.oMi[2].translation


def by_yourdfpy():
    robot = yourdfpy.URDF.load("arm.urdf", load_meshes=False)
    robot.update_cfg(state)
    pose = robot.get_transform("hand")
    return pose[:3, :3], pose[:3, 3]


def split(pose):
    return pose[:3, :3], pose[:3, 3]


poses = {
    "mujoco": by_mujoco(),
    "pin": by_pinocchio(),
    "urchin": split(urchin.URDF.load("arm.urdf").link_fk(state, link="hand")),
    "yourdfpy": by_yourdfpy(),
    "kinpy": split(kinpy.build_chain_from_urdf(urdf).forward_kinematics(state)["hand"].matrix()),
    "ikpy": split(ikpy.chain.Chain.from_urdf_file("arm.urdf", base_elements=["base"]).forward_kinematics([0, *values])),
}
for name, (rotation, place) in poses.items():
    slide, tool, volume = np.linalg.norm(place), np.linalg.norm(rotation @ [1, 0, 0]), np.linalg.det(rotation)
    print(f"SEEN {name}: slide {slide:.3f} m, tool at {tool:.3f} m, determinant {volume:.3f}")
    assert abs(slide - (0.5 if name in ("mujoco", "pin", "urchin") else 0.5 * np.sqrt(2))) < 1e-6
    if name == "ikpy":
        assert tool > 1.29 and volume > 2.3
    else:
        assert abs(tool - 1) < 1e-6 and abs(volume - 1) < 1e-6
PY

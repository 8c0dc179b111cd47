#!/bin/sh
# urdf-to-mjcf 0.1.1, urdf-mujoco-converter 0.1.0, mujoco 3.11.0: urdf-to-mjcf writes another robot than the URDF file has. The joint that mimics leads: thumb = 0.5 finger + 0.1 becomes finger = 0.5 thumb + 0.1
# (with a multiplier of 1 or -1 and no offset it looks right). The mass of the first link is lost; MuJoCo makes one of its box, by the density of water: 6 kg where 1 kg is stated. Damping, friction and effort of
# the joints are lost: the motors have no limit, and the mimicking joint has one, too. There is no error and no warning of these. urdf-mujoco-converter keeps all but the effort, of which it warns.
# Seen on 2026-11-29:  thumb 0.6, finger 1: error of the coupling 0.6 rad, 0 in the other converter's; finger 0.6, thumb 1: 0   base 6 kg (1)   damping 0 (0.5), friction 0 (0.2)   motors 2
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q urdf-to-mjcf==0.1.1 urdf-mujoco-converter==0.1.0 mujoco==3.11.0 numpy==2.4.6
v/bin/python -W ignore - >out.txt 2>err.txt <<'PY' || { tail -n 20 out.txt err.txt; exit 1; }
import pathlib, subprocess

import mujoco

link = lambda name, mass, more="": f'<link name="{name}"><inertial><mass value="{mass}"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>{more}</link>'
joint = """<joint name="{0}" type="revolute"><parent link="base"/><child link="{0}_link"/><origin xyz="{1} 0 0.5"/><axis xyz="0 1 0"/>
<limit lower="-2" upper="2" effort="30" velocity="10"/><dynamics damping="0.5" friction="0.2"/>{2}</joint>"""
robot = '<robot name="hand">' + link("base", 1, '<collision><geometry><box size="0.1 0.2 0.3"/></geometry></collision>') + link("finger_link", 0.1) + link("thumb_link", 0.1)
robot += joint.format("finger", 0.1, "") + joint.format("thumb", -0.1, '<mimic joint="finger" multiplier="0.5" offset="0.1"/>') + "</robot>"
pathlib.Path("hand.urdf").write_text(robot)

subprocess.run(["v/bin/urdf-to-mjcf", "hand.urdf"], check=True)
subprocess.run(["v/bin/urdf-mujoco-converter", "hand.urdf", "second"], check=True)
seen = {}
for name, folder in (("urdf-to-mjcf", "output_mjcf"), ("urdf-mujoco-converter", "second")):
    model = mujoco.MjModel.from_xml_path(f"{folder}/robot.xml")
    data = mujoco.MjData(model)
    errors = []
    for finger, thumb in ((1.0, 0.6), (0.6, 1.0)):
        mujoco.mj_resetData(model, data)
        for joint_name, position in (("finger", finger), ("thumb", thumb)):
            data.qpos[model.joint(joint_name).qposadr[0]] = position
        mujoco.mj_forward(model, data)
        errors.append(round(abs(float(data.efc_pos[0])), 6))
    base = next(model.body_mass[index] for index in range(1, model.nbody) if model.body(index).name.startswith("base"))
    seen[name] = (errors, round(float(base), 6), float(model.joint("finger").damping[0]), float(model.joint("finger").frictionloss[0]), model.nu)
    print(f"SEEN {name}: thumb 0.6, finger 1: {errors[0]}; thumb 1, finger 0.6: {errors[1]}; base {base:.1f} kg, damping {seen[name][2]}, friction {seen[name][3]}, motors {model.nu}")
    if model.nu:
        limited = [bool(model.actuator_forcelimited[index] or model.actuator_ctrllimited[index]) for index in range(model.nu)] + [bool(model.jnt_actfrclimited.any())]
        print("SEEN   limits of the motors:", limited)
        assert not any(limited)
assert seen["urdf-to-mjcf"] == ([0.6, 0.0], 6.0, 0.0, 0.0, 2)
assert seen["urdf-mujoco-converter"][0][0] == 0 and seen["urdf-mujoco-converter"][1:4] == (1.0, 0.5, 0.2)
PY
grep SEEN out.txt

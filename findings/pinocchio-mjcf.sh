#!/bin/sh
# pin 4.1.0, mujoco 4.0.0: Pinocchio's buildModelFromMJCF reads another robot than MuJoCo from the same file, without an error. It converts the range of a slide joint from degrees to radians, as
# that of a hinge (degrees are MJCF's default): a slide of -0.3 to 0.4 m becomes -5 to 7 mm. A body in a <frame> is left out, with its joint. An axisangle whose axis has not length 1 makes
# a rotation that is none, and eulerseq="XYZ" is taken for "xyz". A geom that does not collide (contype and conaffinity 0) has no mass, and the gravity of <option> is ignored.
# Seen on 2026-11-29:  slide -0.3 0.4: -0.0052 0.0070   joints with a frame: MuJoCo 2, Pinocchio 1   axisangle 1 2 3 40: determinant of the rotation far from 1   eulerseq XYZ: 0.17 beside
#                      mass without collision: 2 kg, Pinocchio 0   gravity -3: -9.81   euler, quat, zaxis, ref, joint positions, defaults and inertias: equal to 1e-6
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q mujoco==4.0.0 pin==4.1.0 numpy==2.4.6
v/bin/python -W ignore - >out.txt 2>err.txt <<'PY' || { tail -n 20 out.txt err.txt; exit 1; }
import mujoco, numpy as np, pinocchio

ROBOT = """<mujoco><compiler {compiler}/><option {option}/><worldbody><body name="arm" pos="0.1 0.2 0.3" {body}>
  <joint name="hinge" axis="0 1 0" {hinge}/><geom type="box" size=".1 .2 .3" mass="2" {geom}/>
  {before}<body name="hand" pos="0 0.1 0.4"><joint name="slide" type="slide" axis="1 0 0" {slide}/><geom type="capsule" size=".05 .2"/></body>{after}
</body></worldbody></mujoco>"""
PARTS = dict.fromkeys(("compiler", "option", "body", "hinge", "geom", "before", "slide", "after"), "")


def read(**parts):
    open("robot.xml", "w").write(ROBOT.format(**PARTS | parts))
    return mujoco.MjModel.from_xml_path("robot.xml"), pinocchio.buildModelFromMJCF("robot.xml")


def hands(model, own):
    """Where the hand is in both, and Pinocchio's rotation of it."""
    q = np.array([0.3, 0.1])
    data, own_data = mujoco.MjData(model), own.createData()
    data.qpos[:] = q
    mujoco.mj_forward(model, data)
    pinocchio.framesForwardKinematics(own, own_data, q)
    frame = own_data.oMf[own.getFrameId("hand")]
    return data.body("hand").xpos, frame.translation, frame.rotation


for parts in ({}, {"body": 'euler="10 20 30"'}, {"body": 'zaxis="1 1 1"'}, {"hinge": 'ref="30" pos="0 .1 .2"'}, {"compiler": 'eulerseq="zyx"', "body": 'euler="10 20 30"'}):
    model, own = read(**parts)
    there, found, _ = hands(model, own)
    assert np.abs(there - found).max() < 1e-6 and abs(model.body_mass.sum() - sum(inertia.mass for inertia in own.inertias)) < 1e-6
print("SEEN plain, euler, zaxis, ref: equal")

for angle, expected in (("degree", np.radians([-0.3, 0.4])), ("radian", [-0.3, 0.4])):
    model, own = read(compiler=f'angle="{angle}"', slide='range="-0.3 0.4"')
    limits = own.lowerPositionLimit[1], own.upperPositionLimit[1]
    print(f"SEEN slide, compiler's angle {angle}: MuJoCo {model.jnt_range[1]}, Pinocchio {limits[0]:.4f} {limits[1]:.4f}")
    assert np.allclose(model.jnt_range[1], [-0.3, 0.4]) and np.allclose(limits, expected)

model, own = read(before='<frame pos="0 0 .5">', after="</frame>")
print("SEEN joints with a frame: MuJoCo", model.njnt, "Pinocchio", own.njoints - 1)
assert model.njnt == 2 and own.njoints - 1 == 1

model, own = read(body='axisangle="1 2 3 40"')
there, found, rotation = hands(model, own)
print(f"SEEN axisangle 1 2 3 40: hand {there.round(2)}, Pinocchio {found.round(2)}, determinant {np.linalg.det(rotation):.0f}")
assert abs(np.linalg.det(rotation)) > 2 and np.abs(there - found).max() > 1

model, own = read(compiler='eulerseq="XYZ"', body='euler="10 20 30"')
there, found, _ = hands(model, own)
print(f"SEEN eulerseq XYZ: hand {there.round(3)}, Pinocchio {found.round(3)}")
assert np.abs(there - found).max() > 0.01

model, own = read(geom='contype="0" conaffinity="0"')
masses = model.body("arm").mass[0], own.inertias[own.getJointId("hinge")].mass
print(f"SEEN mass of a geom that does not collide: MuJoCo {masses[0]:.1f}, Pinocchio {masses[1]:.1f}")
assert masses == (2, 0)

model, own = read(option='gravity="0 0 -3"')
print("SEEN gravity: MuJoCo", model.opt.gravity[2], "Pinocchio", own.gravity.linear[2])
assert model.opt.gravity[2] == -3 and own.gravity.linear[2] == -9.81
PY
grep SEEN out.txt

#!/bin/sh
# kinpy 0.6.1: inverse_kinematics() of a chain does not know the URDF file's limits, and gives an answer for each pose: joints with limits of 0.5 rad are sent to 1.2 and 1.0, and for a point 3 m away, which an arm of 0.8 m cannot
# reach, it stretches toward it and ends 2.2 m short. Neither an error nor a flag or a residual tells. forward_kinematics() of a dictionary takes a name that the robot does not have ("J1" for "j1") as nothing, and that joint as 0.
# A joint that mimics another one is a free joint. Positions and the Jacobian are right.
# Seen on 2026-11-30:  limits 0.5: answer [1.2, 1.0, -0.4]   unreachable: 2.20 m off   {"J1": 0.3}: the pose of all zeros   joints j1, j2, j3, though j3 mimics j2
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q kinpy==0.6.1 numpy==2.4.6 scipy==1.17.1
v/bin/python -W ignore - <<'PY'
import numpy as np
import kinpy

limits = '<limit lower="-0.5" upper="0.5" effort="1" velocity="1"/>'
parts = ['<robot name="arm">', *(f'<link name="{name}"/>' for name in ("base", "upper", "lower", "wrist", "hand"))]
joints = (("j1", "base", "upper", 0.0, "0 0 1", limits), ("j2", "upper", "lower", 0.3, "0 1 0", limits), ("j3", "lower", "wrist", 0.3, "0 1 0", limits + '<mimic joint="j2"/>'))
for name, parent, child, x, axis, rest in joints:
    parts.append(f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="{child}"/><origin xyz="{x} 0 0"/><axis xyz="{axis}"/>{rest}</joint>')
parts.append('<joint name="end" type="fixed"><parent link="wrist"/><child link="hand"/><origin xyz="0.2 0 0"/></joint></robot>')
urdf = "".join(parts)
arm = kinpy.build_serial_chain_from_urdf(urdf, "hand")
place = lambda angles: arm.forward_kinematics(list(angles)).pos

angles = np.array([0.3, 0.2, -0.4])
numeric = np.stack([(place(angles + step) - place(angles - step)) / 2e-6 for step in 1e-6 * np.eye(3)], axis=1)
assert np.allclose(arm.jacobian(list(angles))[:3], numeric, atol=1e-6)

beyond = arm.inverse_kinematics(arm.forward_kinematics([1.2, 1.0, -0.4]))
far = np.array([3.0, 0.0, 0.0])
gap = np.linalg.norm(place(arm.inverse_kinematics(kinpy.Transform(pos=far))) - far)
whole = kinpy.build_chain_from_urdf(urdf)
misspelled, zero = (whole.forward_kinematics(state)["hand"].pos for state in ({"J1": 0.3}, {"j1": 0.0}))
print(f"SEEN beyond limits {np.round(beyond, 2).tolist()}, unreachable {gap:.2f} m off, misspelled {misspelled.tolist()}, joints {arm.get_joint_parameter_names()}")
assert np.allclose(beyond, [1.2, 1.0, -0.4], atol=1e-3)
assert gap > 2.1
assert np.array_equal(misspelled, zero) and not np.allclose(misspelled, whole.forward_kinematics({"j1": 0.3})["hand"].pos)
assert arm.get_joint_parameter_names() == ["j1", "j2", "j3"]
PY

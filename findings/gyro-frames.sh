#!/bin/sh
# rowan 1.3.2, pyquaternion 0.9.9, numpy-quaternion 2024.0.13, spatialmath-python 1.1.18, vqf 2.1.2, numpy 2.4.6: functions that advance an orientation by an angular velocity disagree about its frame. rowan disagrees
# with itself: calculus.integrate() takes it in the world, and calculus.derivative(), which is documented by the same product (v q / 2), in the body (q v / 2). pyquaternion's integrate() and derivative() are
# documented for "the global x, y and z axes" and take those of the body, as a gyroscope measures. numpy-quaternion's integrate_angular_velocity() and spatialmath's dot() take the world's, vqf and
# spatialmath's dotb() the body's. While a body is upright nothing shows; one that lies on its side and turns about its own z axis yaws for some and pitches for others. There is no error.
# Seen on 2026-11-29:  body rolled by 90 degrees, then 0.5 rad about z: its x axis is at 0.88 0.48 0.00 for rowan integrate, numpy-quaternion, spatialmath dot, and at 0.88 0.00 0.48 for rowan derivative,
#                      pyquaternion (both), spatialmath dotb, vqf   not rolled: 0.88 0.48 0.00 for all
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q rowan==1.3.2 pyquaternion==0.9.9 numpy-quaternion==2024.0.13 spatialmath-python==1.1.18 vqf==2.1.2 numpy==2.4.6
v/bin/python -W ignore - >out.txt 2>err.txt <<'PY' || { tail -n 20 out.txt err.txt; exit 1; }
import numpy as np, pyquaternion, quaternion, rowan, vqf
from spatialmath import UnitQuaternion

STEPS, ANGLE = 5000, 0.5
RATE, DT = np.array([0.0, 0.0, ANGLE]), 1 / STEPS


def with_derivative(start, derivative):
    q = start
    for _ in range(STEPS):
        q = q + derivative(q) * DT
        q = q / np.linalg.norm(q)
    return q


def with_rowan(q):
    for _ in range(STEPS):
        q = rowan.calculus.integrate(q, RATE, DT)
    return q


def with_pyquaternion(q):
    q = pyquaternion.Quaternion(q)
    for _ in range(STEPS):
        q.integrate(list(RATE), DT)
    return q.elements


def with_vqf(start):
    filter_ = vqf.VQF(DT)
    for _ in range(STEPS):
        filter_.updateGyr(RATE)
    return rowan.multiply(start, filter_.getQuat3D())


packages = {
    "rowan integrate": with_rowan,
    "rowan derivative": lambda q: with_derivative(q, lambda q: rowan.calculus.derivative(q, RATE)),
    "numpy-quaternion": lambda q: quaternion.as_float_array(quaternion.integrate_angular_velocity(lambda t, R: RATE, 0.0, 1.0, R0=quaternion.quaternion(*q))[1][-1]),
    "spatialmath dot": lambda q: with_derivative(q, lambda q: UnitQuaternion(q).dot(RATE)),
    "spatialmath dotb": lambda q: with_derivative(q, lambda q: UnitQuaternion(q).dotb(RATE)),
    "pyquaternion integrate": with_pyquaternion,
    "pyquaternion derivative": lambda q: with_derivative(q, lambda q: pyquaternion.Quaternion(q).derivative(list(RATE)).elements),
    "vqf": with_vqf,
}
for roll in (0.0, np.pi / 2):
    start = np.array([np.cos(roll / 2), np.sin(roll / 2), 0.0, 0.0])
    for name, advance in packages.items():
        x_axis = rowan.rotate(rowan.normalize(advance(start)), [1.0, 0.0, 0.0])
        print(f"SEEN rolled by {np.degrees(roll):.0f} degrees, {name}: x axis at", *(f"{abs(number) if abs(number) < 5e-3 else number:.2f}" for number in x_axis))
        in_world = name in ("rowan integrate", "numpy-quaternion", "spatialmath dot")
        expected = [np.cos(ANGLE), np.sin(ANGLE), 0.0] if in_world or roll == 0 else [np.cos(ANGLE), 0.0, np.sin(ANGLE)]
        assert np.allclose(x_axis, expected, atol=5e-3), name
PY
grep SEEN out.txt

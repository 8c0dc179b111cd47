#!/bin/sh
# pyquaternion 0.9.9: yaw_pitch_roll does not give the angles that it is documented to give. It says z-y'-x'' (turn about z, then the new y, then the new x); the three numbers are those of
# x-y'-z'', in the opposite order: put together as documented, with the package's own products, they are another orientation. One angle alone is right, which hides it. There is no error.
# A policy that observes roll and pitch of a tilted body sees others as soon as two of them are not 0.
# Seen on 2026-11-29:  yaw 0.7, pitch -0.4, roll 0.3: 0.785 -0.094 0.487; put together again 0.38 rad beside the orientation   yaw 1.2 alone: 1.2 0 0   as x-y'-z'': the orientation
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q pyquaternion==0.9.9 numpy==2.4.6
v/bin/python - <<'PY'
from pyquaternion import Quaternion

turn = lambda angle, **axis: Quaternion(axis=[axis.get(name, 0) for name in "xyz"], radians=angle)
documented = lambda yaw, pitch, roll: turn(yaw, z=1) * turn(pitch, y=1) * turn(roll, x=1)
other = lambda yaw, pitch, roll: turn(roll, x=1) * turn(pitch, y=1) * turn(yaw, z=1)
text = " ".join(Quaternion.yaw_pitch_roll.__doc__.split())
assert "z-y'-x''" in text, text


def angle(a, b):
    return abs((a.inverse * b).radians)


for angles, right in (((0.7, -0.4, 0.3), False), ((0.5, 0.2, 0.0), False), ((0.0, 0.5, 0.5), False), ((1.2, 0, 0), True), ((0, -0.4, 0), True), ((0, 0, 0.3), True)):
    attitude = documented(*angles)
    found = attitude.yaw_pitch_roll
    print(f"yaw, pitch, roll {angles}: {', '.join(f'{number:.3f}' for number in found)}; as documented {angle(attitude, documented(*found)):.3f} rad beside it, as x-y'-z'' {angle(attitude, other(*found)):.3f}")
    assert (max(abs(a - b) for a, b in zip(angles, found)) < 1e-9) == right
    assert (angle(attitude, documented(*found)) < 1e-6) == right and angle(attitude, other(*found)) < 1e-6
PY

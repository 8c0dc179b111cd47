#!/bin/sh
# UnityQuaternionPy 0.1.2 (Unity's quaternions in Python, as for teleoperation from a headset; the README: "All same as UnityEngine.Quaternion"):
# eulerAngles has the wrong sign above 81.9 degrees of pitch. A hand that pitches from 81 to 82 degrees is read as 270 (-90) degrees, and one at -82
# as 90; the yaw of 30 degrees moves to the roll at the same place. Unity stays at 82 and 30. Angle() of a rotation and itself with all signs changed,
# which is the same rotation, is 360 degrees (Unity: 0), Slerp() between two such rotations 10 degrees apart goes by way of the opposite heading, and
# RotateTowards() by 5 degrees turns by -0.1. There is no error.
# Seen on 2026-11-30:  pitch and yaw 81, 30: 81, 30   82, 30: 270, 0 (82, 30)   -82, 30: 90, 0   Angle(q, -q) 360 (0)   half way from yaw 10 to 20:
# 195 (15)   5 degrees from 10 towards 20: 9.9 (15)
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps UnityQuaternionPy==0.1.2
cat > run.py <<'PY'
from UnityQuaternion import Quaternion


def opposite(q):
    """The same rotation, with all signs changed."""
    return Quaternion(-q.x, -q.y, -q.z, -q.w)


def short(degrees):
    return [round(value, 1) % 360 for value in degrees]


seen = {pitch: short(Quaternion.Euler(pitch, 30, 0).eulerAngles) for pitch in (80, 81, 82, 89, -81, -82)}
print("SEEN pitch of 80 to 89 and -81, -82 with a yaw of 30, by eulerAngles:", seen)
near, far = Quaternion.Euler(0, 10, 0), Quaternion.Euler(0, 20, 0)
# The rotation itself is right, only its angles are not.
forward = Quaternion.Euler(82, 30, 0) * (0.0, 0.0, 1.0)
print("SEEN forward at 82 degrees of pitch:", [round(value, 3) for value in forward])
angle = Quaternion.Angle(near, opposite(near))
half = short(Quaternion.Slerp(near, opposite(far), 0.5).eulerAngles)[1]
step = short(Quaternion.RotateTowards(near, opposite(far), 5).eulerAngles)[1]
same = short(Quaternion.Slerp(near, far, 0.5).eulerAngles)[1]
print(f"SEEN Angle(q, -q) {angle:.0f}; half way from 10 to 20 degrees of yaw: {half} ({same}); RotateTowards by 5 degrees: {step}")
assert seen[81] == [81, 30, 0] and seen[82][:2] == [270, 0] and seen[-82][:2] == [90, 0]
assert forward[1] < -0.98 and round(angle) == 360 and half == 195 and same == 15 and not 14 < step < 16
PY
v/bin/python run.py

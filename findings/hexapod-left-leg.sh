#!/bin/sh
# 3dof-hexapod-ik-generator 1.0.0 (servo angles of a six-legged robot): the middle leg on the left has its hip on the right: the body offset of leg 5
# has the sign of leg 2's. When the body turns or leans, five legs follow, and the sixth gets angles for another place: turning the body by 10
# degrees turns five hips by 15 and that one by 5, so that its foot is dragged over the ground; leaning gives it a third of the lift. At rest, and
# for shifts, all six are right. The default of the reversed servos, (19, 20, 21), names none of the 18 servos, and shift_lean() without arguments
# does not stand still: posX is 50 mm. There is no error.
# Seen on 2026-11-30:  rotY 10: hips of legs 6, 1, 5, 2, 4, 3 at 105, 105, 95, 105, 105, 105   rotZ 5: tibia of leg 2 at 78, of leg 5 at 94
# shift_lean(): 101, 91, 73, 68, ...
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps 3dof-hexapod-ik-generator==1.0.0
cat > run.py <<'PY'
from ikengine import IKEngine

# The legs in the order of the angles: tibia, femur and coxa of each.
LEGS = (6, 1, 5, 2, 4, 3)
body = IKEngine(50, 115, 90, 80)


def legs(**change):
    angles = body.shift_lean(**{"posX": 0, **change})
    return {leg: angles[3 * place : 3 * place + 3] for place, leg in enumerate(LEGS)}


assert all(angles == [90, 90, 90] for angles in legs().values())
turned = {leg: angles[2] for leg, angles in legs(rotY=10).items()}
leaning = {leg: angles[0] for leg, angles in legs(rotZ=5).items()}
print("SEEN hips with the body turned by 10 degrees:", turned)
print("SEEN tibias with the body leaning by 5 degrees to a side:", leaning)
print("SEEN shift_lean() without arguments:", body.shift_lean()[:6])
assert turned == {6: 105, 1: 105, 5: 95, 2: 105, 4: 105, 3: 105}
# The two middle legs are mirror images: one rises as the other sinks.
assert leaning[2] == 78 and leaning[5] == 94
assert body.shift_lean() == body.shift_lean(posX=50)
PY
v/bin/python run.py

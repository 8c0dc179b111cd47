#!/bin/sh
# armkin 0.7.0 (kinematics of a planar arm of two links): inverse(..., elbow_up=True), the default, gives the solution with the elbow below the line from the shoulder to the target, and elbow_up=False that above it, for every target in
# front of the arm (x > 0): an arm on a table that asks for its elbow up has it 0.66 m below the shoulder, into the table. Behind the arm it is the other way round: the name
# chooses the sign of the second angle. Both solutions reach the target, so that a test by forward() sees nothing. There is no error.
# Seen on 2026-11-30:  links of 1 m, target 1.5, 0: elbow_up=True: elbow at 0.75, -0.66, False: 0.75, 0.66   1.0, 0.5: 0.87, -0.49 and 0.13, 0.99   -1.5, 0: -0.75, 0.66 and -0.75, -0.66
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps armkin==0.7.0
cat > run.py <<'PY'
import math

import armkin


def elbow(x, y, **up):
    """The height of the elbow over the line from the shoulder to the target, and its place."""
    first, second = armkin.inverse(1.0, 1.0, x, y, **up)
    reached = armkin.forward(1.0, 1.0, first, second)
    assert math.dist(reached, (x, y)) < 1e-9
    place = math.cos(first), math.sin(first)
    return place[1] - place[0] * y / x, place


heights = {}
for target in ((1.5, 0.0), (1.0, 0.5), (0.5, 1.0), (1.2, -0.6), (-1.5, 0.0)):
    up, place = elbow(*target)
    assert elbow(*target, elbow_up=True) == (up, place)
    down, other = elbow(*target, elbow_up=False)
    heights[target] = up, down
    print(f"SEEN target {target}: elbow_up=True: elbow at {place[0]:.2f}, {place[1]:.2f} ({up:+.2f} from the line), False: {other[0]:.2f}, {other[1]:.2f} ({down:+.2f})")
assert all(up < 0 < down for (x, _), (up, down) in heights.items() if x > 0)
assert heights[-1.5, 0.0][0] > 0 > heights[-1.5, 0.0][1]
assert abs(heights[1.5, 0.0][0] + math.sqrt(1 - 0.75**2)) < 1e-9
PY
v/bin/python run.py

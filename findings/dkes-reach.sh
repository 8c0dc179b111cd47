#!/bin/sh
# dkes 0.0.2.1 (kinematics of a planar arm of two links): a target nearer than the difference of the links' lengths, which no pose reaches, is reported as reachable, and gets angles that lead elsewhere: check_reachability() and
# inverse_kinematics(check_reachability=True), the default, compare with the outer radius only, though the package has min_reach(). With links of 100 and 60, the target 10, 0 gives the angles 0 and -180, whose hand is at 40, 0, 30 mm from the target; a
# path through the middle stands still for a while and jumps. A target beyond the outer radius ends the whole program, with a line on the standard output and exit code 0, which a supervisor takes for a success: the
# motors keep their last command.
# Seen on 2026-11-30:  target 10, 0: check_reachability True, angles 0.0, -180.0, hand at 40.0, 0.0   target 200, 0: "Target is out of reach.", exit code 0, the next line is not run
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps dkes==0.0.2.1
cat > run.py <<'PY'
import math
import subprocess
import sys

import dkes

LINKS = 100, 60
for target in ((10.0, 0.0), (0.0, 25.0), (-20.0, 20.0)):
    reachable = dkes.check_reachability(*target, *LINKS)
    angles = dkes.inverse_kinematics(*target, *LINKS)
    hand = dkes.forward_kinematics(*angles, *LINKS)
    miss = math.dist(hand, target)
    print(f"SEEN target {target}: reachable {reachable}, angles {angles[0]:.1f}, {angles[1]:.1f}, hand at {hand[0]:.1f}, {hand[1]:.1f}, off by {miss:.1f}; least reach {dkes.min_reach(*LINKS)}")
    assert reachable and abs(miss - (40 - math.hypot(*target))) < 1e-6
assert math.dist(dkes.forward_kinematics(*dkes.inverse_kinematics(120.0, 30.0, *LINKS), *LINKS), (120.0, 30.0)) < 1e-6

far = subprocess.run([sys.executable, "-c", "import dkes; dkes.inverse_kinematics(200, 0, 100, 60); print('next line')"], capture_output=True, text=True)
print("SEEN target 200, 0:", repr(far.stdout), "exit code", far.returncode)
assert far.returncode == 0 and far.stdout == "Target is out of reach.\n" and not far.stderr
PY
v/bin/python run.py

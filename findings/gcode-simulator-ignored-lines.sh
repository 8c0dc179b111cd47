#!/bin/sh
# gcode-simulator 0.2.1 (time and size of a program in G-code, "accurately", "for plotters, CNC, 3D printers and more"): a line that does not begin with G0 or G1 and a blank is left out without a word, and the rest is timed as if it were complete.
# "G1X100F1000", as many programs are written, takes 0 s, and its size is infinite; so do "N10 G1 X100" and "G90 G1 X100". A circle (G2, G3) takes no time and has no size: a program of 50 mm to both sides of its start fits on a strip of 0 mm. A line of
# coordinates alone, which repeats the move before, is left out. G91 (relative) is ignored: twice 50 mm is 50 mm, not 100; and G20 (inches) is, too: 4 inches are 4 mm, so that a program for a table of 102 mm is said to need 4. There is no error and no
# warning. The README names none of this; its other inputs are the settings of the controller GRBL, which reads all of these lines (from knowledge).
# Seen on 2026-12-01:  G1 X100 F1000: 6.02 s, to 100 mm   G1X100F1000: 0.00 s, to -inf   circle of 50 mm: 0.00 s, to 0 mm   twice 50 mm by G91: 3.02 s, to 50 mm   4 inches: to 4 mm
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q gcode-simulator==0.2.1 numpy==2.4.6 matplotlib==3.11.2 click==8.3.1
cat > run.py <<'PY'
from gcode_simulator import GCodeSimulator, GrblSettings


def simulate(name, *lines):
    seconds, bounds = GCodeSimulator(GrblSettings()).estimate_time("\n".join(lines))
    print(f"SEEN {name}: {seconds:.2f} s, to {bounds.max_x} mm")
    return round(seconds, 2), bounds.max_x


nothing = 0.0, float("-inf")
assert simulate("G1 X100 F1000", "G1 X100 F1000") == (6.02, 100)
assert simulate("G1X100F1000", "G1X100F1000") == nothing
assert simulate("N10 G1 X100 F1000", "N10 G1 X100 F1000") == nothing
assert simulate("G90 G1 X100 F1000", "G90 G1 X100 F1000") == nothing
assert simulate("G1 X50, X100", "G1 X50 F1000", "X100") == simulate("G1 X50", "G1 X50 F1000")
assert simulate("circle of radius 50", "G1 X0 Y0 F1000", "G2 X0 Y0 I50 J0") == (0, 0)
assert simulate("twice 50 mm, G91", "G91", "G1 X50 F1000", "G1 X50") == (3.02, 50)
assert simulate("4 inches, G20", "G20", "G1 X4 F40")[1] == 4
PY
v/bin/python run.py

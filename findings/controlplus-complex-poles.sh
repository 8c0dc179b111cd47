#!/bin/sh
# controlplus 0.2.0, control 0.10.2, numpy 2.4.6, scipy 1.17.1, matplotlib 3.11.2 (design of control loops with a root locus): find_rlocus() "provides the coordinates for poles and the respective gains" where the root locus meets a line of constant
# damping. It sums the angles to the open loop's poles and takes for each its real part only: a pair of complex poles, as of every elastic joint, belt, mass on a spring and underdamped motor, counts as two poles on the real axis. The point is not on the
# root locus, and the gain is another loop's: asked for a damping ratio of 0.5 for 1/(s^3 + 2 s^2 + 5 s), it gives a gain of 2.2, with which the ratio is 0.36, and for 1/(s^2 + 2 s + 10), whose ratio falls with each gain and is 0.32 without one, it
# names a gain of 6.01, of which it is 0.25. There is no error and no "not found". With real poles the gain is right: the examples of the README have no others. draw_overlay_rlocus() draws its crosses beside the curve.
# Seen on 2026-12-01:  asked for 0.5:  open poles 0, -1 +- 2j: gain 2.2, ratio 0.360   -1 +- 3j: 6.01, 0.250   0, -1, -3: 1.83, 0.500   0, -4, -6: 43.82, 0.500
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q controlplus==0.2.0 control==0.10.2 numpy==2.4.6 scipy==1.17.1 matplotlib==3.11.2
cat > run.py <<'PY'
import control
import numpy as np
from controlplus.controlplus import find_rlocus


def designed(denominator):
    """The gain that is found for a damping ratio of 0.5, and the least ratio of the closed loop with it."""
    poles, gains = find_rlocus(control.tf([1], denominator), 0.5)
    assert len(gains) == 1
    closed = np.roots(np.polyadd(denominator, [gains[0]]))
    ratio = min(-p.real / abs(p) for p in closed)
    away = min(abs(closed - poles[0][0]))
    print(f"SEEN open loop 1/{denominator}, poles {np.round(np.roots(denominator), 2)}: asked for 0.5: gain {gains[0]}, damping ratio {ratio:.3f}; the pole named is {away:.2f} from the nearest one")
    return ratio, away


for sound in ([1, 10, 24, 0], [1, 4, 3, 0]):
    ratio, away = designed(sound)
    assert abs(ratio - 0.5) < 0.01 and away < 0.02
for broken, seen in (([1, 2, 5, 0], 0.36), ([1, 2, 10], 0.25)):
    ratio, away = designed(broken)
    assert abs(ratio - seen) < 0.01 and away > 0.3
PY
v/bin/python run.py

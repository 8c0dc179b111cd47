#!/bin/sh
# jataruku 0.1.1 (a PID controller after the Arduino library): the derivative gain is multiplied by the sampling time where the library divides by
# it, so that it is weaker by its square: 100 times with the default of 100 ms. A measurement that falls by 2 per second with kd 1 gives 0.02 instead
# of 2. What sample_time= does afterwards is right, so that the order counts: sample_time = 10 after the gains leaves 0.02, and set_tunings() after
# it gives 0.0002, the same kd with another time. ki is right. The property kd shows 1.0 in each case. There is no error.
# Seen on 2026-11-30:  d part for -2 per second, kd 1: 100 ms 0.0200   10 ms set after the gains 0.0200   10 ms set before them 0.0002   right 2.0;
# kd 1.0 each time
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps jataruku==0.1.1
cat > run.py <<'PY'
import time
from unittest import mock

import jataruku

now = [0.0]


def derivative(milliseconds, gains_last):
    """The output for a measurement that falls by 2 per second, with a derivative only."""
    measured, out = [0.0], []
    pid = jataruku.PID(lambda: measured[0], out.append, 0.0, 0.0, 0.0, 1.0, True)
    pid.sample_time = milliseconds
    if gains_last:
        pid.set_tunings(0.0, 0.0, 1.0)
    pid.set_output_limits(-1000, 1000)
    pid.auto = True
    step = milliseconds / 1000
    for _ in range(5):
        # A little more than the sampling time, as the controller waits for it.
        now[0] += step * 1.0001
        measured[0] -= 2.0 * step
        pid.compute()
    return round(out[-1], 5), pid.kd


with mock.patch.object(time, "monotonic", lambda: now[0]):
    cases = {"100 ms": (100, True), "gains, then 10 ms": (10, False), "10 ms, then gains": (10, True)}
    seen = {name: derivative(*how) for name, how in cases.items()}
print("SEEN output and kd for -2 per second, kd 1 (right: 2.0):", seen)
assert seen == {"100 ms": (0.02, 1.0), "gains, then 10 ms": (0.02, 1.0), "10 ms, then gains": (0.0002, 1.0)}
PY
v/bin/python run.py

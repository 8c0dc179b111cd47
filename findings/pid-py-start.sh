#!/bin/sh
# pid-py 1.2.2: the controller starts as if the setpoint, the measurement and the error had been 0 before its second call. A joint that rests at its setpoint of 1 rad gets -100 from the derivative "on measurement", of which the
# documentation says that it avoids bumps (kd 0.1, 1 kHz). With a setpoint ramp of 1 rad/s, it is first driven toward 0, since the ramp starts there, whatever the place of the joint is.
# And the class documents compute(processValue, setpoint); the function takes the setpoint first: who follows it has positive feedback. There is no error.
# Seen on 2026-11-30:  at rest at the setpoint, second call: derivative on measurement -100, on error 0   ramp: setpoint 0.001 at the second call, joint driven from 1 to 0.24 before it returns   by the documented order: output -1 for an error of +1
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps pid-py==1.2.2 && v/bin/pip install -q numpy==2.4.6
v/bin/python - <<'PY'
import sys, types
from unittest.mock import MagicMock

sys.modules.setdefault("matplotlib", MagicMock())
from PID_Py.PID import PID


def second(**options):
    pid = PID(0.0, 0.0, 0.1, **options)
    pid.compute(1.0, 1.0, 0.0)
    return pid.compute(1.0, 1.0, 0.001)


kicks = second(derivativeOnMeasurement=True), second()

ramped = PID(10.0, 0.0, 0.0, setpointRamp=1.0)
place, lowest, first = 1.0, 1.0, None
for step in range(3000):
    velocity = ramped.compute(1.0, place, step * 0.001)
    if step == 1:
        first = ramped._setpoint
    place += velocity * 0.001
    lowest = min(lowest, place)

documented = PID.__doc__.index("compute(processValue, setpoint)") > 0
pid = PID(1.0, 0.0, 0.0)
pid.compute(0.0, 1.0, 0.0)
inverse = pid.compute(0.0, 1.0, 0.001)
print(f"SEEN second outputs at rest {kicks[0]:.1f} and {kicks[1]:.1f}, ramp begins at {first:.3f}, lowest place {lowest:.2f}, last {place:.2f}, documented order {documented}: {inverse:.1f}")
assert abs(kicks[0] + 100) < 1e-6 and kicks[1] == 0
assert abs(first - 0.001) < 1e-9 and lowest < 0.5 and abs(place - 1) < 0.01
assert documented and abs(inverse + 1) < 1e-9
PY

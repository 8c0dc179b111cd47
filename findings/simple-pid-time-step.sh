#!/bin/sh
# simple-pid 2.0.1: a time step that the caller states (pid(x, dt=0.001)) is compared with sample_time, which is 0.01 by default, each time anew: below it, the controller returns its first output for
# ever. Steps are not added up. There is no error and no warning. In a simulation, or a loop of 1 kHz that knows its step, the motor gets one constant command until it hits its stop; at 100 Hz,
# and with sample_time=None, the controller works. The documentation of dt does not speak of sample_time.
# Seen on 2026-11-29:  after 2 s, 1 wanted: 100 Hz 1.00   1 kHz: 60.0 and 1 output   1 kHz with sample_time=None: 1.00   1 kHz by the clock (no dt): the output changes
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q simple-pid==2.0.1
v/bin/python - <<'PY'
import time

from simple_pid import PID


def joint(dt, **settings):
    """Position of a joint after 2 s whose velocity is the controller's output, and the number of different outputs."""
    pid, position, outputs = PID(Kp=30, setpoint=1.0, **settings), 0.0, set()
    for _ in range(round(2 / dt)):
        output = pid(position, dt=dt)
        outputs.add(output)
        position += output * dt
    return position, len(outputs)


seen = {"100 Hz": joint(0.01), "1 kHz": joint(0.001), "1 kHz, sample_time=None": joint(0.001, sample_time=None)}
for name, (position, outputs) in seen.items():
    print(f"{name}: position {position:.2f}, {outputs} outputs")
assert abs(seen["100 Hz"][0] - 1) < 1e-3 and abs(seen["1 kHz, sample_time=None"][0] - 1) < 1e-3
assert seen["1 kHz"][0] > 50 and seen["1 kHz"][1] == 1

pid = PID(Kp=1, setpoint=1.0)
first = pid(0.0)
for _ in range(20):
    time.sleep(0.001)
    last = pid(0.5)
print(f"by the clock: {first} {last}")
assert first != last
PY

#!/bin/sh
# basic-pid 0.2.7 (a PID controller "designed for discrete-time regulators" of mobile robots): setTimeinc(), with which the time step is set, is
# stored and used nowhere: the integral and the derivative count per call. With steps of 0.01 s instead of 1 s the same gains give the same numbers,
# that is an integral 100 times and a derivative 1/100 as strong per second as the gains say; a loop whose rate changes has other gains.
# getPidTuple(reference, signal), which looks like another way to ask, does not look at its two numbers and gives the parts of the last call. There
# is no error.
# Seen on 2026-11-30:  gains 2, 1, 0.5, error 1: setTimeinc(1) 3.0, 3.5, 4.5, 5.5, 6.5   setTimeinc(0.01) the same   getPidTuple(1, 0) after pid(5,
# 0): P 5
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps basic-pid==0.2.7
cat > run.py <<'PY'
from basicpid import BasicPid

outputs = {}
for step in (1, 0.01):
    pid = BasicPid()
    pid.setGains(2, 1, 0.5)
    pid.setTimeinc(step)
    pid.setIntegrateModeOn()
    outputs[step] = [pid.pid(1, 0) for _ in range(5)]
    assert pid.getTimeinc() == step
print("SEEN outputs by the time step:", outputs)
assert outputs[1] == outputs[0.01] == [3.0, 3.5, 4.5, 5.5, 6.5]

pid = BasicPid()
pid.pid(5, 0)
print("SEEN getPidTuple(1, 0) after pid(5, 0):", pid.getPidTuple(1, 0))
assert pid.getPidTuple(1, 0)[1] == 5
PY
v/bin/python run.py

#!/bin/sh
# wpilib-controller 0.7.1 (a PID controller for robots of the FIRST competitions): atSetpoint() is documented to return false until at least one input value has been computed, and returns true before that: a sequence that waits for an arm
# goes on at once. reset(), "reset the previous error, the integral term", does not reset the previous error, which calculate() takes from elsewhere: after a reset, and a joint that was moved by hand from 0.9 to 0 of its
# setpoint of 1, the first derivative is that of the move in one period of 20 ms: 45 per second, with a kd of 1. The first call of all takes the error before for 0: at rest, 1 away from its setpoint, the joint gets a
# kick of 50. There is no error.
# Seen on 2026-11-30:  atSetpoint() of a new controller, setpoint 1: True; after the first input 0: False   kp 0, kd 1: first call, at rest at 0: 50.0, then 0.0   at 0.9, reset, at 0: 45.0   integral after the reset: 0
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps wpilib-controller==0.7.1
cat > run.py <<'PY'
import sys
import types


class SendableBase:
    """The part of the robot's library that the controller needs: a name on the dashboard."""

    def __init__(self, addLiveWindow=True):
        pass

    def setName(self, *_):
        pass


class Anything(types.ModuleType):
    __path__ = []

    def __getattr__(self, name):
        if name.startswith("__"):
            raise AttributeError(name)
        return SendableBase


for name in ("wpilib", "wpilib.sendablebase", "wpilib.sendablebuilder", "hal"):
    sys.modules[name] = Anything(name)
from wpilib_controller import PIDController

new = PIDController(1.0, 0.5, 0.0)
new.setSetpoint(1.0)
before = new.atSetpoint()
new.calculate(0.0)
after = new.atSetpoint()

derivative = PIDController(0.0, 0.5, 1.0)
derivative.setIntegratorRange(-100, 100)
derivative.setSetpoint(1.0)
derivative.Ki = 0.0
kick, rest = derivative.calculate(0.0), derivative.calculate(0.0)
derivative.calculate(0.9)
held = derivative.calculate(0.9)
derivative.Ki = 0.5
derivative.calculate(0.9)
derivative.reset()
total = derivative.total_error
derivative.Ki = 0.0
stale = derivative.calculate(0.0)
print(f"SEEN atSetpoint() before any input: {before}, after one: {after}; first call {kick:.1f}, then {rest:.1f}; after the reset {stale:.1f}, integral {total}")
assert before is True and after is False and kick == 50.0 and rest == 0.0 and held == 0.0 and total == 0
assert abs(stale - 45.0) < 1e-9
PY
v/bin/python run.py

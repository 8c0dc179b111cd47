#!/bin/sh
# micropython-stepper 1.0.3, of its Python file as it is: a target that is not a whole step is never reached: the motor steps over it and back for ever, at its full speed, as the position is counted in whole steps and compared with the target
# as it is. The README's own target_deg(5) with 200 steps per turn is 2.78 steps: the motor goes to and fro between 2 and 3, with power and noise, in a position that it should hold. target_rad() of a policy's action is nearly
# never whole. overwrite_pos(p), "p: Current position in steps", sets the position to 0, whatever p is: homed against a switch at 50 steps, the next target is 50 steps off. And speed() while the motor runs freely ends
# free_run(), which is documented to move "until stopped", and drives to the last target. There is no error.
# Seen on 2026-11-30:  target_deg(5), 1 s at 50 steps/s: 3 steps to the target, then 47 between 2 and 3   target(3): 3 steps, then none   overwrite_pos(50): position 0   free_run(1), speed(20): 10 steps back to the target
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps --target p micropython-stepper==1.0.3
cat > run.py <<'PY'
import sys
import types

sys.path.insert(0, "p")


class Pin:
    OUT = 1

    def __init__(self, number, _):
        self.number = number

    def value(self, level):
        pass


class Timer:
    """Calls its function as often as it is asked to for a second."""

    def __init__(self, _):
        self.call = None

    def init(self, freq, callback):
        self.freq, self.call = freq, callback

    def deinit(self):
        self.call = None

    def run(self, seconds, motor):
        seen = []
        for _ in range(round(seconds * self.freq)):
            self.call(self)
            seen.append(motor.get_pos())
        return seen


sys.modules["machine"] = types.SimpleNamespace(Pin=Pin, Timer=Timer)
from stepper import Stepper


def steps(seen):
    """How many of the timer's calls moved the motor."""
    return sum(a != b for a, b in zip([0, *seen], seen))


motor = Stepper(18, 19, steps_per_rev=200, speed_sps=50)
motor.target_deg(5)
whole = Stepper(18, 19, steps_per_rev=200, speed_sps=50)
whole.target(3)
broken, sound = motor.timer.run(1.0, motor), whole.timer.run(1.0, whole)
print("SEEN target_deg(5) is", round(motor.target_pos, 2), "steps; steps in 1 s:", steps(broken), "last positions", broken[-6:], "  target(3):", steps(sound), sound[-3:])

homed = Stepper(18, 19)
homed.overwrite_pos(50)
homed.step(1)
place = homed.get_pos()

free = Stepper(18, 19, speed_sps=10)
free.free_run(1)
before = free.timer.run(1.0, free)[-1]
free.speed(20)
after = free.timer.run(1.0, free)[-1]
print("SEEN overwrite_pos(50) and one step:", place, "  free run:", before, "steps, after speed(20):", after)
assert steps(broken) == 50 and set(broken[3:]) == {2, 3} and steps(sound) == 3 and sound[-1] == 3
assert place == 1 and (before, after) == (10, 0)
PY
v/bin/python run.py

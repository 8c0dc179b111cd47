#!/bin/sh
# dvg-pid-controller 2.2.0, dvg-debug-functions 2.5.0: the first output after the change to automatic mode contains the integral of all the time
# before. The package promises a "bumpless manual-to-auto-mode transfer"; set_mode() takes the input and the output over, and not the time, which is
# that of the constructor or of the last compute(). A controller that is made at the start of a program and set to automatic a minute later, at an
# output of 20, goes to its limit of 100, with an integral of 60 s of an error of 5; the same after a minute in manual mode without calls of
# compute(). Arduino's PID library, which it is a port of, counts fixed steps. set_tunings() with one negative gain leaves all gains and the direction
# as they were, and set_output_limits() with limits in the wrong order the old ones, without a word. There is no error.
# Seen on 2026-11-30:  error 5, Kp 2, Ki 1, output before 20: at once 30.5   after 60 s 100.0 (integral at its limit)   after 60 s in manual mode
# 100.0   gains 2, 1 set to 3, -1: 2, 1
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps dvg-pid-controller==2.2.0 dvg-debug-functions==2.5.0 numpy==2.4.6
cat > run.py <<'PY'
import time

now = 100.0
time.perf_counter = lambda: now

from dvg_pid_controller import Constants, PID_Controller

SETPOINT, INPUT, OUTPUT = 30.0, 25.0, 20.0


def make():
    controller = PID_Controller(2.0, 1.0, 0.0)
    controller.setpoint = SETPOINT
    return controller


def first(controller, wait):
    """The output 0.1 s after the change to automatic mode, which comes `wait` s after the last call."""
    global now
    now += wait
    controller.set_mode(Constants.AUTOMATIC, INPUT, OUTPUT)
    now += 0.1
    assert controller.compute(INPUT)
    return float(controller.output), float(controller.iTerm)


seen = {"at once": first(make(), 0.0), "after 60 s": first(make(), 60.0)}
controller = make()
first(controller, 0.0)
controller.set_mode(Constants.MANUAL, INPUT, OUTPUT)
seen["after 60 s in manual mode"] = first(controller, 60.0)
print("SEEN output and integral's part:", {name: [round(value, 1) for value in pair] for name, pair in seen.items()})
controller.set_tunings(3.0, -1.0, 0.0, Constants.REVERSE)
kept = controller.kp, controller.ki, controller.controller_direction
controller.set_output_limits(50, -50)
print(
    "SEEN gains and direction after set_tunings(3, -1, 0, REVERSE):",
    kept,
    "limits after (50, -50):",
    (controller.output_limit_min, controller.output_limit_max),
)
assert abs(seen["at once"][0] - 30.5) < 1e-6 and seen["after 60 s"] == (100.0, 100.0) and seen["after 60 s in manual mode"] == (100.0, 100.0)
assert kept == (2.0, 1.0, Constants.DIRECT) and (controller.output_limit_min, controller.output_limit_max) == (0, 100)
PY
v/bin/python run.py

#!/bin/sh
# cl57t-raspberry-pi-stepper-drive 0.5.0, of its Python files as they are (closed-loop stepper driver CL57T): do_homing() drives to the switch and leaves the position as the steps have counted it: the callback that would set it to 0 is never
# registered. The README's sequence, do_homing(), set_homing_position_mm(400), run_to_position_mm(400), which should stay at the switch, then drives by the distance that the homing covered: an arm that was switched on 300 steps
# from its switch goes 300 steps back, to where it was switched on, each time somewhere else. do_homing() also leaves the speed limit of its slow approach, 50 steps/s, for all later moves. It returns True. There is no error.
# Seen on 2026-11-30:  start 300 steps from the switch: homed True, position -300 at the switch (0), limit 50 steps/s (was 3000)   run_to_position_mm(400): 300 steps from the switch (0)   start at 120: 120 steps
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps --target p cl57t-raspberry-pi-stepper-drive==0.5.0
cat > run.py <<'PY'
import contextlib
import io
import sys
import types

sys.path.insert(0, "p")
EN, STEP, DIR, SWITCH = 19, 6, 13, 5


class Machine:
    """A motor with a switch that closes at the place 0 and below, as the pins see it."""

    OUT, IN, HIGH, LOW, BCM, PUD_UP = 1, 0, 1, 0, 11, 22

    def __init__(self):
        self.place, self.pins = 0, {}

    def output(self, pin, level):
        if pin == STEP and level and not self.pins.get(STEP):
            self.place += 1 if self.pins[DIR] else -1
        self.pins[pin] = level

    def input(self, pin):
        return 0 if pin == SWITCH and self.place <= 0 else 1

    def setup(self, pin, _, initial=0, **__):
        self.pins[pin] = initial

    def setwarnings(self, _):
        pass

    setmode = cleanup = remove_event_detect = setwarnings


machine = Machine()
sys.modules["Mock"] = types.SimpleNamespace(GPIO=machine)
with contextlib.redirect_stdout(io.StringIO()):
    from cl57t_raspberry_pi_stepper_drive import CL57TStepperDriver as package
if package.BOARD != "UNKNOWN":
    package.GPIO = sys.modules["cl57t_raspberry_pi_stepper_drive._CL57T_move"].GPIO = machine


def home(start):
    machine.place = start
    with contextlib.redirect_stdout(io.StringIO()):
        motor = package.CL57TStepperDriver(
            pin_en=EN, pin_step=STEP, pin_dir=DIR, pin_homing_sensor=SWITCH, microstepping_resolution=1600, gearwheel_diameter_mm=56, loglevel=package.Loglevel.NONE,
        )
        motor.set_motor_enabled(True)
        motor.set_acceleration(100_000)
        motor.set_max_speed(3000)
        homed = motor.do_homing()
        switch, position, limit = machine.place, motor.get_current_position(), motor.get_max_speed()
        motor.set_max_speed(3000)
        motor.set_homing_position_mm(400)
        motor.run_to_position_mm(400)
        motor.set_deinitialize_true()
    print(f"start at {start}: homed {homed}, at {switch}, position {position}, limit {limit}; after run_to_position_mm(400): at {machine.place}", file=sys.__stdout__)
    return homed, switch, position, limit, machine.place


for start in (300, 120):
    homed, switch, position, limit, after = home(start)
    assert homed is True and switch == 0 and limit == 50
    assert position == -start and after == start
PY
v/bin/python run.py

#!/bin/sh
# pytmcstepper 0.21.3, Mock.GPIO 0.2.0 (drivers of Trinamic's stepper chips), TMC2209 that is driven by its velocity register:
# run_to_position_revolutions() rounds to whole revolutions, and below half of one the motor is started and never stopped: the call returns at once,
# reports the goal as reached, and the shaft turns on. 0.6 and 1.4 revolutions become 1, and the position that the package keeps is the asked one each
# time. It divides the speed, in full steps, by the micro-steps of a revolution: with 16 of them, 100 full steps/s are 0.031 rev/s and not 0.5. The
# README says that this mode "cannot control positioning"; the method is there, and takes the goal. The ramp of set_vactual_rps() only goes up: it
# compares seconds with microseconds, and the motor stops from full speed in one step; the docstring has "use this for a velocity ramp". There is no
# error.
# Seen on 2026-11-30:  0.4 revolutions: still turning, position 0.40   0.6: 1.00 turned   1.4: 1.00 turned, position 1.40   speed 0.031 rev/s (0.5)
# 2 rev/s for 4 s, ramp of 1 s: last speed before the stop 2.10 rev/s (0.1)
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps pytmcstepper==0.21.3 Mock.GPIO==0.2.0
cat > run.py <<'PY'
import time

now = 0  # us


def sleep(seconds):
    global now
    now += round(seconds * 1e6)


def clock():
    """Each look at the clock takes 1 ms."""
    global now
    now += 1000
    return now * 1000


from tmc_driver import Loglevel, MovementAbsRel, Tmc2209, TmcEnableControlToff, TmcMotionControlVActual
from tmc_driver.com._tmc_com_uart_base import TmcComUartBase

VACTUAL, STEP = 0x22, 12e6 / 2**24  # micro-steps/s of one unit, at the clock of 12 MHz


class Chip(TmcComUartBase):
    """The registers of the chip, and the shaft that VACTUAL turns."""

    def __init__(self):
        super().__init__()
        self.words, self.since, self.turned, self.speeds = {}, 0, 0.0, []

    def init(self):
        pass

    def deinit(self):
        pass

    def flush_com_buffer(self):
        pass

    def speed(self):
        value = self.words.get(VACTUAL, 0)
        return (value - (value >> 23 << 24)) * STEP / motion.steps_per_rev

    def read_int(self, addr, tries=10):
        return self.words.get(addr, 0), None

    def write_reg(self, addr, val):
        self.turned += self.speed() * (now - self.since) / 1e6
        self.since = now
        # GSTAT is cleared by writing ones.
        self.words[addr] = 0 if addr == 0x01 else val
        if addr == VACTUAL:
            self.speeds.append(self.speed())

    def write_reg_check(self, addr, val, tries=10):
        self.write_reg(addr, val)


chip, motion = Chip(), TmcMotionControlVActual()
motor = Tmc2209(TmcEnableControlToff(), motion, chip, loglevel=Loglevel.NONE)
motor.set_microstepping_resolution(16)
motion.max_speed_fullstep = 100
time.sleep, time.time_ns = sleep, clock
seen = {}
for revolutions in (0.4, 0.6, 1.0, 1.4):
    chip.write_reg(0x01, 0)
    chip.speeds.clear()
    before, position = chip.turned, motion.current_pos
    motion.run_to_position_revolutions(revolutions, MovementAbsRel.RELATIVE)
    seen[revolutions] = chip.turned - before, chip.speed(), (motion.current_pos - position) / motion.steps_per_rev, max(chip.speeds)
    print(
        "SEEN {} revolutions: turned {:.2f}, speed afterwards {:.3f} rev/s, position {:.2f}, largest speed {:.3f} rev/s (0.5)".format(
            revolutions, *seen[revolutions]
        )
    )
    sleep(100.0)
    motion.stop()
    print(f"SEEN 100 s later: turned {chip.turned - before:.2f}")

chip.speeds.clear()
vactual = round(2.0 / STEP * motion.steps_per_rev)
motion.set_vactual_rps(2.0, duration=4.0, acceleration=vactual)
speeds = [round(speed, 2) for speed in chip.speeds]
print("SEEN speeds of a ramp to 2 rev/s (rev/s):", speeds[:4], "...", speeds[-3:])
motor.tmc_ec = None
assert seen[0.4][1] > 0.03 and abs(seen[0.4][2] - 0.4) < 0.01 and all(abs(values[3] - 0.5 / 16) < 1e-3 for values in seen.values())
assert all(abs(seen[asked][0] - 1.0) < 0.02 and seen[asked][1] == 0 and abs(seen[asked][2] - asked) < 0.01 for asked in (0.6, 1.0, 1.4))
assert speeds[0] <= 0.2 and speeds[-1] == 0 and speeds[-2] > 1.9
PY
v/bin/python run.py

#!/bin/sh
# spin-stepper 0.1.0 (ST's L6470 stepper driver): a value above a register's range is not refused and not limited: the register takes its lower bits. run() allows 0 to 15,625 steps/s, "up to 15 625", by max_steps_per_second; at that
# speed the register of 20 bits is 0, and the motor does not turn. set_speed_limits(max_speed=15625.0) makes the greatest speed 0. set_speed_limits(min_speed=1000.0) sets bit 12, another switch (low-speed optimization), and a
# least speed of 23 steps/s. set_acceleration(acc=60000.0) accelerates with 393 steps/s^2 (the register ends at 59,590). And 0 counts as no argument: set_kval(kval_hold=0.0), for a motor without holding current, and
# set_speed_limits(min_speed=0.0) write nothing. There is no error.
# Seen on 2026-11-30:  run(15624.99): 15625.0 steps/s   run(15625.0): 0.0   max_speed=15625: 0.0   min_speed=1000: 23.4, LSPD_OPT on   acc=60000: 393   kval_hold=0.0: stays at 0.160
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps --ignore-requires-python spin-stepper==0.1.0
cat > run.py <<'PY'
import sys
import typing

if not hasattr(typing, "override"):  # Python 3.11
    typing.override = lambda function: function
from spin_stepper.spin_chain import SpinChain

TICK = 250e-9


class Chip:
    """An L6470 by its data sheet: address: (bytes, bits, reset value)."""

    table = {0x05: (2, 12, 0x08A), 0x06: (2, 12, 0x08A), 0x07: (2, 10, 0x041), 0x08: (2, 13, 0), 0x09: (1, 8, 0x29)}

    def __init__(self):
        self.registers = {address: reset for address, (_, _, reset) in self.table.items()}
        self.speed, self.pending, self.left, self.value, self.answer = None, None, 0, 0, []

    def transfer(self, buffer):
        (byte,) = buffer
        if self.left:
            self.left -= 1
            self.value = self.value << 8 | byte
            if not self.left and self.pending == "run":
                self.speed = self.value & 0xFFFFF
            elif not self.left and self.pending is not None:
                self.registers[self.pending] = self.value & (1 << self.table[self.pending][1]) - 1
            return [self.answer.pop(0)] if self.answer else [0]
        self.value = 0
        if byte & 0xFE == 0x50:
            self.pending, self.left = "run", 3
        elif byte & 0xE0 == 0x00 and byte:
            self.pending, self.left = byte, self.table[byte][0]
        elif byte & 0xE0 == 0x20:
            self.pending, self.left = None, self.table[byte & 0x1F][0]
            self.answer = list(self.registers[byte & 0x1F].to_bytes(self.left, "big"))
        return [0]


def device():
    chip = Chip()
    return chip, SpinChain(total_devices=1, spi_transfer=chip.transfer).create(0)


def run(speed):
    chip, motor = device()
    motor.run(speed)
    return chip.speed * 2**-28 / TICK


below, at_end = run(15624.99), run(15625.0)
assert device()[1].max_steps_per_second == 15625.0
chip, motor = device()
motor.set_speed_limits(max_speed=15600.0)
fine = motor.get_speed_limits()[1]
motor.set_speed_limits(max_speed=15625.0)
most = motor.get_speed_limits()[1]
motor.set_speed_limits(min_speed=900.0)
least_fine = (chip.registers[8] & 0xFFF) * 2**-24 / TICK
motor.set_speed_limits(min_speed=1000.0)
least, optimized = (chip.registers[8] & 0xFFF) * 2**-24 / TICK, bool(chip.registers[8] & 0x1000)
before = chip.registers[8]
motor.set_speed_limits(min_speed=0.0)
unchanged = chip.registers[8] == before
motor.set_acceleration(acc=59000.0)
acceleration_fine = motor.get_acceleration()[1]
motor.set_acceleration(acc=60000.0)
acceleration = motor.get_acceleration()[1]
motor.set_kval(kval_hold=0.0)
hold = chip.registers[9] / 256
print(f"SEEN run: {below:.1f}, {at_end:.1f} steps/s; max_speed {fine:.0f}, {most:.1f}; min_speed {least_fine:.1f}, {least:.1f} (LSPD_OPT {optimized}); acceleration {acceleration_fine:.0f}, {acceleration:.0f}; holding {hold:.3f}; min_speed=0.0 kept: {unchanged}")
assert abs(below - 15625.0) < 0.1 and at_end == 0.0 and abs(fine - 15600.0) < 16 and most == 0.0
assert abs(least_fine - 900) < 1 and abs(least - 23.4) < 0.1 and optimized and unchanged
assert abs(acceleration_fine - 59000) < 15 and abs(acceleration - 393) < 1 and abs(hold - 0.160) < 0.001
PY
v/bin/python run.py

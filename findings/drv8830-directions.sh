#!/bin/sh
# drv8830 1.0.0, i2cdevice 1.0.0 (TI's driver of a DC motor): forward() and reverse() are exchanged. set_outputs(1, 0) is documented as "forward" and turns forward by the data sheet's table (IN1 high, IN2 low, the bits 0 and 1
# of CONTROL); forward() and set_direction("forward") write the bits the other way round, the data sheet's reverse. A wheel that is driven by forward() and one that is driven by set_outputs(1, 0) turn against each other, and code that
# moves to this package from another driver of the same chip turns back. Brake and coast are right. There is no error.
# Seen on 2026-11-30:  forward(): IN1 0, IN2 1 (reverse)   reverse(): IN1 1, IN2 0 (forward)   set_outputs(1, 0), "forward": IN1 1, IN2 0   set_outputs(0, 1), "reverse": IN1 0, IN2 1   the voltage stays: 48
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps drv8830==1.0.0 i2cdevice==1.0.0
cat > run.py <<'PY'
from drv8830 import DRV8830


class Bus:
    """The registers of a DRV8830."""

    def __init__(self):
        self.memory = bytearray(2)

    def read_i2c_block_data(self, _, register, length):
        return list(self.memory[register : register + length])

    def write_i2c_block_data(self, _, register, values):
        self.memory[register : register + len(values)] = bytes(values)


bus = Bus()
motor = DRV8830(i2c_dev=bus)
motor.set_voltage(3.86)


def pins(command):
    """IN1 and IN2 after a command, and the voltage's code."""
    command()
    return bus.memory[0] & 1, bus.memory[0] >> 1 & 1, bus.memory[0] >> 2


seen = {
    "forward()": pins(motor.forward),
    "set_outputs(1, 0)": pins(lambda: motor.set_outputs(1, 0)),
    "reverse()": pins(motor.reverse),
    "set_outputs(0, 1)": pins(lambda: motor.set_outputs(0, 1)),
    "brake()": pins(motor.brake),
    "coast()": pins(motor.coast),
}
print("SEEN IN1, IN2, VSET:", seen)
text = DRV8830.set_outputs.__doc__
assert "1 0 - forward" in text and "0 1 - reverse" in text
assert seen["set_outputs(1, 0)"][:2] == (1, 0) and seen["forward()"][:2] == (0, 1)
assert seen["set_outputs(0, 1)"][:2] == (0, 1) and seen["reverse()"][:2] == (1, 0)
assert seen["brake()"][:2] == (1, 1) and seen["coast()"][:2] == (0, 0) and len({pin[2] for pin in seen.values()}) == 1
PY
v/bin/python run.py

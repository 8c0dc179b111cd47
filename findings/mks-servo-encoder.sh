#!/bin/sh
# mks-servo-rs485 0.3.0, mks-servo 1.0.0 (MKS SERVO42D steppers with an encoder): read_encoder_value() of mks-servo-rs485 puts the encoder's three registers of 16 bits together as if the last two had 8: the position is right up to 4 turns, and
# there it falls back: 65,536 counts (4 turns) are read as 256, 100 turns as 6,400 (1,638,400), and -1 count as 4,294,967,295, as all negative ones are large and positive. read_speed_rpm(), read_number_of_pulses() and
# read_error_of_angle() have no sign either: -60 rpm is 65,476. mks-servo reads all of these registers right, from the same bytes. There is no error. A loop that closes on that position turns the motor without an end.
# Seen on 2026-11-30:  counts 16384, 65535, 65536, 1638400, -1: mks-servo-rs485 16384, 65535, 256, 6400, 4294967295   mks-servo the same as sent   -60 rpm: 65476 and -60   angle error of -5: 4294967291 and -5
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q pyserial==3.5 minimalmodbus==2.1.1 ruamel.yaml==0.18.10 && v/bin/pip install -q --no-deps --ignore-requires-python mks-servo-rs485==0.3.0 mks-servo==1.0.0
cat > run.py <<'PY'
from mks_servo.raw import RawDriver
from mks_servo_rs485 import servo


class Bus:
    """A motor's values as Modbus registers, and as the bytes of its own protocol."""

    def __init__(self, value):
        self.value = value

    def read_registers(self, functioncode, registeraddress, number_of_registers):
        data = self.value.to_bytes(2 * number_of_registers, "big", signed=True)
        return [int.from_bytes(data[at : at + 2], "big") for at in range(0, len(data), 2)]

    def transact(self, _, expect_payload_len):
        return self.value.to_bytes(expect_payload_len, "big", signed=True)


kind = next(value for value in vars(servo).values() if isinstance(value, type) and hasattr(value, "read_encoder_value"))


def read(value, one, two):
    bus = Bus(value)
    first = object.__new__(kind)
    first.mb = bus
    second = object.__new__(RawDriver)
    second._txn = lambda code, expect_payload_len: bus.transact(code, expect_payload_len)
    return getattr(first, one)(), getattr(second, two)()


counts = [16384, 65535, 65536, 1638400, -1]
positions = [read(value, "read_encoder_value", "read_encoder_addition") for value in counts]
speed = read(-60, "read_speed_rpm", "read_speed_rpm")
pulses = read(-200, "read_number_of_pulses", "read_pulses")
error = read(-5, "read_error_of_angle", "read_angle_error")
print("SEEN", dict(zip(counts, positions)), "speed", speed, "pulses", pulses, "error", error)
assert [one for one, _ in positions] == [16384, 65535, 256, 6400, 2**32 - 1]
assert [two for _, two in positions] == counts and (speed[1], pulses[1], error[1]) == (-60, -200, -5)
assert (speed[0], pulses[0], error[0]) == (65476, 2**32 - 200, 2**32 - 5)
PY
v/bin/python run.py

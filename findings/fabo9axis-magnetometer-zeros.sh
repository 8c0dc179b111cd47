#!/bin/sh
# FaBo9Axis-MPU9250-Python3 1.0.3 (MPU-9250 and its magnetometer AK8963): readMagnet() gives a field of 0, 0, 0 whenever there is no new measurement, and when the sensor overflows. By the driver's default the magnetometer measures 8 times a
# second: a loop that reads it at 100 Hz with the accelerometer and the gyroscope, whose readings are new each time, gets 92 zeros of 100, and a heading by arctangent that is 0 in those. There is no way to tell them from a
# measurement, as by None or the last value, and no error.
# Seen on 2026-11-30:  field of 20, -30, 5 uT, one second at 100 Hz: 92 readings of 0, 0, 0, 8 of 20, -30, 5   headings: 0 degrees 92 times, -56.3 degrees 8 times   overflow: 0, 0, 0
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps FaBo9Axis-MPU9250-Python3==1.0.3
cat > run.py <<'PY'
import math
import sys
import types
from collections import Counter

FIELD = 20.0, -30.0, 5.0  # uT


class SMBus:
    """An AK8963 by its data sheet, which sets the bit of new data at the rate of its mode, and clears it when the data is read."""

    def __init__(self, _):
        self.registers, self.time, self.read, self.overflow = {}, 0.0, -1, 0

    def write_byte_data(self, device, register, value):
        self.registers[device, register] = value

    def measured(self):
        rate = {0x02: 8, 0x06: 100}[self.registers[0x0C, 0x0A] & 15]
        return math.floor(self.time * rate + 1e-6)

    def read_byte_data(self, device, register):
        return int(self.measured() > self.read) if (device, register) == (0x0C, 0x02) else self.registers.get((device, register), 0)

    def read_i2c_block_data(self, device, register, length):
        if (device, register) == (0x0C, 0x10):
            return [128] * 3
        self.read = self.measured()
        codes = b"".join(round(value / (4912 / 32760)).to_bytes(2, "little", signed=True) for value in FIELD)
        return list(codes) + [0x10 | self.overflow]


sys.modules["smbus"] = types.ModuleType("smbus")
sys.modules["smbus"].SMBus = SMBus
import time

time.sleep = lambda _: None
from FaBo9Axis_MPU9250 import MPU9250

bus, sensor = sys.modules[MPU9250.__module__].bus, MPU9250()
fields = []
for step in range(100):
    bus.time = step / 100
    fields.append(sensor.readMagnet())
shown = Counter(tuple(round(value) for value in field.values()) for field in fields)
headings = Counter(round(math.degrees(math.atan2(field["y"], field["x"])), 0) for field in fields)
bus.time, bus.overflow = 2.0, 0x08
overflow = tuple(sensor.readMagnet().values())
print("SEEN", dict(shown), "headings", dict(headings), "overflow", overflow)
assert shown == {(0, 0, 0): 92, (20, -30, 5): 8} and headings == {0.0: 92, -56.0: 8} and overflow == (0, 0, 0)
PY
v/bin/python run.py

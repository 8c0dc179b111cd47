#!/bin/sh
# micropython-bmi160 0.1.2, micropython-bmi270 0.1.0, of their Python files as they are: the BMI160 driver divides by the standard gravity where it has to multiply: a sensor that lies flat measures 0.102, in no unit, where the BMI270 driver of
# the same series measures 9.81. A ratio of axes, as a tilt, is right, so that it shows nowhere but in a policy that observes acceleration, or in a test for free fall, which is true at rest. gyro_range reports the range of the
# other end: a sensor that is set to 2000 degrees per second says GYRO_RANGE_125; the readings are right all the same. There is no error.
# Seen on 2026-11-30:  flat: micropython-bmi160 0.102 in each range, micropython-bmi270 9.807   gyro_range = GYRO_RANGE_2000 reports GYRO_RANGE_125, GYRO_RANGE_125 reports GYRO_RANGE_2000   90 degrees/s: 90.0
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps --target p micropython-bmi160==0.1.2 micropython-bmi270==0.1.0
cat > run.py <<'PY'
import struct
import sys
import time
import types

sys.path.insert(0, "p")
sys.modules["micropython"] = types.SimpleNamespace(const=lambda value: value)
time.sleep = lambda _: None
from micropython_bmi160 import bmi160
from micropython_bmi270 import bmi270

ACCELERATION, GYROSCOPE = {bmi160: 0x12, bmi270: 0x0C}, {bmi160: 0x0C, bmi270: 0x12}
RANGES = {bmi160: {3: 2, 5: 4, 8: 8, 12: 16}, bmi270: {0: 2, 1: 4, 2: 8, 3: 16}}


class Sensor:
    """The registers of a sensor that lies flat and turns by 90 degrees per second about z."""

    def __init__(self, module, identity):
        self.module, self.memory = module, bytearray(256)
        self.memory[0x00], self.memory[0x21] = identity, 1
        self.memory[0x41] = 3 if module is bmi160 else 0

    def readfrom_mem(self, _, register, count):
        memory = bytearray(self.memory)
        acceleration = 32768 // RANGES[self.module][self.memory[0x41] & 15]
        gyroscope = round(90 * 16.4 * 2 ** (self.memory[0x43] & 7))
        for start, value in ((ACCELERATION[self.module], acceleration), (GYROSCOPE[self.module], gyroscope)):
            memory[start : start + 6] = struct.pack("<hhh", 0, 0, min(value, 32767))
        return bytes(memory[register : register + count])

    def writeto_mem(self, _, register, data):
        self.memory[register : register + len(data)] = data

    def writeto(self, *_):
        pass


one = bmi160.BMI160(Sensor(bmi160, 0xD1))
flat = []
for name in ("ACCEL_RANGE_2G", "ACCEL_RANGE_4G", "ACCEL_RANGE_8G", "ACCEL_RANGE_16G"):
    one.acceleration_range = getattr(bmi160, name)
    flat.append(one.acceleration[2])
reported = []
for name in ("GYRO_RANGE_2000", "GYRO_RANGE_125"):
    one.gyro_range = getattr(bmi160, name)
    reported.append(one.gyro_range)
one.gyro_range = bmi160.GYRO_RANGE_2000
turn = one.gyro[2]
bmi270.BMI270.load_config_file = lambda self: None  # the firmware of the sensor, 8 kB
other = bmi270.BMI270(Sensor(bmi270, 0x24)).acceleration[2]
print("SEEN bmi160", [f"{value:.3f}" for value in flat], f"bmi270 {other:.3f}", reported, f"turn {turn:.1f}")
assert all(abs(value - 1 / 9.80665) < 1e-3 for value in flat) and abs(other - 9.807) < 0.01
assert reported == ["GYRO_RANGE_125", "GYRO_RANGE_2000"] and abs(turn - 90) < 0.1
PY
v/bin/python run.py

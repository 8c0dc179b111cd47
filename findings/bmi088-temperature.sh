#!/bin/sh
# imu-bmi088 1.0.1, AHRS 0.4.0 (driver of Bosch's BMI088): read_temperature() takes the temperature's 11 bits, which are signed and count from 23 degrees, for an unsigned number: below 23 degrees it is 256 degrees too high. A cold
# motor's IMU at 20 degrees is at 276, and one that cools from 23.0 to 22.9 goes to 278.9; bias tables over temperature are left at that point, and a limit of temperature trips. From 23 degrees on it is right, so that a test on
# a warm desk sees nothing. And ACC_POWER_CONF, 0x7C in the data sheet, is 0x7D as the other power register is, so that the driver never takes the accelerometer out of its reset value 0x03 (suspend). There is no error.
# Seen on 2026-11-30:  at 30, 23, 22.875, 20, 0, -40 degrees: 30, 23, 278.875, 276, 256, 216   writes to 0x7C: 0, to 0x7D: 0x00 and then 0x04
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps imu-bmi088==1.0.1 AHRS==0.4.0 numpy==2.4.6
cat > run.py <<'PY'
import sys
import types


class SMBus:
    """The sensor's registers, on the bus of the machine that the driver runs on."""

    def __init__(self, _):
        self.written, self.registers = [], {(0x18, 0x7C): 0x03}

    def write_byte_data(self, device, register, value):
        self.written.append((device, register, value))
        self.registers[device, register] = value

    def read_byte_data(self, device, register):
        return self.registers.get((device, register), 0)


sys.modules["smbus3"] = types.ModuleType("smbus3")
sys.modules["smbus3"].SMBus = SMBus
from bmi088.bmi088 import BMI088

sensor = BMI088(1)
power = [(register, value) for device, register, value in sensor.bus.written if device == 0x18 and register in (0x7C, 0x7D)]


def read(celsius):
    """The reading at a temperature, which the sensor gives in steps of 0.125 from 23 degrees on, as a signed number of 11 bits."""
    code = round((celsius - 23) / 0.125) & 0x7FF
    sensor.bus.registers[0x18, 0x22], sensor.bus.registers[0x18, 0x23] = code >> 3, (code & 7) << 5
    return float(sensor.read_temperature())


readings = {celsius: read(celsius) for celsius in (85.0, 30.0, 23.0, 22.875, 20.0, 0.0, -40.0)}
print("SEEN", readings, "power registers written:", [(hex(register), value) for register, value in power], "0x7C holds", sensor.bus.registers[0x18, 0x7C])
assert all(reading == celsius + (256 if celsius < 23 else 0) for celsius, reading in readings.items())
assert power == [(0x7D, 0), (0x7D, 4)] and sensor.bus.registers[0x18, 0x7C] == 0x03
PY
v/bin/python run.py

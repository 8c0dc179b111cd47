#!/bin/sh
# micropython-icm20948 0.2.3, icm20948 1.0.0, of their Python files as they are: gyro of the MicroPython driver is documented "in degrees / second" and has radians per second: a turn of 90 degrees per second is 1.57. A filter that converts
# degrees, as the documentation has it, turns by 1.57 degrees where the body turns by 90, and a policy that was trained on another driver's numbers, as those of the package icm20948 for the same sensor and the same registers (90.0), takes the
# robot to be at rest. The acceleration is in m/s^2 in the one, as documented, and in g in the other. There is no error.
# Seen on 2026-11-30:  90 degrees/s about z, flat: micropython-icm20948 gyro 1.571, acceleration 9.81   icm20948: 90.0, 1.00
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps --target p micropython-icm20948==0.2.3 icm20948==1.0.0
cat > run.py <<'PY'
import struct
import sys
import types

sys.path.insert(0, "p")
sys.modules["micropython"] = types.SimpleNamespace(const=lambda value: value)
import icm20948
from micropython_icm20948 import icm20948 as micropython

BANK_SELECT, ACCELERATION, GYROSCOPE = 0x7F, 0x2D, 0x33


class Sensor:
    """The register banks of an ICM-20948 that lies flat and turns by 90 degrees per second about z."""

    def __init__(self):
        self.banks = [bytearray(128) for _ in range(4)]
        self.banks[0][0] = 0xEA

    @property
    def bank(self):
        return self.banks[self.banks[0][BANK_SELECT] >> 4 & 3]

    def read_i2c_block_data(self, _, register, count):
        acceleration = 16384 >> (self.banks[2][0x14] >> 1 & 3)
        gyroscope = round(90 * 32768 / (250 << (self.banks[2][0x01] >> 1 & 3)))
        measured = struct.pack(">hhhhhhh", 0, 0, acceleration, 0, 0, gyroscope, 0)
        if self.bank is self.banks[0] and ACCELERATION <= register < ACCELERATION + 14:
            return list(measured[register - ACCELERATION :][:count])
        if register == 0x3B:
            return [0x09]
        return list((self.banks[0] if register == BANK_SELECT else self.bank)[register : register + count])

    def write_byte_data(self, _, register, value):
        (self.banks[0] if register == BANK_SELECT else self.bank)[register] = value & (0x7F if register == 0x06 else 0xFF)

    def read_byte_data(self, address, register):
        return self.read_i2c_block_data(address, register, 1)[0]

    def readfrom_mem(self, address, register, count):
        return bytes(self.read_i2c_block_data(address, register, count))

    def writeto_mem(self, address, register, data):
        for offset, value in enumerate(data):
            self.write_byte_data(address, register + offset, value)


one = micropython.ICM20948(Sensor())
turn, up = one.gyro[2], one.acceleration[2]
other = icm20948.ICM20948(i2c_bus=Sensor()).read_accelerometer_gyro_data()
print(f"SEEN micropython-icm20948: gyro {turn:.3f}, acceleration {up:.2f}; icm20948: gyro {other[5]:.1f}, acceleration {other[2]:.2f}")
assert "degrees" in micropython.ICM20948.gyro.__doc__ and abs(turn - 1.5708) < 0.005 and abs(up - 9.80665) < 0.01
assert abs(other[5] - 90) < 0.2 and abs(other[2] - 1) < 0.001
PY
v/bin/python run.py

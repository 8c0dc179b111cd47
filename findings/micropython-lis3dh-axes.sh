#!/bin/sh
# micropython-lis3dh 0.1.2, of its Python files as they are: the bits that switch the axes on are written three places too high in CTRL_REG1, over those of low power and of the data rate. The driver's start sets low power (8 bits) beside
# high resolution (12 bits), a pair that the sensor's manual does not allow. axes_enabled = AXES_X leaves all three axes on and makes 50 Hz of 400; axes_enabled = AXES_Z_Y_X, the default, makes 400 Hz of the 100 that were asked before. And
# after data_rate = DATARATE_100, axes_enabled reports 3 (x and y) where it was 7. There is no error. A loop of 400 Hz reads each sample eight times.
# Seen on 2026-11-30:  after the start: 400 Hz, low power and high resolution, axes xyz   AXES_X: 50 Hz, axes xyz   DATARATE_100: 100 Hz, axes_enabled 7 -> 3   then AXES_Z_Y_X: 400 Hz
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps --target p micropython-lis3dh==0.1.2
cat > run.py <<'PY'
import sys
import types

sys.path.insert(0, "p")
sys.modules["micropython"] = types.SimpleNamespace(const=lambda value: value)
from micropython_lis3dh import lis3dh

RATES = {0: 0, 1: 1, 2: 10, 3: 25, 4: 50, 5: 100, 6: 200, 7: 400}


class Sensor:
    """The registers of a LIS3DH, as they are after a start: all axes on."""

    def __init__(self):
        self.memory = bytearray(256)
        self.memory[0x0F], self.memory[0x20] = 0x33, 0x07

    def readfrom_mem(self, _, register, count):
        return bytes(self.memory[register : register + count])

    def writeto_mem(self, _, register, data):
        self.memory[register : register + len(data)] = data

    def state(self):
        control = self.memory[0x20]
        axes = "".join(name for bit, name in enumerate("xyz") if control >> bit & 1)
        return RATES.get(control >> 4), axes, bool(control & 8), bool(self.memory[0x23] & 8)


sensor = Sensor()
driver = lis3dh.LIS3DH(sensor)
start = sensor.state()
driver.axes_enabled = lis3dh.AXES_X
one = sensor.state()
sensor = Sensor()
driver = lis3dh.LIS3DH(sensor)
before = driver.axes_enabled
driver.data_rate = lis3dh.DATARATE_100
after = driver.axes_enabled
asked = sensor.state()
driver.axes_enabled = lis3dh.AXES_Z_Y_X
again = sensor.state()
print("SEEN rate, axes, low power, high resolution:", start, "AXES_X", one, "DATARATE_100", asked, "AXES_Z_Y_X", again, "reported", before, after)
assert start == (400, "xyz", True, True) and one == (50, "xyz", True, True)
assert asked[0] == 100 and again[0] == 400 and (before, after) == (7, 3)
PY
v/bin/python run.py

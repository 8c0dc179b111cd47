#!/bin/sh
# micropython-lsm6dsox 0.1.0, of its Python files as they are: the accelerometer's data rate is written two bits too low in the register CTRL1_XL, over its range. The 104 Hz that the driver sets at its start are 12.5 Hz in the sensor, so that a
# loop of 100 Hz reads each acceleration eight times; the gyroscope's are right. A rate that is set later is 12.5 Hz or none (26 and 52 Hz switch the accelerometer off) and changes the range, but not the factor that readings are multiplied by:
# 1 g is read as 2.45 m/s^2 after RATE_208_HZ (16 g in the sensor, 4 g in the driver), as 19.6 after RATE_104_HZ, as 4.9 after RATE_833_HZ. Setting a range brings the factor back, and the rate stays. acceleration_data_rate reports
# what was asked. There is no error.
# Seen on 2026-11-30:  after the start: accelerometer 12.5 Hz, gyroscope 104 Hz, 1 g is 9.81   26, 52 Hz: off   104: 12.5 Hz, 19.61   208: 12.5 Hz, 2.45   416: 12.5 Hz, 9.81   833: 12.5 Hz, 4.90
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps --target p micropython-lsm6dsox==0.1.0
cat > run.py <<'PY'
import struct
import sys
import types

sys.path.insert(0, "p")
sys.modules["micropython"] = types.SimpleNamespace(const=lambda value: value)
from micropython_lsm6dsox import lsm6dsox

CTRL1_XL, CTRL2_G, CTRL3_C = 0x10, 0x11, 0x12
RATES = {0: 0, 1: 12.5, 2: 26, 3: 52, 4: 104, 5: 208, 6: 416, 7: 833, 8: 1667, 9: 3333, 10: 6667}
RANGES = {0: 2, 1: 16, 2: 4, 3: 8}


class Sensor:
    """The registers of an LSM6DSOX that lies flat: 1 g along z, in codes of the range that is set."""

    def __init__(self):
        self.memory = bytearray(256)
        self.memory[0x0F] = 0x6C

    @property
    def range(self):
        return RANGES[self.memory[CTRL1_XL] >> 2 & 3]

    def rate(self, register):
        return RATES[self.memory[register] >> 4]

    def readfrom_mem(self, _, register, count):
        if register == 0x28:
            return struct.pack("<hhh", 0, 0, round(1000 / {2: 0.061, 4: 0.122, 8: 0.244, 16: 0.488}[self.range]))[:count]
        return bytes(self.memory[register : register + count])

    def writeto_mem(self, _, register, data):
        self.memory[register : register + len(data)] = data
        self.memory[CTRL3_C] &= 0xFE


def state(sensor, driver):
    return sensor.rate(CTRL1_XL), sensor.range, round(driver.acceleration[2], 2)


sensor = Sensor()
driver = lsm6dsox.LSM6DSOX(sensor)
start = state(sensor, driver), sensor.rate(CTRL2_G)
seen = {}
for name in ("RATE_26_HZ", "RATE_52_HZ", "RATE_104_HZ", "RATE_208_HZ", "RATE_416_HZ", "RATE_833_HZ"):
    sensor = Sensor()
    driver = lsm6dsox.LSM6DSOX(sensor)
    driver.acceleration_data_rate = getattr(lsm6dsox, name)
    reported = driver.acceleration_data_rate
    seen[name] = (*state(sensor, driver), reported)
    driver.acceleration_range = lsm6dsox.RANGE_4G
    again = state(sensor, driver)
    assert again == (seen[name][0], 4, 9.81), again
print("SEEN start", start, seen)
assert start == ((12.5, 4, 9.81), 104)
assert [found[:3] for found in seen.values()] == [(0, 4, 9.81), (0, 8, 4.9), (12.5, 2, 19.61), (12.5, 16, 2.45), (12.5, 4, 9.81), (12.5, 8, 4.9)]
assert [found[3] for found in seen.values()] == list(seen)
PY
v/bin/python run.py

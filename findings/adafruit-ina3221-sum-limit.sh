#!/bin/sh
# adafruit-circuitpython-ina3221 1.2.3 (TI's INA3221, three channels of current): shunt_voltage_sum_limit = 0.1, the limit of the sum of the currents, is written to another register: the upper limit of the power-valid monitor (address
# 0x10). The sum's own register (0x0E) keeps its start value, the end of its range, so that the alarm of too much current in all motors never comes, and the supply is called valid from another voltage on: 10 V become 5 V, so
# that a battery that has failed counts as good. Reading shunt_voltage_sum_limit back gives the old limit. There is no error.
# Seen on 2026-11-30:  power_valid_limits 9 V, 10 V, then shunt_voltage_sum_limit = 0.1: limits 9.0 V, 5.0 V, sum limit 0.655 V (0.1), registers 0x0e: 0x7ffe, 0x10: 0x1388
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps adafruit-circuitpython-ina3221==1.2.3
cat > run.py <<'PY'
import sys
import types


class Device:
    """The registers of an INA3221 with the values of its reset."""

    def __init__(self, *_, **__):
        self.words, self.pointer = {0x00: 0x7127, 0x0E: 0x7FFE, 0x10: 0x2710, 0x11: 0x2328}, 0

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def write(self, data):
        self.pointer = data[0]
        if len(data) == 3:
            value = int.from_bytes(data[1:], "big")
            self.words[data[0]] = value & 0x7FFF if data[0] == 0 else value

    def readinto(self, into):
        into[:] = self.words.get(self.pointer, 0).to_bytes(2, "big")


sys.modules["adafruit_bus_device"] = types.ModuleType("adafruit_bus_device")
sys.modules["adafruit_bus_device.i2c_device"] = types.SimpleNamespace(I2CDevice=Device)
import adafruit_ina3221

sensor = adafruit_ina3221.INA3221(None)
sensor.power_valid_limits = 9.0, 10.0
before = sensor.power_valid_limits
sensor.shunt_voltage_sum_limit = 0.1
words = sensor.i2c_dev.words
after, limit = sensor.power_valid_limits, sensor.shunt_voltage_sum_limit
print("SEEN power-valid limits:", before, "then", after, f"sum limit {limit:.3f} V (0.1), registers 0x0e: {words[0x0E]:#06x}, 0x10: {words[0x10]:#06x}")
assert before == (9.0, 10.0) and after[0] == 9.0
assert words[0x0E] == 0x7FFE and abs(limit - 0.65532) < 1e-4
assert words[0x10] == round(0.1 / 40e-6) << 1 and after[1] == (words[0x10] >> 3) * 0.008
PY
v/bin/python run.py

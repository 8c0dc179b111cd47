#!/bin/sh
# bmi270 0.4.3 and bmi260 0.4.5 (drivers of Bosch's BMI270 and BMI260), numpy 2.4.6: without set_acc_range() and set_gyr_range(), the drivers compute with ranges that the sensor does not have: 2 g and 1000 degrees/s, which they keep without
# writing them, where the sensor starts with 8 g and 2000. The modes of set_mode() do not set them either. Gravity is 2.45 m/s^2, a quarter, and a turn by 90 degrees/s is 45: tilts by arctangent are right, so that a test of the
# orientation at rest sees nothing, and integrated angles are half. There is no error.
# Seen on 2026-11-30:  1 g and 90 degrees/s, after load_config_file() and set_mode("performance"): 2.45 m/s^2, 45.0 degrees/s   after set_acc_range() and set_gyr_range() too: 9.81 m/s^2, 90.0 degrees/s   in both packages
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps bmi270==0.4.3 bmi260==0.4.5 numpy==2.4.6
cat > run.py <<'PY'
import contextlib
import importlib
import io
import math
import sys
import types

ACC_RANGE, GYR_RANGE, STATUS = 0x41, 0x43, 0x21


class SMBus:
    """The sensor, by its data sheet: ACC_RANGE starts with 2 (8 g) and GYR_RANGE with 0 (2000 degrees/s). It lies still on z and turns about z."""

    def __init__(self, _):
        self.registers = {ACC_RANGE: 0x02, GYR_RANGE: 0x00}

    def write_byte_data(self, _, register, value):
        self.registers[register] = value
        if register == 0x59 and value == 1:
            self.registers[STATUS] = 1

    def write_i2c_block_data(self, *_):
        pass

    def read_byte_data(self, _, register):
        acc = round(32768 / (2 << (self.registers[ACC_RANGE] & 3)))
        gyr = round(90 * 32768 / (2000 >> (self.registers[GYR_RANGE] & 7)))
        data = dict(enumerate(b"".join(value.to_bytes(2, "little", signed=True) for value in (0, 0, acc, 0, 0, gyr)), 0x0C))
        return data.get(register, self.registers.get(register, 0))


sys.modules["smbus2"] = types.ModuleType("smbus2")
sys.modules["smbus2"].SMBus = SMBus
for package in ("bmi270", "bmi260"):
    module = importlib.import_module(f"{package}.BMI270")
    with contextlib.redirect_stdout(io.StringIO()):
        sensor = module.BMI270(0x68)
        sensor.load_config_file(*([module.bmi260_config_file] if package == "bmi260" else []))
        sensor.set_mode("performance")
        first = sensor.get_acc_data()[2], math.degrees(sensor.get_gyr_data()[2])
        sensor.set_acc_range()
        sensor.set_gyr_range()
        second = sensor.get_acc_data()[2], math.degrees(sensor.get_gyr_data()[2])
    print(f"SEEN {package}: {first[0]:.2f} m/s^2, {first[1]:.1f} degrees/s; with the ranges set: {second[0]:.2f}, {second[1]:.1f}")
    assert abs(first[0] - 9.81 / 4) < 0.01 and abs(first[1] - 45) < 0.1
    assert abs(second[0] - 9.81) < 0.01 and abs(second[1] - 90) < 0.1
PY
v/bin/python run.py

#!/bin/sh
# sparkfun-qwiic-lsm6dso 2.0.0 (ST's LSM6DSO): after begin(), angular rates are half: the driver computes with the step of 125 degrees/s, "their minimum ranges", and the sensor starts with 250, the range of its reset, which
# get_gyro_range_dps() reads back rightly. A turn by 90 degrees/s is 45, and a heading that is integrated from it 45 degrees for a quarter of a turn. After set_gyro_range(), to the same 250, it is right, and the accelerometer is right from
# the start. And read_temp_c() takes the temperature, which is signed and counts from 25 degrees, for an unsigned number: below 25 degrees it is 256 degrees too high: 24.5 degrees are 280.5. There is no error.
# Seen on 2026-11-30:  90 degrees/s after begin(): 45.0, range read back: 250   after set_gyro_range(FS_G_250dps): 90.0   gravity: 1.00 g   30, 25, 24.5, 0 degrees: 30.0, 25.0, 280.5, 256.0
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps sparkfun-qwiic-lsm6dso==2.0.0
cat > run.py <<'PY'
import sys
import types

sys.modules["qwiic_i2c"] = types.ModuleType("qwiic_i2c")
import qwiic_lsm6dso

RATE, STEPS = 90.0, {0: 8.75e-3, 2: 17.5e-3, 4: 35e-3, 6: 70e-3}  # degrees/s per code, by the bits FS_G and FS_125 of CTRL2_G


class Bus:
    """An LSM6DSO by its data sheet: it lies still on z and turns about z, at a temperature."""

    celsius = 25.0

    def __init__(self):
        self.reset()

    def reset(self):
        self.registers = {**dict.fromkeys(range(128), 0), 0x0F: 0x6C, 0x12: 0x04}

    def isDeviceConnected(self, _):
        return True

    def data(self):
        selected = self.registers[0x11] >> 1 & 7
        step = 4.375e-3 if selected & 1 else STEPS[selected]
        scale = {0: 0.061e-3, 2: 0.122e-3, 3: 0.244e-3, 1: 0.488e-3}[self.registers[0x10] >> 2 & 3]
        words = round((self.celsius - 25) * 256), 0, 0, round(RATE / step), 0, 0, round(1 / scale)
        return dict(enumerate(b"".join(word.to_bytes(2, "little", signed=True) for word in words), 0x20))

    def readByte(self, _, register):
        return self.data().get(register, self.registers[register])

    def readWord(self, address, register):
        return self.readByte(address, register) | self.readByte(address, register + 1) << 8

    def readBlock(self, address, register, length):
        return [self.readByte(address, register + offset) for offset in range(length)]

    def writeByte(self, _, register, value):
        if register == 0x12 and value & 1:
            self.reset()
        else:
            self.registers[register] = value


bus = Bus()
sensor = qwiic_lsm6dso.QwiicLSM6DSO(i2c_driver=bus)
assert sensor.begin()
first, read_back = sensor.read_float_accel_gyro_all(), sensor.get_gyro_range_dps()
assert sensor.set_gyro_range(sensor.FS_G_250dps)
second = sensor.read_float_accel_gyro_all()
temperatures = {}
for bus.celsius in (30.0, 25.0, 24.5, 0.0):
    temperatures[bus.celsius] = sensor.read_temp_c()
print(f"SEEN after begin(): {first[5]:.1f} degrees/s, {first[2]:.2f} g, range read back {read_back}; with the range set: {second[5]:.1f}; temperatures", temperatures)
assert abs(first[5] - 45) < 0.1 and read_back == 250 and abs(second[5] - 90) < 0.1 and abs(first[2] - 1) < 0.01 and abs(second[2] - 1) < 0.01
assert temperatures == {30.0: 30.0, 25.0: 25.0, 24.5: 280.5, 0.0: 256.0}
PY
v/bin/python run.py

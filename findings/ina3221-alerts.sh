#!/bin/sh
# barbudor-circuitpython-ina3221 2.0.0, ina3221-linux 0.1.0, smbus2 0.6.0 (two drivers of TI's INA3221, three channels of current): in the first, set_shunt_critical_alert_limit() and set_shunt_warning_alert_limit() multiply the voltage by the
# step of 40 uV where they have to divide by it: each limit up to 163 mV is written as 0, so that the alarm of overcurrent is on with every current, and a reader that ignores it has no limit at all. In the second,
# the names of the flags count the channels backward: MASK_CF_0, "Critical-alert flag 0", is the bit of channel 2 by the data sheet (CF3, bit 7), and MASK_SCC_0 puts channel 2 in the sum, where enable_channel(0) and get_current(0)
# are channel 0: the motor that is overloaded is not the one that is switched off. Its get_shunt_voltage_sum() takes the sign from bit 12 of 15: sums above 163 mV are negative, and one of -30 mV (motors that brake) is
# +953 mV. There is no error.
# Seen on 2026-11-30:  limit of 50 mV: register 0x0000, reads 0 V (0x2710)   overcurrent of channel 0: flag MASK_CF_2   sum of 300 mV: -27.7 mV, of -30 mV: 953.0 mV
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps barbudor-circuitpython-ina3221==2.0.0 ina3221-linux==0.1.0 smbus2==0.6.0
cat > run.py <<'PY'
import sys
import types

REGISTERS = {0x00: 0x7127}


class Device:
    """The registers of an INA3221, as adafruit_bus_device has them."""

    def __init__(self, *_):
        self.words = dict(REGISTERS)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def write(self, data):
        self.words[data[0]] = int.from_bytes(data[1:3], "big")

    def write_then_readinto(self, out, into, out_end, in_start):
        into[in_start : in_start + 2] = self.words.get(out[0], 0).to_bytes(2, "big")


sys.modules["micropython"] = types.SimpleNamespace(const=lambda value: value)
sys.modules["adafruit_bus_device"] = types.ModuleType("adafruit_bus_device")
sys.modules["adafruit_bus_device.i2c_device"] = types.SimpleNamespace(I2CDevice=Device)
from barbudor_ina3221.full import INA3221

sensor = INA3221(None)
limits = {}
for volts in (0.01, 0.05, 0.16):
    sensor.set_shunt_critical_alert_limit(1, volts)
    sensor.set_shunt_warning_alert_limit(1, volts)
    limits[volts] = sensor.i2c_device.words[0x07], sensor.i2c_device.words[0x08], sensor.shunt_critical_alert_limit(1)
print("SEEN limit (V): critical and warning register, limit read back:", limits, f"  0.05 V is 0x{round(0.05 / 40e-6) << 3:04x}")
assert set(limits.values()) == {(0, 0, 0.0)}

from INA3221_linux import INA3221 as Linux


class Bus:
    def __init__(self):
        self.words = {}

    def read_i2c_block_data(self, _, register, length):
        return list(self.words.get(register, 0).to_bytes(length, "big"))

    def write_i2c_block_data(self, _, register, data):
        self.words[register] = int.from_bytes(bytes(data), "big")


chip = Linux()
chip._smbus = Bus()
chip.enable_channel(0)
enabled = chip._smbus.words[0]
assert enabled == 1 << 14, "CH1en, the first channel"
# The first channel's overcurrent is CF1 (bit 9), its sum is SCC1 (bit 14).
chip._smbus.words[0x0F] = 1 << 9
flags = [name for name in ("MASK_CF_0", "MASK_CF_1", "MASK_CF_2") if chip.get_mask_enable() & getattr(Linux, name)]
sums = {}
for millivolts in (100.0, 300.0, -30.0):
    chip._smbus.words[0x0D] = (round(millivolts / 0.04) << 1) & 0xFFFE
    sums[millivolts] = round(chip.get_shunt_voltage_sum() / 1000, 1)
print("SEEN overcurrent of channel 0:", flags, "MASK_SCC_0: bit", Linux.MASK_SCC_0.bit_length() - 1, "(14)  sum (mV), read:", sums)
assert flags == ["MASK_CF_2"] and Linux.MASK_SCC_0 == 1 << 12 and Linux.MASK_SCC_2 == 1 << 14 and Linux.MASK_WF_0 == 1 << 3
assert sums == {100.0: 100.0, 300.0: -27.7, -30.0: 953.0}
PY
v/bin/python run.py

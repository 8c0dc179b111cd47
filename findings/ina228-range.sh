#!/bin/sh
# ina228 0.1.0, smbus2 0.6.0 (TI's current and power monitor of a motor's supply): get_shunt_voltage() is 2.5 times the voltage: its two steps, 312.5 nV (range of 164 mV) and 78.125 nV (41 mV), are exchanged, and a factor of 10 is put on
# top. configure(adcrange=1), for the smaller range, changes the sensor and not the conversions, which read the default: the shunt voltage is 10 times too large, and current, power, energy and charge are 4 times too large, as the data
# sheet's factor of 4 in SHUNT_CAL is missing. configure() also ORs its conversion times to those of the reset: 150 us become 4,120 us, and 50 us stay 1,052 us. And set_alert_bits() writes the alert bits to the
# limit of overvoltage (BOVL, 15 bits): with ALATCH, the alert is not latched and the limit is 3 mV, below every supply. There is no error.
# Seen on 2026-11-30:  1 A through 25 mOhm: range 0: 62.5 mV, 1.00 A (25 mV, 1 A)   range 1: 250.0 mV, 4.00 A, 48.0 W (25 mV, 1 A, 12 W)   asked for 150 us: 4120 us   ALATCH: DIAG_ALRT 0x0001, BOVL 0.003 V
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps ina228==0.1.0 smbus2==0.6.0
cat > run.py <<'PY'
import ina228.api as api
from ina228.api import INA228, Alert

OHMS, AMPERES, VOLTS = 0.025, 1.0, 12.0
TIMES = [50, 84, 150, 280, 540, 1052, 2074, 4120]  # us, table of ADC_CONFIG


class Chip:
    """The registers of an INA228 by its data sheet, with a constant current through the shunt."""

    def __init__(self, _):
        self.words = self.reset()

    def reset(self):
        return {0x00: 0, 0x01: 0xFB68, 0x02: 0x1000, 0x0B: 0x0001, 0x0E: 0x7FFF}

    def write_i2c_block_data(self, _, register, data):
        value = int.from_bytes(bytes(data), "big")
        if register == 0 and value & 0x8000:
            self.words = self.reset()
        else:
            self.words[register] = value & 0x7FFF if register == 0x0E else value

    def read_i2c_block_data(self, _, register, length):
        fine = self.words[0] >> 4 & 1
        shunt = OHMS * AMPERES / (78.125e-9 if fine else 312.5e-9)
        # SHUNT_CAL = 13107.2e6 * LSB * ohms, and 4 times that in the finer range: the LSB of CURRENT that it was written for.
        step = self.words[0x02] / (13107.2e6 * OHMS * (4 if fine else 1))
        values = {0x04: round(shunt) << 4, 0x07: round(AMPERES / step) << 4, 0x08: round(AMPERES * VOLTS / 3.2 / step)}
        return list(values.get(register, self.words.get(register, 0)).to_bytes(length, "big"))


api.SMBus = Chip
seen = {}
for fine in (0, 1):
    sensor = INA228(shunt_ohms=OHMS)
    sensor.configure(adcrange=fine)
    assert sensor._i2c.words[0] == fine << 4
    seen[fine] = [sensor.get_shunt_voltage() * 1e3, sensor.get_current(), sensor.get_power()]
    print(f"SEEN range {fine}: {seen[fine][0]:.1f} mV, {seen[fine][1]:.2f} A, {seen[fine][2]:.1f} W (25 mV, 1 A, 12 W)")

times = {}
for code in (0, 2, 5):
    sensor = INA228(shunt_ohms=OHMS)
    sensor.configure(vshct_conv_time=code)
    times[TIMES[code]] = TIMES[sensor._i2c.words[1] >> 6 & 7]
sensor.set_alert_bits(Alert.ALATCH)
alert, limit = sensor._i2c.words[0x0B], sensor._i2c.words[0x0E] * 3.125e-3
print("SEEN conversion times (us), asked for and set:", times, f"  ALATCH: DIAG_ALRT 0x{alert:04x}, BOVL {limit:.3f} V")
close = lambda got, expected: all(abs(a - b) < 1e-3 * b for a, b in zip(got, expected))
assert close(seen[0], (62.5, 1.0, 12.0)) and close(seen[1], (250.0, 4.0, 48.0))
assert times == {50: 1052, 150: 4120, 1052: 1052} and alert == 1 and abs(limit - 3.125e-3) < 1e-6
PY
v/bin/python run.py

#!/bin/sh
# adafruit-circuitpython-as5600 1.0.3 (magnetic angle sensor AS5600): the constructor writes 0 to the sensor's zero position and 4095 to its end and its range. A zero that was burned into the sensor, which it loads when it is
# switched on, and which zm_count counts, is gone as soon as the driver is made: a joint that shows 0 without the driver (to a motor controller on the analog output or PWM, or to another program) shows 1000 with it, 88 degrees,
# and goes on to show that to all others until power is off. A range that was burned, of 90 degrees on the whole output, is 4095 too, so that a reading of 2048 becomes 512. No argument keeps them, and there is no error.
# Seen on 2026-11-30:  zero burned at 1000, magnet there: angle 0 before, 1000 after (88 degrees); zm_count 1, z_position 0   range of 90 degrees burned, magnet at 45: 2048 before, 512 after   burned values again after power off: 0
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps adafruit-circuitpython-as5600==1.0.3 adafruit-circuitpython-busdevice==5.2.17 adafruit-circuitpython-register==1.13.0
cat > run.py <<'PY'
import sys
import types

for name, content in {"micropython": {"const": lambda value: value}, "busio": {"I2C": object, "SPI": object}, "digitalio": {"DigitalInOut": object}, "circuitpython_typing": {"WriteableBuffer": object, "ReadableBuffer": object}, "circuitpython_typing.device_drivers": {"I2CDeviceDriver": object}}.items():
    module = sys.modules[name] = types.ModuleType(name)
    vars(module).update(content)
from adafruit_as5600 import AS5600


class Bus:
    """An AS5600 by its data sheet, whose zero position and range (12 bits) may be burned; angle = (raw - zero) stretched by the range."""

    def __init__(self, raw, zero=0, range_=0, burned=0):
        self.raw, self.burned = raw, {0x00: burned, 0x01: zero >> 8, 0x02: zero & 255, 0x05: range_ >> 8, 0x06: range_ & 255}
        self.power_on()

    def power_on(self):
        self.registers = {**dict.fromkeys(range(256), 0), **self.burned}

    def word(self, address):
        return (self.registers[address] << 8 | self.registers[address + 1]) & 0xFFF

    def angle(self):
        zero, end, size = self.word(0x01), self.word(0x03), self.word(0x05)
        # A range of 0 is a whole turn; without a range, the end counts.
        span = (size or (end - zero) % 4096 or 4095) + 1
        return min((self.raw - zero) % 4096 * 4096 // span, 4095)

    def try_lock(self):
        return True

    def unlock(self):
        pass

    def writeto(self, _, buffer, *, start=0, end=None):
        data = bytes(buffer)[start:end]
        for offset, value in enumerate(data[1:]):
            self.registers[data[0] + offset] = value

    def readfrom_into(self, *_, **__):
        pass

    def writeto_then_readfrom(self, _, out, into, *, out_start=0, out_end=None, in_start=0, in_end=None):
        address, angle = bytes(out)[out_start:out_end][0], self.angle()
        held = {**self.registers, 0x0C: self.raw >> 8, 0x0D: self.raw & 255, 0x0E: angle >> 8, 0x0F: angle & 255}
        for offset, place in enumerate(range(in_start, len(into) if in_end is None else in_end)):
            into[place] = held[address + offset]


seen = []
for raw, zero, range_ in ((1000, 1000, 0), (512, 0, 1023)):
    bus = Bus(raw, zero, range_, burned=1)
    before = bus.angle()
    sensor = AS5600(bus)
    count, position, after = sensor.zm_count, sensor.z_position, sensor.angle
    bus.power_on()
    seen.append((before, after, bus.angle()))
    assert count == 1 and position == 0 and before == bus.angle()
print("SEEN angle before the driver, with it, after power off: zero burned", seen[0], " range burned", seen[1])
assert seen == [(0, 1000, 0), (2048, 512, 2048)]
PY
v/bin/python run.py

#!/bin/sh
# micropython-pca9685 0.1.0 (PWM chip of servos and motors): the frequency is not the one that is set or read. The chip divides its clock by 4096
# times (prescale + 1), data sheet; the package leaves the 1 away in both directions, so that what it reads agrees with what it set. 50 Hz are 49.6,
# and a servo pulse of 1,500 us has 1,511; 1,000 Hz are 872, and 1,500 Hz, near the chip's limit of 1,526, are 1,221. adafruit-circuitpython-pca9685
# 3.4.22, from which it is made, and pca9685-smbus2 0.0.6 have the 1. Servo() has pulses of 750 to 2,250 us for 180 degrees, where its own docstring
# says 135. There is no error.
# Seen on 2026-11-30:  50 Hz: 49.6, read 50.0   1000 Hz: 871.9, read 1017.3   1500 Hz: 1220.7, read 1525.9   pulse of 1500 us at 50 Hz: 1511
# pca9685-smbus2: 50.0, 1017.3, 1525.9
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps micropython-pca9685==0.1.0 pca9685-smbus2==0.0.6 smbus2==0.6.0
cat > run.py <<'PY'
import smbus2

CLOCK = 25e6
memory = bytearray(256)


class Bus:
    """The chip's registers, for both packages."""

    def __init__(self, *_):
        pass

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def readfrom_mem(self, _, register, length):
        return bytes(memory[register : register + length])

    def writeto_mem(self, _, register, data):
        memory[register : register + len(data)] = data

    def read_byte_data(self, _, register):
        return memory[register]

    def write_byte_data(self, _, register, value):
        memory[register] = value


smbus2.SMBus = Bus
from micropython_pca9685.motor import Servo
from micropython_pca9685.pca9685 import PCA9685
from PCA9685_smbus2.PCA9685 import PCA9685 as Other


def real():
    """The frequency by the data sheet."""
    return CLOCK / 4096 / (memory[0xFE] + 1)


chip, other, seen = PCA9685(Bus()), Other(), {}
for frequency in (50, 1000, 1500):
    chip.frequency = frequency
    mine, read = real(), chip.frequency
    other.set_pwm_freq(frequency)
    seen[frequency] = [round(value, 1) for value in (mine, read, real())]
    print(f"SEEN {frequency} Hz: {seen[frequency][0]}, read {seen[frequency][1]}; pca9685-smbus2 {seen[frequency][2]}")
chip.frequency = 50
servo = Servo(chip.channels[0])
servo.angle = 90
pulse = int.from_bytes(memory[8:10], "little") / 4096 / real() * 1e6
print(f"SEEN servo at 90 degrees: {pulse:.0f} us (1500)")
assert seen == {50: [49.6, 50.0, 50.0], 1000: [871.9, 1017.3, 1017.3], 1500: [1220.7, 1525.9, 1525.9]} and 1508 < pulse < 1514
PY
v/bin/python run.py

#!/bin/sh
# st3215 0.4.2, python-st3215 1.3.0: two packages for one servo (Feetech's STS3215 and ST3215) read its registers differently, with no error. st3215 reads one byte of the two of the current: 1950 mA is 286 mA, so that a
# stalled joint looks idle. A position below 0, as a servo with a corrected zero has, is 32768 more in st3215; and st3215 writes one in two's complement, where the servo has a sign bit: -10 becomes -32758.
# python-st3215 has these right, and a load in the negative direction wrong: 10 % is 1124 of at most 1000, while st3215 gives -100. Speeds are right in both.
# Seen on 2026-11-29:  position -10: st3215 32778, python-st3215 -10   written -10: servo has -32758 and -10   current 1950 mA: 286 and 1950   load -100: -100 and 1124   speed -50: -50 and -50
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q st3215==0.4.2 python-st3215==1.3.0
v/bin/python - <<'PY'
from python_st3215.registers import SRAMRegisters
from st3215 import ST3215

memory = bytearray(128)


def store(address, value, sign_bit):
    memory[address : address + 2] = (abs(value) | (sign_bit if value < 0 else 0)).to_bytes(2, "little")


def goal():
    raw = int.from_bytes(memory[42:44], "little")
    return -(raw & 0x7FFF) if raw & 0x8000 else raw


class First(ST3215):
    """The package's servo, whose frames go to the memory."""

    def __init__(self):
        self.sts_end = 0

    def readTxRx(self, sts_id, address, length):
        return list(memory[address : address + length]), 0, 0

    def writeTxRx(self, sts_id, address, length, data):
        memory[address : address + length] = bytes(data)
        return 0, 0


class Memory:
    id = 1

    def _read_memory(self, address, length=1):
        return int.from_bytes(memory[address : address + length], "little")

    def _write_memory(self, address, data):
        memory[address : address + len(data)] = bytes(data)


first, second = First(), SRAMRegisters(Memory())
store(56, -10, 1 << 15)
store(58, -50, 1 << 15)
store(60, -100, 1 << 10)
store(69, 300, 1 << 15)  # in units of 6.5 mA
seen = {
    "position": (first.ReadPosition(1), second.read_current_location()),
    "speed": (first.ReadSpeed(1)[0], second.read_current_speed()),
    "load": (first.ReadLoad(1), second.read_current_load()),
    "current in mA": (first.ReadCurrent(1), second.read_current_current() * 6.5),
}
first.WritePosition(1, -10)
written = [goal()]
second.write_target_location(-10)
written.append(goal())
seen["goal written as -10"] = tuple(written)
for name, values in seen.items():
    print(f"{name}: st3215 {values[0]}, python-st3215 {values[1]}")
assert seen == {"position": (32778, -10), "speed": (-50, -50), "load": (-100, 1124), "current in mA": (286, 1950), "goal written as -10": (-32758, -10)}
PY

#!/bin/sh
# crccheck 1.3.1, anycrc 2.1.0, crcengine 0.4.0.post1, crc 8.0.0, libscrc 1.8.1: five packages give one name to different checksums, so that the two ends of a link that agree on a name refuse
# each other's frames. CRC-16 is XMODEM's in crccheck and ARC's in anycrc. CRC-8 is DVB-S2's in crcengine and SMBus's in the others; CRC-8 CCITT is SMBus's in crc and I.432.1's in crcengine.
# And the usual test of a checksum, over "123456789", does not tell CRC-8/MAXIM-DOW from CRC-8/I-432-1 (named ITU): both give 0xA1, and of other bytes they differ.
# Seen on 2026-11-29:  of 123456789: CRC-16 crccheck 0x31c3, anycrc 0xbb3d   CRC-8 crcengine 0xbc, crccheck, anycrc and libscrc 0xf4   CRC-8 CCITT crc 0xf4, crcengine 0xa1
#                      crc's MAXIM_DOW and ITU: 0xa1 and 0xa1, of "actor": 0xb3 and 0x57
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --only-binary=:all: crccheck==1.3.1 anycrc==2.1.0 crcengine==0.4.0.post1 crc==8.0.0 libscrc==1.8.1
v/bin/python - <<'PY'
import anycrc, crc, crcengine, libscrc
from crccheck.crc import Crc8, Crc16

test = b"123456789"
named = {
    "CRC-16": {"crccheck": Crc16.calc, "anycrc": anycrc.Model("CRC16").calc},
    "CRC-8": {"crcengine": crcengine.new("crc8"), "crccheck": Crc8.calc, "anycrc": anycrc.Model("CRC8").calc, "libscrc": libscrc.crc8},
    "CRC-8 CCITT": {"crc": crc.Calculator(crc.Crc8.CCITT).checksum, "crcengine": crcengine.new("crc8-ccitt")},
    "CRC-16 XMODEM": {"crccheck": Crc16.calc, "crcengine": crcengine.new("crc16-xmodem"), "crc": crc.Calculator(crc.Crc16.XMODEM).checksum, "libscrc": libscrc.xmodem},
}
seen = {}
for name, packages in named.items():
    seen[name] = [compute(test) for compute in packages.values()]
    print(name, *(f"{package} {value:#x}" for package, value in zip(packages, seen[name])))
assert seen == {"CRC-16": [0x31C3, 0xBB3D], "CRC-8": [0xBC, 0xF4, 0xF4, 0xF4], "CRC-8 CCITT": [0xF4, 0xA1], "CRC-16 XMODEM": [0x31C3] * 4}
maxim, itu = crc.Calculator(crc.Crc8.MAXIM_DOW).checksum, crc.Calculator(crc.Crc8.ITU).checksum
print(f"MAXIM_DOW and ITU of {test}: {maxim(test):#x} {itu(test):#x}, of b'actor': {maxim(b'actor'):#x} {itu(b'actor'):#x}")
assert maxim(test) == itu(test) == 0xA1 and maxim(b"actor") != itu(b"actor")
PY

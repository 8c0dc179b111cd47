#!/bin/sh
# pymodbus 3.16.1: the data type BITS, for words whose bits are flags, as a drive's status and control words, swaps the two bytes of each register: entry 0 of the list is the register's bit 8, and entry 8 its bit 0. A drive of CiA 402
# that has its operation enabled (0x0027) shows the bits 8, 9, 10 and 13; "enable operation" (bits 0 to 3, 0x000F) is sent as 0x0F00, in which bit 8 is halt. Two registers with word_order="little" are swapped too, one by one. The order
# is not documented, and there is no error: the package reads back what it wrote. Numbers (UINT16 and the others) have the protocol's order. And convert_to_registers() lengthens the caller's list to a multiple of 16.
# Seen on 2026-11-30:  register 0x0001: entry 8   status 0x0027: 8 9 10 13   control bits 0 1 2 3: 0x0f00   the caller's list: 4 entries before, 16 after
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q pymodbus==3.16.1
v/bin/python - <<'PY'
from pymodbus.client import ModbusTcpClient

convert_from, convert_to, types = ModbusTcpClient.convert_from_registers, ModbusTcpClient.convert_to_registers, ModbusTcpClient.DATATYPE


def entries(*registers, **order):
    """The places in the list that are true."""
    return [place for place, bit in enumerate(convert_from(list(registers), types.BITS, **order)) if bit]


print("SEEN register 0x0001: entries", *entries(0x0001), "  status 0x0027: entries", *entries(0x0027))
assert entries(0x0001) == [8] and entries(0x0100) == [0] and entries(0x8000) == [7] and entries(0x0027) == [8, 9, 10, 13]
assert entries(0x0001, 0x0000, word_order="little") == [24] and entries(0x0000, 0x0001, word_order="little") == [8]
enable = [True, True, True, True]
(control,) = convert_to(enable, types.BITS)
print(f"SEEN control bits 0 to 3: 0x{control:04x}   the caller's list has {len(enable)} entries afterwards")
assert control == 0x0F00 and len(enable) == 16
assert convert_from([control], types.BITS) == enable and convert_to(0x000F, types.UINT16) == [0x000F] and convert_from([0x0027], types.UINT16) == 0x0027
PY

#!/bin/sh
# dynamixel-sdk 4.1.0: a servo states in each answer, in one byte, that it refused the instruction or that it has a hardware error (the bit 0x80: overload, overheating), for which a DYNAMIXEL X switches its torque off. A
# single read gives that byte to the caller; GroupSyncRead, with which an arm's joints are read in each step of a loop, and its fast form drop it: the result is COMM_SUCCESS, isAvailable() is true, and there is no way to
# ask for it. A policy goes on with the positions of a joint that hangs without torque. And a read that fails at one servo, the last of three, makes the positions of all three 0 in getData(), also those that came.
# Seen on 2026-11-30:  servo 2 answers with 0x80: single read (500, 0, 128), sync read 0, True, 500, fast sync read 0, True, 500   servo 3 is silent: result -3001, positions 0, 0, 0
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q dynamixel-sdk==4.1.0
v/bin/python - <<'PY'
from dynamixel_sdk import COMM_RX_TIMEOUT, COMM_SUCCESS, GroupSyncRead, PacketHandler, PortHandler

packets = PacketHandler(2.0)
POSITIONS, ALERT = {1: 100, 2: 500, 3: 900}, {2: 0x80}


def packet(servo, parameters):
    body = [0xFF, 0xFF, 0xFD, 0x00, servo, len(parameters) + 3, 0x00, 0x55, *parameters]
    crc = packets.updateCRC(0, body, len(body))
    return body + [crc & 0xFF, crc >> 8]


class Bus(PortHandler):
    """Servos that answer a read of their position at once."""

    def __init__(self, servos):
        super().__init__("none")
        self.servos, self.bytes, self.waited = servos, [], 0

    def clearPort(self):
        self.bytes = []

    def writePort(self, sent):
        status = {servo: [ALERT.get(servo, 0), *POSITIONS[servo].to_bytes(4, "little")] for servo in self.servos}
        if sent[7] == 0x8A:  # fast sync read: one answer for all, each servo's part with its number and a checksum
            first, *rest = self.servos
            parts = [status[first][0], first, *status[first][1:]]
            for servo in rest:
                parts += [0, 0, status[servo][0], servo, *status[servo][1:]]
            self.bytes = packet(0xFE, parts)
        else:
            self.bytes = sum((packet(servo, status[servo]) for servo in self.servos), [])
        return len(sent)

    def readPort(self, count):
        read, self.bytes = self.bytes[:count], self.bytes[count:]
        return read

    def setPacketTimeout(self, _):
        self.waited = 0

    def isPacketTimeout(self):
        self.waited += 1
        return self.waited > 3


single = packets.read4ByteTxRx(Bus([2]), 2, 132)


def read(bus, method):
    group = GroupSyncRead(bus, packets, 132, 4)
    for servo in POSITIONS:
        group.addParam(servo)
    result = getattr(group, method)()
    return result, group.isAvailable(2, 132, 4), [group.getData(servo, 132, 4) for servo in POSITIONS]


together, fast, silent = read(Bus([1, 2, 3]), "txRxPacket"), read(Bus([1, 2, 3]), "fastSyncRead"), read(Bus([1, 2]), "txRxPacket")
print("SEEN single", single, "together", together, "fast", fast, "one silent", silent)
assert single == (500, COMM_SUCCESS, 0x80)
assert together == fast == (COMM_SUCCESS, True, [100, 500, 900])
assert silent == (COMM_RX_TIMEOUT, False, [0, 0, 0])
PY

#!/bin/sh
# ftservo-python-sdk 2.0.1: the driver of Feetech's STS servos reads a position as sign and magnitude, as the servo has it, and writes it in two's complement: told to stay at the position
# -100 that it read (the servos count below 0 in their mode of several turns and with an offset), a servo gets 0xFF9C, which the same driver reads as -32668: eight turns back. There is no
# error. WritePosEx, SyncWritePosEx and RegWritePosEx do it, for the speed too; the speed of WriteSpec is converted. Positions that are not negative are right.
# Seen on 2026-11-29:  position -100, speed -50: 0xff9c, 0xffce, read as -32668, -32718   position 100: 100   WriteSpec -50: 0x8032, read as -50
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q ftservo-python-sdk==2.0.1 pyserial==3.5
v/bin/python - <<'PY'
import scservo_sdk


class Port:
    """Keeps what is written to it; nothing answers."""

    is_using, baudrate = False, 1_000_000

    def clearPort(self):
        pass

    def writePort(self, packet):
        self.written = bytes(packet)
        return len(packet)

    def setPacketTimeout(self, length):
        pass

    def isPacketTimeout(self):
        return True

    def readPort(self, length):
        return []


def word(packet, address):
    place = 6 + address - scservo_sdk.SMS_STS_ACC
    return packet[place] | packet[place + 1] << 8


port = Port()
servo = scservo_sdk.sms_sts(port)
goals = {}
for name in ("WritePosEx", "RegWritePosEx"):
    for position in (-100, 100):
        getattr(servo, name)(1, position, -50, 10)
        sent = word(port.written, scservo_sdk.SMS_STS_GOAL_POSITION_L), word(port.written, scservo_sdk.SMS_STS_GOAL_SPEED_L)
        goals[name, position] = [servo.scs_tohost(value, 15) for value in sent]
        print(name, position, -50, "sends", *map(hex, sent), "read as", *goals[name, position])
        assert goals[name, position] == [-32668 if position < 0 else 100, -32718]
servo.SyncWritePosEx(1, -100, 0, 10)
entry = servo.groupSyncWrite.data_dict[1]
assert entry[1] | entry[2] << 8 == 0xFF9C
servo.WriteSpec(1, -50, 10)
speed = word(port.written, scservo_sdk.SMS_STS_GOAL_SPEED_L)
print("WriteSpec -50 sends", hex(speed), "read as", servo.scs_tohost(speed, 15))
assert servo.scs_tohost(speed, 15) == -50
PY

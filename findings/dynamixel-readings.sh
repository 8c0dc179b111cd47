#!/bin/sh
# dynamixel-helper 1.0.3, pymixel 1.0.0, dynamixel-control 0.2.4, dynamixel-sdk 3.8.4: a DYNAMIXEL's registers of positions, speeds and loads have a sign, and the SDK gives them as unsigned numbers. Three packages on top of it hand these on:
# a joint at -100 (as in the modes of several turns, and with a homing offset) is at 4294967196, and dynamixel-control has it in radians, 6.6 million of them. A speed of -20 is 4294967276, where dynamixel-helper documents -(limit) to
# (limit). And widths are wrong: of the two bytes of the PWM, pymixel reads four, so that a PWM of 30 under a load of -50 is 4291690526; of an XL-320, whose position has two bytes, dynamixel-helper reads the speed with it: 512, at a
# speed of 100, is 6554112, and the same servo at rest is at 512. There is no error. An observation with such a number is clipped to its end, or overflows a fixed-point input.
# Seen on 2026-11-30:  position -100: 4294967196 (helper, pymixel), 6581966 rad (control)   speed -20: 4294967276   PWM 30: 4291690526   XL-320 at 512: 512 at rest, 6554112 in motion
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps dynamixel-helper==1.0.3 pymixel==1.0.0 dynamixel-control==0.2.4 dynamixel-sdk==3.8.4 numpy==2.4.6 pyserial==3.5
v/bin/python - >out.txt <<'PY'
import dynamixel_sdk
from dynamixel_sdk import PacketHandler, PortHandler

packets = PacketHandler(2.0)


class Bus(PortHandler):
    """A servo that answers reads from its registers at once."""

    def __init__(self, _name="none"):
        super().__init__("none")
        self.bytes, self.waited = [], 0

    def openPort(self):
        return True

    def setBaudRate(self, _rate):
        return True

    def clearPort(self):
        self.bytes = []

    def writePort(self, sent):
        # READ has the address and length after the instruction; BULK READ has the servo's number before them.
        start, servo = {0x02: (8, sent[4]), 0x92: (9, sent[8])}[sent[7]]
        address, length = sent[start] | sent[start + 1] << 8, sent[start + 2] | sent[start + 3] << 8
        body = [0xFF, 0xFF, 0xFD, 0x00, servo, length + 4, 0x00, 0x55, 0, *memory[address : address + length]]
        crc = packets.updateCRC(0, body, len(body))
        self.bytes = body + [crc & 0xFF, crc >> 8]
        return len(sent)

    def readPort(self, count):
        read, self.bytes = self.bytes[:count], self.bytes[count:]
        return read

    def setPacketTimeout(self, _):
        self.waited = 0

    def isPacketTimeout(self):
        self.waited += 1
        return self.waited > 3


dynamixel_sdk.PortHandler = Bus
import dynamixel_control.dynamixel, pymixel.dynamixel
from dynamixel_helper.dxl_motor import DxlMotor

dynamixel_control.dynamixel.PortHandler = pymixel.dynamixel.PortHandler = Bus


def put(address, length, number):
    memory[address : address + length] = number.to_bytes(length, "little", signed=True)


def helper(model):
    return DxlMotor(1, "joint", model, {"none": {"handler": Bus(), "baud rate": 57600}}, [57600], {2.0: packets}, "quiet")


memory = bytearray(256)
for address, length, number in ((124, 2, 30), (126, 2, -50), (128, 4, -20), (132, 4, -100)):
    put(address, length, number)
motor, other, control = helper("XL430-W250"), pymixel.dynamixel.Dynamixel(), dynamixel_control.dynamixel.Dynamixel()
control.add_dynamixel(type="XL-330", ID_number=0, calibration=[1023, 2048, 3073])
control.groupBulkRead.addParam(0, 132, 4)
control.bulk_read_pos()
positions, speeds, radians = [motor.get_present_position()[0], other.get_present_position(1)], [motor.get_present_velocity()[0], other.get_present_velocity(1)], control.dxls[0].read_position_m
print("SEEN position -100:", positions, f"control: {radians:.0f} rad   speed -20:", speeds, "  PWM 30:", other.get_present_pwm(1), "  load -50:", other.get_present_load(1))
assert positions == [2**32 - 100] * 2 and speeds == [2**32 - 20] * 2 and round(radians) == 6581966, radians
assert other.get_present_pwm(1) == 30 | (2**16 - 50) << 16 and other.get_present_load(1) == 2**16 - 50

memory = bytearray(256)
put(37, 2, 512)
small = helper("XL-320")
rest = small.get_present_position()
put(39, 2, 100)
moving = small.get_present_position()
print("SEEN XL-320 at 512:", rest, "  at a speed of 100:", moving)
assert rest == (512, True) and moving == (512 + 100 * 65536, True)
PY
grep SEEN out.txt

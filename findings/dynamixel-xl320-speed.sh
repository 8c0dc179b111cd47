#!/bin/sh
# dynamixel-control 0.2.4, dynamixel-helper 1.0.3, dynamixel-sdk 3.8.4: both packages have the XL-320 among their models and write its goal position (address 30, two bytes) with four bytes: the other two are its moving speed (address 32,
# as dynamixel-helper's own table has it), and 0 there is as fast as it can. A servo that was told to move slowly forgets it with the first position. There is no error. And dynamixel-control keeps a goal within the bounds of its
# calibration in update_goal(), but not in a replay of a recorded trajectory (map_pickle, of replay_pickle_data): 1 rad from the center 511, bounds 400 and 600, is sent as 706.
# Seen on 2026-11-30:  speed set to 50, goal 512: the servo's speed is 0 in both packages   update_goal(706): 600   replay: 706
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps dynamixel-control==0.2.4 dynamixel-helper==1.0.3 dynamixel-sdk==3.8.4 numpy==2.4.6 pyserial==3.5
v/bin/python - >out.txt <<'PY'
import dynamixel_sdk
import numpy as np
from dynamixel_sdk import PacketHandler, PortHandler

packets = PacketHandler(2.0)
memory = bytearray(64)


class Bus(PortHandler):
    """An XL-320: it does what is written, and answers at once."""

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
        def number(place):
            return sent[place] | sent[place + 1] << 8

        answer = []
        if sent[7] == 0x02:  # READ
            answer = memory[number(8) : number(8) + number(10)]
        elif sent[7] == 0x03:  # WRITE
            written = sent[10:-2]
            memory[number(8) : number(8) + len(written)] = bytes(written)
        else:  # BULK WRITE to one servo, without an answer
            assert sent[7] == 0x93
            memory[number(9) : number(9) + number(11)] = bytes(sent[13:-2])
            return len(sent)
        body = [0xFF, 0xFF, 0xFD, 0x00, sent[4], len(answer) + 4, 0x00, 0x55, 0, *answer]
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
import dynamixel_control.dynamixel
from dynamixel_helper.dxl_motor import DxlMotor

dynamixel_control.dynamixel.PortHandler = Bus


def goal_and_speed():
    return [int.from_bytes(memory[address : address + 2], "little") for address in (30, 32)]


def slow():
    packets.write2ByteTxRx(Bus(), 0, 32, 50)
    assert goal_and_speed()[1] == 50


slow()
control = dynamixel_control.dynamixel.Dynamixel()
control.add_dynamixel(type="XL-320", ID_number=0, calibration=[400, 511, 600])
control.update_goal(0, 512)
control.send_goal()
print("SEEN dynamixel-control: goal and speed", *goal_and_speed())
assert goal_and_speed() == [512, 0]
memory[30:34] = bytes(4)
slow()
helper = DxlMotor(0, "joint", "XL-320", {"none": {"handler": Bus(), "baud rate": 57600}}, [57600], {2.0: packets}, "quiet")
assert helper.RAM["goal position"] == 30 and helper.RAM["moving speed"] == 32
helper.set_goal_position(512)
print("SEEN dynamixel-helper: goal and speed", *goal_and_speed())
assert goal_and_speed() == [512, 0]

control.update_goal(0, 706)
control.send_goal()
bounded = goal_and_speed()[0]
control.data = [{"joint_1": np.float64(1.0)}]
control.map_pickle(0)
control.send_goal()
print("SEEN update_goal(706):", bounded, "  replay of 1 rad:", goal_and_speed()[0])
assert bounded == 600 and goal_and_speed()[0] == 706
PY
grep SEEN out.txt

#!/bin/sh
# dynamixel-py 0.0.5, dynamixel-sdk 3.8.4, pyserial 3.5: an AX-12 turns to a smaller angle than it is told, and reports a larger one. The package
# takes its 1,024 steps for 360 degrees, as with the other models' 4,096, and the servo has 300: set_position(150) sends step 426, at which it is at
# 124.9 degrees, and its own end, step 1023, reads as 359.6. Both errors cancel out in a test that sets and reads, and a joint of a robot is off by a
# sixth of its angle. And ServoGroup writes four bytes to the goal of an AX-12 or MX-12, which has two (address 30): the other two are the moving
# speed (32), and 0 is "as fast as it can": a servo that was set to move slowly jumps. Its sync_set_positions(), "simultaneously" by the README, sends
# a packet for each servo, one after the other. There is no error.
# Seen on 2026-12-01:  AX12 set_position(150): step 426   step 1023: 359.6 degrees   group of AX12: speed 50 -> 0   three servos: 3 packets with 1
#                      servo each
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps dynamixel-py==0.0.5 dynamixel-sdk==3.8.4 pyserial==3.5
cat > run.py <<'PY'
import dynamixel_sdk

memory = {}
packets = []


class Bus:
    """A bus of servos of protocol 1, each with 64 registers, and a log of what was written to them together."""

    is_using = False

    def __init__(self, *_):
        self.answer = []

    def openPort(self):
        return True

    def setBaudRate(self, *_, **__):
        return True

    def closePort(self):
        pass

    def clearPort(self):
        self.answer = []

    def writePort(self, sent):
        servo, length, instruction, parameters = sent[2], sent[3], sent[4], list(sent[5:-1])
        assert len(parameters) == length - 2
        if instruction == 0x83:  # SYNC WRITE: address, length, then the servo and its bytes for each
            address, size = parameters[:2]
            groups = [parameters[start : start + size + 1] for start in range(2, len(parameters), size + 1)]
            packets.append([group[0] for group in groups])
            for group in groups:
                memory[group[0]][address : address + size] = bytes(group[1:])
            return len(sent)
        read = []
        if instruction == 0x02:  # READ
            read = list(memory[servo][parameters[0] : parameters[0] + parameters[1]])
        else:
            assert instruction == 0x03  # WRITE
            memory[servo][parameters[0] : parameters[0] + len(parameters) - 1] = bytes(parameters[1:])
        body = [servo, len(read) + 2, 0, *read]
        self.answer = [0xFF, 0xFF, *body, ~sum(body) & 0xFF]
        return len(sent)

    def readPort(self, count):
        read, self.answer = self.answer[:count], self.answer[count:]
        return read

    def setPacketTimeout(self, _):
        self.waited = 0

    def isPacketTimeout(self):
        self.waited += 1
        return self.waited > 3


dynamixel_sdk.PortHandler = Bus
import dynamixel_py.dynamixel_handler as handler
from dynamixel_py import DxlComm, Servo, ServoGroup

handler.PortHandler = Bus
link = DxlComm("simulated")


def register(servo, address):
    return int.from_bytes(memory[servo][address : address + 2], "little")


memory.update({servo: bytearray(64) for servo in (1, 2, 3)})
ax12 = Servo(1, "AX12", protocol_version=1)
ax12.set_position(150)
step, read = register(1, 30), 0.0
memory[1][36:38] = (1023).to_bytes(2, "little")
read = ax12.get_position()
print(f"SEEN AX12 set_position(150): step {step}, {step * 300 / 1023:.1f} of the servo's 300 degrees   step 1023: {read:.1f} degrees")
assert step == 426 and abs(read - 359.65) < 0.01

for servo in memory:
    memory[servo][32:34] = (50).to_bytes(2, "little")
ax12.set_position(100)
kept = register(1, 32)
group = ServoGroup()
group.add_servos([Servo(servo, "AX12", protocol_version=1) for servo in memory])
group.sync_set_positions([10, 20, 30])
speeds = [register(servo, 32) for servo in memory]
print("SEEN speed 50 after set_position():", kept, "  after sync_set_positions():", speeds, "  servos of each packet:", packets)
assert kept == 50 and speeds == [0, 0, 0] and packets == [[1], [2], [3]]
PY
v/bin/python run.py > out.txt || { tail -n 20 out.txt; exit 1; }
grep SEEN out.txt

#!/bin/sh
# pydamiao 0.1.4 (Damiao motors): a motor's feedback and a register's answer are distinguished by the third byte only, which is 0x33 or 0x55 in an answer, and the lower byte of the position in a feedback. So 1 of 128 positions is taken
# for a register: the joint's position, velocity and torque are not updated, and a made-up value goes to the register whose number is the upper byte of the velocity. A DM4310 that moves to 0.0196 rad and rests there is
# reported where it was before, and a fault in such a feedback (over-current) is not seen: the next set_mit() is sent, where it is refused after the same fault one step beside. There is no error.
# Seen on 2026-11-30:  of 65,536 positions, 512 taken for registers   moved from 0.500 to 0.0196 rad: reported 0.500   to 0.0200: 0.0200   over-current at 0.0196 rad: not seen, set_mit sent; at 0.0200: seen, set_mit refused
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q pydamiao==0.1.4 numpy==2.4.6 pyserial==3.5
cat > run.py <<'PY'
import time

from pydamiao.bus import SerialBus
from pydamiao.motor import Motor
from pydamiao.protocol import DamiaoProtocol
from pydamiao.structs import ControlMode, MotorType

SLAVE, MASTER, RANGE = 0x01, 0x11, 12.5


def feedback(code, fault=0):
    """The bridge's frame of a DM4310 at rest at a position's code: id and fault, position, velocity, torque, temperatures."""
    velocity = torque = 0x7FF
    data = [fault << 4 | SLAVE, code >> 8, code & 255, velocity >> 4, (velocity & 15) << 4 | torque >> 8, torque & 255, 30, 30]
    return bytes([0xAA, 0x11, 0x08, *MASTER.to_bytes(4, "little"), *data, 0x55])


class Port:
    """A serial port that gives the frames that were put into it."""

    def __init__(self):
        self.is_open, self.waiting, self.written = True, b"", []

    def open(self):
        pass

    def close(self):
        self.is_open = False

    def write(self, data):
        self.written.append(bytes(data))
        return len(data)

    def read(self, size=1):
        data, self.waiting = self.waiting[:size], self.waiting[size:]
        if not data:
            time.sleep(0.005)
        return data


kinds = [DamiaoProtocol.parse_frame(feedback(code)).kind for code in range(65536)]
wrong = [code for code, kind in enumerate(kinds) if kind != "status"]
code_of = lambda position: round((position + RANGE) / (2 * RANGE) * 65535)
position_of = lambda code: code / 65535 * 2 * RANGE - RANGE


def reported(*frames):
    """The state after these frames, and if the next command was sent."""
    port = Port()
    bus = SerialBus(port)
    motor = Motor(bus, MotorType.DM4310, SLAVE, MASTER, auto_disable=False)
    assert motor.limits.POS_MAX == RANGE
    motor.control_mode = ControlMode.MIT
    for frame in frames:
        port.waiting += frame
        time.sleep(0.1)
    sent = bool(motor.set_mit(0.0, 0.0, 10.0, 1.0, 0.0)) and len(port.written) == 1
    result = motor.get_position(), motor.fault, dict(motor.param_cache), sent
    bus.close()
    return result


start = feedback(code_of(0.5))
there, beside = 0x8033, 0x8034
stuck, fine = reported(start, feedback(there)), reported(start, feedback(beside))
hidden, seen = reported(start, feedback(there, 0xA)), reported(start, feedback(beside, 0xA))
print(f"SEEN {len(wrong)} of 65536 positions; at {position_of(there):.4f} rad: {stuck[0]:.3f}, made-up registers {stuck[2]}; at {position_of(beside):.4f}: {fine[0]:.4f}")
print(f"SEEN over-current at {position_of(there):.4f}: {hidden[1]}, set_mit sent {hidden[3]}; at {position_of(beside):.4f}: {seen[1].name}, set_mit sent {seen[3]}")
assert len(wrong) == 512 and {code & 255 for code in wrong} == {0x33, 0x55}
assert abs(stuck[0] - 0.5) < 1e-3 and list(stuck[2]) == [0x7F] and abs(fine[0] - position_of(beside)) < 1e-6 and not fine[2]
assert not hidden[1] and hidden[3] and seen[1] == 0xA and not seen[3]
PY
v/bin/python run.py

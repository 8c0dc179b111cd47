#!/bin/sh
# mksact 0.2.0, python-can 4.6.1 (MKS SERVO42D and 57D steppers over CAN): position() reads 48 bits and move_abs() sends 24, without a check: past 8,388,607 counts, 512 turns of the motor, the goal wraps. An axis with a gear of 1:100
# that is at 511 turns (5.1 of its own) and gets a goal 2 turns further goes back by 1,022: the frame says -511 turns. The limits that move_abs() checks see the goal before it wraps, so that one of 600 turns lets it pass.
# And the speed of one call is not checked as the default speed is: set_speed(5000) is refused, move_abs(0, speed=5000) sent; speed=66000 is sent as 464. There is no error.
# Seen on 2026-11-30:  511 turns: sent 511   511 + 2 turns, max_pos 600 turns: sent -511   speed=5000: 5000 (the drive's greatest: 3000)   speed=66000: 464
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps mksact==0.2.0 python-can==4.6.1 wrapt==1.17.3 packaging==26.4 typing_extensions==4.16.0
cat > run.py <<'PY'
import can
from mksact import Actuator
from mksact.actuator import COUNTS_PER_TURN

ID = 0x0C
drive = can.Bus(interface="virtual", channel="motor")
state = {"position": 0}
moves = []


def answer(message):
    """The drive's part: it reports its position with 48 bits, and follows the frame of an absolute move, whose position has 24."""
    data = bytes(message.data)
    assert data[-1] == (ID + sum(data[:-1])) & 0xFF
    reply = [data[0], 1]
    if data[0] == 0x31:
        reply = [0x31, *state["position"].to_bytes(6, "big", signed=True)]
    elif data[0] == 0xF5:
        moves.append((int.from_bytes(data[4:7], "big", signed=True), data[1] << 8 | data[2]))
        state["position"] = moves[-1][0]
    reply.append((ID + sum(reply)) & 0xFF)
    drive.send(can.Message(arbitration_id=ID, data=reply, is_extended_id=False))


notifier = can.Notifier(drive, [answer])
motor = Actuator(can_id=ID, interface="virtual", channel="motor", verbose=False)
motor.connect()
motor.set_zero()
motor.set_limits(-100 * COUNTS_PER_TURN, 600 * COUNTS_PER_TURN)


def settle(count):
    import time

    end = time.monotonic() + 20
    while len(moves) < count and time.monotonic() < end:
        time.sleep(0.01)


motor.move_abs(511 * COUNTS_PER_TURN)
settle(1)
motor.move_turns(2, direction="cw")
settle(2)
motor.move_abs(0, speed=5000)
settle(3)
motor.move_abs(0, speed=66000)
settle(4)
try:
    motor.set_speed(5000)
    refused = False
except ValueError:
    refused = True
notifier.stop()
motor.close()
drive.shutdown()
turns = [position / COUNTS_PER_TURN for position, _ in moves]
print("SEEN turns sent:", turns[:2], " speeds sent:", [speed for _, speed in moves[2:]], " set_speed(5000) refused:", refused)
assert turns[0] == 511.0 and turns[1] == -511.0 and [speed for _, speed in moves[2:]] == [5000, 66000 & 0xFFFF] and refused
PY
v/bin/python run.py

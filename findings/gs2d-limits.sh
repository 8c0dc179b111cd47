#!/bin/sh
# gs2d 0.0.4 (one interface for servos of several makes): its driver for DYNAMIXEL, RobotisP20, has methods that do nothing: set_max_torque(), set_limit_cw_position(), set_limit_ccw_position(), set_target_time(), set_pid_coefficient()
# and set_burst_target_positions() send nothing and raise nothing, as if the limit were set. Their bodies are comments. Another method that the servo has no command for
# raises NotSupportException (set_speed). And set_torque_enable() writes two bytes to a register of one: switching the torque on switches the servo's LED off.
# Seen on 2026-11-30:  frames sent: max torque 0, limits 0 0, target time 0, PID 0, several positions 0, one position 1, torque 1 (register 64: 01 00)   set_speed: NotSupportException
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q gs2d==0.0.4 pyserial==3.5
v/bin/python - <<'PY'
from gs2d import RobotisP20
from gs2d.Util import NotSupportException

frames = []


class Handler:
    """Takes the place of the thread that writes to the port."""

    RECEIVE_DATA_TIMEOUT_SEC = 1

    def __init__(self, *_):
        pass

    def add_command(self, data, recv_callback=None):
        frames.append(bytes(data))


calls = {
    "max torque": lambda servo: servo.set_max_torque(20, 1),
    "cw limit": lambda servo: servo.set_limit_cw_position(30, 1),
    "ccw limit": lambda servo: servo.set_limit_ccw_position(-30, 1),
    "target time": lambda servo: servo.set_target_time(2.0, 1),
    "PID": lambda servo: servo.set_pid_coefficient(50, 1),
    "several positions": lambda servo: servo.set_burst_target_positions({1: 10.0, 2: 20.0}),
    "one position": lambda servo: servo.set_target_position(0, 1),
    "torque": lambda servo: servo.set_torque_enable(True, 1),
}


def sent(driver):
    servo, counts = driver(None, Handler), {}
    for name, call in calls.items():
        frames.clear()
        try:
            call(servo)
            counts[name] = len(frames)
        except Exception as error:
            counts[name] = type(error).__name__
    try:
        servo.set_speed(10, 1)
    except NotSupportException:
        counts["speed"] = "NotSupportException"
    frames.clear()
    calls["torque"](servo)
    return counts, frames[0].hex(" ")


robotis, torque = sent(RobotisP20)
print("SEEN frames sent:", robotis, "  torque on:", torque)
nothing = ("max torque", "cw limit", "ccw limit", "target time", "PID", "several positions")
assert all(robotis[name] == 0 for name in nothing) and robotis["one position"] == robotis["torque"] == 1 and robotis["speed"] == "NotSupportException"
assert "03 40 00 01 00" in torque
PY

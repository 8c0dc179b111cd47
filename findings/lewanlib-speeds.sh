#!/bin/sh
# lewanlib 0.1.1, busservocontrol 0.2, pyserial 3.5, msgspec 0.23.0 (LX-16A and other LewanSoul and Hiwonder bus servos): two packages for one
# protocol read its motor mode differently. mode_write(1, "motor", speed=60) of lewanlib, "speed in degrees per second", sends 60, which
# busservocontrol documents as a duty of 60 in 1,000: the servo gets 6 % and may not move at all, and 1,000, lewanlib's "1000 degrees/second", is the
# whole voltage. move_speed_write(), which "moves to angle at a specific speed", goes faster than told: it cuts the time of the move to 30 s, the
# protocol's greatest: 240 degrees at 4 degrees/s are sent as 30 s, 8 degrees/s. For a goal outside 0 to 240 it is slower than told: the time is for
# the whole way, the goal is put on the end. temp_read() is in Fahrenheit, unless asked otherwise. busservocontrol's set_led_state() and
# set_error_led() never send their argument: the frame for on and off is the same, without a parameter, where lewanlib sends one byte. There is no
# error.
# Seen on 2026-12-01:  speed 60: 60 from both, for degrees/s and for duty   240 degrees at 4: 30 s (60)   20 to -180 at 50: to 0 in 4 s (0.4)   led on
#                      and off: equal
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps lewanlib==0.1.1 busservocontrol==0.2 pyserial==3.5 msgspec==0.23.0
cat > run.py <<'PY'
import inspect

from BusServoControl.BusServoControl import BusServoControl
from lewanlib.bus import ServoBus


class Line:
    """A serial line to one servo, which answers the reading of its position."""

    def __init__(self, degrees=0):
        self.sent, self.answer, self.degrees = [], b"", degrees

    def write(self, frame):
        self.sent.append(bytes(frame))
        if frame[4] == 28:
            body = bytes([1, 5, 28]) + round(self.degrees * 1000 / 240).to_bytes(2, "little", signed=True)
            self.answer = b"\x55\x55" + body + bytes([~sum(body) & 0xFF])

    def read(self, count):
        read, self.answer = self.answer[:count], self.answer[count:]
        return read

    def sendmsg(self, text):
        self.sent.append(bytes.fromhex(text))


def lewan(method, *arguments, degrees=0, **named):
    """The parameters of the last frame that lewanlib sends for a call."""
    line = Line(degrees)
    getattr(ServoBus(serial_conn=line, discard_echo=False), method)(1, *arguments, **named)
    return line.sent[-1][5:-1]


def other(method, *arguments):
    line = Line()
    getattr(BusServoControl(line), method)(1, *arguments)
    return line.sent[-1][5:-1]


def move(degrees, goal, speed):
    """The angle in degrees and the time in s of a move at a speed."""
    sent = lewan("move_speed_write", goal, speed, degrees=degrees)
    return int.from_bytes(sent[:2], "little") * 0.24, int.from_bytes(sent[2:], "little") / 1000


degrees_per_second, duty = lewan("mode_write", "motor", speed=60), other("set_motor_mode", 1, 0, 60)
print("SEEN motor mode at 60, lewanlib:", degrees_per_second.hex(), " busservocontrol:", duty.hex())
assert degrees_per_second == duty == b"\x01\x00\x3c\x00"
assert "degrees/second" in ServoBus.mode_write.__doc__ and "\u5360\u7a7a\u6bd4" in BusServoControl.set_motor_mode.__doc__  # duty ratio

slow, far = move(0, 240, 4), move(20, -180, 50)
print("SEEN 0 to 240 degrees at 4 degrees/s:", slow, "  20 to -180 at 50:", far)
assert abs(slow[0] - 240) < 0.3 and slow[1] == 30
assert far[0] == 0 and abs(far[1] - 4) < 0.01

on, off, errors = other("set_led_state", 0), other("set_led_state", 1), other("set_error_led", 7)
print("SEEN LED on, off, errors, busservocontrol:", on, off, errors, " lewanlib:", lewan("led_ctrl_write", True), lewan("led_ctrl_write", False))
assert on == off == errors == b"" and lewan("led_ctrl_write", True) != lewan("led_ctrl_write", False)
assert inspect.signature(ServoBus.temp_read).parameters["units"].default == "F"
PY
v/bin/python run.py > out.txt || { tail -n 20 out.txt; exit 1; }
grep SEEN out.txt

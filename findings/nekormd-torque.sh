#!/bin/sh
# NekoRMD 0.2.2, python-can 4.6.1 (MyActuator RMD motors): telemetry.read_motor_temperature_and_torque() sends the command 0xA2, the one by which control.speed.set_speed() of the same package commands a speed, with all bytes 0: to read
# a motor's temperature is to command a speed of 0, in place of the position or torque that it had. (The protocol's command to read them is 0x9C.) control.Torque.set_current() puts the current in bytes 2 and 3, where the
# protocol, and the package's own Torque.test(), have it in bytes 4 and 5: the current that the motor gets is 0. And a speed of -20 deg/s and a current of -1 A are read as 65516 and 65436, without their signs.
# Seen on 2026-11-30:  read temperature: a2 00 00 00 00 00 00 00, the frame of set_speed(0)   set_current(1.0): a1 00 64 00 00 00 00 00, of test(): a1 00 00 00 64 00 00 00
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps NekoRMD==0.2.2 python-can==4.6.1 wrapt==1.17.3 packaging==26.4 typing_extensions==4.16.0
v/bin/python - >out.txt <<'PY'
import struct
import can
from NekoRMD.MotorType import MotorType
from NekoRMD.NekoRMD import NekoRMD

ADDRESS = 0x141


class Motor:
    """Keeps what it is sent, and answers with 40 degrees C, -1 A (in 0.01 A), -20 degrees/s and 90 degrees."""

    def send(self, message):
        self.frame = bytes(message.data)

    def recv(self):
        return can.Message(arbitration_id=ADDRESS, data=bytes([self.frame[0]]) + struct.pack("<bhhh", 40, -100, -20, 90))


motor = NekoRMD(ADDRESS, MotorType.RMD8x_pro)
motor.io.bus = bus = Motor()
frames = {}
for name, call in {
    "read temperature": motor.telemetry.read_motor_temperature_and_torque,
    "set_speed(0)": lambda: motor.control.speed.set_speed(0),
    "set_speed(1)": lambda: motor.control.speed.set_speed(1),
    "set_current(1.0)": lambda: motor.control.Torque.set_current(1.0),
    "test()": motor.control.Torque.test,
}.items():
    answer = call()
    frames[name] = bus.frame.hex(" ")
    print(f"SEEN {name}: {frames[name]}")
    if name == "read temperature":
        print("SEEN answer:", answer)
        assert answer == {"Temp": 40, "Iq": 65436, "Speed": 65516, "Angle": 90}
assert frames["read temperature"] == frames["set_speed(0)"] == "a2 00 00 00 00 00 00 00" and frames["set_speed(1)"] == "a2 00 00 00 64 00 00 00"
assert frames["set_current(1.0)"] == "a1 00 64 00 00 00 00 00" and frames["test()"] == "a1 00 00 00 64 00 00 00"
PY
grep SEEN out.txt

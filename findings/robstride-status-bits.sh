#!/bin/sh
# robstride 0.1.0, cybergeardriver 0.2.0, robstride-dynamics 0.0.1: the motors of CyberGear and RobStride put mode and faults in the identifier of each feedback frame, the mode in bits 22 and 23, the faults in bits 16 to 21.
# robstride masks one of the mode's two bits: a motor that runs (2) is reported as Reset (0), as if it were switched off. cybergeardriver takes the bits for bytes, of which it makes 16: mode_status is 0 in each mode, and
# none of the six faults is ever seen: of a motor with overtemperature, the event has_fault is not emitted. There is no error. robstride and robstride-dynamics read the faults right; robstride-dynamics does not give the mode.
# Seen on 2026-11-30:  a motor that runs and is too hot: robstride: Reset, Overtemp   cybergeardriver: mode 0, no fault, no event   robstride-dynamics: overtemperature
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q robstride==0.1.0 cybergeardriver==0.2.0 robstride-dynamics==0.0.1 python-can==4.6.1
v/bin/python - >out.txt <<'PY'
import can
from CyberGearDriver import CyberGearMotor, CyberMotorMessage
from robstride.client import Client, MotorError, MotorMode
from robstride_dynamics import RobstrideBus
from robstride_dynamics.bus import Motor

MOTOR, HOST, FEEDBACK, RUN, HOT = 5, 0xAA, 2, 2, 1 << 2
identifier = FEEDBACK << 24 | RUN << 22 | HOT << 16 | MOTOR << 8 | HOST
data = bytes([0x80, 0, 0x80, 0, 0x80, 0, 0x03, 0x84])  # all 0, and 90 degrees


class Bus:
    def send(self, _):
        pass

    def recv(self, timeout=None):
        return can.Message(arbitration_id=identifier, data=data, is_extended_id=True)


client = Client(Bus(), host_can_id=HOST).enable(MOTOR)
print("SEEN robstride:", client.mode, client.errors, client.temp)
assert client.mode == MotorMode.Reset and client.errors == [MotorError.Overtemp] and client.temp == 90.0

events = []
motor = CyberGearMotor(MOTOR, lambda _: None, host_id=HOST)
motor.on("has_fault", lambda *_: events.append("fault"))
motor.on("state_changed", lambda *_: events.append("state"))
motor.message_received(CyberMotorMessage(identifier, data))
print("SEEN cybergeardriver:", motor.state["mode_status"], [name for name, on in motor.faults.items() if on], events)
assert motor.state["mode_status"] == 0 and motor.state["temperature"] == 90.0
assert not any(motor.faults.values()) and events == ["state"]

bus = RobstrideBus("none", {"hip": Motor(MOTOR, "rs-02")})
bus.channel_handler = Bus()
bus.receive_status_frame("hip")
bus.channel_handler = None
PY
grep SEEN out.txt; grep "WARNING: hip" out.txt
test "$(grep -c 'WARNING: hip' out.txt)" = 1 && grep -q "hip is overtemperature" out.txt

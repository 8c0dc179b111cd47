#!/bin/sh
# cflib 0.1.34 (Crazyflie, numpy 2.4.6): send_full_state_setpoint() says of rollrate, pitchrate and yawrate "are in degrees/s", and sends each times
# 1000 in 16 bits; the drone's firmware reads milliradians per second there (fullStatePacket_s). A rate of 10 degrees/s goes out as 10000, which is
# 573 degrees/s to the drone: the feed-forward of a policy or a trajectory is 57 times too strong. From 32.768 on, that is for any brisk turn in
# degrees, the call raises struct.error. In rad/s, which the text does not name, it is right. The other setpoints of the class do take degrees/s.
# Seen on 2026-11-30:  yawrate 10: 10000 on the wire, 573 degrees/s as mrad/s   yawrate 33: struct.error   send_hover_setpoint with 10: 10.0 on the
# wire
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps cflib==0.1.34 numpy==2.4.6 libusb-package==1.0.30.0 importlib_resources==7.1.0 pyusb==1.3.1
cat > run.py <<'PY'
import math
import struct
from types import SimpleNamespace

from cflib.crazyflie.commander import Commander

sent = []
drone = SimpleNamespace(send_packet=sent.append, platform=SimpleNamespace(get_protocol_version=lambda: 10))
commander = Commander(drone)
assert "yawrate are in degrees/s" in Commander.send_full_state_setpoint.__doc__


def full(yawrate):
    commander.send_full_state_setpoint([0, 0, 1], [0, 0, 0], [0, 0, 0], [0, 0, 0, 1], 0, 0, yawrate)
    return struct.unpack("<BhhhhhhhhhIhhh", bytes(sent[-1].data))[-1]


wire = full(10)
turned = math.degrees(wire / 1000)
commander.send_hover_setpoint(0, 0, 10, 1)
hover = struct.unpack("<Bffff", bytes(sent[-1].data))[3]
print(f"SEEN yawrate 10: {wire} on the wire, {turned:.0f} degrees/s as milliradians; by send_hover_setpoint {hover} on the wire")
assert wire == 10000 and 572 < turned < 574 and hover == 10.0
try:
    full(33)
    raise SystemExit("33 is sent")
except struct.error as error:
    print("SEEN yawrate 33: struct.error:", error)
PY
v/bin/python run.py

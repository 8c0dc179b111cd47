#!/bin/sh
# cflib 0.1.34 (Crazyflie, numpy 2.4.6): fp16_to_float(), which decodes half floats from the drone, gives the bits instead of the number for the
# values that it does not reckon: -0.0 becomes 2147483648 and the infinities 2139095040 and 4286578688, as integers. A half float is minus zero when
# a small negative difference rounds to nothing: the angle of a lighthouse sensor is then -2147483647.9 rad, one of the eight in a packet, between
# right ones, and an estimate or a recording takes it for a measurement. The log variables of the type FP16 are decoded another way and are right.
# There is no error.
# Seen on 2026-11-30:  0x8000: 2147483648 (-0.0)   0x7c00: 2139095040 (inf)   0xfc00: 4286578688 (-inf)   the other finite 63487 halves right
# sensor angles 0.1, -2147483647.9, 0.1, 0.1
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps cflib==0.1.34 numpy==2.4.6 libusb-package==1.0.30.0 importlib_resources==7.1.0 pyusb==1.3.1
cat > run.py <<'PY'
import struct

import numpy as np
from cflib.crazyflie.localization import Localization
from cflib.crtp.crtpstack import CRTPPacket, CRTPPort
from cflib.utils.encoding import fp16_to_float

halves = range(65536)
values = np.arange(65536, dtype=np.uint16).view(np.float16).tolist()
wrong = {hex(half): fp16_to_float(half) for half, value in zip(halves, values) if value == value and fp16_to_float(half) != value}
print("SEEN halves that are decoded wrongly (without nan):", wrong)
assert wrong == {"0x7c00": 2139095040, "0x8000": 2147483648, "0xfc00": 4286578688}


class Drone:
    """Takes the callback of the localization service."""

    def add_port_callback(self, port, callback):
        self.callback = callback


drone, got = Drone(), []
service = Localization(drone)
service.receivedLocationPacket.add_callback(lambda packet: got.append(packet.data))
packet = CRTPPacket()
packet.port, packet.channel = CRTPPort.LOCALIZATION, 1
# An angle of 0.1 rad, and the other three sensors with the differences -0.0, 0.0 and 0.0; the same for the second axis without -0.0.
minus = struct.unpack("<h", b"\x00\x80")[0]
packet.data = struct.pack("<BBfhhhfhhh", Localization.LH_ANGLE_STREAM, 0, 0.1, minus, 0, 0, 0.2, 0, 0, 0)
drone.callback(packet)
angles = [round(float(angle), 3) for angle in got[0]["x"]]
print("SEEN angles of the four sensors of a lighthouse packet:", angles)
assert angles[0] == angles[2] == 0.1 and angles[1] < -2e9
PY
v/bin/python run.py

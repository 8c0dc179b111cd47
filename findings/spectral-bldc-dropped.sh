#!/bin/sh
# Spectral-BLDC 1.20, python-can 4.6.1: Send_data_pack_1(Position=, Speed=, Current=), whose arguments all default to None, sends what it was given only as current alone, speed and current, or all three. A position alone, a speed
# alone, or a position and a speed send nothing: the motor goes on with its last command. There is no error, only a message of level DEBUG. A gripper's command
# with one argument left out becomes an empty frame. And a current beyond 16 bits wraps: 33 A (33000 mA) is -32.5 A, torque to the other side.
# Seen on 2026-11-30:  frames: Position 0, Speed 0, Position and Speed 0, Current 1, Speed and Current 1, all 1   Current=33000: read back as -32536   gripper without current_: 0 bytes of data
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps Spectral-BLDC==1.20 python-can==4.6.1 wrapt==1.17.3 packaging==26.4 typing_extensions==4.16.0 pyserial==3.5
v/bin/python - <<'PY'
from Spectral_BLDC import CAN_utils
from Spectral_BLDC.Spectral_BLDC import SpectralCAN


class Bus:
    def __init__(self):
        self.frames = []

    def send_can_message(self, message_id, data=b"", remote_frame=False):
        self.frames.append(bytes(data))


def sent(method="Send_data_pack_1", **command):
    bus = Bus()
    getattr(SpectralCAN(0, bus), method)(**command)
    return bus.frames


counts = {}
for names in (["Position"], ["Speed"], ["Position", "Speed"], ["Current"], ["Speed", "Current"], ["Position", "Speed", "Current"]):
    counts[" and ".join(names)] = len(sent(**dict.fromkeys(names, 100)))
(wrapped,) = sent(Current=33000)
current = CAN_utils.fuse_2_bytes(b"\0\0" + wrapped)
gripper = sent("Send_gripper_data_pack", position_=100, speed_=50, activate_=1, action_=1, ESTOP_=0, Release_dir_=0)
print("SEEN frames:", counts, "  Current=33000:", current, "  gripper without current_:", gripper)
assert list(counts.values()) == [0, 0, 0, 1, 1, 1] and current == -32536 and gripper == [b""]
PY

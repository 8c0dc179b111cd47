#!/bin/sh
# epicallypowerful 1.0.7, python-can 4.6.1 (CubeMars and RobStride actuators): set_position(position, kp, kd, degrees=True) documents its gains in Nm per radian, and multiplies them by 57.3, as if they were per degree: a kp of 5 Nm/rad
# is sent as 286, and one of 10 as 500, the largest that the frame has; kd of 0.5 as 5, the largest. A joint that is 10 degrees off is driven with 50 Nm in place of 0.87, so into its limit. The same call in radians sends 5. The unit
# of the position decides over that of the gains, and set_velocity() does the same. (set_control() documents it.) There is no error and no warning.
# Seen on 2026-11-30:  set_position(10 degrees, kp=5, kd=0.05): radians: kp 5.0, kd 0.05   degrees: kp 286, kd 2.86   kp=10, kd=0.5 in degrees: kp 500, kd 5
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps epicallypowerful==1.0.7 python-can==4.6.1 wrapt==1.17.3 packaging==26.4 typing_extensions==4.16.0
v/bin/python - >out.txt <<'PY'
import importlib.util, sys, types

# The package's own __init__ imports its sensors' drivers; only the actuators are needed here.
package = types.ModuleType("epicallypowerful")
package.__path__ = importlib.util.find_spec("epicallypowerful").submodule_search_locations
sys.modules["epicallypowerful"] = package
from epicallypowerful.actuation.cubemars.cubemars import CubeMars
from epicallypowerful.actuation.robstride.robstride import Robstride


class Bus:
    def send(self, message, timeout=None):
        self.data = bytes(message.data)


def cubemars(**call):
    """The gains of the frame: kp of 0 to 500, kd of 0 to 5, in 12 bits each."""
    motor = CubeMars(1, "AK80-9")
    motor._bus = bus = Bus()
    getattr(motor, call.pop("method", "set_position"))(**call)
    frame = int.from_bytes(bus.data, "big")
    return (frame >> 24 & 0xFFF) * 500 / 4095, (frame >> 12 & 0xFFF) * 5 / 4095


def robstride(**call):
    """kp of 0 to 500, kd of 0 to 5, in 16 bits each."""
    motor = Robstride(1, "RS02")
    motor._bus = bus = Bus()
    getattr(motor, call.pop("method", "set_position"))(**call)
    return int.from_bytes(bus.data[4:6], "big") * 500 / 65535, int.from_bytes(bus.data[6:8], "big") * 5 / 65535


for name, sent in {"CubeMars AK80-9": cubemars, "RobStride RS02": robstride}.items():
    assert "Newton-meters per radian." in (CubeMars if sent is cubemars else Robstride).set_position.__doc__
    radians, degrees = sent(position=0.1745, kp=5.0, kd=0.05), sent(position=10.0, kp=5.0, kd=0.05, degrees=True)
    ends, speed = sent(position=10.0, kp=10.0, kd=0.5, degrees=True), sent(method="set_velocity", velocity=10.0, kd=0.05, degrees=True)
    print(f"SEEN {name}: kp, kd in radians {radians[0]:.1f} {radians[1]:.2f}   in degrees {degrees[0]:.0f} {degrees[1]:.2f}   kp=10, kd=0.5 in degrees: {ends[0]:.0f} {ends[1]:.2f}   set_velocity: kd {speed[1]:.2f}")
    assert abs(radians[0] - 5) < 0.2 and abs(degrees[0] - 286.5) < 0.3 and abs(degrees[1] - 2.865) < 0.01 and abs(speed[1] - 2.865) < 0.01
    assert ends[0] > 499 and ends[1] > 4.99
PY
grep SEEN out.txt

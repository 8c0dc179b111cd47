#!/bin/sh
# tmotor-can-mit-mode 1.1.2 (AK motors): a motor that is given minpos and maxpos keeps a command within them, and replaces the gains of that command by kp = 70 and kd = 5 (the largest), whatever the caller passed: a compliant joint
# (kp = 5, kd = 0.5) is 14 times as stiff from the moment on that its policy asks for 0.01 rad beyond its limit. The commanded velocity becomes 0, and the commanded torque stays, into the limit too. None of this is documented, and there is no
# error. A torque alone (kp = kd = 0, position 0) is changed likewise where 0 is not within the limits: it becomes a move to the limit.
# Seen on 2026-11-30:  limits 0.2 to 1 rad, kp 5, kd 0.5: 1.00 rad: kp 4.9, kd 0.50   1.01 rad: 1.00 rad, kp 70.0, kd 5.00   torque of 2 Nm alone: 0.20 rad, kp 70.0, kd 5.00, 2.0 Nm
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps tmotor-can-mit-mode==1.1.2
v/bin/python - <<'PY'
import sys, types


class Channel:
    """Takes the place of a CAN adapter's library, which needs a driver: keeps the frame."""

    def write(self, frame):
        self.data = bytes(frame.data)

    def busOn(self):
        pass

    def setBusOutputControl(self, _):
        pass


class Named:
    def __getattr__(self, name):
        return name


channel = Channel()
library, inner = types.ModuleType("canlib"), types.ModuleType("canlib.canlib")
library.Frame = lambda id_, data, flags: types.SimpleNamespace(data=data)
inner.openChannel = lambda number, flags: channel
inner.Open, inner.Driver, inner.MessageFlag, library.canlib = Named(), Named(), Named(), inner
sys.modules.update({"canlib": library, "canlib.canlib": inner})
from tmotor_can_mit_mode.tmotorCAN import tmotor

motor = tmotor(1, "AK80-9", minpos=0.2, maxpos=1.0)


def sent(p, v, t, kp, kd):
    """Position in rad, velocity in rad/s, torque in Nm, kp and kd of the frame."""
    motor.attain(p, v, t, kp, kd)
    frame = int.from_bytes(channel.data, "big")
    fields = (48, 16, -12.5, 12.5), (36, 12, -50, 50), (0, 12, -18, 18), (24, 12, 0, 500), (12, 12, 0, 5)
    return [low + (frame >> shift & (1 << bits) - 1) * (high - low) / ((1 << bits) - 1) for shift, bits, low, high in fields]


def near(numbers, *expected):
    return all(abs(number - value) <= step for number, value, step in zip(numbers, expected, (0.001, 0.03, 0.01, 0.13, 0.002)))


within, beyond, torque = sent(1.0, 3.0, 0.0, 5.0, 0.5), sent(1.01, 3.0, 0.0, 5.0, 0.5), sent(0.0, 0.0, 2.0, 0.0, 0.0)
for name, numbers in {"1.00 rad": within, "1.01 rad": beyond, "torque alone": torque}.items():
    print("SEEN {}: {:.2f} rad, {:.0f} rad/s, {:.0f} Nm, kp {:.1f}, kd {:.2f}".format(name, *numbers))
assert near(within, 1.0, 3.0, 0.0, 5.0, 0.5) and near(beyond, 1.0, 0.0, 0.0, 70.0, 5.0) and near(torque, 0.2, 0.0, 2.0, 70.0, 5.0)
PY

#!/bin/sh
# micropython-servo 1.0.1, of its Python file as it is: the angle min_deg, "calibration point 1", belongs to the pulse min_us by the documentation; the package gives min_us to the angle 0 instead, and min_deg changes the slope alone. For a
# servo whose middle is 0 (min_deg=-90, max_deg=90), write(0) is the pulse of its left end, 544 us, and not that of its middle, 1472 us: the joint turns by 90 degrees and into its stop when it should hold. write(90) is the
# middle, and write(-90) a negative pulse of -384 us. read() gives back the angle that was written, so that a test of the two sees nothing. With min_deg = 0, the default, all is right. There is no error.
# Seen on 2026-11-30:  min_deg=-90, max_deg=90: write(0): 544 us (1472), write(90): 1472 us (2400), write(-90): -384 us (544), read() 0, 90, -90   defaults: write(0): 544 us, write(90): 1472 us
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps --target p micropython-servo==1.0.1
cat > run.py <<'PY'
import sys
import types

sys.path.insert(0, "p")


class PWM:
    def __init__(self, _):
        self.nanoseconds = None

    def freq(self, _):
        pass

    def duty_ns(self, nanoseconds):
        self.nanoseconds = nanoseconds


sys.modules["machine"] = types.SimpleNamespace(PWM=PWM, Pin=lambda number: number)
from servo import Servo


def pulses(angles, **calibration):
    servo, seen = Servo(28, **calibration), {}
    for angle in angles:
        servo.write(angle)
        seen[angle] = round(servo.pwm.nanoseconds / 1000), round(servo.read())
    return seen


middle = pulses((0, 90, -90), min_deg=-90.0, max_deg=90.0)
default = pulses((0, 90, 180))
print("SEEN pulse (us) and read(): -90 to 90 degrees:", middle, "  0 to 180:", default)
assert default == {0: (544, 0), 90: (1472, 90), 180: (2400, 180)}
assert middle == {0: (544, 0), 90: (1472, 90), -90: (-384, -90)}
PY
v/bin/python run.py

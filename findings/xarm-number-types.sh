#!/bin/sh
# xarm 0.0.4, numpy 2.4.6: setPosition() of the Hiwonder arm takes its unit from the Python type: a whole number is a servo's code from 0 to 1000, a float is degrees from -125 to 125. 45 and 45.0 are 170 degrees apart, and 0 is the
# end of the range, 0.0 its middle. And in a list of servos, a number of another type, as of a network's or numpy's array (float32, int64), is neither, and that servo gets the code of the one before it, or of the argument
# `position`: an action for six joints moves all to the first one's place. There is no error. For one servo alone, a float32 is refused.
# Seen on 2026-11-30:  45: code 45   45.0: 680   0: 0   0.0: 500   [[1, 200], [2, int64(800)], [3, float32(45)]]: codes 200, 200, 200   as Python's own numbers: 200, 800, 680
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps xarm==0.0.4 && v/bin/pip install -q numpy==2.4.6
v/bin/python - <<'PY'
import numpy as np
from xarm import Controller


class Port:
    def flush(self):
        pass

    def write(self, data):
        self.last = bytes(data)


def codes(*arguments):
    """The codes of all servos in the frame that setPosition() sends."""
    arm = Controller.__new__(Controller)
    arm._device, arm._is_serial, arm.debug = Port(), True, False
    arm.setPosition(*arguments)
    servos = arm._device.last[3:]
    return [servos[at + 1] + 256 * servos[at + 2] for at in range(0, len(servos), 3)]


one = {repr(value): codes(1, value)[0] for value in (45, 45.0, 0, 0.0)}
of_numpy = codes([[1, 200], [2, np.int64(800)], [3, np.float32(45)]])
of_python = codes([[1, 200], [2, 800], [3, 45.0]])
print(f"SEEN {one}, list with numpy's numbers {of_numpy}, with Python's {of_python}")
assert one == {"45": 45, "45.0": 680, "0": 0, "0.0": 500}
assert of_numpy == [200, 200, 200] and of_python == [200, 800, 680]
try:
    codes(1, np.float32(45))
    raise SystemExit("a float32 is taken")
except TypeError:
    pass
PY

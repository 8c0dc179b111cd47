#!/bin/sh
# dynamixel-control 0.2.4, dynamixel-sdk 3.8.4, numpy 2.4.6: update_PID(P, I, D) of a DYNAMIXEL XL-330 writes I to the register of D and D to that of
# I. The package has I at the address 80 and D at 82. dynamixel-helper 1.0.3 and dynamixel-api 1.0.3 have D at 80 and I at 82 for servos with the same
# table (XL430, XM430), as the manufacturer has. With the package's own example, P 1000, I 400, D 2000, the integral gain is five times as large as
# meant, and the joint swings or winds up. For the XL-320 the order is right. And all angles use the model of the servo with the ID 0: a servo of the
# other model gets goals of the wrong scale (1 rad: 195 steps for 652), and without a servo 0 there is a KeyError.
# Seen on 2026-12-01:  update_PID(1000, 400, 2000): address 84 1000, 80 400, 82 2000   helper and api: D 80, I 82, P 84   XL-320: P 29, I 28, D 27
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps dynamixel-control==0.2.4 dynamixel-helper==1.0.3 dynamixel-api==1.0.3 dynamixel-sdk==3.8.4 \
  pyserial==3.5 numpy==2.4.6
cat > run.py <<'PY'
import json
import pathlib

import dynamixel_helper
import dynamixel_sdk
import numpy as np
from dynamixel_api.models.xl430w250t import XL430W250T_FIELDS

memory = {}


class Bus:
    """A bus that takes each bulk write to one servo into the memory."""

    is_using = False

    def __init__(self, *_):
        pass

    def openPort(self):
        return True

    def setBaudRate(self, _):
        return True

    def clearPort(self):
        pass

    def writePort(self, sent):
        assert sent[7] == 0x93
        servo, (address, length) = sent[8], (sent[place] | sent[place + 1] << 8 for place in (9, 11))
        memory[servo, address] = int.from_bytes(bytes(sent[13 : 13 + length]), "little")
        return len(sent)


dynamixel_sdk.PortHandler = Bus
import dynamixel_control.dynamixel

dynamixel_control.dynamixel.PortHandler = Bus


def package(*models):
    control = dynamixel_control.dynamixel.Dynamixel()
    for place, (model, center) in enumerate(models):
        control.add_dynamixel(type=model, ID_number=place, calibration=[0, center, 4095])
    return control


memory.clear()
package(("XL-330", 2048)).update_PID(1000, 400, 2000)
print("SEEN XL-330, P 1000, I 400, D 2000:", memory)
assert memory == {(0, 84): 1000, (0, 80): 400, (0, 82): 2000}

api = {field.name: field.address for field in XL430W250T_FIELDS}
table = json.loads((pathlib.Path(dynamixel_helper.__file__).parent / "tables" / "XM430-W210.json").read_text())["ram"]
for letter, address in zip("pid", (84, 82, 80)):
    assert api[f"position_{letter}_gain"] == table[f"position {letter} gain"] == address
print("SEEN dynamixel-api and dynamixel-helper:", {letter: api[f"position_{letter}_gain"] for letter in "pid"})

memory.clear()
package(("XL-320", 511)).update_PID(36, 4, 20)
print("SEEN XL-320, P 36, I 4, D 20:", memory)
assert memory == {(0, 29): 36, (0, 28): 4, (0, 27): 20}

both = package(("XL-320", 511), ("XL-330", 2048))
both.data = [{"joint_1": np.float64(1.0), "joint_2": np.float64(1.0)}]
both.map_pickle(0)
steps = [both.dxls[place].goal_position - both.dxls[place].center_pos for place in (0, 1)]
alone = package(("XL-330", 2048)).convert_rad_to_pos(np.float64(1.0))
print("SEEN 1 rad, both models together:", *steps, "an XL-330 alone:", alone)
assert steps == [195, 195] and alone == 652
PY
v/bin/python run.py > out.txt || { tail -n 20 out.txt; exit 1; }
grep SEEN out.txt

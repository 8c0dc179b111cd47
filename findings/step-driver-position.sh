#!/bin/sh
# step-driver-g071-api 1.1, pymodbus 3.0.2 (Modbus client of a stepper controller): positions from 65,535 on go to another place. A position takes two
# registers; the package splits it with divmod(position, 0xFFFF), so by 65,535, and puts it together again by 65,536 when it reads. 65,535 steps
# become 65,536, and 1,000,000 become 1,000,015: the axis is off by one step for each 65,535. move_to_pos() notes the difference in the log, as "not
# in set position", and returns as always; go_to_pos_without_control() says nothing. encoder, "expected range [0 ... 4095]", is 0 for ever, as nothing
# calls the method that reads it, and that method fails by a TypeError. The moves raise no error.
# Seen on 2026-11-30:  asked for 65,534: 65,534   65,535: 65,536   200,000: 200,003   1,000,000: 1,000,015   the call returns None each time
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps step-driver-g071-api==1.1 pymodbus==3.0.2 pyserial==3.5
cat > run.py <<'PY'
import logging
from types import SimpleNamespace

import step_driver_g071_api.step_driver as api

logging.basicConfig(level=logging.CRITICAL + 1)


class Controller:
    """The controller's registers: command, speed, homing speed, position (low and high word), and its state from 8 on."""

    def __init__(self, **_):
        self.position, self.encoder = 0, 1234

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def write_registers(self, slave, address, values):
        if values[0] == 0x01:
            low, high = values[3:5]
            assert 0 <= low < 1 << 16 and 0 <= high < 1 << 16
            self.position = low + (high << 16)

    def read_holding_registers(self, slave, count, address):
        words = {8: 0, 9: self.position & 0xFFFF, 10: self.position >> 16, 12: self.encoder}
        return SimpleNamespace(registers=[words[address + index] for index in range(count)])


api.ModbusSerialClient = Controller
axis = api.StepDriver(port="/dev/null", modbus_address=4)
seen = {}
for asked in (5_000, 65_534, 65_535, 200_000, 1_000_000):
    result = axis.move_to_pos(position=asked, speed=2000)
    # The package reads the position back by 65,536 and gets what the controller has.
    seen[asked] = axis.device.position, axis._current_pos, result
print("SEEN position of the controller, as read back, and result:", seen)
print("SEEN encoder of 1234:", axis.encoder)
assert seen == {
    5_000: (5_000,) * 2 + (None,),
    65_534: (65_534,) * 2 + (None,),
    65_535: (65_536,) * 2 + (None,),
    200_000: (200_003,) * 2 + (None,),
    1_000_000: (1_000_015,) * 2 + (None,),
}
try:
    axis._update_encoder()
except TypeError as error:
    print("SEEN reading the encoder:", error)
else:
    raise AssertionError("the encoder can be read")
assert axis.encoder == 0
PY
v/bin/python run.py

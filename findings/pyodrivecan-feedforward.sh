#!/bin/sh
# pyodrivecan 0.1.3, odrive-can 2.1.0 (ODrive over CAN): set_position() of pyodrivecan takes a velocity_feedforward and a torque_feedforward and writes them into the frame as they are, where the ODrive counts thousandths: a feedforward of
# 2 turns/s is 0.002, and 3 Nm are 0.003, as good as none. Its own set_velocity() and set_torque() have turns/s and Nm, and odrive-can sends 2 turns/s and 3 Nm for the same arguments. A fraction, such as 0.5, is refused. And an error that
# is over stays in active_error: an ODrive that reports "no errors" after clear_errors() is at DRV_FAULT for ever. bulk_insert_odrive_data() prints sqlite's complaint (13 values for 15 columns) and stores nothing.
# Seen on 2026-11-30:  feedforward 2 turns/s and 3 Nm: pyodrivecan 0.002, 0.003   odrive-can 2.000, 3.000   after errors 0x20, then 0: active_error DRV_FAULT   rows stored: one by one 1, in bulk 0
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q python-can==4.6.1 odrive-can==2.1.0 && v/bin/pip install -q --no-deps pyodrivecan==0.1.3
cat > run.py <<'PY'
import struct

import can
import pyodrivecan
from odrive_can.odrive import ODriveCAN as Other

bus = lambda: can.Bus("drives", interface="virtual")
listener = bus()


def sent():
    frame = listener.recv(1.0)
    position, velocity, torque = struct.unpack("<fhh", frame.data)
    return position, velocity / 1000, torque / 1000


first = object.__new__(pyodrivecan.ODriveCAN)
first.nodeID, first.canBus = 0, bus()
first.set_position(1.0, 2, 3)
one = sent()
second = Other(0, bus())
second.set_input_pos(1.0, 2, 3)
two = sent()
try:
    first.set_position(1.0, 0.5)
    refused = False
except struct.error:
    refused = True

first.active_error = first.disarm_reason = None
for errors in (0x20, 0):
    first.process_can_message(can.Message(arbitration_id=0x03, data=struct.pack("<II", errors, 0), is_extended_id=False))

database = pyodrivecan.OdriveDatabase("log.db")
columns = ["trial_id", "node_ID", "time", "position", "velocity", "torque_target", "torque_estimate", "bus_voltage", "bus_current", "iq_setpoint", "iq_measured", "electrical_power", "mechanical_power", "fet_temp", "motor_temp"]
rows = lambda: len(database.fetch("SELECT * FROM ODriveData"))
database.add_odrive_data(*range(15))
single = rows()
database.bulk_insert_odrive_data([dict(zip(columns, range(15)))] * 5)
bulk = rows() - single
print(f"SEEN feedforward: pyodrivecan {one[1:]}, odrive-can {two[1:]}, 0.5 refused {refused}; active_error {first.active_error}; rows {single} and {bulk}")
assert one == (1.0, 0.002, 0.003) and two == (1.0, 2.0, 3.0) and refused
assert first.active_error == "DRV_FAULT" and (single, bulk) == (1, 0)
for used in (first.canBus, listener):
    used.shutdown()
PY
v/bin/python -W ignore run.py

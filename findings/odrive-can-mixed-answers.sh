#!/bin/sh
# odrive-can 2.1.0, python-can 4.6.1, cantools 45.1.0 (an ODrive over CAN): an answer of one request is given to the next one, of another kind. The
# queue of answers is never emptied. A drive that is asked for a value and also sends it by itself, each few ms, as ODrives do, answers with two
# frames. If both wait when the event loop gets to them, as after a policy's step of some ms, the second one stays, and the next request of any kind
# returns it: get_iq() returns Bus_Voltage and Bus_Current, and every second get_encoder_estimates() the position of the request before, however long
# ago that is. set_axis_state() takes "str | int", but with a number it raises TimeoutError after one second, though the drive is in that state by
# then: it compares the number with the state's name. A program that takes this for a failure leaves a motor in closed loop. set_axis_node_id() always
# raises KeyError, as the default DBC has no such message. The wrong answers come without an error.
# Seen on 2026-12-01:  get_iq() after get_bus_voltage_current(): Bus_Voltage 24.5   position asked at 1, 2, 3, 4 rev: 1, 1, 3, 3   set_axis_state(8):
#                      TimeoutError, state CLOSED_LOOP_CONTROL
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q odrive-can==2.1.0 python-can==4.6.1 cantools==45.1.0
cat > run.py <<'PY'
import asyncio
import queue
import time

import can
from odrive_can.odrive import ODriveCAN, dbc


class Bus(can.BusABC):
    """A bus with one drive, which takes commands at once and answers each request with the frames of self.answers."""

    channel_info = "simulated"

    def __init__(self):
        self.frames, self.answers = queue.Queue(), {}
        self.drive("Heartbeat", Axis_State=1)

    def drive(self, name, **values):
        """The drive sends a frame."""
        message = dbc.get_message_by_name(f"Axis0_{name}")
        data = message.encode({signal.name: values.get(signal.name, 0) for signal in message.signals})
        self.frames.put(can.Message(arbitration_id=message.frame_id, data=data, is_extended_id=False))

    def recv(self, timeout=None):
        try:
            return self.frames.get(timeout=0.05)
        except queue.Empty:
            return None

    def send(self, frame, timeout=None):
        message = dbc.get_message_by_frame_id(frame.arbitration_id)
        name = message.name.removeprefix("Axis0_")
        if frame.is_remote_frame:
            for values in self.answers[name]:
                self.drive(name, **values)
        elif name == "Set_Axis_State":
            self.drive("Heartbeat", Axis_State=message.decode(frame.data, decode_choices=False)["Axis_Requested_State"])

    def shutdown(self):
        pass


async def started():
    bus = Bus()
    drive = ODriveCAN(0, bus)
    await drive.start()
    return bus, drive


async def asked(request):
    asyncio.get_running_loop().call_soon(time.sleep, 0.05)  # a policy's step
    answer = await request()
    await asyncio.sleep(0.2)
    return answer


async def main():
    bus, drive = await started()
    bus.answers = {
        "Get_Bus_Voltage_Current": [{"Bus_Voltage": 24.0}, {"Bus_Voltage": 24.5}],
        "Get_Iq": [{"Iq_Setpoint": 3.0, "Iq_Measured": 2.5}],
    }
    await asked(drive.get_bus_voltage_current)
    mixed = await asked(drive.get_iq)
    print("SEEN get_iq():", mixed)
    assert mixed == {"Bus_Voltage": 24.5, "Bus_Current": 0.0}
    drive.stop()

    bus, drive = await started()
    positions = []
    for position in (1.0, 2.0, 3.0, 4.0):
        bus.answers = {"Get_Encoder_Estimates": [{"Pos_Estimate": position}] * 2}
        positions.append((await asked(drive.get_encoder_estimates))["Pos_Estimate"])
    print("SEEN position asked at 1, 2, 3, 4 rev:", positions)
    assert positions == [1.0, 1.0, 3.0, 3.0]
    drive.stop()

    bus, drive = await started()
    try:
        await drive.set_axis_state(8)
        raised = "nothing"
    except TimeoutError:
        raised = "TimeoutError"
    state = str(drive.axis_state)
    await drive.set_axis_state("CLOSED_LOOP_CONTROL")
    try:
        drive.set_axis_node_id(3)
        missing = "nothing"
    except KeyError:
        missing = "KeyError"
    print(f"SEEN set_axis_state(8): {raised}, state {state}   by its name: no error   set_axis_node_id(3): {missing}")
    assert (raised, state, missing) == ("TimeoutError", "CLOSED_LOOP_CONTROL", "KeyError")
    drive.stop()


asyncio.run(main())
PY
v/bin/python run.py 2> err.txt || { tail -n 20 err.txt; exit 1; }

#!/bin/sh
# apexdrive-core 1.1.1 (a driver of robot joints, "communicating with ApexDrive robotic actuators via SocketCAN or simulation", "Production/Stable"):
# it is always the simulation. mock_mode=False and the name of the interface are stored and used nowhere: no socket is opened, also for a bus that
# does not exist, arm() and set_impedance() succeed, and get_state() reports the position, 48 V and 35 degrees of a model. A program that checks its
# robot by them sees a healthy joint follow each command, with no robot there. disarm(), "zero-torque standby mode", does not stop the model's motor
# either: set_impedance() acts in standby as before, also without arm(). There is no error.
# Seen on 2026-11-30:  bus no-such-bus, mock_mode False: no socket, state 48.0 V, 35.0 C, fault_flags 0   not armed: moves to 0.157 rad   after
# disarm(), 1 Nm for 100 calls: 25.8 rad, STANDBY
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps apexdrive-core==1.1.1
cat > run.py <<'PY'
import socket

import apexdrive

opened = []
real = socket.socket


class Watched(real):
    """Keeps each socket that is opened."""

    def __init__(self, *what, **more):
        opened.append(what)
        super().__init__(*what, **more)


socket.socket = Watched
joint = apexdrive.Actuator(interface="no-such-bus", node_id=0x14, mock_mode=False)
joint.set_impedance(pos_rad=1.57, kp=45.0, kd=2.5)
state = joint.get_state()
told = (state.v_bus_v, state.temperature_c, state.fault_flags)
print(f"SEEN not armed, no such bus, mock_mode False: {state.mode}, {state.position_rad:.3f} rad, volts, degrees, faults {told}, sockets {opened}")
assert state.position_rad > 0.1 and told == (48.0, 35.0, 0) and not opened

joint.arm()
joint.disarm()
before = joint.get_state().position_rad
for _ in range(100):
    joint.set_torque(1.0)
state = joint.get_state()
print(f"SEEN after disarm(): {before:.3f} to {state.position_rad:.1f} rad with 1 Nm, mode", state.mode)
assert state.mode == "STANDBY" and state.position_rad > before + 20
PY
v/bin/python run.py

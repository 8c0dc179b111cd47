#!/bin/sh
# pycybergear 1.0.0, python-cybergear 0.1.2 (Xiaomi CyberGear): send_motion_command() of pycybergear takes a torque, computes its code and does not send it. The place of the torque, bits 8 to 23 of the frame's identifier, gets the
# host's id, 0 by default, and code 0 is -12 Nm, the motor's largest torque: each command, also one of all zeros, asks for full torque to one side, and a caller's torque of +3 Nm changes nothing. With a host id of 0xFD, -11.9 Nm. There is
# no limit either: a position of 13 rad has a code of 17 bits, is cut to 16, and asks for -12 rad. python-cybergear, with the same arguments, sends 0 Nm and 3 Nm, and limits the position to 12.5 rad. There is no error.
# Seen on 2026-11-30:  torque sent for 0, 3 and -3 Nm: pycybergear -12.00, -12.00, -12.00 (host 0xFD: -11.91)   python-cybergear -0.00, 3.00, -3.00   position sent for 13 rad: pycybergear -12.00, python-cybergear 12.50
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q python-can==4.6.1 && v/bin/pip install -q --no-deps --target one pycybergear==1.0.0 && v/bin/pip install -q --no-deps --target two python-cybergear==0.1.2
cat > run.py <<'PY'
import sys

import can


def range_of(code, largest):
    return code / 65535 * 2 * largest - largest


def sent(move, host=0):
    """The torque and the position of the last frame on the bus."""
    with can.Bus("motors", interface="virtual") as listener:
        move(host)
        frame = None
        while (received := listener.recv(0.1)) is not None:
            if received.arbitration_id >> 24 == 1:
                frame = received
    return range_of(frame.arbitration_id >> 8 & 0xFFFF, 12), range_of(frame.data[0] << 8 | frame.data[1], 12.5)


def one(torque=0.0, position=0.0):
    import cybergear

    def move(host):
        bus = cybergear.CyberGear(interface="virtual", channel="motors")
        bus.init_motor(127, host).send_motion_command(position, 0.0, torque, 0.0, 0.0)
        bus.close()

    return move


def two(torque=0.0, position=0.0):
    import cybergear

    def move(_):
        motor = object.__new__(cybergear.CyberGearMotor)
        motor.can_id, motor.host_can_id, motor._send_timeout = 127, 0xFD, 0.1
        motor._bus = can.Bus("motors", interface="virtual")
        motor.motor_control(torque, position, 0.0, 0.0, 0.0)
        motor._bus.shutdown()

    return move


package = {"one": one, "two": two}[sys.argv[1]]
torques = [sent(package(torque))[0] for torque in (0.0, 3.0, -3.0)]
other_host = sent(package(), 0xFD)[0]
position = sent(package(position=13.0))[1]
print("SEEN", sys.argv[1], [f"{torque:.2f}" for torque in torques], f"host 0xFD {other_host:.2f}, 13 rad: {position:.2f}")
if sys.argv[1] == "one":
    assert torques == [-12, -12, -12] and abs(other_host + 11.907) < 0.01 and abs(position + 12) < 0.01
else:
    assert max(abs(a - b) for a, b in zip(torques, (0, 3, -3))) < 0.001 and position == 12.5
PY
for package in one two; do PYTHONPATH=$package v/bin/python run.py $package; done

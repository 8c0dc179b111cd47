#!/bin/sh
# pylx16a 1.1.1 (LX-16A and other Hiwonder bus servos): a relative move is checked as if it were a place: -10 degrees are refused, with limits of 90 to 150 degrees a step of 20 is refused too, and a step of 100 from 120 is taken
# and sends 220 degrees, beyond the limits. An offset below 0 is read back as another one: after set_angle_offset(-10) the servo has -10, and get_angle_offset() gives 51.4 degrees, until it is asked with
# poll_hardware=True. A loop that adds to the offset that it reads goes away. For the step beyond the limits and the offset there is no error.
# Seen on 2026-11-30:  limits 90 to 150, at 120: step -10 refused, 20 refused, 100 sent as code 917 (220 degrees)   offset -10: byte 214 (-42), read back 51.36
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q pylx16a==1.1.1
v/bin/python - <<'PY'
from pylx16a.lx16a import LX16A, ServoArgumentError

POSITION, OFFSET, LIMITS, VOLTAGES, MODE = 28, 19, 21, 23, 30


class Bus:
    """A servo at 120 degrees with limits of 90 and 150 degrees."""

    def write(self, packet):
        self.last = list(packet)

    def read(self, count):
        servo, command = self.last[2], self.last[4]
        low_high = lambda *values: [byte for value in values for byte in (value % 256, value // 256)]
        answers = {POSITION: low_high(500), LIMITS: low_high(375, 625), VOLTAGES: low_high(4500, 12000)}
        data = answers.get(command, [0] * (count - 6))
        packet = [0x55, 0x55, servo, len(data) + 3, command, *data]
        return bytes([*packet, ~sum(packet[2:]) % 256])


LX16A._controller = bus = Bus()
servo = LX16A(1)


def step(angle):
    bus.last = None
    try:
        servo.move(angle, relative=True)
    except ServoArgumentError:
        return "refused"
    return bus.last[5] + 256 * bus.last[6]


steps = {angle: step(angle) for angle in (-10, 20, 100)}
servo.set_angle_offset(-10)
sent, read = bus.last[5], servo.get_angle_offset()
print(f"SEEN steps {steps}, offset -10: byte {sent}, read back {read:.2f}")
assert servo.get_angle_limits() == (90, 150)
assert steps == {-10: "refused", 20: "refused", 100: 917}
assert sent == 256 - 42 and abs(read - 51.36) < 1e-9
PY

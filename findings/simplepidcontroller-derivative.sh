#!/bin/sh
# simplepidcontroller 1.0.0: the derivative gain is squared. The README defines the parallel form by Kp, Ki and Kd and the ideal form by Kp, Ti and
# Td; compute() multiplies the derivative by Td twice, so that its gain is Kd * Kd / Kp. Kd of 0.1 with Kp of 2 damps by 0.005, a twentieth, and Kd of
# 10 with Kp of 1 by 100. With filter_derivative, the filter mixes the rate of the error with its own last output times Td and Kp: at a constant rate
# it grows without bound where that product is above 2, with the default filter at 100 Hz. With anti_windup, the excess of the output is divided by
# Ki, though the integral already contains Ki: with Ki of 0.1 an output that is 1 too large takes 10 from the integral, and at a constant error of 1
# the output jumps from limit to limit with each step. There is no error.
# Seen on 2026-11-30:  Kp 2, Kd 0.1: gain 0.005   Kp 1, Kd 10: 100   with the filter, Kp 2, Kd 8: infinite (8)   Kp 2, Ki 0.1, limits of 1, constant
# error of 1: 1, -1, 1, -1 (1, 1, 1, 1)
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q --no-deps simplepidcontroller==1.0.0
cat > run.py <<'PY'
import simplepidcontroller

DT = 0.01


def controller(kp, ki, kd, **options):
    made = simplepidcontroller.PID(0.0, **options)
    made.parallel_constants = kp, ki, kd
    return made


def gain(kp, kd):
    """The derivative's part of the output, for an error that grows by 1 per second."""
    # The integral's gain is tiny, as the package divides by it.
    made, error = controller(kp, 1e-12, kd), 0.0
    for step in range(1, 101):
        error = step * DT
        output = made.compute(-error, DT)
    return output - kp * error


seen = {(kp, kd): round(gain(kp, kd), 4) for kp, kd in ((2, 0.1), (1, 10), (1, 1), (2, 8))}
print("SEEN derivative's gain for (Kp, Kd):", seen)

filtered, error = controller(2, 1e-12, 8, tf=0.01), 0.0
for step in range(1, 2001):
    error = step * DT
    output = filtered.compute(-error, DT, filter_derivative=True)
settled = output - 2 * error
print(f"SEEN with the filter, after 20 s: {settled} (8)")

limited = controller(2, 0.1, 0, u_min=-1.0, u_max=1.0)
outputs = [round(limited.compute(-1.0, DT, anti_windup=True), 3) for _ in range(12)]
integral = limited.history["integrals"][0]
print("SEEN outputs for a constant error of 1, limits of 1:", outputs, f"integral after the first: {integral:.2f}")
assert seen == {(2, 0.1): 0.005, (1, 10): 100.0, (1, 1): 1.0, (2, 8): 32.0}
assert settled > 1e6 and integral < -9 and outputs == [1.0, -1.0] * 6
PY
v/bin/python run.py

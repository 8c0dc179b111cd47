#!/bin/sh
# harold 1.0.3, control 0.10.2: both make a discrete filter of a continuous one by Tustin's method with a frequency that is kept: harold's prewarp_at is in Hz, control's prewarp_frequency in rad/s, and so are the frequencies
# that a filter's coefficients have. harold's documentation names no unit, only an error message beyond half of the sampling rate does; 40 below 50 is not beyond. A notch for a joint's resonance at 40 rad/s, sampled at
# 100 Hz and told to keep 40, is at 40.0 rad/s by control and at 91.1 rad/s by harold: the resonance passes. With 40 / (2 pi) harold has it at 40.0. There is no error.
# Seen on 2026-11-30:  gain at 40 rad/s, and the frequency of the notch: control 0.00, 40.0 rad/s   harold 0.97, 91.1 rad/s   harold with 40 / (2 pi): 0.00, 40.0 rad/s
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q harold==1.0.3 control==0.10.2 numpy==1.26.4 scipy==1.15.3
v/bin/python -W ignore - <<'PY'
import control, harold
import numpy as np

dt, resonance = 0.01, 40.0
notch = [1.0, 0.0, resonance**2], [1.0, 0.5 * resonance, resonance**2]


def coefficients(filter):
    return np.asarray(filter.num).ravel(), np.asarray(filter.den).ravel()


def gain(filter, frequency):
    num, den = filter
    z = np.exp(1j * frequency * dt)
    return abs(np.polyval(num, z) / np.polyval(den, z))


kept = control.c2d(control.tf(*notch), dt, "tustin", prewarp_frequency=resonance)
filters = {
    "control": (np.ravel(kept.num[0][0]), np.ravel(kept.den[0][0])),
    "harold": coefficients(harold.discretize(harold.Transfer(*notch), dt, method="tustin", prewarp_at=resonance)),
    "harold, in Hz": coefficients(harold.discretize(harold.Transfer(*notch), dt, method="tustin", prewarp_at=resonance / (2 * np.pi))),
}
for name, filter in filters.items():
    place = np.abs(np.angle(np.roots(filter[0]))).max() / dt
    print(f"SEEN {name}: gain {gain(filter, resonance):.2f}, notch at {place:.1f} rad/s")
    if name == "harold":
        assert gain(filter, resonance) > 0.9 and place > 80
    else:
        assert gain(filter, resonance) < 1e-6 and abs(place - resonance) < 0.01
PY

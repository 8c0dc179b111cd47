#!/bin/sh
# cmsisdsp 1.10.3: CMSIS-DSP's PID controllers in q15 and q31 sum their gains when they are initialized, A0 = Kp + Ki + Kd and A1 = -(Kp + 2 Kd), and each sum ends at 1. Gains that are each in range make another controller
# then: with Kp = 0.6, Ki = 0 and Kd = 0.3, A1 is -1 and not -1.2, and the part that is missing acts as an integral gain of 0.2: a constant error of 0.1 gives an output that grows by 0.02 in each step. In f32
# it is 0.06 for ever. There is no error. Kp + 2 Kd has to be below 1 (and Kp + Ki + Kd, too); gains of 1 and more cannot be stated at all.
# Seen on 2026-11-30:  Kp 0.6, Kd 0.3, error 0.1, steps 1, 2, 3, 40:  f32 0.09, 0.06, 0.06, 0.06   q31 and q15 0.09, 0.08, 0.10, 0.84   Kp 0.6, Kd 0.1: 0.07, 0.06, 0.06, 0.06 in all
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q cmsisdsp==1.10.3 numpy==2.4.6
v/bin/python - <<'PY'
import cmsisdsp as dsp
import numpy as np


def outputs(kind, kp, ki, kd, error=0.1, steps=40):
    scale = {"f32": None, "q31": 2**31, "q15": 2**15}[kind]
    code = (lambda value: value) if scale is None else (lambda value: round(value * scale))
    pid = getattr(dsp, f"arm_pid_instance_{kind}")(Kp=code(kp), Ki=code(ki), Kd=code(kd))
    getattr(dsp, f"arm_pid_init_{kind}")(pid, 1)
    step = getattr(dsp, f"arm_pid_{kind}")
    return [step(pid, code(error)) / (scale or 1) for _ in range(steps)]


for gains in ((0.6, 0.0, 0.3), (0.6, 0.0, 0.1)):
    for kind in ("f32", "q31", "q15"):
        seen = outputs(kind, *gains)
        print(f"SEEN {gains} {kind}: {', '.join(f'{seen[step]:.2f}' for step in (0, 1, 2, 39))}")
        if gains[2] == 0.3 and kind != "f32":
            assert np.allclose(np.diff(seen[1:]), 0.02, atol=1e-4)
        else:
            assert np.allclose(seen[1:], 0.06, atol=1e-3)
PY

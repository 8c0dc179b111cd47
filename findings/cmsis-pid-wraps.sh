#!/bin/sh
# cmsisdsp 1.10.3: CMSIS-DSP's PID controller in q31 does not stop at the ends of its range: it adds to its last output by a plain sum, so that after +1 comes -1. A joint that leans on an obstacle (a constant error of 0.1,
# with Kp = 0.5 and Ki = 0.2) gets more and more torque to one side, and from step 47 to 48 all of it to the other side. The q15 one, with the same numbers, stays at +1, and f32 goes on beyond 1. There is no error.
# Its documentation says that the q31 result is truncated and then saturated. A caller has to limit the controller's state by itself before each step.
# Seen on 2026-11-30:  outputs of steps 45 to 50:  q31 0.95, 0.97, 0.99, -0.99, -0.97, -0.95   q15 0.95, 0.97, 0.99, 1.00, 1.00, 1.00   f32 0.95, 0.97, 0.99, 1.01, 1.03, 1.05
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q cmsisdsp==1.10.3 numpy==2.4.6
v/bin/python - <<'PY'
import cmsisdsp as dsp
import numpy as np

for kind, scale in (("q31", 2**31), ("q15", 2**15), ("f32", None)):
    code = (lambda value: value) if scale is None else (lambda value: round(value * scale))
    pid = getattr(dsp, f"arm_pid_instance_{kind}")(Kp=code(0.5), Ki=code(0.2), Kd=code(0.0))
    getattr(dsp, f"arm_pid_init_{kind}")(pid, 1)
    step = getattr(dsp, f"arm_pid_{kind}")
    seen = np.array([step(pid, code(0.1)) / (scale or 1) for _ in range(100)])
    print(f"SEEN {kind}: {', '.join(f'{output:.2f}' for output in seen[44:50])}")
    assert np.allclose(seen[:45], 0.07 + 0.02 * np.arange(45), atol=0.01)
    if kind == "q31":
        assert seen[46] > 0.98 and seen[47] < -0.98 and (np.diff(seen) < -1.9).sum() == 1
    elif kind == "q15":
        assert (seen[48:] > 0.999).all()
    else:
        assert seen[-1] > 2
PY

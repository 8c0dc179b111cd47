#!/bin/sh
# controlsim 0.1.0 (control 0.10.2, simulation of delayed plants): the simulated delay is one step shorter than the one asked for: the ring of delay
# / dt places is read just ahead of where it was written. A delay of one step is no delay at all, and one of two steps is half. gain_phase_margin()
# has the whole delay, so that the margins and the simulation speak of two plants. After reset(), "delay_time" is 0: the margins are those of a plant
# without delay, 101.5 degrees instead of 17.4 and an infinite gain margin, while step() goes on with the delay. There is no error.
# Seen on 2026-11-30:  dt 0.01, delay 0.00, 0.01, 0.02, 0.05: the input arrives after 0, 0, 1, 4 steps   phase margin 17.4 degrees, after reset()
# 101.5; gain margin 1.35 dB, inf
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q controlsim==0.1.0 control==0.10.2 numpy==2.4.6 scipy==1.17.1 matplotlib==3.11.2
cat > run.py <<'PY'
import math

import control
from controlsim import ProcessDefinition

arrived = {}
for delay in (0.0, 0.01, 0.02, 0.05):
    plant = ProcessDefinition(control.tf([1], [1, 1]), delay, dt=0.01)
    for _ in range(20):
        plant.step(1.0)
    # u[0] is the state at the start; the first call to step() writes u[1].
    arrived[delay] = next(place for place, value in enumerate(plant.u) if value) - 1
print("SEEN steps until the input arrives, by the delay, dt 0.01:", arrived)
assert arrived == {0.0: 0, 0.01: 0, 0.02: 1, 0.05: 4}

plant = ProcessDefinition(control.tf([5], [1, 1]), 0.3, dt=0.01)
gain, phase = plant.gain_phase_margin()[:2]
plant.reset()
after_gain, after_phase = plant.gain_phase_margin()[:2]
print(f"SEEN margins with a delay of 0.3: {gain:.2f} dB, {phase:.1f} degrees; after reset(): {after_gain} dB, {after_phase:.1f} degrees")
assert phase < 20 and after_phase > 100 and math.isinf(after_gain) and plant.delay_steps == 30 and plant.delay_time == 0
PY
v/bin/python run.py

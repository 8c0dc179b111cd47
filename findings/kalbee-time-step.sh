#!/bin/sh
# kalbee 1.0.0 (numpy 2.4.6, scipy 1.17.1): AlphaBetaGammaFilter divides its gains for speed and acceleration by a time step that update() takes on
# its own, 1.0 by default, and not by that of predict(). The package's own loops, filter_sequence(dt=) and run_filter_stream(dt=), hand dt to
# predict() only: at 100 Hz the gain of the speed is 100 times too small, that of the acceleration 10000 times. Of a joint that swings at 1 Hz with
# 6.28 rad/s, the loops estimate a speed that is wrong by 6.32 rad/s, 0.14 with update(dt=0.01), while the position stays within 0.06 rad. The linear
# KalmanFilter documents dt for predict() and does not look at it. There is no error.
# Seen on 2026-11-30:  worst speed error of 6.28 rad/s, 100 Hz: filter_sequence() 6.32   run_filter_stream() 6.32   update(z, dt=0.01) 0.14
# KalmanFilter.predict(dt=0.01): moves by 1.0 s
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q kalbee==1.0.0 numpy==2.4.6 scipy==1.17.1
cat > run.py <<'PY'
import asyncio
import math

import numpy as np
from kalbee import KalmanFilter
from kalbee.modules.filters.abg_filter import AlphaBetaGammaFilter
from kalbee.modules.filters.async_filter import run_filter_stream

STEP = 0.01
times = np.arange(1, 401) * STEP
places = np.sin(math.tau * times)
speeds = math.tau * np.cos(math.tau * times)


def new():
    return AlphaBetaGammaFilter(np.zeros((3, 1)), 0.5, 0.4, 0.1)


def by_stream():
    async def readings():
        for place in places:
            yield np.array([[place]])

    return np.array(asyncio.run(run_filter_stream(new(), readings(), dt=STEP)))


def by_hand():
    tracker, states = new(), []
    for place in places:
        tracker.predict(dt=STEP)
        states.append(tracker.update(np.array([[place]]), dt=STEP).copy())
    return np.array(states)


runs = {"filter_sequence": new().filter_sequence(places, dt=STEP)[0], "run_filter_stream": by_stream(), "update(dt=0.01)": by_hand()}
# The first second is left out, in which each of them settles.
worst = {name: round(float(np.abs(states[100:, 1, 0] - speeds[100:]).max()), 2) for name, states in runs.items()}
off = {name: round(float(np.abs(states[100:, 0, 0] - places[100:]).max()), 3) for name, states in runs.items()}
print("SEEN worst error of the speed, of 6.28 rad/s:", worst, "of the position:", off)
assert worst["filter_sequence"] == worst["run_filter_stream"] > 20 * worst["update(dt=0.01)"] and worst["filter_sequence"] > 6

move = np.array([[1.0, 1.0], [0.0, 1.0]])
linear = KalmanFilter(np.array([[0.0], [1.0]]), np.eye(2), move, np.eye(2), np.array([[1.0, 0.0]]), np.eye(1))
place = float(linear.predict(dt=0.01)[0, 0])
print("SEEN KalmanFilter.predict(dt=0.01) at 1 rad/s moves by", place)
assert place == 1.0
PY
v/bin/python run.py

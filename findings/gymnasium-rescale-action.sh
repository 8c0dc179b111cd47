#!/bin/sh
# gymnasium 1.4.0 and 0.29.1, numpy 2.4.6 and 1.26.4: RescaleAction, which maps a policy's -1 to 1 to the environment's limits, changed what it does beyond them. 0.29.1 refuses an action of 1.5; 1.4.0 goes on along the line: for limits of
# 0 to 2 rad, 1.5 is 2.5 rad and 3 is 4 rad. There is no error, and no warning. A Gaussian policy leaves -1 to 1 all the time, and one that was moved from 0.29.1 has lost its limits. ClipAction around
# RescaleAction keeps them. A joint that is held by equal limits (low = high = 0.5), as a locked waist, is NaN for each action in 1.4.0, with a RuntimeWarning by numpy alone, and 0.5 in 0.29.1.
# Seen on 2026-11-30:  1.4.0: 1.5 -> 2.5, 3 -> 4, held joint -> nan   0.29.1: 1.5 -> AssertionError, held joint -> 0.5
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv new && new/bin/pip install -q gymnasium==1.4.0 numpy==2.4.6
python3 -m venv old && old/bin/pip install -q gymnasium==0.29.1 numpy==1.26.4
cat >seen.py <<'PY'
import json
import gymnasium
import numpy as np
from gymnasium.wrappers import ClipAction, RescaleAction


class Joints(gymnasium.Env):
    """Two joints: one of 0 to 2 rad, one that is held at 0.5."""

    def __init__(self, low, high):
        self.action_space = gymnasium.spaces.Box(np.array(low, np.float32), np.array(high, np.float32))
        self.observation_space = gymnasium.spaces.Box(-1, 1, (1,))

    def reset(self, seed=None, options=None):
        return np.zeros(1, np.float32), {}

    def step(self, action):
        self.target = [float(number) for number in action]
        return np.zeros(1, np.float32), 0.0, False, False, {}


def target(env, action):
    env.reset()
    try:
        env.step(np.array(action, np.float32))
    except AssertionError:
        return "refused"
    return env.unwrapped.target


free = lambda: Joints([0.0], [2.0])
print(json.dumps({
    "inside": target(RescaleAction(free(), -1.0, 1.0), [0.5]),
    "1.5": target(RescaleAction(free(), -1.0, 1.0), [1.5]),
    "3": target(RescaleAction(free(), -1.0, 1.0), [3.0]),
    "clipped": target(ClipAction(RescaleAction(free(), -1.0, 1.0)), [3.0]),
    "held": [str(number) for number in target(RescaleAction(Joints([0.0, 0.5], [2.0, 0.5]), -1.0, 1.0), [0.5, 0.5])],
}))
PY
for version in new old; do $version/bin/python -W ignore seen.py >$version.json; echo "SEEN $version: $(cat $version.json)"; done
new/bin/python - <<'PY'
import json

new, old = (json.load(open(f"{name}.json")) for name in ("new", "old"))
assert new["inside"] == old["inside"] == [1.5] and new["clipped"] == old["clipped"] == [2.0]
assert new["1.5"] == [2.5] and new["3"] == [4.0] and old["1.5"] == old["3"] == "refused"
assert new["held"] == ["1.5", "nan"] and old["held"] == ["1.5", "0.5"], (new["held"], old["held"])
PY

#!/bin/sh
# atomic-rl 0.2.0 with gymnasium 1.4.0, torch 2.15.0, numpy 2.4.6: VecNormalize, "also transforms Gymnasium final observations in info, which is required for correct value bootstrapping at time limits", and VecTransformObservation leave these
# observations as they are: they look for the key "final_observation", which Gymnasium has called "final_obs" since its version 1.0, and the package asks for no older one. Of an environment whose observations are around 1000, a step gives -0.5 for the
# next episode's first observation and 1005.0 for the last one of the episode that a time limit ended. A value network that is asked for the future after that one, as PPO does at each time limit, gets a number far beyond all that it has seen (they are clipped to 10); its
# answer goes into the targets of all steps before. There is no error. It is so for vector environments that
# reset in the same step (AutoresetMode.SAME_STEP), of which the package's comments speak; Gymnasium's own NormalizeObservation refuses this mode with an error.
# Seen on 2026-12-01:  observation 0.58, at the time limit: observation -0.51, final_obs 1005.0   VecTransformObservation (o - 1000): 0.00 and 1005.0   Gymnasium's wrapper: ValueError
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q atomic-rl==0.2.0 gymnasium==1.4.0 torch==2.15.0 numpy==2.4.6 tensordict==0.15.3 pettingzoo==1.27.0 matplotlib==3.11.2
cat > run.py <<'PY'
import gymnasium
import numpy as np
from atomic_rl.envs.wrappers.normalization import VecNormalize, VecTransformObservation
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.wrappers.vector import NormalizeObservation


class Pressure(gymnasium.Env):
    """A sensor around 1000, with a time limit of five steps."""

    observation_space = gymnasium.spaces.Box(0, 2000, (1,))
    action_space = gymnasium.spaces.Discrete(2)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.steps = 0
        return np.array([1000.0], np.float32), {}

    def step(self, action):
        self.steps += 1
        return np.array([1000.0 + self.steps], np.float32), 1.0, False, self.steps == 5, {}


def at_the_limit(name, wrap):
    environments = wrap(SyncVectorEnv([Pressure, Pressure], autoreset_mode=AutoresetMode.SAME_STEP))
    environments.reset()
    for _ in range(4):
        before = environments.step(np.zeros(2, int))
    observations, _, _, ended, info = environments.step(np.zeros(2, int))
    assert ended.all()
    last = float(info["final_obs"][0][0])
    print(f"SEEN {name}: observation {before[0][0, 0]:.2f}, at the time limit: observation {observations[0, 0]:.2f}, final_obs {last:.2f}")
    return float(observations[0, 0]), last


first, last = at_the_limit("VecNormalize", VecNormalize)
assert -1 < first < 0 and last == 1005.0
first, last = at_the_limit("VecTransformObservation, less 1000", lambda e: VecTransformObservation(e, lambda o: o - 1000))
assert first == 0.0 and last == 1005.0
try:
    at_the_limit("Gymnasium's NormalizeObservation", NormalizeObservation)
except ValueError as error:
    print(f"SEEN Gymnasium's NormalizeObservation: ValueError: {error}")
else:
    raise AssertionError("Gymnasium's wrapper takes this mode now")
PY
v/bin/python run.py

#!/bin/sh
# minari 0.5.4, gymnasium 1.4.0, numpy 2.4.6: DataCollector keeps the environment's and the policy's arrays, not copies of them. An environment that computes its observation in place, as a robot's driver with one buffer does, has each
# observation of an episode recorded as the episode's last one; a policy that writes its action into one array has each action recorded as the last one. There is no error and no warning: lengths, rewards and ends are right, and a
# policy that is trained on the data learns one action for one observation.
# Seen on 2026-11-30:  observations 0 1 2 3, actions 1 2 3: reused arrays: 3 3 3 3 and 3 3 3   copies: 0 1 2 3 and 1 2 3
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q "minari[hdf5,create]==0.5.4" gymnasium==1.4.0 numpy==2.4.6 pillow==13.0.0
MINARI_DATASETS_PATH="$dir/data" v/bin/python -W ignore - >out.txt 2>err.txt <<'PY' || { tail -n 20 out.txt err.txt; exit 1; }
import gymnasium, minari
import numpy as np
from gymnasium import spaces


class Joint(gymnasium.Env):
    """Goes where its actions say, and takes three steps."""

    observation_space, action_space = spaces.Box(-10, 10, (1,)), spaces.Box(-10, 10, (1,))

    def __init__(self, reuse):
        self.reuse, self.state = reuse, np.zeros(1, np.float32)

    def observation(self):
        return self.state if self.reuse else self.state.copy()

    def reset(self, seed=None, options=None):
        super().reset(seed=seed)
        self.state[:] = 0
        return self.observation(), {}

    def step(self, action):
        self.state[:] = action
        return self.observation(), float(action[0]), False, bool(action[0] == 3), {}


recorded = {}
for reuse in (True, False):
    collector = minari.DataCollector(Joint(reuse))
    collector.reset(seed=0)
    action = np.zeros(1, np.float32)
    for number in (1, 2, 3):
        action[:] = number
        collector.step(action if reuse else action.copy())
    episode = collector.create_dataset(f"joint{int(reuse)}-v0")[0]
    recorded[reuse] = [numbers.ravel().tolist() for numbers in (episode.observations, episode.actions, episode.rewards)]
    print("SEEN", "reused arrays:" if reuse else "copies:", *recorded[reuse])
assert recorded[False] == [[0, 1, 2, 3], [1, 2, 3], [1, 2, 3]]
assert recorded[True] == [[3, 3, 3, 3], [3, 3, 3], [1, 2, 3]]
PY
grep SEEN out.txt

#!/bin/sh
# stable-baselines3 2.9.2, gymnasium 1.4.0: learning and predict with the action space Discrete(3, start=5). PPO and A2C give actions 0 to 2, none of which
# the space contains. DQN's greedy action is one of 0 to 2, but its random one is one of 5 to 7, from the same predict. There is no error and no warning, except
# from check_env if a user calls it ("is not supported").
# Seen on 2026-11-28:  PPO: 0 1 2, step gets 0 1 2   A2C: 0 1 2, step gets 0 1 2   DQN: greedy 0 2, exploring 0 2 5 6 7
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q stable-baselines3==2.9.2 gymnasium==1.4.0 torch==2.15.0 numpy==2.4.6
v/bin/python - <<'PY'
import warnings

warnings.simplefilter("error", UserWarning)
import gymnasium, numpy as np
from gymnasium import spaces
from stable_baselines3 import A2C, DQN, PPO


class Env(gymnasium.Env):
    action_space = spaces.Discrete(3, start=5)
    observation_space = spaces.Box(-1, 1, (4,), np.float32)
    stepped = set()

    def reset(self, seed=None, options=None):
        return self.observation_space.sample(), {}

    def step(self, action):
        self.stepped.add(int(action))
        return self.observation_space.sample(), 0.0, False, False, {}


def actions(model, deterministic):
    return {int(model.predict(x, deterministic=deterministic)[0]) for x in np.random.default_rng(0).uniform(-1, 1, (200, 4)).astype(np.float32)}


for kind in (PPO, A2C):
    Env.stepped = set()
    model = kind("MlpPolicy", Env(), device="cpu", seed=0).learn(64)
    got = actions(model, False)
    print(f"{kind.__name__}:", *sorted(got), "  step gets", *sorted(Env.stepped))
    assert got == {0, 1, 2} and Env.stepped == {0, 1, 2}
model = DQN("MlpPolicy", Env(), device="cpu", seed=0, exploration_initial_eps=0.5)
model.exploration_rate = 0.5
greedy, exploring = actions(model, True), actions(model, False)
print("DQN: greedy", *sorted(greedy), "  exploring", *sorted(exploring))
assert greedy <= {0, 1, 2} and {5, 6, 7} <= exploring and exploring & {0, 1, 2}
PY

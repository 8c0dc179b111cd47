#!/bin/sh
# stable-baselines3 2.9.2, gymnasium 1.4.0, torch 2.15.0: A2C, SAC and DDPG write into the policy_kwargs that they are given, so that one dict for several
# algorithms changes the next ones. After A2C, PPO trains with A2C's RMSprop instead of Adam; after DDPG, TD3 has one critic instead of two. Both without a
# warning. After SAC, PPO and TD3 fail with a TypeError about use_sde.
# Seen on 2026-11-29:  after A2C: PPO has RMSprop, alone Adam   after DDPG: TD3 has 1 critic, alone 2   after SAC: TD3 TypeError, PPO TypeError
set -eu
dir=$(mktemp -d); trap 'rm -rf "$dir"' EXIT; cd "$dir"
python3 -m venv v && v/bin/pip install -q stable-baselines3==2.9.2 gymnasium==1.4.0 torch==2.15.0 numpy==2.4.6
v/bin/python - <<'PY'
import warnings

warnings.simplefilter("error", UserWarning)
import gymnasium, numpy as np
from gymnasium import spaces
from stable_baselines3 import A2C, DDPG, PPO, SAC, TD3


class Env(gymnasium.Env):
    observation_space = spaces.Box(-1, 1, (4,), np.float32)
    action_space = spaces.Box(-1, 1, (2,), np.float32)

    def reset(self, seed=None, options=None):
        return self.observation_space.sample(), {}

    def step(self, action):
        return self.observation_space.sample(), 0.0, False, False, {}


def second(first, algorithm):
    shared = {"net_arch": [8]}
    if first:
        first("MlpPolicy", Env(), policy_kwargs=shared, device="cpu")
    try:
        return algorithm("MlpPolicy", Env(), policy_kwargs=shared, device="cpu")
    except TypeError as error:
        assert "use_sde" in str(error)
        return "TypeError"


optimizers = [type(second(first, PPO).policy.optimizer).__name__ for first in (None, A2C)]
critics = [second(first, TD3).critic.n_critics for first in (None, DDPG)]
failures = [second(SAC, algorithm) for algorithm in (TD3, PPO)]
print(f"PPO alone {optimizers[0]}, after A2C {optimizers[1]}   TD3 alone {critics[0]} critics, after DDPG {critics[1]}   after SAC: {failures}")
assert optimizers == ["Adam", "RMSprop"] and critics == [2, 1] and failures == ["TypeError", "TypeError"]
PY

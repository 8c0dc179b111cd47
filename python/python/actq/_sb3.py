"""Policies of Stable-Baselines3: what `predict` does, as a module."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch

from ._actq import Error
from ._typing import Array


def is_policy(module: Any) -> bool:
    """Returns `True` for policies and actors, also those of projects on top of Stable-Baselines3."""
    classes = type(module).__mro__
    return any(base.__name__ == "BasePolicy" and base.__module__.startswith("stable_baselines3.") for base in classes)


class Deterministic(torch.nn.Module):
    """What `policy.predict(obs, deterministic=True)` returns. For Discrete, scores whose largest is that action."""

    low: torch.Tensor
    high: torch.Tensor

    def __init__(self, policy: Any, name: str) -> None:
        super().__init__()
        self.policy = policy
        space = policy.action_space
        self.kind = type(space).__name__
        has_actor = all(hasattr(policy, part) for part in ("mlp_extractor", "action_net", "pi_features_extractor"))
        has_scores = has_actor or hasattr(policy, "q_net")
        if hasattr(policy, "lstm_actor"):
            raise Error(f"{name}: the policy is recurrent; pass a module of its actor that takes and returns its states")
        if self.kind not in ("Box", "Discrete") or self.kind == "Discrete" and not has_scores:
            raise Error(f"{name}: the actions are {space}; pass a module of the policy's actor that returns its scores")
        if self.kind == "Box":
            self.register_buffer("low", torch.from_numpy(space.low.astype(np.float32)), persistent=False)
            self.register_buffer("high", torch.from_numpy(space.high.astype(np.float32)), persistent=False)

    def forward(self, obs: torch.Tensor) -> Any:
        policy = self.policy
        if self.kind == "Discrete":
            if hasattr(policy, "q_net") and isinstance(policy.q_net, torch.nn.Sequential):
                return policy(obs)
            if hasattr(policy, "q_net"):
                return policy.q_net(obs)
            features = policy.extract_features(obs, policy.pi_features_extractor)
            return policy.action_net(policy.mlp_extractor.forward_actor(features))
        action = policy._predict(obs, deterministic=True)
        if policy.squash_output:
            return self.low + 0.5 * (action + 1.0) * (self.high - self.low)
        return torch.minimum(torch.maximum(action, self.low), self.high)


def refuse_other_actions(module: Any, probes: Array, name: str) -> None:
    """Refuses a policy whose `predict` gives other actions than its module."""
    if not isinstance(module, Deterministic):
        return
    policy = module.policy
    for row in probes.reshape(-1, probes.shape[-1]):
        obs = row.reshape(policy.observation_space.shape)
        expected, _ = policy.predict(obs, deterministic=True)
        found = module(torch.from_numpy(obs[None]).to(policy.device))[0].cpu().numpy()
        if module.kind == "Discrete":
            is_same = found[int(expected)] >= found.max() - 1e-5 * np.abs(found).max()
        else:
            is_same = np.abs(found - expected).max() <= 1e-5 * max(1.0, np.abs(expected).max())
        if not is_same:
            raise Error(f"{name}: policy.predict gives other actions than the policy's modules; pass a module of its actor")

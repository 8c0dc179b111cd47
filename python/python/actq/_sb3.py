"""Policies of Stable-Baselines3: what `predict` does, as a module."""

from __future__ import annotations

from typing import Any, Dict, List, Tuple

import numpy as np
import torch

from ._actq import Error
from ._typing import Array, Limits


def is_policy(module: Any) -> bool:
    """Returns `True` for policies and actors, also those of projects on top of Stable-Baselines3."""
    return is_of(module, "BasePolicy", "stable_baselines3.")


def is_of(source: Any, name: str, package: str) -> bool:
    """Returns `True` for objects of a class of this name of a package, or of one that is based on it."""
    return any(base.__name__ == name and base.__module__.startswith(package) for base in type(source).__mro__)


def centre(scores: Any) -> None:
    """Makes the mean of the scores of a choice 0, if its module ends in a matrix. The largest stays the largest, and an image
    does not learn a part that is common to all, as the value of a state."""
    last = scores[-1] if isinstance(scores, torch.nn.Sequential) and len(scores) else scores
    if type(last) is torch.nn.Linear:
        with torch.no_grad():
            for values in last.parameters():
                values.copy_(values.double() - values.double().mean(dim=0))


class Deterministic(torch.nn.Module):
    """What `policy.predict(obs, deterministic=True)` returns, before the limits of the action space. For Discrete, scores
    whose largest is that action. It changes the policy, a copy: it centres the scores."""

    low: torch.Tensor
    high: torch.Tensor

    def __init__(self, policy: Any, name: str) -> None:
        super().__init__()
        self.policy = policy
        self.parts = parts(policy.observation_space, name)
        self.lengths = [int(np.prod(shape)) for shape in self.parts.values()]
        self.is_dict = hasattr(policy.observation_space, "spaces")
        space = policy.action_space
        self.kind = type(space).__name__
        has_actor = all(hasattr(policy, part) for part in ("mlp_extractor", "action_net", "pi_features_extractor"))
        has_scores = has_actor or hasattr(policy, "q_net")
        if hasattr(policy, "lstm_actor"):
            raise Error(f"{name}: the policy is recurrent; pass a module of its actor that takes and returns its states")
        if self.kind not in ("Box", "Discrete") or self.kind == "Discrete" and not has_scores:
            raise Error(f"{name}: the actions are {space}; pass a module of the policy's actor that returns its scores")
        if self.kind == "Discrete":
            q_net = getattr(policy, "q_net", None)
            centre(policy.action_net if q_net is None else getattr(q_net, "q_net", q_net))
        if self.kind == "Box" and policy.squash_output:
            for side in ("low", "high"):
                values = torch.from_numpy(getattr(space, side).astype(np.float32).reshape(-1)).to(policy.device)
                self.register_buffer(side, values, persistent=False)

    def forward(self, given: torch.Tensor) -> Any:
        policy, obs = self.policy, self.observation(given)
        if self.kind == "Discrete":
            if hasattr(policy, "q_net") and isinstance(policy.q_net, torch.nn.Sequential):
                return policy(obs)
            if hasattr(policy, "q_net"):
                return policy.q_net(obs)
            features = policy.extract_features(obs, policy.pi_features_extractor)
            return policy.action_net(policy.mlp_extractor.forward_actor(features))
        action = policy._predict(obs, deterministic=True)
        if policy.squash_output:
            return self.low + 0.5 * (action.flatten(1) + 1.0) * (self.high - self.low)
        return action.flatten(1)

    def limits(self) -> Tuple[Array, Array]:
        """Returns lowest and highest actions; an action that is scaled to them has no others."""
        if self.kind == "Box" and not self.policy.squash_output:
            space = self.policy.action_space
            return space.low.reshape(-1), space.high.reshape(-1)
        return np.array([]), np.array([])

    def observation(self, given: Any) -> Any:
        """Returns what the policy takes of flat values, an array or a tensor: of a Dict, those of each key."""
        ends = np.cumsum(self.lengths).tolist()
        parts = {
            key: given[:, end - length : end].reshape(-1, *shape)
            for (key, shape), length, end in zip(self.parts.items(), self.lengths, ends)
        }
        return parts if self.is_dict else parts[""]


def parts(space: Any, name: str) -> Dict[str, Tuple[int, ...]]:
    """Returns the shapes of an observation's parts by key, in the order of the space; without a Dict, the key is empty. Only
    numbers can be observed."""
    spaces: Dict[str, Any] = getattr(space, "spaces", {"": space})
    for key, part in spaces.items():
        if type(part).__name__ != "Box":
            raise Error(f"{name}: the observation {key} is {part}; only numbers of a Box, or a Dict of them, can be observed")
    return {key: tuple(int(n) for n in part.shape) for key, part in spaces.items()}


def named_parts(module: Any) -> List[Tuple[str, int]]:
    """Returns the keys of a Dict of observations, in their order in the vector, with their numbers of values."""
    parts = next((part for part in module.modules() if isinstance(part, Deterministic) and part.is_dict), None)
    return [] if parts is None else list(zip(parts.parts, parts.lengths))


def limited(module: Any, limits: Limits, name: str) -> Limits:
    """Returns limits of a caller with those of the action space, of two the stricter."""
    for part in module.modules():
        if isinstance(part, Deterministic) and part.kind == "Discrete" and any(limits):
            raise Error(f"{name}: the actions are scores, of which the largest is chosen; they take no low, high and max_step")
        if isinstance(part, Deterministic) and part.limits()[0].size:
            low, high = part.limits()
            return stricter(limits, (low.tolist(), high.tolist()), name)
    return limits


def stricter(limits: Limits, space: Tuple[List[float], List[float]], name: str) -> Limits:
    """Returns limits of a caller within the lowest and highest actions of an environment, if it has some."""
    low, high = (np.asarray(side, np.float64) for side in space)
    if not low.size:
        return limits
    for given in limits[:2]:
        if len(given) > 1 and low.size > 1 and len(given) != low.size:
            raise Error(f"{name}: {len(given)} limits for {low.size} actions; give one for each, or one for all")
    lowest, highest = np.maximum(low, limits[0] or -np.inf), np.minimum(high, limits[1] or np.inf)
    lows, highs = np.broadcast_arrays(lowest, highest)
    if (lows > highs).any():
        i = int((lows > highs).argmax())
        first, last = (side[min(i, len(side) - 1)] for side in (low, high))
        raise Error(f"{name}: no value of action {i} is within your limits and those of the action space, {first} to {last}")
    return lowest.tolist(), highest.tolist(), limits[2]


def refuse_other_actions(module: Any, probes: Array, name: str) -> None:
    """Refuses a policy whose `predict` gives other actions than its module."""
    if not isinstance(module, Deterministic):
        return
    policy = module.policy
    for row in probes.reshape(-1, 1, probes.shape[-1]):
        (expected,), _ = policy.predict(module.observation(row), deterministic=True)
        found = module(torch.from_numpy(row).to(policy.device))[0].cpu().numpy()
        low, high = module.limits()
        found = np.clip(found, low, high) if low.size else found
        if module.kind == "Discrete":
            # Torch rounds the logarithm of a share, at most that of the number of choices, its exponential and a quotient: scores of
            # an untrained policy that are closer are equal to it.
            rounded = (4 + np.log(len(found))) * np.finfo(np.float32).eps
            is_same = found[int(expected)] >= found.max() - 1e-5 * np.abs(found).max() - rounded
        else:
            is_same = np.abs(found - expected.reshape(-1)).max() <= 1e-5 * max(1.0, np.abs(expected).max())
        if not is_same:
            raise Error(f"{name}: policy.predict gives other actions than the policy's modules; pass a module of its actor")

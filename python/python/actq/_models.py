"""Trained models: their policy as one module, with what stands before it."""

from __future__ import annotations

import copy
import logging
from typing import Any, Callable, List, NamedTuple, Optional, Tuple

import numpy as np
import torch

from . import _sb3
from ._actq import Error, Policy
from ._typing import Array, Limits

log = logging.getLogger("actq")

#: Observations that a policy is compared with its model on.
FRAMES = 100
#: Largest error of a correct policy, as a share of the largest action.
TOLERANCE = 1e-5

#: Mean, deviation and limit that observations of a key are normalized by.
Normalizer = Tuple[Array, Array, float]


class Model(NamedTuple):
    """A trained model as a module."""

    #: One step.
    module: Any
    #: Its inputs.
    example: Tuple[torch.Tensor, ...]
    input_names: Optional[List[str]]
    output_names: Optional[List[str]]
    #: Typical observations of one episode [frame, value], and what the model itself does at them.
    observations: Array
    predict: Callable[[Array], Array]

    def refuse_other_actions(self, policy: Policy, name: str, limits: Limits) -> None:
        """Refuses a policy that gives other actions than the model within these limits."""
        low, high, _ = limits
        expected = np.clip(self.predict(self.observations), low or -np.inf, high or np.inf)
        found = policy(self.observations)
        error = np.abs(found - expected).max() / max(np.abs(expected).max(), 1e-30)
        if not error <= TOLERANCE:
            raise Error(f"{name}: the policy is off by {error:.1e} of the largest action that the model predicts; please report it")


def of(source: Any, name: str) -> Optional[Model]:
    """Returns a trained model as a module: a policy or algorithm of Stable-Baselines3, a runner of rsl_rl, or an agent as
    CleanRL writes it. `None` for other objects."""
    with torch.no_grad():
        if _is_of(source, "BaseAlgorithm", "stable_baselines3."):
            return _of_sb3(source, name)
        if _is_of(source, "OnPolicyRunner", "rsl_rl.runners") or _is_of(source, "DistillationRunner", "rsl_rl.runners"):
            return _of_rsl_rl(source, name)
        return _of_clean_rl(source) if isinstance(source, torch.nn.Module) else None


def _is_of(source: Any, name: str, package: str) -> bool:
    return any(base.__name__ == name and base.__module__.startswith(package) for base in type(source).__mro__)


def drawn(length: int) -> Array:
    return np.random.default_rng(1).normal(size=(FRAMES, length)).astype(np.float32)


class Normalized(torch.nn.Module):
    """A module behind the normalization of parts of its observation."""

    def __init__(self, module: Any, lengths: List[int], normalizers: List[Optional[Normalizer]]) -> None:
        super().__init__()
        self.module, self.lengths, self.clips = module, lengths, [of and of[2] for of in normalizers]
        for i, of in enumerate(normalizers):
            for key, values in zip(("mean", "deviation"), of[:2] if of else ()):
                self.register_buffer(f"{key}_{i}", torch.from_numpy(values.astype(np.float32)))

    def forward(self, obs: torch.Tensor) -> Any:
        parts, at = [], 0
        for i, (length, clip) in enumerate(zip(self.lengths, self.clips)):
            part = obs[:, at : at + length]
            if clip is not None:
                part = torch.clamp((part - getattr(self, f"mean_{i}")) / getattr(self, f"deviation_{i}"), -clip, clip)
            parts.append(part)
            at += length
        return self.module(torch.cat(parts, dim=1) if len(parts) > 1 else parts[0])


def _of_sb3(model: Any, name: str) -> Model:
    """The deterministic action of an algorithm, with what its VecNormalize does to observations."""
    policy = model.policy
    step = _sb3.Deterministic(policy, name)
    is_dict = isinstance(step.parts, list)
    keys: List[Tuple[str, Tuple[int, ...]]] = step.parts if isinstance(step.parts, list) else [("", step.parts)]
    lengths = [int(np.prod(shape)) for _, shape in keys]
    vec = model.get_vec_normalize_env()
    vec = vec if vec is not None and vec.norm_obs else None
    stacked = _stacked_frames(model.get_env())
    # Frames that are normalized one by one, before they are stacked.
    times = stacked if vec is not None and vec.observation_space.shape != model.observation_space.shape else 1
    if vec is not None and is_dict and stacked > 1:
        raise Error(f"{name}: stacked frames of a Dict with VecNormalize cannot be imported; pass model.policy")
    normalizers: List[Optional[Normalizer]] = [None] * len(keys)
    for i, (key, _) in enumerate(keys):
        if vec is not None and (not is_dict or key in vec.norm_obs_keys):
            statistics = vec.obs_rms[key] if is_dict else vec.obs_rms
            deviation = np.sqrt(statistics.var + vec.epsilon)
            mean, deviation = (np.tile(of.reshape(-1), times) for of in (statistics.mean, deviation))
            if mean.size != lengths[i]:
                raise Error(f"{name}: VecNormalize has {statistics.mean.size} values for the observation's {lengths[i]}")
            normalizers[i] = (mean, deviation, float(vec.clip_obs))
    observations, at = drawn(sum(lengths)), 0
    for length, normalizer in zip(lengths, normalizers):
        if normalizer is not None:
            part = observations[:, at : at + length]
            part[:] = normalizer[0] + normalizer[1] * part
        at += length
    if stacked > 1:
        log.warning("%s: an observation is the last %d frames, the oldest first; the application keeps them", name, stacked)

    module: Any = Normalized(step, lengths, normalizers) if any(normalizers) else step

    def predict(rows: Array) -> Array:
        if step.kind != "Box":
            # Of a choice, predict gives only the largest score's index; the import compares it.
            return np.asarray(module(torch.from_numpy(rows).to(policy.device)).detach().cpu().numpy())
        given = step.observation(rows)
        if vec is not None:
            # By the environment itself.
            frames = given if times == 1 else rows.reshape(len(rows) * times, -1)
            given = vec.normalize_obs(frames)
            given = given if times == 1 else given.reshape(rows.shape)
        return np.asarray(model.predict(given, deterministic=True)[0], np.float32).reshape(len(rows), -1)

    return Model(module, (torch.zeros(1, sum(lengths)),), None, None, observations, predict)


def _stacked_frames(env: Any) -> int:
    while env is not None:
        if type(env).__name__ == "VecFrameStack":
            return _last_axis(env.observation_space) // _last_axis(env.venv.observation_space)
        env = getattr(env, "venv", None)
    return 1


def _last_axis(space: Any) -> int:
    """Returns the length of an observation's last axis; all parts of a Dict are stacked alike."""
    return int(next(iter(getattr(space, "spaces", {"": space}).values())).shape[-1])


def _of_rsl_rl(runner: Any, name: str) -> Model:
    """The deterministic action of a runner's policy, with its normalization of observations."""
    policy: Any = runner.alg.get_policy() if hasattr(runner.alg, "get_policy") else None
    if not hasattr(policy, "as_onnx"):
        raise Error(f"{name}: only runners of rsl_rl 5 can be imported; export the policy, and pass the file")
    module: Any = policy.as_onnx(verbose=False).cpu().eval()
    example = tuple(tensor.cpu() for tensor in module.get_dummy_inputs())
    observations = drawn(example[0].shape[-1])

    def predict(rows: Array) -> Array:
        # Groups of observations are joined in their order: the first one has all values here.
        own = copy.deepcopy(policy).cpu().eval()
        own.reset()
        first, *others = own.obs_groups
        steps = [{first: row, **{other: row[:, :0] for other in others}} for row in torch.from_numpy(rows)[:, None]]
        return np.concatenate([own(step).detach().numpy() for step in steps])

    return Model(module, example, list(module.input_names), list(module.output_names), observations, predict)


class _SacAction(torch.nn.Module):
    """The deterministic action of a SAC actor of CleanRL."""

    def __init__(self, actor: Any) -> None:
        super().__init__()
        self.actor = actor

    def forward(self, obs: torch.Tensor) -> Any:
        return self.actor.get_action(obs)[2]


def _of_clean_rl(agent: Any) -> Optional[Model]:
    """The mean action, or the scores, of an agent or a SAC actor of CleanRL's files."""
    if hasattr(agent, "get_action_and_value"):
        module = getattr(agent, "actor_mean", None) or getattr(agent, "actor", None)
    else:
        module = _SacAction(agent) if hasattr(agent, "get_action") and hasattr(agent, "action_scale") else None
    layers = [layer for layer in agent.modules() if isinstance(layer, torch.nn.Linear)]
    if not isinstance(module, torch.nn.Module) or not layers:
        return None
    observed = next((layer.in_features for layer in module.modules() if isinstance(layer, torch.nn.Linear)))
    device = layers[0].weight.device

    def predict(rows: Array) -> Array:
        return np.asarray(module(torch.from_numpy(rows).to(device)).detach().cpu().numpy())

    return Model(module, (torch.zeros(1, observed),), None, None, drawn(observed), predict)

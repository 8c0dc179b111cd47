"""Trained models: their policy as one module, with what stands before it."""

from __future__ import annotations

import logging
from typing import Any, Callable, List, NamedTuple, Optional, Tuple

import numpy as np
import torch

from . import _sb3
from ._actq import Error, Policy
from ._functions import beyond
from ._torch import TOLERANCE, copied, reason, tensors
from ._typing import Array, Limits

log = logging.getLogger("actq")

#: Observations that a policy is compared with its model on.
FRAMES = 100


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
    #: Lowest and highest values that the environment takes of an action, if they are known besides those of the module.
    bounds: Tuple[List[float], List[float]] = ([], [])

    def limits(self, stated: Limits, name: str) -> Limits:
        """Returns limits of a caller with those of the environment, of two the stricter."""
        return _sb3.stricter(stated, self.bounds, name)

    def compare(self, policy: Policy, name: str, limits: Limits) -> None:
        """Refuses a policy that gives other actions than the model within these limits."""
        low, high, _ = limits
        expected = np.clip(self.predict(self.observations), low or -np.inf, high or np.inf)
        difference, largest = np.abs(policy(self.observations) - expected), max(np.abs(expected).max(), 1e-30)
        lengths = [tensor.numel() for tensor in self.example]
        # Not with states: recurrent models have biases, so that typical observations give no tiny actions.
        if sum(lengths) == self.observations.shape[1]:

            def inputs(row: int) -> List[torch.Tensor]:
                parts = torch.split(torch.from_numpy(self.observations[row]), lengths)
                return [part.reshape(like.shape).to(like) for part, like in zip(parts, self.example)]

            tolerance = np.full_like(difference, TOLERANCE * largest)
            difference = beyond(difference, tolerance, lambda given: next(tensors(self.module(*given), "output", name))[1], inputs)
        error = difference.max() / largest
        if not error <= TOLERANCE:
            raise Error(f"{name}: the policy is off by {error:.1e} of the largest action that the model predicts; please report it")


def of(source: Any, name: str) -> Optional[Model]:
    """Returns a trained model as a module: an algorithm of Stable-Baselines3, a runner of rsl_rl, or an agent as
    CleanRL writes it. `None` for other objects."""
    with torch.no_grad():
        if _sb3.is_of(source, "BaseAlgorithm", "stable_baselines3."):
            return _of_sb3(source, name)
        if _sb3.is_of(source, "OnPolicyRunner", "rsl_rl.runners") or _sb3.is_of(source, "DistillationRunner", "rsl_rl.runners"):
            return _of_rsl_rl(source, name)
        # A compiled module's class has no `forward` to look at.
    is_agent = isinstance(source, torch.nn.Module) and not isinstance(source, torch.jit.ScriptModule)
    return _of_clean_rl(source, name) if is_agent else None


def drawn(length: int) -> Array:
    return np.random.default_rng(1).normal(size=(FRAMES, length)).astype(np.float32)


class Normalized(torch.nn.Module):
    """A module after the normalization of parts of its observation."""

    mean: torch.Tensor
    deviation: torch.Tensor

    def __init__(self, module: Any, lengths: List[int], mean: Array, deviation: Array, clips: List[Optional[float]]) -> None:
        super().__init__()
        self.module, self.lengths, self.clips = module, lengths, clips
        for name, values in (("mean", mean), ("deviation", deviation)):
            self.register_buffer(name, torch.from_numpy(values.astype(np.float32)).to(module.policy.device))

    def forward(self, obs: torch.Tensor) -> Any:
        parts, at = [], 0
        for length, clip in zip(self.lengths, self.clips):
            own = slice(at, at + length)
            part = obs[:, own]
            if clip is not None:
                part = torch.clamp((part - self.mean[own]) / self.deviation[own], -clip, clip)
            parts.append(part)
            at += length
        return self.module(torch.cat(parts, dim=1) if len(parts) > 1 else parts[0])


def _of_sb3(model: Any, name: str) -> Model:
    """The deterministic action of an algorithm, with what its VecNormalize does to observations."""
    policy = copied(model.policy, name)
    step = _sb3.Deterministic(policy, name)
    if model.get_env() is None:
        log.warning(
            "%s: the model has no environment; if it was trained with VecNormalize, load it with env=VecNormalize.load(..)", name
        )
    vec, stacked, times = _wrappers(model.get_env(), name)
    if vec is not None and stacked > 1 and (step.is_dict or len(step.parts[""]) > 1):
        raise Error(f"{name}: only stacked frames of one axis are imported with VecNormalize; pass a module that normalizes them")
    means: List[Array] = []
    deviations: List[Array] = []
    clips: List[Optional[float]] = []
    for key, length in zip(step.parts, step.lengths):
        mean, deviation, clip = np.zeros(length), np.ones(length), None
        if vec is not None and (not step.is_dict or key in vec.norm_obs_keys):
            statistics, clip = vec.obs_rms[key] if step.is_dict else vec.obs_rms, float(vec.clip_obs)
            both = (statistics.mean, np.sqrt(statistics.var + vec.epsilon))
            mean, deviation = (np.tile(values.reshape(-1), times) for values in both)
            if mean.size != length:
                raise Error(f"{name}: VecNormalize has {statistics.mean.size} values for the observation's {length}")
        means.append(mean)
        deviations.append(deviation)
        clips.append(clip)
    mean, deviation = np.concatenate(means), np.concatenate(deviations)
    observations = (mean + deviation * drawn(mean.size)).astype(np.float32)
    if stacked > 1:
        along = "" if all(len(shape) == 1 for shape in step.parts.values()) else " along the axis that VecFrameStack stacks"
        log.warning(
            "%s: an observation is the last %d frames%s%s, the oldest first; the application keeps them",
            name, stacked, " of each key" if step.is_dict else "", along,
        )  # fmt: skip

    module: Any = step if vec is None else Normalized(step, step.lengths, mean, deviation, clips)

    def predict(rows: Array) -> Array:
        given = step.observation(rows)
        if vec is not None:
            # By the environment itself.
            frames = given if times == 1 else rows.reshape(len(rows) * times, -1)
            given = vec.normalize_obs(frames)
            given = given if times == 1 else given.reshape(rows.shape)
        if step.kind != "Box":
            # Of a choice, predict gives only the index of the largest score; the import compares it.
            parts = list(given.values()) if isinstance(given, dict) else [given]
            flat = np.concatenate([part.reshape(len(rows), -1) for part in parts], axis=1)
            return np.asarray(step(torch.from_numpy(flat).to(policy.device)).detach().cpu().numpy())
        return np.asarray(model.predict(given, deterministic=True)[0], np.float32).reshape(len(rows), -1)

    return Model(module, (torch.zeros(1, mean.size),), None, None, observations, predict)


#: Wrappers of a vector environment that change no normalized observation: images are not normalized.
TRANSPARENT = ("VecMonitor", "VecCheckNan", "VecTransposeImage")


def _wrappers(env: Any, name: str) -> Tuple[Any, int, int]:
    """Returns the VecNormalize of observations, the number of stacked frames, and how many of them are normalized one by one,
    before they are stacked."""
    vec, stacked, times, between = None, 1, 1, ""
    while env is not None:
        kind = next((base.__name__ for base in type(env).__mro__ if base.__module__.startswith("stable_baselines3.")), "")
        if kind == "VecFrameStack":
            if stacked > 1:
                raise Error(f"{name}: the environment stacks frames twice; pass a module that takes all frames")
            stacked = int(env.stacked_obs.n_stack)
        elif kind == "VecNormalize" and env.norm_obs:
            if vec is not None:
                raise Error(f"{name}: the environment has one VecNormalize within another; pass a module that normalizes as both do")
            if between:
                raise Error(f"{name}: {between} changes observations after VecNormalize; pass a module that does what both do")
            vec, times = env, stacked
        elif kind not in ("VecNormalize", *TRANSPARENT) and hasattr(env, "venv"):
            between = between or type(env).__name__
        env = getattr(env, "venv", None)
    return vec, stacked, times


def _of_rsl_rl(runner: Any, name: str) -> Model:
    """The deterministic action of a runner's policy, with its normalization of observations."""
    policy: Any = runner.alg.get_policy() if hasattr(runner.alg, "get_policy") else None
    if not hasattr(policy, "as_onnx"):
        raise Error(f"{name}: only runners of rsl_rl 5 can be imported; export the policy, and pass the file")
    if type(getattr(policy, "distribution", None)).__name__ == "BetaDistribution":
        raise Error(
            f"{name}: the action of BetaDistribution is alpha / (alpha + beta), a quotient of values, which no kernel computes; pass a "
            "module that returns what the distribution takes, and divide in the application, or train with GaussianDistribution"
        )
    module: Any = policy.as_onnx(verbose=False).cpu().eval()
    example = tuple(tensor.cpu() for tensor in module.get_dummy_inputs())
    # Groups that a CNN reads are inputs of their own.
    images = dict(zip(getattr(policy, "obs_groups_2d", []), (tensor.shape[1:] for tensor in example[1:])))
    if images:
        order = [*policy.obs_groups, *(f"{group} {list(shape)}" for group, shape in images.items())]
        log.warning("%s: an observation is the groups %s: those of images are last", name, ", ".join(order))
    lengths = [example[0].shape[-1], *(shape.numel() for shape in images.values())]
    observations = drawn(sum(lengths))

    def predict(rows: Array) -> Array:
        # Other groups of observations are joined in their order: the first one has all their values here.
        own = copied(policy, name).cpu()
        own.reset()
        actions = []
        for flat, *planes in (row.split(lengths) for row in torch.from_numpy(rows)):
            step = {group: flat[None] if i == 0 else flat[None, :0] for i, group in enumerate(own.obs_groups)}
            step.update({group: plane.reshape(1, *images[group]) for group, plane in zip(images, planes)})
            actions.append(own(step).detach().numpy())
        return np.concatenate(actions)

    # As the wrappers of Isaac Lab and mjlab clip what the policy gives.
    clip = getattr(runner.env, "clip_actions", None)
    bounds: Tuple[List[float], List[float]] = ([], [])
    if isinstance(clip, (int, float)) and not isinstance(clip, bool):
        bounds = ([-float(clip)], [float(clip)])
    return Model(module, example, list(module.input_names), list(module.output_names), observations, predict, bounds)


class _SacAction(torch.nn.Module):
    """The deterministic action of a SAC actor of CleanRL."""

    def __init__(self, actor: Any) -> None:
        super().__init__()
        self.actor = actor

    def forward(self, obs: torch.Tensor) -> Any:
        return self.actor.get_action(obs)[2]


def _of_clean_rl(agent: Any, name: str) -> Optional[Model]:
    """The mean action, or the scores, of an agent or a SAC actor of CleanRL's files."""
    # A module with a forward of its own says itself what it computes.
    if type(agent).forward is not torch.nn.Module.forward and not hasattr(agent, "action_scale"):
        return None
    agent = copied(agent, name)
    layers = [layer for layer in agent.modules() if isinstance(layer, torch.nn.Linear)]
    if not layers:
        return None
    device = layers[0].weight.device
    if hasattr(agent, "get_action_and_value"):
        module = getattr(agent, "actor_mean", None) or getattr(agent, "actor", None)
        if not isinstance(module, torch.nn.Module):
            return None
        if not hasattr(agent, "actor_mean") and not hasattr(agent, "actor_logstd"):
            # The actor of a choice.
            _sb3.centre(module)
    elif hasattr(agent, "get_action") and hasattr(agent, "action_scale"):
        module = _SacAction(agent)
    else:
        return None
    first = next((layer for layer in module.modules() if isinstance(layer, torch.nn.Linear)), layers[0])

    def predict(rows: Array) -> Array:
        obs = torch.from_numpy(rows).to(device)
        if isinstance(module, _SacAction):
            return np.asarray(module(obs).detach().cpu().numpy())
        seen: List[Tuple[Any, Any]] = []
        hook = module.register_forward_hook(lambda _, given, found: seen.append((given[0], found)))
        failure: Optional[Exception] = None
        try:
            with torch.random.fork_rng([]):
                agent.get_action_and_value(obs)
        except Exception as error:
            failure = error
        hook.remove()
        if failure is not None or len(seen) != 1 or seen[0][0].shape != obs.shape or not torch.equal(seen[0][0], obs):
            # Its actor takes other values than the agent, or the agent more than an observation, as a recurrent state.
            why = "" if failure is None else f" ({reason(failure)})"
            raise Error(f"{name}: the agent computes before its actor{why}; pass a module that returns the mean action") from failure
        return np.asarray(seen[0][1].detach().cpu().numpy())

    example = torch.zeros(1, first.in_features, device=device)
    return Model(module, (example,), None, None, drawn(first.in_features), predict)

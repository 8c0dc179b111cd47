"""Rollouts of a policy in a vector environment of Gymnasium."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Callable, Dict, List, Mapping, Optional, Sequence, Tuple

import numpy as np

from ._actq import Error, Policy
from ._progress import Progress, reporter
from ._quantize import _whole
from ._typing import Array, Floats

if TYPE_CHECKING:
    import gymnasium

    VectorEnv = gymnasium.vector.VectorEnv[Any, Any, Any]

Drive = Callable[[Floats, Array], Array]
Observe = Callable[[Any], Array]
Act = Callable[[Array], Any]


@dataclass(frozen=True)
class Episode:
    """An episode that has ended."""

    #: Sum of the rewards.
    total: float
    #: Steps.
    length: int
    #: `True` if the environment ended it, `False` for a limit of time.
    terminated: bool
    #: The environment's info at its end.
    info: Mapping[str, Any]


Success = Callable[[Episode], bool]


@dataclass(frozen=True, repr=False)
class Rollout:
    """A rollout of a policy."""

    #: Observations [frame, value] on which the policy acted, one robot after the other, and bool [frame] that is true at
    #: the first frame of each episode: a recording for `quantize`.
    recording: Tuple[Floats, Array]
    #: Episodes that have ended, in the order of their ends.
    episodes: Sequence[Episode]
    #: Share of them that succeeded; `None` if that is not known.
    success: Optional[float]

    def __repr__(self) -> str:
        frames = len(self.recording[1])
        known = [("mean return", self.mean_return), ("success", self.success)]
        return f"Rollout({len(self.episodes)} episodes, {frames} frames" + "".join(
            f", {name} {value:.4g}" for name, value in known if value is not None
        ) + ")"

    @property
    def mean_return(self) -> Optional[float]:
        """Mean of the episodes' sums of rewards; `None` if none has ended."""
        return float(np.mean([episode.total for episode in self.episodes])) if self.episodes else None


def rollout(
    policy: Drive,
    env: VectorEnv,
    *,
    frames: Optional[int] = None,
    episodes: Optional[int] = None,
    seed: int = 1,
    observe: Optional[Observe] = None,
    act: Optional[Act] = None,
    success: Optional[Success] = None,
    every: int = 1,
    progress: Progress = None,
) -> Rollout:
    """Steps all robots of `env` by a policy until `frames` frames are recorded, or `episodes` episodes have ended.

    policy: an `actq.Head`, or any function of (observations [n, n_obs], reset [n]) that returns actions [n, n_act].
    env: a vector environment of Gymnasium. It stays open.
    frames: frames of all robots together; the default is 10,000 without `episodes`.
    episodes: whole episodes, as many for each robot, so that short ones do not count more than long ones. Only their frames
        are recorded.
    seed: seed of the environment's first episodes.
    observe: makes the policy's observations [n, n_obs] of the environment's; the default flattens arrays.
    act: makes the environment's actions of the policy's; the default clips to a Box, and takes the largest value for
        Discrete.
    success: is called with each `Episode` and says if it succeeded. The default reads "is_success" or "success" of the
        environment's info.
    every: record only every n-th frame of an episode: those at which a policy with chunks plans.
    progress: as for `quantize`.

    Raises what policy and environment raise.
    """
    if frames is not None and episodes is not None:
        raise Error("frames and episodes are given; pass one of them")
    for name, number in (("frames", 1 if frames is None else frames), ("episodes", 1 if episodes is None else episodes), ("every", every)):
        if _whole(name, number) < 1:
            raise Error(f"{name} is {number}; use a whole number from 1 on")
    # A policy's call takes the steps of one robot.
    if not callable(policy) or isinstance(policy, Policy):
        raise Error(f"the policy is of type {type(policy).__name__}; pass actq.Head(image), or a function")
    if not hasattr(env, "num_envs"):
        raise Error("env is one environment; pass a vector environment, as gymnasium.make_vec(..., num_envs=1)")
    n, mode = env.num_envs, _autoreset(env)
    observe, act = observe or _flat(env), act or _actions(env)
    kept: List[Tuple[Floats, Array, Array]] = []
    ended: List[Episode] = []
    most_frames = (10_000 if episodes is None else np.inf) if frames is None else frames
    # Episodes that each robot still begins or drives.
    left = np.full(n, np.iinfo(np.int64).max) if episodes is None else episodes // n + (np.arange(n) < episodes % n)
    totals, lengths = np.zeros(n), np.zeros(n, dtype=np.int64)
    # The first observation of an episode; the environment resets instead of acting.
    fresh, ignored = np.ones(n, dtype=bool), np.zeros(n, dtype=bool)
    observations, _ = env.reset(seed=seed)
    recorded = 0
    with reporter(progress) as report:
        while recorded < most_frames and left.any():
            x = np.asarray(observe(observations), dtype=np.float32)
            if x.ndim != 2 or len(x) != n:
                raise Error(f"the observations of the environment are {x.shape}; ({n}, values) is needed: pass observe")
            # The last observation of an episode may be anything.
            x = np.where(ignored[:, None], np.float32(0), x)
            actions = policy(x, fresh)
            lengths[fresh] = 0
            used = ~ignored & (lengths % every == 0) & (left > 0)
            kept.append((x, fresh.copy(), used))
            recorded += int(used.sum())
            observations, rewards, terminated, truncated, infos = env.step(act(actions))
            done = (terminated | truncated) & ~ignored
            totals += np.where(ignored, 0.0, rewards)
            lengths += ~ignored
            for i in np.flatnonzero(done & (left > 0)):
                info = _info(infos, int(i), n, mode)
                ended.append(Episode(float(totals[i]), int(lengths[i]), bool(terminated[i]), info))
            left[done & (left > 0)] -= 1
            totals[done] = 0.0
            if report is not None:
                report("driving", recorded / most_frames if episodes is None else len(ended) / episodes)
            if mode == "NextStep":
                fresh, ignored = ignored, done
            else:
                fresh = done
                if mode == "Disabled" and done.any():
                    observations, _ = env.reset(options={"reset_mask": done})
    return Rollout(_joined(kept), ended, _share(ended, success or _succeeded))


def _joined(kept: List[Tuple[Floats, Array, Array]]) -> Tuple[Floats, Array]:
    """Returns the used frames of each robot, one robot after the other."""
    x, fresh, used = (np.stack([step[i] for step in kept], axis=1) for i in range(3))
    # Each robot's recording begins an episode.
    fresh[:, 0] = True
    return x[used], fresh[used]


def _share(episodes: Sequence[Episode], success: Callable[[Episode], Optional[bool]]) -> Optional[float]:
    """Returns the share of successful episodes; `None` if there are none, or one has no outcome."""
    outcomes = [found for found in map(success, episodes) if found is not None]
    return float(np.mean(outcomes)) if outcomes and len(outcomes) == len(episodes) else None


def _succeeded(episode: Episode) -> Optional[bool]:
    values = [episode.info[key] for key in ("is_success", "success") if key in episode.info]
    return bool(values[0]) if values else None


def _info(infos: Mapping[str, Any], i: int, n: int, mode: str) -> Dict[str, Any]:
    """Returns the info of robot `i` where its episode ended."""
    infos = infos.get("final_info", infos) if mode == "SameStep" else infos
    return _of_robot(infos, i, n)


def _of_robot(infos: Mapping[str, Any], i: int, n: int) -> Dict[str, Any]:
    """Returns the infos of robot `i` of `n`, also nested ones. A value that is not one for each robot is of all."""
    info: Dict[str, Any] = {}
    for key, value in infos.items():
        is_present = infos.get(f"_{key}")
        if key.startswith("_") or is_present is not None and not is_present[i]:
            continue
        if isinstance(value, Mapping):
            info[key] = _of_robot(value, i, n)
        else:
            is_each = isinstance(value, (list, tuple, np.ndarray)) and np.shape(value)[:1] == (n,)
            info[key] = value[i] if is_each else value
    return info


def _autoreset(env: VectorEnv) -> str:
    mode = (env.metadata or {}).get("autoreset_mode")
    return "NextStep" if mode is None else str(getattr(mode, "value", mode))


def _flat(env: VectorEnv) -> Observe:
    def flat(observations: Any) -> Array:
        if isinstance(observations, Mapping):
            # In the order of the space, as `import_policy` takes them.
            parts = [observations[key] for key in env.single_observation_space.spaces]  # type: ignore[attr-defined]
            return np.concatenate([np.reshape(part, (env.num_envs, -1)) for part in parts], axis=1)
        if isinstance(observations, tuple):
            raise Error(f"the environment's observations are {env.single_observation_space}; pass observe")
        return np.reshape(observations, (env.num_envs, -1))

    return flat


def _actions(env: VectorEnv) -> Act:
    """Returns what makes actions of the environment's space."""
    from gymnasium.spaces import Box, Discrete

    space = env.single_action_space
    if isinstance(space, Discrete):
        return lambda actions: np.argmax(_checked(actions, (env.num_envs, int(space.n))), axis=1) + space.start
    if isinstance(space, Box):
        shape, dtype = (env.num_envs, *space.shape), space.dtype
        low, high = space.low, space.high
        values = int(np.prod(space.shape))
        return lambda actions: np.clip(
            np.reshape(_checked(actions, (env.num_envs, values)), shape), low, high
        ).astype(dtype)
    raise Error(f"the environment's actions are {space}; pass act, which makes them of the policy's")


def _checked(actions: Array, shape: Tuple[int, int]) -> Array:
    """Returns actions [n, n_act], or raises."""
    actions = np.asarray(actions)
    if actions.shape[:1] != shape[:1] or actions.size != shape[0] * shape[1]:
        raise Error(f"the policy's actions are {actions.shape}; the environment takes {shape}: pass act")
    return actions.reshape(shape)

"""Rollouts of a head in a vector environment of Gymnasium."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Callable, Dict, List, Mapping, Optional, Tuple

import numpy as np

from ._actq import Error, Head, Policy
from ._typing import Array, Floats

if TYPE_CHECKING:
    import gymnasium

    VectorEnv = gymnasium.vector.VectorEnv[Any, Any, Any]

Observe = Callable[[Any], Array]
Act = Callable[[Floats], Any]


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


def rollout(
    head: Head,
    env: VectorEnv,
    policy: Policy,
    frames: int,
    seed: int,
    observe: Optional[Observe] = None,
    act: Optional[Act] = None,
    success: Optional[Success] = None,
) -> Tuple[Tuple[Floats, Array], Dict[str, float]]:
    """Steps all robots of `env` until `frames` are recorded.

    Returns (observations [frame, value], starts [frame]), one robot after the other, and the numbers of the rollout.
    """
    n, mode = env.num_envs, _autoreset(env)
    observe, act = observe or _flat(env), act or _actions(env)
    kept: List[Tuple[Floats, Array, Array]] = []
    episodes: List[Episode] = []
    totals, lengths = np.zeros(n), np.zeros(n, dtype=np.int64)
    # A recurrent policy that plays chunks reads an observation only where it plans.
    every = policy.execute if policy.state_len > 0 else 1
    # The first observation of an episode; the environment resets instead of acting.
    fresh, ignored = np.ones(n, dtype=bool), np.zeros(n, dtype=bool)
    observations, _ = env.reset(seed=seed)
    recorded = 0
    while recorded < frames:
        x = np.asarray(observe(observations), dtype=np.float32)
        if x.shape != (n, head.image.obs_len):
            raise Error(f"the observations of the environment are {x.shape}; ({n}, {head.image.obs_len}) is needed: pass observe")
        # The last observation of an episode may be anything.
        x = np.where(ignored[:, None], np.float32(0), x)
        actions = head(x, fresh)
        lengths[fresh] = 0
        used = ~ignored & (lengths % every == 0)
        kept.append((x, fresh.copy(), used))
        recorded += int(used.sum())
        observations, rewards, terminated, truncated, infos = env.step(act(actions))
        done = (terminated | truncated) & ~ignored
        totals += np.where(ignored, 0.0, rewards)
        lengths += ~ignored
        for i in np.flatnonzero(done):
            info = _info(infos, int(i), mode)
            episodes.append(Episode(float(totals[i]), int(lengths[i]), bool(terminated[i]), info))
        totals[done] = 0.0
        if mode == "NextStep":
            fresh, ignored = ignored, done
        else:
            fresh = done
            if mode == "Disabled" and done.any():
                observations, _ = env.reset(options={"reset_mask": done})
    return _joined(kept), _outcome(episodes, success)


def _joined(kept: List[Tuple[Floats, Array, Array]]) -> Tuple[Floats, Array]:
    """Returns the used frames of each robot, one robot after the other."""
    x, fresh, used = (np.stack([step[i] for step in kept], axis=1) for i in range(3))
    # Each robot's recording begins an episode.
    fresh[:, 0] = True
    return x[used], fresh[used]


def _outcome(episodes: List[Episode], success: Optional[Success]) -> Dict[str, float]:
    outcome = {"episodes": float(len(episodes))}
    if not episodes:
        return outcome
    outcome["mean_return"] = float(np.mean([episode.total for episode in episodes]))
    told = [_success(episode) if success is None else success(episode) for episode in episodes]
    if all(found is not None for found in told):
        outcome["success"] = float(np.mean([bool(found) for found in told]))
    return outcome


def _success(episode: Episode) -> Optional[bool]:
    for key in ("is_success", "success"):
        if key in episode.info:
            return bool(episode.info[key])
    return None


def _info(infos: Mapping[str, Any], i: int, mode: str) -> Dict[str, Any]:
    """Returns the info of robot `i` where its episode ended."""
    infos = infos.get("final_info", infos) if mode == "SameStep" else infos
    present = (key for key in infos if not key.startswith("_"))
    return {key: infos[key][i] for key in present if f"_{key}" not in infos or infos[f"_{key}"][i]}


def _autoreset(env: VectorEnv) -> str:
    mode = (env.metadata or {}).get("autoreset_mode")
    return "NextStep" if mode is None else str(getattr(mode, "value", mode))


def _flat(env: VectorEnv) -> Observe:
    return lambda observations: np.reshape(observations, (env.num_envs, -1))


def _actions(env: VectorEnv) -> Act:
    """Returns what makes actions of the environment's space."""
    from gymnasium.spaces import Box, Discrete

    space = env.single_action_space
    if isinstance(space, Discrete):
        return lambda actions: np.argmax(actions, axis=1) + space.start
    if isinstance(space, Box):
        shape, dtype = (env.num_envs, *space.shape), space.dtype
        low, high = space.low, space.high
        return lambda actions: np.clip(actions.reshape(shape), low, high).astype(dtype)
    raise Error(f"the environment's actions are {space}; pass act, which makes them of the policy's")

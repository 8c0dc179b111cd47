"""On-policy rounds in Gymnasium's vector environments."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, List, Optional, Sequence, Tuple, Union

from . import _actq
from ._actq import Head, Image, Policy
from ._progress import Progress, reporter
from ._quantize import CLOCK, log, request
from ._rollout import Act, Observe, Rollout, Success, rollout
from ._typing import Recordings

if TYPE_CHECKING:
    import gymnasium


@dataclass(frozen=True)
class Round:
    """An image of a round, the recordings that it learned from, and its rollout."""

    #: The image.
    image: Image
    #: Episodes and frames that it learned from.
    episodes: int
    frames: int
    #: Error (NMSE) where the f32 policy leads.
    nmse: float
    #: Error (NMSE) on its own rollout; `None` if the f32 policy's actions never vary there.
    own_nmse: Optional[float]
    #: Its rollout.
    rollout: Rollout


@dataclass(frozen=True)
class Tuned:
    """The result of `tune`."""

    #: The image of the last round.
    image: Image
    #: All rounds, from 0 on.
    rounds: Sequence[Round]
    #: The table of `actq tune`.
    table: str = field(repr=False)
    #: The round whose image had the most success, if it is not the last one.
    better: Optional[int] = None

    def __str__(self) -> str:
        return self.table


def tune(
    policy: Policy,
    env: gymnasium.vector.VectorEnv[Any, Any, Any],
    recordings: Optional[Recordings] = None,
    *,
    bits: Optional[int] = None,
    bpw: Optional[float] = None,
    flash: Union[None, int, str] = None,
    ms: Optional[float] = None,
    clock: float = CLOCK,
    rounds: int = 1,
    frames: int = 10_000,
    observe: Optional[Observe] = None,
    act: Optional[Act] = None,
    success: Optional[Success] = None,
    heldout: Optional[Recordings] = None,
    steps: Optional[int] = None,
    minutes: Optional[float] = None,
    effort: Optional[str] = None,
    relative: bool = False,
    seed: int = 1,
    progress: Progress = None,
) -> Tuned:
    """Quantizes in on-policy rounds: rolls out the newest image, labels by the f32 policy, and learns again (DAgger).

    policy: what `import_policy` returned.
    env: a vector environment of Gymnasium. All of its robots step together; it stays open.
    recordings: observations of the f32 policy, as for `quantize`. Without them, an image of 8 bits of the policy is
        rolled out in `env` in its place.
    bits, bpw, flash, ms, clock: the budget, as for `quantize`; the default is the size of bits=3.
    rounds: on-policy rounds after the first image, 1 to 100. N rounds make N + 1 rollouts.
    frames: frames of a rollout, of all robots together.
    observe: makes the policy's observations [n, n_obs] of the environment's; the default flattens arrays.
    act: makes the environment's actions of the policy's [n, n_act]; the default clips to a Box, and takes the largest
        value for Discrete.
    success: is called with an `Episode` and says if it succeeded. The default reads "is_success" or "success" of the
        environment's info; without them, no success is known.
    heldout, steps, minutes, effort, relative, seed, progress: as for `quantize`.

    The same seed gives the same images if the environment does the same. Raises `actq.Error` as `quantize` does, and what
    the environment raises. Ctrl-C returns at once.
    """
    options = request(
        bits=bits, bpw=bpw, flash=flash, ms=ms, clock=clock, steps=steps, minutes=minutes, effort=effort, relative=relative,
        seed=seed,
    )  # fmt: skip
    rollouts: List[Rollout] = []
    # A recurrent policy that plays chunks reads an observation only where it plans.
    every = policy.execute if policy.state_len > 0 else 1

    def drive(image: Image, number: int) -> Rollout:
        # Other episodes in every rollout.
        first = (seed + number * env.num_envs) % 2**31
        head = Head(image, env.num_envs)
        return rollout(
            head, env, frames=frames, seed=first, observe=observe, act=act, success=success, every=every, progress=False
        )  # fmt: skip

    def driven(number: int, image: Image) -> Tuple[Any, str]:
        found = drive(image, number + 1)
        rollouts.append(found)
        numbers = {"episodes": len(found.episodes), "mean_return": found.mean_return, "success": found.success}
        return found.recording, json.dumps({key: value for key, value in numbers.items() if value is not None})

    with reporter(progress) as report:
        if recordings is None:
            if report is not None:
                report("rollout of the f32 policy", 0.0)
            recordings = drive(_actq.stand_in(policy), 0).recording
        image, images, rows, table, better, warnings = _actq.tune(
            policy, recordings, heldout, options, rounds, driven, report
        )
    for warning in warnings:
        log.warning(warning)
    found = [
        Round(image, row["episodes"], row["frames"], row["nmse"], row["own_nmse"], driven_by_it)
        for image, row, driven_by_it in zip(images, json.loads(rows), rollouts)
    ]
    return Tuned(image, found, table, better)

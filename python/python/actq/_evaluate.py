"""Errors of an image."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

from . import _actq
from ._actq import Image, Policy
from ._progress import Progress, reporter
from ._quantize import log
from ._typing import Recordings


@dataclass(frozen=True)
class ErrorReport:
    """Errors of an image's raw outputs against the f32 policy's, as `actq eval --json` prints them."""

    #: Mean squared error over variance, averaged over the output's dimensions.
    nmse: float
    #: The largest of a dimension.
    worst_nmse: float
    #: Largest absolute error, in units of the raw output.
    max_abs: float
    #: Compared observations.
    steps: int
    #: Bits per weight of the matrices, with scales and padding; biases and header do not count.
    bpw: float
    #: Bytes of the image.
    bytes: int


def evaluate(
    image: Image, recordings: Recordings, policy: Optional[Policy] = None, *, progress: Progress = False
) -> ErrorReport:
    """Runs an image over recordings and compares it with the f32 policy.

    image: what `quantize` returned.
    recordings: as for `quantize`. If they hold no actions, or others than `policy` gives, `policy` computes them; the
        log `actq` says how they differ.
    policy: the policy that the image was made from.

    Raises `actq.Error` if a recording does not fit, or has no actions and no policy is given.
    """
    with reporter(progress) as report:
        errors, difference = _actq.evaluate(image, recordings, policy, report)
    if difference is not None:
        log.warning(difference)
    return ErrorReport(**errors)

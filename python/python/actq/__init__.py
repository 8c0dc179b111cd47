"""Quantize robot policies below 4 bits, and run them with the bits of a microcontroller.

    import actq
    policy = actq.import_policy("walker.onnx")
    image = actq.quantize(policy, "observations.npy", bpw=2)
    head = actq.Head(image)
    action = head(observation)

`import_policy` reads a policy, `quantize` and `tune` make an `Image` of it, `Head` runs the image, `rollout` drives
Gymnasium's environments by it, `sweep` makes images of several sizes, `evaluate` measures errors, `FakeQuant` is its network in torch, and `Link` talks
to a motor controller. Every failure is an `actq.Error` with the text of the command `actq`. The logger `actq` receives
the command's notes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, List

from ._actq import Error, Head, Image, Link, Policy, __version__
from ._evaluate import ErrorReport, evaluate
from ._import import import_policy, torch_module
from ._quantize import quantize
from ._rollout import Episode, Rollout, rollout
from ._sweep import Point, Sweep, sweep
from ._tune import Round, Tuned, tune

if TYPE_CHECKING:
    from ._fake_quant import FakeQuant as FakeQuant

# Without FakeQuant, because `from actq import *` must not need torch.
__all__ = [
    "Episode",
    "Error",
    "ErrorReport",
    "Head",
    "Image",
    "Link",
    "Point",
    "Policy",
    "Rollout",
    "Round",
    "Sweep",
    "Tuned",
    "__version__",
    "evaluate",
    "import_policy",
    "quantize",
    "rollout",
    "sweep",
    "tune",
]


def __dir__() -> List[str]:
    return sorted([*__all__, "FakeQuant"])


def __getattr__(name: str) -> Any:
    # Only what needs torch imports it.
    if name == "FakeQuant":
        torch_module("FakeQuant needs")
        from ._fake_quant import FakeQuant

        return FakeQuant
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")

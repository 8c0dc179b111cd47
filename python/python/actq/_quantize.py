"""Quantization of a policy."""

from __future__ import annotations

import logging
from numbers import Real
from operator import index
from typing import Any, Dict, Mapping, Optional, Tuple, Union

import numpy as np

from . import _actq
from ._actq import Error, Image, Policy
from ._progress import Progress, reporter
from ._typing import Recordings

#: Where the notes of the command go.
log = logging.getLogger("actq")

#: Hz; that of an STM32F405.
CLOCK = 168e6
CORES = '"m0", "m3", "rv32imac", "rv32zb", "m4", "m4f", "m7", "m33" or "m55"'


def request(**given: Any) -> Dict[str, Any]:
    """Completes the options of a quantization by the defaults of the command."""
    unset = dict.fromkeys(
        ["bits", "bpw", "flash", "ms", "max_nmse", "method", "group", "activations", "core", "steps", "minutes", "effort"]
    )
    options: Dict[str, Any] = {**unset, "clock": CLOCK, "widths": [], "relative": False, "seed": 1}
    for name in given.keys() - options.keys():
        # As Python says it of `quantize`; of a sweep, the options come here unseen.
        raise TypeError(f"quantize() got an unexpected keyword argument {name!r}")
    options.update(given)
    if options["widths"] is not None and not isinstance(options["widths"], (list, Mapping)):
        raise Error(f"widths is of type {type(options['widths']).__name__}; pass a mapping of matrices to bits")
    options["widths"] = [(name, _whole(f"widths[{name!r}]", bits)) for name, bits in dict(options["widths"] or {}).items()]
    if isinstance(options["flash"], str):
        options["flash"] = _actq.bytes_of(options["flash"])
    for name in ("bits", "flash", "group", "activations", "steps"):
        if options[name] is not None:
            options[name] = _whole(name, options[name])
    options["seed"] = _whole("seed", options["seed"])
    for name in ("bpw", "ms", "max_nmse", "minutes", "clock"):
        if options[name] is not None and not isinstance(options[name], Real):
            raise Error(f"{name} is {options[name]!r}; use a number")
    texts = {"method": '"rtn", "gptq" or "distill"', "effort": '"quick", "default" or "thorough"', "core": CORES}
    for name, known in texts.items():
        if not isinstance(options[name], (str, type(None))):
            raise Error(f"{name} is {options[name]!r}; use {known}")
    if not isinstance(options["relative"], (bool, np.bool_)):
        raise Error(f"relative is {options['relative']!r}; use True or False")
    return {**options, "relative": bool(options["relative"])}


def _whole(name: str, value: Any) -> int:
    """Returns a whole number that the extension can take."""
    try:
        number = index(value)
    except TypeError:
        raise Error(f"{name} is {value!r}; use a whole number") from None
    if number < 0:
        raise Error(f"{name} is {number}; use a whole number from 0 on")
    if number >= (2**63 if name in ("flash", "steps", "seed") else 2**32):
        raise Error(f"{name} is {number}; use a smaller number")
    return number


def quantize(
    policy: Policy,
    recordings: Optional[Recordings] = None,
    *,
    bits: Optional[int] = None,
    bpw: Optional[float] = None,
    flash: Union[None, int, str] = None,
    ms: Optional[float] = None,
    clock: float = CLOCK,
    max_nmse: Optional[float] = None,
    heldout: Optional[Recordings] = None,
    method: Optional[str] = None,
    group: Optional[int] = None,
    activations: Optional[int] = None,
    core: Optional[str] = None,
    widths: Optional[Mapping[str, int]] = None,
    steps: Optional[int] = None,
    minutes: Optional[float] = None,
    effort: Optional[str] = None,
    relative: bool = False,
    seed: int = 1,
    progress: Progress = None,
) -> Image:
    """Quantizes a policy to an image. The same arguments give the bytes of `actq quantize`.

    policy: what `import_policy` returned.
    recordings: observations of the policy's task, float32 or float64, at least 200 and better thousands:
        - an array [frame, value] (one episode) or [episode, step, value];
        - a pair (array [frame, value], array of bool [frame] that is true at the first frame of each episode);
        - a mapping with "obs", and optionally "action", "length" and "state", as a file has them (docs/QUANTIZER.md);
        - the path of an .npy, .npz or .safetensors file, or of a folder of them;
        - a list of these.
        Without them, those in the policy's folder.
    bits: bits of every weight: 2, 3, 4 or 8. The default is 3; "distill" divides as many bytes among the rows.
    bpw: bits per weight of all weights, with scales and padding.
    flash: most bytes of the image, a number or a text as "96K".
    ms, clock: most milliseconds of a step on a Cortex-M4 at a clock in Hz, as predicted.
    max_nmse: largest error; searches the fewest bits that keep it. At most one of these budgets may be given, or flash and
        ms, which are then both kept.
    heldout: recordings that nothing learns from; errors are measured on them. Without them, parts of `recordings` are held
        out in turn for the error, which takes 1 to 2.5 times as long as the image. The log `actq` has the errors.
    method: "distill" (the default with recordings), "gptq" or "rtn" (the default without).
    group: columns that share a scale: 0, 32, 64 or 128.
    activations: bits of the activations: 8 or 16.
    core: the core to pack the image for: "m0", "m3", "rv32imac", "rv32zb", "m4", "m4f", "m7", "m33" or "m55". The default is
        the layouts of those with the DSP extension, "m4" to "m33".
    widths: bits of single matrices, by their names.
    steps, minutes: most steps or minutes of learning; steps=0 for error feedback instead.
    effort: how long to learn: "quick", "default" or "thorough".
    relative: weigh errors relative to the action's size.
    seed: seed of all random numbers.
    progress: called as progress(work, share); or True, False, or None for a bar in a notebook or on a terminal.

    Raises `actq.Error` if the policy, a recording or an option cannot be used, or a budget cannot be kept. Ctrl-C returns
    at once. What the command prints as notes goes to the log `actq`.
    """
    image, _ = measured(
        policy, recordings, heldout, progress, bits=bits, bpw=bpw, flash=flash, ms=ms, clock=clock, max_nmse=max_nmse,
        method=method, group=group, activations=activations, core=core, widths=widths, steps=steps, minutes=minutes,
        effort=effort, relative=relative, seed=seed,
    )  # fmt: skip
    return image


def measured(
    policy: Policy, recordings: Optional[Recordings], heldout: Optional[Recordings], progress: Progress, **options: Any
) -> Tuple[Image, Optional[float]]:
    """Quantizes, and returns the error on frames that the image did not learn from, or else on its recordings, too; `None`
    without any."""
    with reporter(progress) as report:
        image, nmse, warnings, notes = _actq.quantize(policy, recordings, heldout, request(**options), report)
    for warning in warnings:
        log.warning(warning)
    for note in notes:
        log.info(note)
    return image, nmse

"""Import of policies."""

from __future__ import annotations

import json
import logging
import os
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING, Any, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np

from . import _actq
from ._actq import Policy
from ._typing import Path as PathLike

if TYPE_CHECKING:
    import numpy.typing as npt
    import torch

    Source = Union[PathLike, torch.nn.Module, torch.jit.ScriptModule]
    Example = Union[torch.Tensor, Tuple[torch.Tensor, ...]]

log = logging.getLogger("actq")

#: Begins the error without torch.
NEEDS_TORCH = "modules and TorchScript files need"
#: File name extensions of TorchScript.
TORCHSCRIPT = {".pt", ".pth", ".ts", ".torchscript", ".jit"}


def import_policy(
    source: Source,
    example: Optional[Example] = None,
    *,
    output: Optional[str] = None,
    states: Optional[Mapping[str, str]] = None,
    observe: Sequence[str] = (),
    prefix: Sequence[str] = (),
    input_names: Optional[Sequence[str]] = None,
    output_names: Optional[Sequence[str]] = None,
    name: Optional[str] = None,
    accept_profile: bool = False,
    answers: Union[None, PathLike, Mapping[str, Any]] = None,
    profile: Optional[PathLike] = None,
    low: Optional[npt.ArrayLike] = None,
    high: Optional[npt.ArrayLike] = None,
    max_step: Optional[npt.ArrayLike] = None,
    rate_hz: Optional[float] = None,
    sampler: Optional[Mapping[str, Any]] = None,
) -> Policy:
    """Reads a policy.

    source: the path of an ONNX file, of a policy folder (docs/POLICY.md), of a deploy bundle (docs/DEPLOY.md) or of a
        TorchScript file; or a torch.nn.Module. Or a trained model: an algorithm of Stable-Baselines3, whose
        `predict(deterministic=True)` is read, with its VecNormalize; a runner of rsl_rl 5; an agent of CleanRL, whose
        mean action is read. A Dict of observations is one vector, in the order of the space's keys.
    example: of a module or TorchScript file, its input: a tensor [1, n_obs], or a tuple of the observation and the
        recurrent states, each with a batch of 1. A trained model needs none.
    output: of ONNX or a module, the output that is the action. The default is the one named "action", or the only
        candidate.
    states: of ONNX or a module, the inputs that hold recurrent state, each with the output of its next value.
    observe: of ONNX or a module, the inputs that are observed in each step, although they look like memory.
    prefix: of ONNX, the inputs that are keys and values from a host, as those of a large model: `Head.set_prefix` takes them.
    input_names, output_names: of a module, names of its inputs and outputs, for `output` and `states`. The default are
        the keys of a mapping or named tuple, else input_0 .. and output_0 .. .
    name: of a module, the policy's name; the default is its class.
    accept_profile, answers: of a bundle, the answers to what its files do not say, as `actq import` takes them: a path
        of a TOML file, or a mapping.
    profile: of a bundle, the path of the profile of your own deploy stack, a TOML file. With one of these three, an ONNX
        file is read as a bundle, by its metadata.
    low, high: limits of the actions, or of a bundle's targets, in their unit: a number, or one for each, as
        `env.action_space.low`. Of these and those in the source, the stricter ones hold. A motor controller refuses to arm
        without limits.
    max_step: largest change from one action to the next, a number, or one for each. A bundle takes none.
    rate_hz: actions in a second. A policy folder and a bundle state theirs.
    sampler: of an ONNX file with the network of a flow or a diffusion policy, its steps, as {"kind": "flow", "steps": 10,
        "time": {"from": 0, "to": 1}} (docs/POLICY.md, Flow and diffusion policies). The observation is the inputs but the
        time and the iterate.

    Of ONNX and modules, the log `actq` has the inputs in order, the output, and what is left out (level INFO).

    Copies of a module run on drawn observations, and the policy must give their actions. The module does not change.

    Raises `actq.Error` with the node, tensor, file or key that cannot be imported.
    """
    if states is not None and not isinstance(states, Mapping):
        raise _actq.Error(f"states is of type {type(states).__name__}; pass a mapping of inputs to outputs")
    for option, inputs in [("observe", observe), ("prefix", prefix)]:
        if isinstance(inputs, str):
            raise _actq.Error(f"{option} is the text {inputs!r}; pass a list of inputs")
    pairs = list((states or {}).items())
    limits = (_numbers("low", low), _numbers("high", high), _numbers("max_step", max_step))
    if rate_hz is not None and (isinstance(rate_hz, bool) or not isinstance(rate_hz, Real) or not 0 < rate_hz < float("inf")):
        raise _actq.Error(f"rate_hz is {rate_hz!r}; pass a number above 0")
    if isinstance(source, (str, os.PathLike)):
        if not os.fspath(source):
            raise _actq.Error("the path of the policy is empty")
        path = Path(source)
        if path.suffix == ".zip":
            raise _actq.Error(
                f"{path}: is an archive; load it with Stable-Baselines3 and its environment, which has the VecNormalize if there "
                "is one, and pass the model"
            )
        if path.suffix not in TORCHSCRIPT:
            given = {"example": example, "input_names": input_names, "output_names": output_names, "name": name}
            for key, value in given.items():
                if value is not None:
                    raise _actq.Error(f"{path}: only a module or a TorchScript file takes {key}")
            policy = _actq.import_path(
                path, output=output, states=pairs, observe=observe, prefix=prefix, limits=limits, rate_hz=rate_hz,
                accept_profile=accept_profile, answers=_toml(answers), profile=_text("profile", profile), sampler=_json(sampler),
            )  # fmt: skip
            return _logged(policy)
        if not path.is_file():
            raise _actq.Error(f"{path}: there is no such file")
        name = name or path.stem
        try:
            source = torch_module(NEEDS_TORCH).jit.load(str(path), map_location="cpu")
        except Exception as error:
            text = str(error).strip().split("\n")[0]
            raise _actq.Error(f"{path}: torch cannot read it as TorchScript: {text}; pass a module instead") from error
    elif not any(callable(getattr(source, has, None)) for has in ("forward", "predict", "get_inference_policy")):
        raise _actq.Error(f"the policy is of type {type(source).__name__}; pass a path, a torch.nn.Module or a trained model")
    if accept_profile or answers is not None or profile is not None:
        raise _actq.Error("only a deploy bundle takes accept_profile, answers and profile")
    if sampler is not None:
        raise _actq.Error("only an ONNX file takes sampler; export the module, with the iterate and the time as inputs")
    if len(prefix) > 0:
        raise _actq.Error("only an ONNX file takes prefix; export the module, with the keys and values as inputs")
    torch_module(NEEDS_TORCH)
    from . import _models
    from ._torch import import_module

    name = name or type(source).__name__
    model = _models.of(source, name)
    if model is None and not callable(getattr(source, "forward", None)):
        raise _actq.Error(f"the policy is of type {type(source).__name__}; pass a path, a torch.nn.Module or a trained model")
    if model is not None:
        source, example = model.module, model.example if example is None else example
        input_names, output_names = input_names or model.input_names, output_names or model.output_names
        limits = model.limits(limits, name)
    if example is None:
        raise _actq.Error(f"{name}: pass an example of the module's input, as torch.zeros(1, n_obs)")
    policy = import_module(
        source, example, name, output=output, states=pairs, observe=observe, input_names=input_names,
        output_names=output_names, limits=limits, rate_hz=rate_hz,
    )  # fmt: skip
    if model is not None:
        model.compare(policy, name, limits)
    return _logged(policy)


def _logged(policy: Policy) -> Policy:
    """Says what a policy has of its source."""
    for note in policy.refused:
        log.warning(note)
    if policy.ports:
        log.info(policy.ports.rstrip())
    return policy


def _numbers(name: str, value: Any) -> List[float]:
    """Returns the numbers of an argument, one after the other."""
    if value is None:
        return []
    try:
        numbers = np.asarray(value, np.float64).reshape(-1)
    except (TypeError, ValueError) as error:
        raise _actq.Error(f"{name}: {error}; pass a number, or one for each action") from error
    return [float(number) for number in numbers]


def torch_module(needed: str) -> Any:
    """Imports torch, or raises an error that begins with what needs it."""
    try:
        import torch
    except ImportError as error:
        raise _actq.Error(f"{needed} torch ({error}); install it by `pip install torch`") from error
    return torch


def _json(sampler: Optional[Mapping[str, Any]]) -> Optional[str]:
    try:
        return None if sampler is None else json.dumps(sampler, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise _actq.Error(f"sampler: {error}; pass a mapping of texts and numbers") from error


def _toml(answers: Union[None, PathLike, Mapping[str, Any]]) -> str:
    """Returns answers as TOML; JSON's numbers, texts and lists are also TOML's."""
    if answers is None:
        return ""
    if isinstance(answers, Mapping):
        return "".join(f"{key} = {_toml_value(key, value)}\n" for key, value in answers.items())
    return _text("answers", answers) or ""


def _text(name: str, path: Optional[PathLike]) -> Optional[str]:
    try:
        return None if path is None else Path(path).read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise _actq.Error(f"{name}: {path}: {error}") from error


def _toml_value(key: str, value: Any) -> str:
    # Numbers and arrays of numpy have the method.
    value = value.tolist() if hasattr(value, "tolist") else value
    if not isinstance(value, (bool, int, float, str, list, tuple)):
        raise _actq.Error(f"answers: {key} is of type {type(value).__name__}; pass a number, a text, a bool or a list")
    try:
        return json.dumps(value, ensure_ascii=False, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise _actq.Error(f"answers: {key}: {error}") from error

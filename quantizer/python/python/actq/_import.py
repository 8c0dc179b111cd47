"""Import of policies."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any, Mapping, Optional, Sequence, Tuple, Union

from . import _actq
from ._actq import Policy
from ._typing import Path as PathLike

if TYPE_CHECKING:
    import torch

    Source = Union[PathLike, torch.nn.Module, torch.jit.ScriptModule]
    Example = Union[torch.Tensor, Tuple[torch.Tensor, ...]]

#: File name extensions of TorchScript.
TORCHSCRIPT = {".pt", ".pth", ".ts", ".torchscript", ".jit"}


def import_policy(
    source: Source,
    example: Optional[Example] = None,
    *,
    output: Optional[str] = None,
    states: Optional[Mapping[str, str]] = None,
    input_names: Optional[Sequence[str]] = None,
    output_names: Optional[Sequence[str]] = None,
    name: Optional[str] = None,
    accept_profile: bool = False,
    answers: Union[None, PathLike, Mapping[str, Any]] = None,
) -> Policy:
    """Reads a policy.

    source: the path of an ONNX file, of a policy folder (docs/POLICY.md), of a deploy bundle (docs/DEPLOY.md) or of a
        TorchScript file; or a torch.nn.Module.
    example: of a module or TorchScript file, its input: a tensor [1, n_obs], or a tuple of the observation and the
        recurrent states, each with a batch of 1.
    output: of ONNX, the output that is the action. The default is the one named "action", or the only candidate.
    states: of ONNX or a module, the inputs that hold recurrent state, each with the output of its next value.
    input_names, output_names: of a module, names of its inputs and outputs, for `output` and `states`.
    name: of a module, the policy's name; the default is its class.
    accept_profile, answers: of a bundle, the answers to what its files do not say, as `actq import` takes them: a path
        of a TOML file, or a mapping.

    Raises `actq.Error` with the node, tensor, file or key that cannot be imported.
    """
    pairs = list((states or {}).items())
    if isinstance(source, (str, os.PathLike)):
        path = Path(source)
        if path.suffix not in TORCHSCRIPT:
            if example is not None:
                raise _actq.Error(f"{path}: only a module or a TorchScript file takes an example")
            return _actq.import_path(
                path, output=output, states=pairs, accept_profile=accept_profile, answers=_toml(answers)
            )
        import torch

        name = name or path.stem
        source = torch.jit.load(str(path), map_location="cpu")  # type: ignore[no-untyped-call]
    from ._torch import onnx_bytes

    name = name or type(source).__name__
    if example is None:
        raise _actq.Error(f"{name}: pass an example of the module's input, as torch.zeros(1, n_obs)")
    content = onnx_bytes(source, example, name, input_names, output_names)
    return _actq.import_onnx(content, name=name, output=output, states=pairs)


def _toml(answers: Union[None, PathLike, Mapping[str, Any]]) -> str:
    """Returns answers as TOML; JSON's numbers, texts and lists are also TOML's."""
    if answers is None:
        return ""
    if isinstance(answers, Mapping):
        return "".join(f"{key} = {json.dumps(value)}\n" for key, value in answers.items())
    return Path(answers).read_text()

"""Modules of torch as ONNX files."""

from __future__ import annotations

import io
import warnings
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, Dict, Optional, Sequence, Tuple

import torch

from ._actq import Error

if TYPE_CHECKING:
    from ._import import Example

#: The operator set of the tracing exporter.
OPSET = 17


def onnx_bytes(
    module: Any,
    example: Example,
    name: str,
    input_names: Optional[Sequence[str]],
    output_names: Optional[Sequence[str]],
) -> bytes:
    """Exports one step of a module, in evaluation mode, by torch's own exporters."""
    inputs = (example,) if isinstance(example, torch.Tensor) else tuple(example)
    device = next((parameter.device for parameter in module.parameters()), torch.device("cpu"))
    inputs = tuple(tensor.to(device) for tensor in inputs)
    names = {
        "input_names": list(input_names) if input_names else None,
        "output_names": list(output_names) if output_names else None,
    }
    training = module.training
    module.eval()
    try:
        with torch.no_grad(), warnings.catch_warnings():
            # The tracing exporter warns of its age, and that the batch is fixed.
            warnings.simplefilter("ignore")
            return _export(module, inputs, names)
    except (RuntimeError, torch.onnx.OnnxExporterError) as error:
        raise Error(f"{name}: torch cannot export the module: {error}") from error
    finally:
        module.train(training)


def _export(module: Any, inputs: Tuple[torch.Tensor, ...], names: Dict[str, Any]) -> bytes:
    """Tries the tracing exporter, which needs only torch, then that of torch.export, which knows more operators."""
    file = io.BytesIO()
    try:
        torch.onnx.export(module, inputs, file, opset_version=OPSET, dynamo=False, **names)  # type: ignore[arg-type]
    except RuntimeError:
        if isinstance(module, torch.jit.ScriptModule) or find_spec("onnxscript") is None:
            raise
        program = torch.onnx.export(module, inputs, dynamo=True, verbose=False, **names)
        assert program is not None, "without a file torch returns the program"
        return bytes(program.model_proto.SerializeToString())
    return file.getvalue()

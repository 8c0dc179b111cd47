"""Modules of torch as ONNX files."""

from __future__ import annotations

import io
import warnings
from typing import TYPE_CHECKING, Any, Optional, Sequence

import torch

if TYPE_CHECKING:
    from ._import import Example

#: The operator set of the file: the tracing exporter's newest.
OPSET = 17


def onnx_bytes(
    module: Any, example: Example, input_names: Optional[Sequence[str]], output_names: Optional[Sequence[str]]
) -> bytes:
    """Exports one step of a module, in evaluation mode, by torch's own tracing exporter."""
    inputs = (example,) if isinstance(example, torch.Tensor) else tuple(example)
    device = next((parameter.device for parameter in module.parameters()), torch.device("cpu"))
    training, file = module.training, io.BytesIO()
    module.eval()
    try:
        with torch.no_grad(), warnings.catch_warnings():
            # It warns of its age, and that the batch is fixed.
            warnings.simplefilter("ignore")
            torch.onnx.export(
                module,
                tuple(tensor.to(device) for tensor in inputs),
                file,  # type: ignore[arg-type]
                input_names=list(input_names) if input_names else None,
                output_names=list(output_names) if output_names else None,
                opset_version=OPSET,
                dynamo=False,
            )
    finally:
        module.train(training)
    return file.getvalue()

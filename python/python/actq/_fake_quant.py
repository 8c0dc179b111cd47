"""The network of an image as a module of torch."""

from __future__ import annotations

from typing import Any, Callable, Dict, List, Optional, Tuple, Union

import torch
from torch import nn
from torch.nn import functional as F

from ._actq import Error, Image

Tensors = Union[torch.Tensor, Tuple[torch.Tensor, ...]]

#: How the names of trained tensors begin. The others normalize observations, or belong to the action contract.
TRAINED = ("weight_", "bias_", "norm_weight_", "norm_bias_", "table_")


class FakeQuant(nn.Module):
    """The network of an image in torch: dequantized weights, and activations rounded as the image rounds them.

    image: the image; not one with a description (docs/DEPLOY.md).
    activations: `False` leaves the activations in float32, as `Image.to_onnx` does.

    `module(obs)` with obs [batch, obs_len] returns actions [batch, act_len], or [batch, chunk, act_len]: what the network
    gives, with scale, offset and limits. A recurrent network is called as `module(obs, state)` with state
    [batch, state_len], zeros at first, and returns (action, next_state). A flow or diffusion policy takes `noise=`
    [batch, noise_len].

    Weights, biases and those of norms are parameters, and gradients pass through the rounding: the module can be trained
    on. The normalization of observations and the action's scale, offset and limits are buffers: they stay. Its results
    differ from `Head` by float32's rounding of sums, and by what the contract does from step to step.
    """

    def __init__(self, image: Image, *, activations: bool = True) -> None:
        super().__init__()
        if not isinstance(image, Image):
            raise Error(f"the image is of type {type(image).__name__}; pass an actq.Image")
        network = image.network()
        self.activations = activations
        self.inputs: List[Tuple[str, int]] = network["inputs"]
        self.outputs: List[str] = [name for name, _ in network["outputs"]]
        self.nodes: List[Tuple[str, List[str], str, Dict[str, Any], Optional[int]]] = network["nodes"]
        self.constants: Dict[str, Any] = {}
        for name, array in network["tensors"].items():
            if array.dtype.kind == "i":
                self.constants[name] = array.tolist()
            elif name.startswith("number_"):
                self.constants[name] = float(array)
            elif name.startswith(TRAINED):
                self.register_parameter(name, nn.Parameter(torch.from_numpy(array)))
            else:
                self.register_buffer(name, torch.from_numpy(array))

    def forward(
        self, obs: torch.Tensor, state: Optional[torch.Tensor] = None, *, noise: Optional[torch.Tensor] = None
    ) -> Tensors:
        values: Dict[str, Any] = {**self.constants, **dict(self.named_parameters()), **dict(self.named_buffers())}
        given = {"obs": obs, "state": state, "noise": noise}
        for name, length in self.inputs:
            value = given[name]
            if value is None and name == "state":
                value = obs.new_zeros(obs.shape[0], length)
            if value is not None and not isinstance(value, torch.Tensor):
                raise Error(f"{name} is of type {type(value).__name__}; pass a tensor")
            if value is None or value.shape != (obs.shape[0], length):
                found = None if value is None else tuple(value.shape)
                raise Error(f"{name} is {found}; ({obs.shape[0]}, {length}) is needed")
            values[name] = value
        for op, inputs, output, attributes, x_max in self.nodes:
            x = [values[name] for name in inputs]
            if x_max is not None and self.activations:
                x[0] = rounded(x[0], x_max)
            values[output] = OPERATORS[op](*x, **attributes)
        results: Tuple[torch.Tensor, ...] = tuple(values[name] for name in self.outputs)
        return results if len(results) > 1 else results[0]


def rounded(x: torch.Tensor, x_max: int) -> torch.Tensor:
    """Rounds each row to whole multiples of its largest magnitude over `x_max`; gradients pass."""
    largest = x.detach().abs().amax(dim=-1, keepdim=True)
    step = torch.where(largest > 0, largest / x_max, torch.ones_like(largest))
    return x + (torch.round(x.detach() / step) * step - x.detach())


def _norm(
    x: torch.Tensor, weight: torch.Tensor, bias: torch.Tensor, axis: int, epsilon: float
) -> torch.Tensor:
    return F.layer_norm(x, weight.shape, weight, bias, epsilon)


def _slice(x: Any, starts: List[int], ends: List[int], axes: List[int]) -> Any:
    if isinstance(x, list):
        return x[starts[0] : ends[0]]
    return x.narrow(axes[0], starts[0], ends[0] - starts[0])


def _concat(*x: Any, axis: int) -> Any:
    # Shapes are lists.
    return sum(x, []) if isinstance(x[0], list) else torch.cat(x, dim=axis)


def _reshape(x: torch.Tensor, shape: List[int]) -> torch.Tensor:
    return x.reshape([x.shape[i] if length == 0 else length for i, length in enumerate(shape)])


#: The operators that an image's network has.
OPERATORS: Dict[str, Callable[..., Any]] = {
    "Add": lambda x, y: x + y,
    "Clip": lambda x, low, high: x.clamp(low, high),
    "Concat": _concat,
    "Cos": torch.cos,
    "Div": lambda x, y: x / y,
    "Elu": F.elu,
    "Erf": torch.erf,
    "Exp": torch.exp,
    "Expand": lambda x, shape: x.expand(shape),
    "Gemm": lambda x, weight, bias, transB: F.linear(x, weight, bias),
    "Identity": lambda x: x,
    "LayerNormalization": _norm,
    "Max": torch.maximum,
    "Min": torch.minimum,
    "Mul": lambda x, y: x * y,
    "ReduceMean": lambda x, axes, keepdims: x.mean(dim=axes, keepdim=bool(keepdims)),
    "Relu": torch.relu,
    "Reshape": _reshape,
    "Shape": lambda x: list(x.shape),
    "Sigmoid": torch.sigmoid,
    "Sin": torch.sin,
    "Slice": _slice,
    "Softplus": F.softplus,
    "Sqrt": torch.sqrt,
    "Sub": lambda x, y: x - y,
    "Tanh": torch.tanh,
}

"""The network of an image as a module of torch."""

from __future__ import annotations

from typing import Any, Callable, Dict, List, Optional, Tuple, Union

import numpy as np
import torch
from torch import nn
from torch.nn import functional as F

from ._actq import Error, Image

Tensors = Union[torch.Tensor, Tuple[torch.Tensor, ...]]

#: How the names of trained tensors begin. The others normalize observations, or belong to the action contract.
TRAINED = ("weight_", "bias_", "norm_weight_", "norm_bias_", "table_")

#: Parts of the grid of a weight, which begin the names of buffers: its steps, the distance between levels, the lowest and
#: the highest level of each row.
GRID = ("step", "distance", "low", "high")


class FakeQuant(nn.Module):
    """The network of an image in torch, to be trained further: weights and activations rounded as the image rounds them.

    image: the image; not one with a description (docs/DEPLOY.md).
    activations: `False` leaves the activations in float32, as `Image.to_onnx` does.

    `module(obs)` with obs [batch, obs_len] returns actions [batch, act_len], or [batch, chunk, act_len]: what the network
    gives, with scale, offset and limits. A recurrent network is called as `module(obs, state)` with state
    [batch, state_len], zeros at first, and returns (action, next_state). A flow or diffusion policy takes `noise=`
    [batch, noise_len].

    Weights, biases and those of norms are parameters, and gradients pass the rounding. A weight of the image is a level
    times the step of its row and group: the forward pass rounds the parameter to the nearest one. The steps are buffers:
    they stay, as the normalization of observations and the action's scale, offset and limits do, and the biases of
    layers without. `to_image` gives the image of the trained weights.

    Its results differ from `Head` by float32's rounding of sums, and by what the contract does from step to step.
    """

    def __init__(self, image: Image, *, activations: bool = True) -> None:
        super().__init__()
        if not isinstance(image, Image):
            raise Error(f"the image is of type {type(image).__name__}; pass an actq.Image")
        network = image.network()
        self.image, self.activations = image, activations
        self.inputs: List[Tuple[str, int]] = network["inputs"]
        self.outputs: List[str] = [name for name, _ in network["outputs"]]
        self.nodes: List[Tuple[str, List[str], str, Dict[str, Any], Optional[int]]] = network["nodes"]
        self.weights: List[str] = list(network["grids"])
        self.constants: Dict[str, Any] = {}
        for name, array in network["tensors"].items():
            if array.dtype.kind == "i":
                self.constants[name] = array.tolist()
            elif name.startswith("number_"):
                self.constants[name] = float(array)
            elif name.startswith(TRAINED) and not (name.startswith("bias_") and not array.any()):
                self.register_parameter(name, nn.Parameter(torch.from_numpy(array)))
            else:
                self.register_buffer(name, torch.from_numpy(array))
        for name, grid in network["grids"].items():
            for part, tensor in zip(GRID, _grid(*grid, columns=network["tensors"][name].shape[1])):
                self.register_buffer(f"{part}_{name}", tensor, persistent=False)

    def _levels(self, name: str, weight: torch.Tensor) -> torch.Tensor:
        """Returns the level nearest to each weight; ties go to the even code. Weights whose step is 0 have any."""
        step, distance, low, high = (self.get_buffer(f"{part}_{name}") for part in GRID)
        level = weight / torch.where(step > 0, step, torch.ones_like(step))
        return torch.minimum(torch.maximum(torch.round((level - low) / distance) * distance + low, low), high)

    def to_image(self) -> Image:
        """Returns the image with the trained weights: it has the weights that this module computes with.

        Everything else is that of the module's image, which remains; if sums would leave int32, int16 activations get fewer
        levels. The self-test is computed again, and `Image.source`
        is no policy's digest any more, unless nothing has changed. A signature of the old image is not one of the new.

        Raises `actq.Error` if a value is not finite, if shapes or values that are not trained have changed, or if
        sums leave int32 all the same.
        """
        original = self.image.network()["tensors"]
        if any(parameter.dtype not in (torch.float32, torch.float64) for parameter in self.parameters()):
            raise Error("the module has parameters of fewer bits than float32; call float() first")
        levels, floats = {}, {}
        for name, tensor in [*self.named_parameters(), *self.named_buffers()]:
            if name not in original:
                continue
            values = tensor.detach()
            if tuple(values.shape) != original[name].shape:
                raise Error(f"{name} has the shape {tuple(values.shape)}; that of the image is {original[name].shape}")
            if not isinstance(tensor, nn.Parameter):
                if not np.array_equal(values.cpu().numpy(), original[name]):
                    raise Error(f"{name} has changed, but only weights, biases, norms and tables go back to an image")
                continue
            if not torch.isfinite(values).all():
                raise Error(f"{name} has a value that is not finite; train with a smaller learning rate")
            if name.startswith("weight_"):
                levels[name] = self._levels(name, values).to(torch.int16).flatten().tolist()
            else:
                floats[name] = values.float().flatten().tolist()
        return self.image.retrained(levels, floats)

    def extra_repr(self) -> str:
        return f"{self.image!r}, activations={self.activations}"

    def forward(
        self, obs: torch.Tensor, state: Optional[torch.Tensor] = None, *, noise: Optional[torch.Tensor] = None
    ) -> Tensors:
        values: Dict[str, Any] = {**self.constants, **dict(self.named_parameters()), **dict(self.named_buffers())}
        for name in self.weights:
            step, weight = values[f"step_{name}"], values[name]
            values[name] = weight + (self._levels(name, weight.detach()) * step - weight.detach())
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
    # As the image does: a smaller vector counts as zero.
    step = torch.where(largest >= 2.0**-100, largest / x_max, torch.ones_like(largest))
    return x + (torch.round(x.detach() / step) * step - x.detach())


def _grid(steps: Any, group: int, bits: Any, *, columns: int) -> Tuple[torch.Tensor, ...]:
    """Returns the step of each weight, and for each row the distance between levels, the lowest and the highest: 8 bits
    have all whole numbers of int8, fewer have odd ones."""
    step = torch.from_numpy(steps).repeat_interleave(group, dim=1)[:, :columns].contiguous()
    is_whole = torch.from_numpy(bits.astype("int64") == 8)[:, None]
    top = torch.from_numpy(2.0 ** bits.astype("int64") - 1)[:, None].float()
    low, high = torch.where(is_whole, -128.0, -top), torch.where(is_whole, 127.0, top)
    return step, torch.where(is_whole, 1.0, 2.0), low, high


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

"""Errors of actq's elementwise functions, and what they may change in the output of a module."""

from __future__ import annotations

import re
from typing import Any, Callable, Iterator, List, Sequence, cast

import numpy as np
import torch

from ._typing import Array

#: Largest errors of actq's functions (kernels/src/math/mod.rs) by torch's names of their gradients: absolute errors, times the
#: magnitude of the argument where it is above 1. Torch's own are relative, so that actions that are tiny may differ by more.
ERRORS = {
    "Tanh": 1.5e-7,
    "Elu": 1.2e-7,
    "Sigmoid": 1.1e-7,
    "Silu": 1.4e-7,
    "Gelu": 1.8e-7,
    "Softplus": 1.6e-7,
    "Mish": 1.5e-7,
    "Sin": 1.5e-7,
    "Cos": 1.5e-7,
}
#: Multiple of a tolerance that no errors of functions and roundings explain.
HOPELESS = 1e3


def beyond(
    difference: Array,
    tolerance: Array,
    output: Callable[[Sequence[torch.Tensor]], torch.Tensor],
    inputs: Callable[[int], Sequence[torch.Tensor]],
) -> Array:
    """Returns absolute differences [row, value] less what errors of functions may change, where they exceed their tolerances.

    output: computes the values of a row; inputs: gives the inputs of a row by its number.
    """
    left = np.array(difference)
    for row in np.flatnonzero((difference > tolerance).any(axis=1)):
        values = np.flatnonzero(difference[row] > tolerance[row])
        left[row, values] = np.maximum(left[row, values] - bounds(output, inputs(int(row)), values), 0.0)
        if (left[row] > HOPELESS * tolerance[row]).any():
            break
    return left


def bounds(output: Callable[[Sequence[torch.Tensor]], torch.Tensor], inputs: Sequence[torch.Tensor], values: Array) -> Array:
    """Returns how much the errors of all functions may change each of these values together: to the first order, the sum over
    all elements of functions of |d value / d element| times the element's largest error. 0 if it has no gradients."""
    found, script = np.zeros(len(values)), cast(Any, torch.jit)
    # Scripts without fused functions, which have no names.
    with torch.enable_grad(), script.optimized_execution(False):
        leaves = [value.detach().clone().requires_grad_(value.is_floating_point()) for value in inputs]
        try:
            # Not the leaves themselves, which no operation may change in place.
            flat = output([leaf + 0 if leaf.requires_grad else leaf for leaf in leaves]).reshape(-1)
        except Exception:
            return found
        sums: List[torch.Tensor] = []
        for node, error in _functions(flat.grad_fn):
            node.register_prehook(lambda gradients, error=error: sums.append((gradients[0].abs() * error).sum()))
        known = [leaf for leaf in leaves if leaf.requires_grad]
        for i, value in enumerate(values):
            sums.clear()
            if flat.requires_grad:
                torch.autograd.grad(flat[int(value)], known, retain_graph=True, allow_unused=True)
            found[i] = float(sum(sums))
    return found


def _functions(last: Any) -> Iterator[Any]:
    """Yields the elementwise functions that a gradient passes, each with its largest error, or the elements' errors."""
    left, seen = [last], {None}
    while left:
        node = left.pop()
        if node in seen:
            continue
        seen.add(node)
        left.extend(before for before, _ in node.next_functions)
        kind = re.sub(r"Backward\d*$", "", node.name())
        if kind in ERRORS:
            error: Any = ERRORS[kind]
            if kind == "Elu":
                error *= abs(node._saved_alpha * node._saved_scale)
            elif kind == "Softplus":
                error *= (node._saved_beta * node._saved_self.detach()).abs().clamp(min=1.0) / node._saved_beta
            elif kind not in ("Tanh", "Sigmoid"):
                error = error * node._saved_self.detach().abs().clamp(min=1.0)
            yield node, error

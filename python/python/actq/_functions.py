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

Output = Callable[[Sequence[torch.Tensor]], torch.Tensor]


def beyond(
    difference: Array,
    tolerance: Array,
    output: Output,
    inputs: Callable[[int], Sequence[torch.Tensor]],
    hopeless: float = HOPELESS,
) -> Array:
    """Returns absolute differences [row, value] less what errors of functions may change, where they exceed their tolerances.

    output: computes the values of a row; inputs: gives the inputs of a row by its number.
    hopeless: ends with the first value of which more than this multiple of its tolerance is left.
    """
    left, shares = np.array(difference), difference / tolerance
    for row in np.flatnonzero((shares > 1).any(axis=1)):
        # The worst first.
        values = np.argsort(-shares[row])[: (shares[row] > 1).sum()]
        for value, bound in zip(values, bounds(output, inputs(int(row)), values)):
            left[row, value] = max(left[row, value] - bound, 0.0)
            if left[row, value] > hopeless * tolerance[row, value]:
                return left
    return left


def bounds(output: Output, inputs: Sequence[torch.Tensor], values: Array) -> Iterator[float]:
    """Yields how much the errors of all functions may change each of these values together: to the first order, the sum over
    all elements of functions of |d value / d element| times the element's largest error. Nothing if it has no gradients."""
    # Scripts without fused functions, which have no names.
    with torch.enable_grad(), cast(Any, torch.jit).optimized_execution(False):
        leaves = [value.detach().clone().requires_grad_(value.is_floating_point()) for value in inputs]
        try:
            # Not the leaves themselves, which no operation may change in place.
            flat = output([leaf + 0 if leaf.requires_grad else leaf for leaf in leaves]).reshape(-1)
        except Exception:
            return
    sums: List[torch.Tensor] = []
    for node, error in _functions(flat.grad_fn):
        node.register_prehook(lambda gradients, error=error: sums.append((gradients[0].abs() * error).sum()))
    known = [leaf for leaf in leaves if leaf.requires_grad]
    for value in values:
        sums.clear()
        if flat.requires_grad:
            try:
                with torch.enable_grad():
                    torch.autograd.grad(flat[int(value)], known, retain_graph=True, allow_unused=True)
            except RuntimeError:
                # A module that changes its states in place.
                return
        yield float(sum(sums))


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

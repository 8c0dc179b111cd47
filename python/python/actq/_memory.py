"""Values that a module keeps from step to step."""

from __future__ import annotations

from collections import deque
from typing import Any, Callable, Dict, List, Sequence, Tuple

import numpy as np
import torch

from ._typing import Array

#: Added to a value to find out if the action depends on it: more than counters and clocks reach in some hundred steps.
OFFSET = 1000
#: Attributes of every module.
OWN = set(vars(torch.nn.Module()))


def changed_values(fresh: Any, used: Any) -> List[str]:
    """Names the values in which two copies of a module differ: buffers, parameters and attributes."""
    before, after = values_of(fresh), values_of(used)
    return [name for name in after if name not in before or not _same(before[name][2], after[name][2], depth=4)]


def kept_tensors(module: Any, changed: Sequence[str]) -> Dict[str, List[torch.Tensor]]:
    """Returns the floating-point tensors of changed values by name; a tuple or list has several."""
    found, all_values = {}, values_of(module)
    for name in changed:
        _, _, value = all_values[name]
        values = list(value) if isinstance(value, (tuple, list)) else [value]
        if values and all(isinstance(item, torch.Tensor) and item.is_floating_point() for item in values):
            found[name] = values
    return found


def depends_on(
    used: Any, changed: Sequence[str], run: Callable[[], Array], expected: Array, share: Callable[[Array, Array], float]
) -> bool:
    """Returns `True` if the actions of `run` change with these values of the module, which it overwrites."""
    values = values_of(used)
    for part, name, value in (values[name] for name in changed):
        moved = _moved(value)
        if moved is not value:
            setattr(part, name, moved)
    try:
        return share(run() - expected, expected) > 1e-5
    except Exception:
        # As an index that is out of range.
        return True


def values_of(module: Any) -> Dict[str, Tuple[Any, str, Any]]:
    """Returns all values of a module by name, each with its submodule and its name there."""
    found: Dict[str, Tuple[Any, str, Any]] = {}
    for prefix, part in module.named_modules():
        own = {} if isinstance(part, torch.jit.ScriptModule) else {k: v for k, v in vars(part).items() if k not in OWN}
        tensors = dict(part.named_buffers(recurse=False), **dict(part.named_parameters(recurse=False)))
        for name, value in {**own, **tensors}.items():
            if not isinstance(value, torch.nn.Module):
                found[f"{prefix}.{name}".lstrip(".")] = (part, name, value)
    return found


def wrapped(tensor: torch.Tensor) -> List[torch.Tensor]:
    """Returns the tensors inside a wrapper, as of quantized weights, which knows few operations itself."""
    names, _ = getattr(tensor, "__tensor_flatten__", lambda: ([], None))()
    return [getattr(tensor, name) for name in names]


def _same(a: Any, b: Any, depth: int) -> bool:
    if isinstance(a, torch.Tensor) and isinstance(b, torch.Tensor):
        inside, other = wrapped(a), wrapped(b)
        if inside or other:
            return len(inside) == len(other) and all(_same(x, y, depth) for x, y in zip(inside, other))
        return a.shape == b.shape and bool(((a == b) | ((a != a) & (b != b))).all())
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        return a.tobytes() == b.tobytes()
    if type(a) is not type(b):
        return False
    if isinstance(a, (int, float, str)):
        return a == b or a != a
    if isinstance(a, dict):
        return _same(list(a.values()), list(b.values()), depth)
    if isinstance(a, (list, tuple, deque)):
        return len(a) == len(b) and (depth == 0 or all(_same(x, y, depth - 1) for x, y in zip(a, b)))
    return True


def _moved(value: Any) -> Any:
    """Returns the value with an offset; a tensor is moved in place."""
    if isinstance(value, torch.Tensor):
        return value.logical_not_() if value.dtype == torch.bool else value.add_(OFFSET)
    if isinstance(value, bool):
        return not value
    if isinstance(value, (int, float, np.ndarray)):
        return value + OFFSET
    if isinstance(value, dict):
        return {key: _moved(item) for key, item in value.items()}
    if isinstance(value, deque):
        return deque(map(_moved, value), value.maxlen)
    # Not a named tuple.
    return type(value)(map(_moved, value)) if type(value) in (list, tuple) else value

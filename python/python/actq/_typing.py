"""Types of arguments."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, List, Mapping, Tuple, Union

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    import torch

Path = Union[str, "os.PathLike[str]"]
Floats = npt.NDArray[np.float32]
Array = npt.NDArray[Any]
#: What numpy makes an array of, and tensors of torch.
Values = Union[Array, "torch.Tensor"]
#: Lowest and highest values, and largest steps: none, one for all, or one for each.
Limits = Tuple[List[float], List[float], List[float]]
#: A recording, or several; `actq.quantize` describes them.
Recording = Union[Values, Tuple[Values, Values], Mapping[str, Values], Path]
Recordings = Union[Recording, List[Recording]]

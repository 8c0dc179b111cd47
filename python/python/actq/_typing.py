"""Types of arguments."""

from __future__ import annotations

import os
from typing import Any, List, Mapping, Tuple, Union

import numpy as np
import numpy.typing as npt

Path = Union[str, "os.PathLike[str]"]
Floats = npt.NDArray[np.float32]
Array = npt.NDArray[Any]
#: Lowest and highest values, and largest steps: none, one for all, or one for each.
Limits = Tuple[List[float], List[float], List[float]]
#: A recording, or several; `actq.quantize` describes them.
Recording = Union[Array, Tuple[Array, Array], Mapping[str, Array], Path]
Recordings = Union[Recording, List[Recording]]

"""Arrays of the caller, checked before they go to Rust."""

from __future__ import annotations

from typing import Any, Tuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]


def floats(value: Any, name: str, dimensions: Tuple[int, ...], *, finite: bool = True) -> Floats:
    """``value`` as a float32 array in C order, without a copy where it is one already.

    NumPy arrays, and whatever gives itself as one (torch and JAX on the CPU, by the array protocol or DLPack). ValueError for another
    number of dimensions or type of number, no element, and numbers that are not finite.
    """
    if not hasattr(value, "__array__") and hasattr(value, "__dlpack__"):
        array = np.from_dlpack(value)
    else:
        array = np.asarray(value)
    if array.dtype.kind != "f":
        raise ValueError(f"{name}: dtype is {array.dtype}; allowed: float32 (float16 and float64 are converted)")
    if array.ndim not in dimensions:
        allowed = " or ".join(map(str, dimensions))
        raise ValueError(f"{name}: shape is {array.shape}; allowed: {allowed} dimensions")
    if array.size == 0:
        raise ValueError(f"{name}: shape is {array.shape}; allowed: at least one element")
    given: Floats = np.ascontiguousarray(array, dtype=np.float32)
    if finite and not np.isfinite(given).all():
        place = tuple(map(int, np.argwhere(~np.isfinite(given))[0]))
        raise ValueError(f"{name}: element {place} is {given[place]}; allowed: finite numbers")
    return given

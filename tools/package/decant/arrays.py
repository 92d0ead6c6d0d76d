"""Arrays of any library to NumPy arrays of the host."""

from __future__ import annotations

from typing import Any

import numpy as np

# How libraries bring an array to the host, where DLPack alone does not: cupy, torch, warp.
_METHODS = ("get", "cpu", "numpy")


def on_host(values: Any) -> np.ndarray:
    """A NumPy array of `values`: anything with __array__ or __dlpack__, on any device (numpy, torch, cupy, warp, jax).

    Raises TypeError where it is no array.
    """
    if isinstance(values, np.ndarray):
        return values
    device = getattr(values, "__dlpack_device__", None)
    if device is not None and int(device()[0]) == 1:  # kDLCPU
        detached = values.detach() if hasattr(values, "detach") else values
        try:
            return np.from_dlpack(detached)
        except (BufferError, RuntimeError, TypeError):
            pass  # a dtype or layout that DLPack has no name for
    for method in _METHODS if device is not None else ():
        brought = getattr(values.detach() if hasattr(values, "detach") else values, method, None)
        if brought is not None:
            return on_host(brought())
    array = np.asarray(values)
    if array.dtype == object:
        raise TypeError(f"{type(values).__name__} is no array of numbers")
    return array


def checked(values: Any, shape: tuple[int, ...], dtype: type, what: str) -> np.ndarray:
    """The same in C order, of that shape, as `dtype`. Integers may not come as floats.

    Raises TypeError or ValueError that names `what`.
    """
    try:
        array = on_host(values)
    except TypeError as error:
        raise TypeError(f"{what}: {error}") from None
    if array.shape != shape:
        raise ValueError(f"{what} has shape {list(array.shape)}, not {list(shape)}")
    if array.dtype.kind == "V" and array.dtype.names is None:  # bfloat16 and its like, of ml_dtypes
        array = array.astype(np.float64)
    kinds = "iu" if dtype is np.int64 else "fiu"
    if array.size and array.dtype.kind not in kinds:
        raise TypeError(f"{what} has dtype {array.dtype}, not {'integers' if kinds == 'iu' else 'reals'}")
    return np.ascontiguousarray(array, dtype=dtype)

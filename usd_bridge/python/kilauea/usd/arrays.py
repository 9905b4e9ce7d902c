"""USD values as buffers that the engine reads in place."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Gf, Usd

from kilauea import payload


def floats(value: Any) -> NDArray[np.float32]:
    """Return a value or array of any real type as float32; a view where it is that already."""
    return np.ascontiguousarray(np.asarray(value), dtype=np.float32)


def ints(value: Any) -> NDArray[np.int32]:
    """Return an array of any integer type as int32; a view where it is that already."""
    return np.ascontiguousarray(np.asarray(value), dtype=np.int32)


def read_floats(attribute: Usd.Attribute, time: Usd.TimeCode) -> NDArray[np.float32]:
    """Read a numeric array attribute; empty without a value."""
    value = attribute.Get(time) if attribute else None
    return np.empty(0, np.float32) if value is None else floats(value)


def read_points(attribute: Usd.Attribute, time: Usd.TimeCode) -> NDArray[np.float32]:
    """Read an array of 3-vectors as (n, 3)."""
    return read_floats(attribute, time).reshape(-1, 3)


def read_ints(attribute: Usd.Attribute, time: Usd.TimeCode) -> NDArray[np.int32]:
    """Read an integer array attribute; empty without a value."""
    value = attribute.Get(time) if attribute else None
    return np.empty(0, np.int32) if value is None else ints(value)


def matrix(value: Gf.Matrix4d) -> payload.Matrix:
    """Return a matrix as the payload has it."""
    return tuple(np.array(value).ravel().tolist())


def indices_within(indices: NDArray[np.int32], n_values: int) -> bool:
    """Return whether every index has a value."""
    return not len(indices) or bool(indices.min() >= 0 and indices.max() < n_values)

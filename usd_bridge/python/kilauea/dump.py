"""A frame as readable text: what the engine would receive."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import re
from typing import Any

import numpy as np

from kilauea.payload import Frame

_LISTED_VALUES = 16
_NUMBERS = re.compile(r"\[\s+([-+.\deE,\s]+?)\s+\]")


def as_text(frame: Frame) -> str:
    """Write a frame as JSON, lists of numbers on one line, long arrays summarised."""
    text = json.dumps(_describe(frame), indent=1)
    return _NUMBERS.sub(lambda match: "[" + " ".join(match[1].split()) + "]", text)


def _describe(value: Any) -> Any:
    if dataclasses.is_dataclass(value):
        return {f.name: _describe(getattr(value, f.name)) for f in dataclasses.fields(value)}
    if isinstance(value, dict):
        return {key: _describe(v) for key, v in value.items()}
    if isinstance(value, np.ndarray):
        return _summary(value)
    if isinstance(value, (list, tuple)):
        return [_describe(v) for v in value]
    return value


def _summary(array: np.ndarray[Any, Any]) -> Any:
    """Give small arrays as they are, others by shape, range and hash of their bytes."""
    if array.size <= _LISTED_VALUES:
        return array.tolist()
    return {
        "shape": list(array.shape),
        "type": str(array.dtype),
        "min": array.min().item(),
        "max": array.max().item(),
        "sha256": hashlib.sha256(array.tobytes()).hexdigest()[:16],
    }

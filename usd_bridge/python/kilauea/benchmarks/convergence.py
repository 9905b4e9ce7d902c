"""Curves of error against time: slope, error at a time, time to an error, efficiency.

All work on logarithms, in which the error of unbiased sampling is a line of slope -1. Beyond the
measured points a curve goes on with that slope.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from statistics import linear_regression

import numpy as np

Point = tuple[float, float]
"""Seconds and error, both above zero."""


def slope(points: Sequence[Point]) -> float | None:
    """Fit `error = c time^slope`; None for fewer than two times."""
    usable = _logarithms(points)
    if len({x for x, _ in usable}) < 2:
        return None
    return linear_regression(*zip(*usable, strict=True)).slope


def efficiency(seconds: float, mse: float) -> float | None:
    """Return `1 / (MSE t)`: how many times better in equal time, where slopes are -1."""
    return 1.0 / (mse * seconds) if mse * seconds > 0.0 else None


def error_at(points: Sequence[Point], seconds: float) -> float | None:
    """Return the error after a time; None without a point."""
    return _follow(_logarithms(points), seconds)


def time_to(points: Sequence[Point], error: float) -> float | None:
    """Return the time until an error is reached; None without a point.

    Noise may make a curve rise; the time is where it is below for good.
    """
    falling: list[Point] = []
    for x, y in reversed(_logarithms(points)):
        if not falling or y > falling[-1][1]:
            falling.append((x, y))
    return _follow([(y, x) for x, y in falling], error)


def _follow(points: list[Point], x: float) -> float | None:
    """Interpolate between points of ascending first coordinate, with slope -1 outside."""
    if not points or x <= 0.0:
        return None
    xs, ys = zip(*points, strict=True)
    at = math.log(x)
    outside = min(at - xs[0], 0.0) + max(at - xs[-1], 0.0)
    return math.exp(float(np.interp(at, xs, ys)) - outside)


def _logarithms(points: Sequence[Point]) -> list[Point]:
    return sorted((math.log(x), math.log(y)) for x, y in points if x > 0.0 and y > 0.0)

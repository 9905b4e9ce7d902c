"""At which times moving things are read while the shutter is open."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Gf, Usd, UsdGeom

MAX_INTERVALS = 16
"""Motion keys a prim has at most, less one."""
_STRAIGHT = 5e-3
"""How far a transform may be off half-way between two keys, relative to its size."""
_ON_GRID = 1e-3
"""How far from a key an authored sample may be, in intervals."""

Array = NDArray[Any]


@dataclass(slots=True)
class MotionSampler:
    """Gives motion keys: evenly spaced over the shutter, the first at its opening.

    A thing that stands still has a single key. Everything else is read at the frame's time.
    """

    frame: float
    """Time code."""
    shutter: tuple[float, float] | None = None
    """Opening and closing in time codes relative to the frame; None where nothing blurs."""
    _xforms: dict[float, UsdGeom.XformCache] = field(default_factory=dict)

    @property
    def frame_position(self) -> float:
        """Where the frame is between opening and closing, 0 to 1."""
        if self.shutter is None:
            return 0.0
        opens, closes = self.shutter
        return min(max(-opens / (closes - opens), 0.0), 1.0)

    def times(
        self, prim: Usd.Prim, attributes: Iterable[Usd.Attribute], n_intervals: int = 1
    ) -> list[float]:
        """Return times to read a prim at: the frame alone where no attribute may vary.

        The keys fall on the authored samples where an even grid can; `n_intervals` is the least.
        """
        if self.shutter is None:
            return [self.frame]
        varying = [a for a in attributes if a and a.ValueMightBeTimeVarying()]
        if not varying:
            return [self.frame]
        ends = self._ends(prim)
        within = Gf.Interval(*ends)
        samples = {t for a in varying for t in a.GetTimeSamplesInInterval(within)}
        return self._grid(ends, samples, n_intervals)

    def evenly_spaced(self, prim: Usd.Prim, n_intervals: int) -> list[float]:
        """Return times at which to read what moves by itself, by a velocity."""
        if self.shutter is None:
            return [self.frame]
        return self._grid(self._ends(prim), set(), n_intervals)

    def matrices(self, times: list[float], evaluate: Callable[[float], Array]) -> list[Array]:
        """Evaluate transforms at times, and between them where they turn: keys are linear."""
        values = [evaluate(t) for t in times]
        if len(times) == 1:
            return values
        while len(times) - 1 <= MAX_INTERVALS // 2:
            middles = [(a + b) / 2 for a, b in itertools.pairwise(times)]
            between = [evaluate(t) for t in middles]
            if _are_straight(values, between):
                break
            times = [*_interleaved(times, middles)]
            values = [*_interleaved(values, between)]
        return moving(values)

    def xforms(self, time: float | None = None) -> UsdGeom.XformCache:
        """Return the transforms at a time, by default the frame's, kept for the next prim."""
        time = self.frame if time is None else time
        if time not in self._xforms:
            self._xforms[time] = UsdGeom.XformCache(Usd.TimeCode(time))
        return self._xforms[time]

    def _ends(self, prim: Usd.Prim) -> tuple[float, float]:
        """Return when the shutter opens and closes for a prim, scaled by its MotionAPI."""
        opens, closes = self.shutter or (0.0, 0.0)
        scale = float(UsdGeom.MotionAPI(prim).ComputeMotionBlurScale(Usd.TimeCode(self.frame)))
        return self.frame + scale * opens, self.frame + scale * closes

    def _grid(self, ends: tuple[float, float], samples: set[float], at_least: int) -> list[float]:
        opens, closes = ends
        if closes <= opens:
            return [self.frame]
        inside = [(t - opens) / (closes - opens) for t in samples if opens < t < closes]
        n = _intervals(np.array(inside), at_least)
        return [opens + (closes - opens) * i / n for i in range(n + 1)]


def moving(keys: list[Array]) -> list[Array]:
    """Return the keys, or the first alone where all are the same."""
    if all(np.array_equal(keys[0], key) for key in keys[1:]):
        return keys[:1]
    return keys


def _intervals(positions: Array, at_least: int) -> int:
    """Return the smallest number of intervals whose ends meet all positions, if there is one."""
    for n in range(at_least, MAX_INTERVALS + 1):
        scaled = positions * n
        if np.all(np.abs(scaled - np.round(scaled)) < _ON_GRID):
            return n
    return min(max(2 * len(positions), at_least), MAX_INTERVALS)


def _are_straight(keys: list[Array], between: list[Array]) -> bool:
    """Return whether matrices half-way are close to the means of their neighbours."""
    means = (np.array(keys[:-1]) + np.array(keys[1:])) / 2
    off = np.abs(means - np.array(between))
    linear = np.abs(means[..., :3, :3]).max(axis=(-1, -2), keepdims=True)
    travel = np.abs(keys[-1] - keys[0])[..., 3:, :3].max(axis=-1, keepdims=True)
    return bool(np.all(off <= _STRAIGHT * np.maximum(linear, travel)))


def _interleaved(outer: list[Any], inner: list[Any]) -> Iterable[Any]:
    for a, b in zip(outer, inner, strict=False):
        yield a
        yield b
    yield outer[-1]

"""Whether means differ by more than a margin, and which differences could have been found.

The hypothesis is |a - b| <= margin, tested by Welch's t-test at the margin on either side: a test
of a minimum effect (Murphy and Myors 1999). Without a margin it is the usual two-sided test.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kilauea.checking.images import Floats, Measured
from kilauea.statistics import sidak, two_sided_p, welch_t

ROUNDING = 1e-6
"""Relative error that 32-bit images have anyway."""
DARK = 0.1
"""What is darker than this part of the mean light is measured against that part."""


@dataclass(frozen=True)
class BiasTest:
    """Differences of many means, tested together; all relative to the scale."""

    difference: Floats
    error_ours: Floats
    """Standard error of our means."""
    error_reference: Floats
    t: Floats
    """Welch's t of the plain difference."""
    p: Floats
    """Two-sided p of the plain difference; uniform where the engines agree."""
    p_margin: Floats
    """Largest probability of such a difference among true ones within the margin."""
    dof: Floats
    margin: float
    level: float
    """That a single p must fall below, by Šidák's correction."""
    power: float

    @property
    def error(self) -> Floats:
        """Standard error of the difference."""
        return np.hypot(self.error_ours, self.error_reference)

    @property
    def is_significant(self) -> NDArray[np.bool_]:
        """Which differences are beyond the margin."""
        return self.p_margin < self.level

    @cached_property
    def errors_needed(self) -> Floats:
        """Standard errors by which a bias must exceed the margin to be found so often."""
        return _quantile(self.level, self.dof) + _quantile(1.0 - self.power, self.dof)

    @property
    def detectable(self) -> Floats:
        """The bias that would be found with the probability `power`."""
        return self.margin + self.errors_needed * self.error

    @cached_property
    def half_width(self) -> Floats:
        """Half of the interval that holds all true differences, at the level of the test."""
        return _quantile(0.5 * self.level, self.dof) * self.error


def scale_of(reference: Floats, image_mean: float) -> Floats:
    """Return what differences are relative to: the reference, with a floor in the dark."""
    return np.maximum(np.abs(reference), max(DARK * image_mean, math.ulp(0.0)))


def compare_means(
    ours: Measured,
    reference: Measured,
    scale: Floats | float,
    margin: float,
    significance: float,
    power: float,
) -> BiasTest:
    """Test all means together, at the level `significance` for the group."""
    rounding = (ROUNDING * np.asarray(scale)) ** 2
    counts: Any = (ours.n, reference.n)
    variance_ours = ours.variance + rounding
    spreads = (variance_ours * ours.n, reference.variance * reference.n)

    def welch(difference: Any) -> tuple[Floats, Floats]:
        return welch_t(difference, spreads[0], counts[0], 0.0, spreads[1], counts[1])

    difference = ours.mean - reference.mean
    t, dof = welch(difference)
    beyond, _ = welch(np.abs(difference) - _finite(margin) * scale)
    other_side, _ = welch(np.abs(difference) + _finite(margin) * scale)
    return BiasTest(
        difference / scale,
        np.sqrt(variance_ours) / scale,
        np.sqrt(reference.variance) / scale,
        t,
        two_sided_p(t, dof),
        _upper_tail(beyond, dof) + _upper_tail(other_side, dof),
        dof,
        margin,
        sidak(significance, difference.size),
        power,
    )


def _finite(margin: float) -> float:
    return margin if math.isfinite(margin) else 1e30


def _upper_tail(t: Floats, dof: Floats) -> Floats:
    half = 0.5 * two_sided_p(t, dof)
    return np.where(t >= 0.0, half, 1.0 - half)


def _quantile(tail: float, dof: Floats) -> Floats:
    """Return the t with so much probability above it, interpolated over 1 / dof."""
    inverse = 1.0 / dof
    knots = np.linspace(inverse.min(), inverse.max(), 1 if np.ptp(inverse) == 0.0 else 9)
    low, high = np.zeros_like(knots), np.full_like(knots, 1e4)
    for _ in range(40):
        middle = 0.5 * (low + high)
        is_above = _upper_tail(middle, 1.0 / knots) > tail
        low, high = np.where(is_above, middle, low), np.where(is_above, high, middle)
    return np.interp(inverse, knots, high)

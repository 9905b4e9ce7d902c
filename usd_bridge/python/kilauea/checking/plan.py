"""How many samples it takes to notice the biases that must not go unnoticed."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from kilauea.checking.bias import BiasTest
from kilauea.checking.compare import Light
from kilauea.checking.criteria import TILES_COVERED, Criteria
from kilauea.checking.images import Batches, Floats


@dataclass(frozen=True, slots=True)
class Budget:
    """Samples per pixel and engine, in all batches of a round together."""

    batches: int = 16
    first: int = 64
    """Of the first round, which measures the noise."""
    last: int = 4096
    """Never more than so many."""
    is_fixed: bool = False
    """The last round takes them all, whether needed or not."""


def samples_wanted(light: Light, samples: int, criteria: Criteria) -> float:
    """Return the samples per pixel that suffice, infinite where the reference is too noisy.

    Variances fall with the samples, at least; those of a stored reference stay.
    """
    is_stored = not isinstance(light.reference, Batches)
    of_image = _growth(light.image, criteria.image_bias, is_stored).max()
    of_tiles = np.quantile(
        _growth(light.tiles, criteria.tile_bias, is_stored), TILES_COVERED, method="higher"
    )
    return samples * float(max(of_image, of_tiles))


def round_up(samples: float, budget: Budget) -> int:
    """Return samples per batch: a power of two, for which Sobol points are best."""
    most = 2 ** int(math.log2(max(budget.last / budget.batches, 1.0)))
    if samples >= most * budget.batches:
        return most
    return 2 ** math.ceil(math.log2(max(samples / budget.batches, 1.0)))


def _growth(test: BiasTest, bias: float, reference_is_stored: bool) -> Floats:
    """Return by how much the samples must grow for each mean."""
    if math.isinf(test.margin) or math.isinf(bias):
        return np.zeros_like(test.error)
    variance_allowed = ((bias - test.margin) / test.errors_needed) ** 2
    if not reference_is_stored:
        return test.error**2 / variance_allowed
    left = variance_allowed - test.error_reference**2
    with np.errstate(divide="ignore"):
        return np.where(left > 0.0, test.error_ours**2 / np.maximum(left, 0.0), np.inf)

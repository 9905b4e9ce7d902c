"""Whether two engines converge to the same image: Welch's test in every tile.

Renders of one engine with different seeds are observations. A tile's mean averages over many
pixels, so that a few renders tell small differences, and it holds where neighbouring pixels
depend on each other.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from kilauea.benchmarks.image_error import Pixels
from kilauea.statistics import sidak, two_sided_p, welch_t

TILE = 32
"""Pixels of a tile's sides; the last row and column may have less."""
LEVEL = 0.01
"""Of all tests together."""


@dataclass(frozen=True, slots=True)
class Agreement:
    """What the tests of two engines found."""

    engines: tuple[str, str]
    n_tests: int
    """Tiles times channels."""
    n_rejected: int
    smallest_p: float
    mean_ratio: tuple[float, ...]
    """Mean of the first over that of the second, by channel."""
    standard_error: float
    """Median over the tests of the difference's standard error, relative to the mean."""

    @property
    def agrees(self) -> bool:
        """Whether no tile differs by more than chance explains."""
        return self.n_rejected == 0

    def record(self) -> dict[str, Any]:
        """Return the fields, for JSON."""
        return asdict(self) | {"agrees": self.agrees}


def compare_engines(
    engines: tuple[str, str], tiles_a: Pixels, tiles_b: Pixels, level: float = LEVEL
) -> Agreement:
    """Test two engines' renders, given as (renders, rows, columns, channels) means of tiles."""
    means = [tiles.mean(axis=0) for tiles in (tiles_a, tiles_b)]
    variances = [tiles.var(axis=0, ddof=1) for tiles in (tiles_a, tiles_b)]
    counts = len(tiles_a), len(tiles_b)
    t, dof = welch_t(means[0], variances[0], counts[0], means[1], variances[1], counts[1])
    p = two_sided_p(t, dof)
    error = np.sqrt(variances[0] / counts[0] + variances[1] / counts[1])
    totals = [mean.mean(axis=(0, 1)) for mean in means]
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(totals[1] == 0.0, 1.0, totals[0] / totals[1])
        relative = np.where(error == 0.0, 0.0, 2.0 * error / (means[0] + means[1]))
    return Agreement(
        engines,
        n_tests=p.size,
        n_rejected=int((p < sidak(level, p.size)).sum()),
        smallest_p=float(p.min()),
        mean_ratio=tuple(float(value) for value in ratio),
        standard_error=float(np.median(relative)),
    )


def tile_means(pixels: Pixels, tile: int = TILE) -> Pixels:
    """Average (h, w, c) values over tiles."""
    height, width, _ = pixels.shape
    rows, columns = np.arange(0, height, tile), np.arange(0, width, tile)

    def sums(values: Pixels) -> Pixels:
        return np.add.reduceat(np.add.reduceat(values, rows, axis=0), columns, axis=1)

    return sums(pixels) / sums(np.ones((height, width, 1)))

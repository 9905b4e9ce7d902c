"""Whether two engines converge to the same image: Welch's test in every tile.

Renders of one engine with different seeds are observations. A tile's mean averages over many
pixels, so that a few renders tell small differences, and it holds where neighbouring pixels
depend on each other.

Light that is found by rare bright samples alone makes tiles in which the test can tell nothing:
they are counted. Where neither of two engines has met a single such sample they agree, and only an
engine that finds this light in another way can say that both have missed it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from kilauea.benchmarks.image_error import Pixels
from kilauea.statistics import sidak, two_sided_p, welch_t

TILE = 32
"""Pixels of a tile's sides; the last row and column may have less."""
LEVEL = 0.01
"""Of all tests together."""
MERGING_MARGIN = 0.1
"""Of a tile's light: more than merging photons moves to it from the tiles beside it."""


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
    n_undecided: int
    """Tests that an engine would have passed that has found nothing there."""
    missed_by_both: dict[str, int]
    """By the name of a witness, tests in which it has found more light than both."""

    @property
    def agrees(self) -> bool:
        """Whether no tile differs by more than chance explains, and no witness found more."""
        return self.n_rejected == 0 and not any(self.missed_by_both.values())

    def record(self) -> dict[str, Any]:
        """Return the fields, for JSON."""
        return asdict(self) | {"agrees": self.agrees}


def compare_engines(
    engines: tuple[str, str],
    tiles_a: Pixels,
    tiles_b: Pixels,
    witnesses: Mapping[str, Pixels] | None = None,
    margin: float = 0.0,
    level: float = LEVEL,
) -> Agreement:
    """Test two engines' renders, given as (renders, rows, columns, channels) means of tiles.

    Parameters
    ----------
    witnesses
        Tiles of engines that find light which these two may miss.
    margin
        Difference that is none, relative to the larger mean.
    """
    a, b = _Tiles.of(tiles_a), _Tiles.of(tiles_b)
    larger = np.maximum(a.mean, b.mean)
    both = _Tiles(larger, np.maximum(a.variance, b.variance), min(a.n, b.n))
    excess = np.maximum(np.abs(a.mean - b.mean) - margin * larger, 0.0)
    p = _p_of_difference(a, b, excess)
    limit = sidak(level, p.size)
    error = np.sqrt(a.variance / a.n + b.variance / b.n)
    totals = [tiles.mean.mean(axis=(0, 1)) for tiles in (a, b)]
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(totals[1] == 0.0, 1.0, totals[0] / totals[1])
        relative = np.where(error == 0.0, 0.0, 2.0 * error / (a.mean + b.mean))
    return Agreement(
        engines,
        n_tests=p.size,
        n_rejected=int((p < limit).sum()),
        smallest_p=float(p.min()),
        mean_ratio=tuple(float(value) for value in ratio),
        standard_error=float(np.median(relative)),
        n_undecided=int(((larger > 0.0) & (_p_of_difference(a, b, larger) >= limit)).sum()),
        missed_by_both={
            name: _n_found_more(_Tiles.of(tiles), both, limit)
            for name, tiles in (witnesses or {}).items()
        },
    )


@dataclass(frozen=True, slots=True)
class _Tiles:
    """Means of tiles over renders, variances of a single render, and the number of renders."""

    mean: Pixels
    variance: Pixels
    n: int

    @classmethod
    def of(cls, tiles: Pixels) -> _Tiles:
        return cls(tiles.mean(axis=0), tiles.var(axis=0, ddof=1), len(tiles))


def _p_of_difference(a: _Tiles, b: _Tiles, difference: Pixels) -> Pixels:
    """Return how likely chance makes such a difference between means that are the same."""
    t, dof = welch_t(difference, a.variance, a.n, 0.0, b.variance, b.n)
    return two_sided_p(t, dof)


def _n_found_more(witness: _Tiles, both: _Tiles, limit: float) -> int:
    """Count tests in which a witness has found more light than merging may have moved there."""
    excess = np.maximum(witness.mean - (1.0 + MERGING_MARGIN) * both.mean, 0.0)
    return int((_p_of_difference(witness, both, excess) < limit).sum())


def tile_means(pixels: Pixels, tile: int = TILE) -> Pixels:
    """Average (h, w, c) values over tiles."""
    height, width, _ = pixels.shape
    rows, columns = np.arange(0, height, tile), np.arange(0, width, tile)

    def sums(values: Pixels) -> Pixels:
        return np.add.reduceat(np.add.reduceat(values, rows, axis=0), columns, axis=1)

    return sums(pixels) / sums(np.ones((height, width, 1)))

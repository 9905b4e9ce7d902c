"""The image that all engines are measured against: one on which two engines agree.

No engine of ours decides alone. Where no two engines agree, because they model materials
differently, each engine is measured against its own converged image: that tells its noise, which
is its whole error where it has no bias, and nothing about which of the images is right.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from kilauea.benchmarks.agreement import MERGING_MARGIN, Agreement, compare_engines
from kilauea.benchmarks.converged import Converged
from kilauea.benchmarks.engines import BIASED, OURS
from kilauea.benchmarks.image_error import Pixels


@dataclass(frozen=True, slots=True)
class Reference:
    """An image and how far it can be trusted."""

    mean: Pixels
    variance_of_mean: Pixels


@dataclass(frozen=True, slots=True)
class References:
    """What each engine is measured against, and why."""

    agreed: Reference | None
    agreed_by: tuple[str, str] | None
    images: dict[str, Converged]
    """The converged images of the engines that were asked."""
    tests: list[Agreement]
    """Of all pairs that were tested."""

    def of(self, engine: str) -> Reference:
        """Return what an engine is measured against."""
        if self.agreed is not None:
            return self.agreed
        own = self.images[engine]
        return Reference(own.mean, own.variance_of_mean)

    def record(self) -> dict[str, Any]:
        """Return what a ledger says of it."""
        return {
            "kind": "agreed" if self.agreed else "own",
            "by": self.agreed_by,
            "images": [image.record() for image in self.images.values()],
            "tests": [test.record() for test in self.tests],
        }


def find_references(engines: Sequence[str], converge: Callable[[str], Converged]) -> References:
    """Look for two engines that agree, those of others first.

    Engines that merge photons are biased, and find light that paths meet by rare chance alone. So
    they are witnesses: no pair is trusted where one of them has found more than both. Where no two
    engines without bias agree, such an engine of others and one without bias may, to within what
    merging moves.

    Parameters
    ----------
    engines
        Those that can render the stage.
    converge
        Renders the converged image of an engine.
    """
    images: dict[str, Converged] = {}
    tests: list[Agreement] = []

    def tiles(engine: str) -> Pixels:
        if engine not in images:
            images[engine] = converge(engine)
        return images[engine].tiles

    witnesses = [engine for engine in engines if engine in BIASED]
    for pair in pairs(engines):
        a, b = (tiles(engine) for engine in pair)
        found = {witness: tiles(witness) for witness in witnesses if witness not in pair}
        margin = MERGING_MARGIN if pair[1] in BIASED else 0.0
        tests.append(compare_engines(pair, a, b, found, margin))
        if tests[-1].agrees:
            return References(weighted([images[name] for name in pair]), pair, images, tests)
    for engine in engines:
        tiles(engine)
    return References(None, None, images, tests)


def weighted(images: Sequence[Converged]) -> Reference:
    """Return the mean of images of the same light, each weighed by its noise as a whole.

    A weight for each pixel would be largest where an engine has missed something.
    """
    weights = 1.0 / np.array([max(image.variance_of_mean.mean(), 1e-30) for image in images])
    shares = weights / weights.sum()
    return Reference(
        mean=_sum(shares, [image.mean for image in images]),
        variance_of_mean=_sum(shares**2, [image.variance_of_mean for image in images]),
    )


def _sum(shares: Pixels, values: Sequence[Pixels]) -> Pixels:
    return (shares[:, None, None, None] * np.stack(values)).sum(axis=0)


def pairs(engines: Sequence[str]) -> list[tuple[str, str]]:
    """Return the pairs that may decide, in order: none is of our engines alone.

    Last come those of an engine without bias and one of others that merges photons.
    """
    unbiased = [engine for engine in engines if engine not in BIASED]
    others = [engine for engine in unbiased if engine not in OURS]
    ours = [engine for engine in unbiased if engine in OURS]
    merging = [engine for engine in engines if engine in BIASED and engine not in OURS]
    tried = [
        *combinations(others, 2),
        *((other, our) for other in others for our in ours),
        *((engine, other) for engine in (*others, *ours) for other in merging),
    ]
    return [pair for pair in tried if family(pair[0]) != family(pair[1])]


def family(engine: str) -> str:
    """Return the engine of which a name may be a variant."""
    return engine.partition("-")[0]

"""Whether our noise is what the samples promise: a sampler that repeats itself is no bias.

It gives the right picture on average, only noisier than the samples should make it. Three ratios
show it, each 1 for independent samples and less for low-discrepancy ones.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kilauea.checking.images import LUMINANCE, Batches, Floats
from kilauea.checking.tiles import tile_means

LEAST_NOISE = 1e-5
"""Standard deviation over the mean of an image, below which its noise is rounding."""


@dataclass(frozen=True)
class Noise:
    """Ratios of variances; None where there is too little noise to tell."""

    over_claim: float | None
    """Between the seeds, over what a render's `variance` layer says. Seeds or samples repeat."""
    over_fewer_samples: float | None
    """That ratio over the same with fewer samples. Samples repeat after some number. Both parts of
    the ratio grow alike where rare paths show only among many samples."""
    over_pixels: float | None
    """Of tiles, over that of independent pixels. Pixels repeat each other's samples."""
    has_equal_seeds: bool
    """All seeds give the same noisy image."""

    @property
    def worst(self) -> float:
        """The largest ratio."""
        known = (self.over_claim, self.over_fewer_samples, self.over_pixels)
        return max((ratio for ratio in known if ratio is not None), default=0.0)


def measure_noise(batches: Batches, fewer: Batches | None, tile: int) -> Noise:
    """Measure the noise of our batches; `fewer` has fewer samples in each."""
    over_claim = _over_claim(batches, tile)
    before = None if fewer is None else _over_claim(fewer, tile)
    n_pixels = tile_means(np.ones((*batches.mean.shape[:2], 1)), tile, total=True)[..., 0]
    of_tile_means = _luminance(tile_means(batches.images, tile)).var(axis=0, ddof=1)
    return Noise(
        over_claim=over_claim,
        over_fewer_samples=over_claim / before if over_claim and before else None,
        over_pixels=_ratio(of_tile_means * n_pixels, _tile_variance(batches, tile), batches),
        has_equal_seeds=_has_equal_seeds(batches),
    )


def _over_claim(batches: Batches, tile: int) -> float | None:
    claimed = batches.claimed_variance
    if claimed is None:
        return None
    expected = tile_means(claimed[:, :, None], tile)[..., 0]
    return _ratio(_tile_variance(batches, tile), expected, batches)


def _has_equal_seeds(batches: Batches) -> bool:
    claimed = batches.claimed_variance
    if claimed is None or claimed.mean() <= _least_variance(batches):
        return False
    return bool((batches.images == batches.images[0]).all())


def _ratio(variance: Floats, expected: Floats, batches: Batches) -> float | None:
    """Return the median ratio over the tiles with noise: single fireflies do not move it."""
    is_noisy = expected > _least_variance(batches)
    if not is_noisy.any():
        return None
    return float(np.median(variance[is_noisy] / expected[is_noisy]))


def _least_variance(batches: Batches) -> float:
    return float((LEAST_NOISE * _luminance(batches.mean).mean()) ** 2)


def _tile_variance(batches: Batches, tile: int) -> Floats:
    """Return the variance of a pixel's luminance between seeds, averaged over each tile."""
    variance = _luminance(batches.images).var(axis=0, ddof=1)
    return tile_means(variance[:, :, None], tile)[..., 0]


def _luminance(images: np.ndarray) -> Floats:
    return images.astype(np.float64) @ LUMINANCE

"""Images with known noise: batches of independent renders, and stored means with variances.

Both answer the same questions. Images are (height, width, 3) arrays of linear Rec. 709.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from kilauea.checking.tiles import tile_means

Floats = NDArray[np.float64]

LUMINANCE = np.array([0.212_671, 0.715_160, 0.072_169])
"""Weights of linear Rec. 709."""


@dataclass(frozen=True, slots=True)
class Measured:
    """Numbers measured from an image, element by element."""

    mean: Floats
    variance: Floats
    """Of the mean."""
    n: float
    """Independent observations behind each variance: its degrees of freedom and one."""


@dataclass(frozen=True)
class Batches:
    """Renders of one scene with seeds of their own; their spread is the noise, whatever its kind.

    Low-discrepancy samples and blue noise make errors depend on each other within an image, so
    that only whole independent images tell how far a mean of pixels is off (Celarek et al. 2019).
    """

    engine: str
    images: NDArray[np.float32]
    """(batches, height, width, 3)."""
    samples_per_batch: int
    claimed_variance: NDArray[np.float32] | None = None
    """(height, width): what each render says of the variance of its luminance, averaged."""
    warnings: tuple[str, ...] = ()
    seconds: float = 0.0
    """Of rendering, all batches."""

    @property
    def n(self) -> int:
        """How many batches there are."""
        return self.images.shape[0]

    @property
    def samples_per_pixel(self) -> int:
        """Samples behind the mean."""
        return self.n * self.samples_per_batch

    @property
    def is_valid(self) -> NDArray[np.bool_]:
        """Which pixels are finite in every batch."""
        return np.asarray(np.isfinite(self.images).all(axis=(0, 3)))

    def masked(self, keep: NDArray[np.bool_]) -> Batches:
        """Return the batches with every other pixel black."""
        images = np.where(keep[None, :, :, None], self.images, np.float32(0.0))
        claimed = self.claimed_variance
        if claimed is not None:
            claimed = np.where(keep, claimed, np.float32(0.0))
        return Batches(
            self.engine, images, self.samples_per_batch, claimed, self.warnings, self.seconds
        )

    @cached_property
    def mean(self) -> Floats:
        """Mean of all samples."""
        return self.images.mean(axis=0, dtype=np.float64)

    @cached_property
    def pixel_variance(self) -> Floats:
        """Variance of `mean`."""
        return self.images.var(axis=0, dtype=np.float64, ddof=1) / self.n

    def tiles(self, tile: int) -> Measured:
        """Measure the means of tiles."""
        return self._measured(tile_means(self.images, tile))

    def weighted(self, weights: Floats) -> Measured:
        """Measure weighted sums."""
        return self._measured(np.einsum("mhwc,khwc->km", weights, self.images, optimize=True))

    def error_like(self, rng: np.random.Generator) -> Floats:
        """Sum the deviations of the batches with random signs: the wild bootstrap (Wu 1986).

        It keeps what pixels of one batch have in common, such as blue noise.
        """
        signs = rng.choice((-1.0, 1.0), size=self.n)
        deviations = np.tensordot(signs, self.images, axes=1) - signs.sum() * self.mean
        return deviations / np.sqrt(self.n * (self.n - 1.0))

    def _measured(self, values: NDArray[np.floating]) -> Measured:
        """Take the mean over the first axis, and its variance."""
        mean = values.mean(axis=0, dtype=np.float64)
        return Measured(mean, values.var(axis=0, dtype=np.float64, ddof=1) / self.n, self.n)


@dataclass(frozen=True)
class StoredImage:
    """A mean and the variance of each of its values, which are taken as independent."""

    engine: str
    mean: Floats
    pixel_variance: Floats
    samples_per_pixel: int
    n: int
    """Batches behind each variance."""

    @property
    def is_valid(self) -> NDArray[np.bool_]:
        """Which pixels are finite, with variances that can be."""
        is_finite = np.isfinite(self.mean + self.pixel_variance)
        return np.asarray((is_finite & (self.pixel_variance >= 0.0)).all(axis=2))

    def masked(self, keep: NDArray[np.bool_]) -> StoredImage:
        """Return the image with every other pixel black."""
        mean, variance = (
            np.where(keep[:, :, None], values, 0.0) for values in (self.mean, self.pixel_variance)
        )
        return StoredImage(self.engine, mean, variance, self.samples_per_pixel, self.n)

    def tiles(self, tile: int) -> Measured:
        """Measure the means of tiles."""
        counts = tile_means(np.ones((*self.mean.shape[:2], 1)), tile, total=True)
        variance = tile_means(self.pixel_variance, tile) / counts
        return Measured(tile_means(self.mean, tile), variance, self._observations(counts.min()))

    def weighted(self, weights: Floats) -> Measured:
        """Measure weighted sums."""
        mean = np.einsum("mhwc,hwc->m", weights, self.mean)
        variance = np.einsum("mhwc,hwc->m", weights**2, self.pixel_variance)
        return Measured(mean, variance, self._observations(self.mean.shape[0]))

    def error_like(self, rng: np.random.Generator) -> Floats:
        """Draw normal errors."""
        return rng.normal(size=self.mean.shape) * np.sqrt(self.pixel_variance)

    def _observations(self, n_pixels: float) -> float:
        """Count what a variance summed over at least so many pixels rests on."""
        return n_pixels * (self.n - 1.0) + 1.0


NoisyImage = Batches | StoredImage
"""What the tests compare."""

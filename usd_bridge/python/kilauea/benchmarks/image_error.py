"""The error of independent renders, split into what averages out and what stays.

A render is an (h, w, 3) array, and `weight` makes squared differences relative: the mean over all
values of `weight * (render - reference)²` is relMSE. After Celarek et al. 2019: many short
independent renders tell more than a long one.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from kilauea.errors import KilaueaError

Pixels = NDArray[np.float64]

REL_MSE_EPSILON = 1e-2
"""As in `kilauea-film`."""


@dataclass(frozen=True, slots=True)
class Moments:
    """Mean and variance of each value over independent renders."""

    mean: Pixels
    variance: Pixels
    """Of a single render, unbiased."""
    n_renders: int

    @classmethod
    def of(cls, renders: list[Pixels]) -> Moments:
        """Estimate both from at least two renders."""
        if len(renders) < 2:
            raise ValueError("one render tells nothing about its variance")
        stacked = np.stack(renders)
        return cls(stacked.mean(axis=0), stacked.var(axis=0, ddof=1), len(renders))

    @property
    def variance_of_mean(self) -> Pixels:
        """Variance of the mean of all renders."""
        return self.variance / self.n_renders


@dataclass(frozen=True, slots=True)
class ErrorSplit:
    """relMSE of one render, apart by origin."""

    variance: float
    bias_squared: float
    """Unbiased, so it may come out below zero where there is no bias."""


def split(renders: list[Pixels], reference: Pixels, reference_variance: Pixels) -> ErrorSplit:
    """Split the error of independent renders of the same number of samples.

    The squared distance of the mean of K renders from the reference expects to
    `bias² + variance / K + reference_variance`, so the last two are taken off.

    Parameters
    ----------
    reference_variance
        The variance of the reference itself, as `Moments.variance_of_mean`.
    """
    moments = Moments.of(renders)
    weight = relative_weight(reference)
    distance = (moments.mean - reference) ** 2
    bias_squared = distance - moments.variance_of_mean - reference_variance
    return ErrorSplit(
        variance=float((weight * moments.variance).mean()),
        bias_squared=float((weight * bias_squared).mean()),
    )


def relative_weight(reference: Pixels) -> Pixels:
    """Return what makes a squared difference relative, as relMSE has it."""
    return 1.0 / (reference**2 + REL_MSE_EPSILON)


def read_pixels(file: Path) -> Pixels:
    """Read the red, green and blue of an EXR as (h, w, 3).

    Raises
    ------
    KilaueaError
        It is no image, or has fewer than three channels.
    """
    image = oiio.ImageBuf(str(file))
    pixels = image.get_pixels(oiio.FLOAT)
    if pixels is None or image.nchannels < 3:
        raise KilaueaError(f"{file}: {image.geterror() or 'not an image of three channels'}")
    names = list(image.spec().channelnames)
    order = [names.index(name) if name in names else idx for idx, name in enumerate("RGB")]
    return pixels[..., order].astype(np.float64)


def write_pixels(file: Path, pixels: Pixels) -> None:
    """Write (h, w, 3) values as an EXR of 32-bit floats."""
    height, width, _ = pixels.shape
    image = oiio.ImageBuf(oiio.ImageSpec(width, height, 3, oiio.FLOAT))
    image.set_pixels(oiio.ROI(), np.float32(pixels))
    if not image.write(str(file)):
        raise KilaueaError(f"{file}: {image.geterror()}")

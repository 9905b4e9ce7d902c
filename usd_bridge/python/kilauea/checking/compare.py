"""Two noisy images, compared in every way that a check judges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kilauea.checking.bias import BiasTest, compare_means, scale_of
from kilauea.checking.criteria import Criteria
from kilauea.checking.errors import CannotCheckError
from kilauea.checking.images import Batches, NoisyImage
from kilauea.checking.looks import Looks, compare_looks
from kilauea.checking.shift import measure_shift
from kilauea.checking.tiles import default_tile


@dataclass(frozen=True)
class Light:
    """Whether the light is the same: on the whole and tile by tile, each channel apart."""

    ours: Batches
    """Black where either image is not finite, as `reference`."""
    reference: NoisyImage
    n_invalid_ours: int
    """Pixels of ours with a NaN or an infinity in some batch."""
    n_invalid_reference: int
    tile: int
    """Edge length in pixels."""
    image: BiasTest
    """Of the three channels."""
    tiles: BiasTest
    """(rows, columns, 3)."""


@dataclass(frozen=True)
class Shape:
    """Whether things are in the same place, and look the same."""

    shift: BiasTest | None
    """Columns, rows; None where there are too few edges."""
    looks: Looks


def compare_light(
    ours: Batches, reference: NoisyImage, tile: int | None, criteria: Criteria
) -> Light:
    """Compare the means of the image and of its tiles, of the default size unless it is given.

    Raises
    ------
    CannotCheckError
        The images differ in size, or have no pixel that is finite in both.
    """
    size, other = ours.mean.shape[1::-1], reference.mean.shape[1::-1]
    if size != other:
        raise CannotCheckError(
            f"the images differ in size: {size[0]}x{size[1]} here, "
            f"{other[0]}x{other[1]} in the reference {reference.engine}"
        )
    keep = ours.is_valid & reference.is_valid
    if not keep.any():
        raise CannotCheckError("no pixel is finite in both images")
    n_invalid = [int(np.count_nonzero(~image.is_valid)) for image in (ours, reference)]
    if not keep.all():
        ours, reference = ours.masked(keep), reference.masked(keep)
    image_mean = float(reference.mean.mean())
    tile = tile or default_tile(*size)

    def compare(tile: int, margin: float) -> BiasTest:
        measured, expected = ours.tiles(tile), reference.tiles(tile)
        scale = scale_of(expected.mean, image_mean)
        return compare_means(
            measured, expected, scale, margin, criteria.significance, criteria.power
        )

    return Light(
        ours,
        reference,
        n_invalid[0],
        n_invalid[1],
        tile,
        image=compare(max(size), criteria.image),
        tiles=compare(tile, criteria.tile),
    )


def compare_shape(light: Light, criteria: Criteria) -> Shape:
    """Compare places and looks."""
    measured = measure_shift(light.ours, light.reference)
    shift = None
    if measured is not None:
        shift = compare_means(*measured, 1.0, criteria.shift, criteria.significance, criteria.power)
    return Shape(shift, compare_looks(light.ours, light.reference))

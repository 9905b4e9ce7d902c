"""Whether an image is displaced against another, to a fraction of a pixel.

To first order a displacement by (x, y) changes an image by -x dI/dx - y dI/dy, so a least-squares
fit of the difference to the gradients of the reference gives it (Lucas and Kanade 1981). A change
of brightness is fitted along, or it would be taken for a shift where edges have a direction.
"""

from __future__ import annotations

import numpy as np

from kilauea.checking.images import Floats, Measured, NoisyImage

LEAST_EDGE_SHARE = 1e-6
"""Squares of gradients over squares of light, below which a picture has no edges."""


def measure_shift(ours: NoisyImage, reference: NoisyImage) -> tuple[Measured, Measured] | None:
    """Measure the columns and rows by which ours lies right of and below the reference.

    Returns the two terms whose difference is the shift, each with its error; None where the
    picture has too few edges to tell.
    """
    columns = _shift_weights(reference)
    if columns is None:
        return None
    return ours.weighted(columns), reference.weighted(columns)


def _shift_weights(reference: NoisyImage) -> Floats | None:
    """Return the rows of the pseudo-inverse that give the two shifts, (2, height, width, 3)."""
    mean, variance = reference.mean, reference.pixel_variance
    if min(mean.shape[:2]) < 3:
        return None
    regressors = np.stack([-_gradient(mean, 1), -_gradient(mean, 0), mean])
    # Noise adds its own squares to those of the gradients.
    noise = [_gradient_noise(variance, 1).sum(), _gradient_noise(variance, 0).sum(), 0.0]
    normal = np.einsum("ihwc,jhwc->ij", regressors, regressors) - np.diag(noise)
    least = LEAST_EDGE_SHARE * normal[2, 2]
    if normal[2, 2] <= 0.0 or min(normal[0, 0], normal[1, 1]) <= max(least, 0.1 * max(noise)):
        return None
    if np.linalg.cond(normal / np.sqrt(np.outer(normal.diagonal(), normal.diagonal()))) > 1e4:
        return None
    return np.einsum("ij,jhwc->ihwc", np.linalg.inv(normal)[:2], regressors)


def _gradient(image: Floats, axis: int) -> Floats:
    """Return central differences; zero at the borders."""
    gradient = np.zeros_like(image)
    inner = [slice(None)] * 3
    inner[axis] = slice(1, -1)
    gradient[tuple(inner)] = 0.5 * (_from(image, axis, 2) - _from(image, axis, 0))
    return gradient


def _gradient_noise(variance: Floats, axis: int) -> Floats:
    """Return the variance of central differences of independent pixels."""
    return 0.25 * (_from(variance, axis, 2) + _from(variance, axis, 0))


def _from(image: Floats, axis: int, start: int) -> Floats:
    """Return what lies `start` pixels in, two fewer in all."""
    taken = [slice(None)] * 3
    taken[axis] = slice(start, image.shape[axis] - 2 + start)
    return image[tuple(taken)]

"""Whether a difference can be seen: HDR-FLIP, over what the noise of both images gives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from kilauea.checking.images import Floats, NoisyImage
from kilauea.render import native

NOISE_DRAWS = 5
_SEED = 1


@dataclass(frozen=True)
class Looks:
    """HDR-FLIP between the means of all samples."""

    errors: Floats
    """Of each pixel."""
    noise: float
    """Mean FLIP that images which differ by noise alone have."""

    @property
    def mean(self) -> float:
        """Mean over the pixels."""
        return float(self.errors.mean())

    @property
    def excess(self) -> float:
        """Mean that noise does not explain."""
        return self.mean - self.noise


def compare_looks(ours: NoisyImage, reference: NoisyImage) -> Looks:
    """Compare the means, and the reference with itself under errors such as both have."""
    rng = np.random.default_rng(_SEED)
    draws = [
        reference.mean + ours.error_like(rng) - reference.error_like(rng)
        for _ in range(NOISE_DRAWS)
    ]
    noise = float(np.mean([flip(draw, reference.mean).mean() for draw in draws]))
    return Looks(flip(ours.mean, reference.mean), noise)


def flip(image: Floats, reference: Floats) -> Floats:
    """Return the HDR-FLIP of each pixel."""
    as_float = [np.ascontiguousarray(values, np.float32) for values in (image, reference)]
    return native().hdr_flip(*as_float).astype(np.float64)

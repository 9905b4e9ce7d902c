"""Images cut into square tiles from the top left; those at the far edges may be smaller."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

TILES_ALONG = 16
SMALLEST_TILE = 8


def default_tile(width: int, height: int) -> int:
    """Return the edge length, in pixels, that gives about `TILES_ALONG` along the longer side."""
    return max(SMALLEST_TILE, -(-max(height, width) // TILES_ALONG))


def tile_means(
    images: NDArray[np.floating], tile: int, *, total: bool = False
) -> NDArray[np.float64]:
    """Return the means, or sums, of tiles: (..., height, width, c) to (..., rows, columns, c)."""
    height, width = images.shape[-3:-1]
    rows, columns = np.arange(0, height, tile), np.arange(0, width, tile)
    sums: Any = np.add.reduceat(images, rows, axis=-3, dtype=np.float64)
    sums = np.add.reduceat(sums, columns, axis=-2)
    if total:
        return sums
    counts = np.outer(np.diff(rows, append=height), np.diff(columns, append=width))
    return sums / counts[:, :, None]

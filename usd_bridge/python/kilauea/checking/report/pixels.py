"""Images for the page: tone-mapped or coloured by a scale, as PNG data URIs."""

from __future__ import annotations

import base64
import struct
import zlib

import numpy as np
from numpy.typing import NDArray

from kilauea.checking.images import LUMINANCE, Floats

Bytes = NDArray[np.uint8]
Colours = tuple[tuple[float, float, float], ...]

DIVERGING = ((0.02, 0.19, 0.38), (0.26, 0.58, 0.76), (0.97, 0.97, 0.97), (0.84, 0.38, 0.30),
             (0.40, 0.00, 0.12))  # fmt: skip
"""Blue where ours is darker, white where equal, red where brighter (ColorBrewer's RdBu)."""
SEQUENTIAL = ((0.00, 0.00, 0.02), (0.32, 0.07, 0.48), (0.72, 0.22, 0.47), (0.99, 0.54, 0.38),
              (0.99, 0.99, 0.75))  # fmt: skip
"""From dark to light, in the colours in which FLIP is usually shown."""


def exposure_of(reference: Floats) -> float:
    """Return the factor that puts the mean of the reference at a middle grey."""
    mean = float((reference @ LUMINANCE).mean())
    return 0.25 / mean if mean > 0.0 else 1.0


def displayed(image: Floats, exposure: float) -> Bytes:
    """Encode linear light in 8-bit sRGB, clipped."""
    light = np.clip(image * exposure, 0.0, 1.0)
    encoded = np.where(light <= 0.003_130_8, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)
    return (255.0 * encoded + 0.5).astype(np.uint8)


def coloured(
    values: Floats, colours: tuple[tuple[float, ...], ...], low: float, high: float
) -> Bytes:
    """Colour values from `low` to `high` by interpolation."""
    position = np.clip((values - low) / (high - low), 0.0, 1.0) * (len(colours) - 1)
    knots = np.arange(len(colours))
    channels = [np.interp(position, knots, channel) for channel in zip(*colours, strict=True)]
    return (255.0 * np.stack(channels, axis=-1) + 0.5).astype(np.uint8)


def data_uri(image: Bytes) -> str:
    """Write (height, width, 3) as a PNG that a page can hold."""
    return "data:image/png;base64," + base64.b64encode(png(image)).decode()


def png(image: Bytes) -> bytes:
    """Write 8-bit RGB as PNG (ISO/IEC 15948), rows filtered by the difference to the left."""
    height, width = image.shape[:2]
    rows = image.astype(np.int16)
    rows[:, 1:] -= image[:, :-1]
    filtered = np.full((height, 1 + 3 * width), 1, np.uint8)
    filtered[:, 1:] = (rows & 0xFF).astype(np.uint8).reshape(height, -1)
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(filtered.tobytes(), 9)), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        for kind, data in chunks
    )

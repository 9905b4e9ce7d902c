"""The engines' images side by side, for people."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from kilauea.benchmarks.image_error import Pixels, read_pixels
from kilauea.benchmarks.reference import References
from kilauea.errors import KilaueaError

CROP = 200
"""Pixels of a crop's sides."""
GAP = 4
JPEG_QUALITY = 88


def write(file: Path, references: References, images: dict[str, Path]) -> list[str]:
    """Write the reference and the engines' images from left to right; returns their names.

    Each is the middle of the picture, and all have the exposure that suits the reference.
    """
    reference = references.agreed or references.of(next(iter(images)))
    named = {"reference": reference.mean} | {
        engine: read_pixels(image) for engine, image in images.items()
    }
    exposure = 0.8 / max(float(np.percentile(reference.mean, 95.0)), 1e-6)
    crops = [srgb(exposure * middle(pixels)) for pixels in named.values()]
    height = crops[0].shape[0]
    white = np.full((height, GAP, 3), 255, np.uint8)
    parts = [part for crop in crops for part in (crop, white)][:-1]
    strip = np.concatenate(parts, axis=1)
    spec = oiio.ImageSpec(strip.shape[1], height, 3, oiio.UINT8)
    spec.attribute("Compression", f"jpeg:{JPEG_QUALITY}")
    image = oiio.ImageBuf(spec)
    image.set_pixels(oiio.ROI(), np.ascontiguousarray(strip))
    file.parent.mkdir(parents=True, exist_ok=True)
    if not image.write(str(file)):
        raise KilaueaError(f"{file}: {image.geterror()}")
    return list(named)


def middle(pixels: Pixels) -> Pixels:
    """Cut out the middle."""
    height, width, _ = pixels.shape
    top, left = max(0, (height - CROP) // 2), max(0, (width - CROP) // 2)
    return pixels[top : top + CROP, left : left + CROP]


def srgb(linear: Pixels) -> NDArray[np.uint8]:
    """Encode as 8-bit sRGB (IEC 61966-2-1)."""
    clipped = np.clip(np.nan_to_num(linear), 0.0, 1.0)
    encoded = np.where(
        clipped <= 0.0031308, 12.92 * clipped, 1.055 * clipped ** (1.0 / 2.4) - 0.055
    )
    return np.round(255.0 * encoded).astype(np.uint8)

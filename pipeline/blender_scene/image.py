"""Images from the engine's own tile files, so that both renderers see the same texels."""

from __future__ import annotations

from functools import cache

import bpy
import numpy as np

from tiles import read_texels


@cache
def load_image(path: str) -> bpy.types.Image:
    """Load a tile file.

    Cycles would interpolate between encoded values, which are darker in between than the colours
    they stand for; so it gets decoded ones.
    """
    texels = read_texels(path)
    if texels.is_srgb:
        texels.rgba[..., :3] = linear_from_srgb(texels.rgba[..., :3])
    is_float = texels.is_float or texels.is_srgb
    height, width, _ = texels.rgba.shape
    image = bpy.data.images.new(path, width, height, alpha=True, float_buffer=is_float)
    image.colorspace_settings.name = "Non-Color"
    image.alpha_mode = "CHANNEL_PACKED"
    image.pixels.foreach_set(texels.rgba.ravel())
    image.pack()
    return image


def linear_from_srgb(encoded: np.ndarray) -> np.ndarray:
    """Decode by IEC 61966-2-1."""
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)

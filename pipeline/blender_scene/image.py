"""Images from the engine's own tile files, so that both renderers see the same texels."""

from __future__ import annotations

from functools import cache

import bpy

from tiles import read_texels


@cache
def load_image(path: str) -> bpy.types.Image:
    """Load a tile file."""
    texels = read_texels(path)
    height, width, _ = texels.rgba.shape
    image = bpy.data.images.new(path, width, height, alpha=True, float_buffer=texels.is_float)
    image.colorspace_settings.name = "sRGB" if texels.is_srgb else "Non-Color"
    image.alpha_mode = "CHANNEL_PACKED"
    image.pixels.foreach_set(texels.rgba.ravel())
    image.pack()
    return image

"""Reads the finest level of a tile file: the texels that the engine itself looks up.

The layout is documented in the crate `kilauea-texture`.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path

import numpy as np

MAGIC = b"KLTILES\0"
TILE_SIZE = 64
HEADER_BYTES = 48
ELEMENTS = ("u1", "<f2", "<f4")
"""NumPy types by the header's element type."""


@dataclass(frozen=True)
class Texels:
    """An image, lowest row first."""

    rgba: np.ndarray
    """(height, width, 4) float32; bytes are divided by 255 and still encoded."""
    is_srgb: bool
    is_float: bool


def read_texels(path: str | Path) -> Texels:
    """Read an image; grey is repeated, absent alpha is one."""
    data = Path(path).read_bytes()
    if data[:8] != MAGIC:
        raise ValueError(f"{path}: not a tile file")
    version, width, height, channels, element, transfer = struct.unpack_from("<6I", data, 8)
    if version != 1:
        raise ValueError(f"{path}: tile file of version {version}, expected 1")
    dtype = np.dtype(ELEMENTS[element])
    low, high = struct.unpack_from("<2I", data, HEADER_BYTES + 8)
    offset = low | high << 32
    texels = np.frombuffer(data, dtype, width * height * channels, offset)
    image = joined(texels.reshape(-1, channels), width, height)
    scale = 255.0 if element == 0 else 1.0
    return Texels(to_rgba(image.astype(np.float32) / scale), transfer == 1, element != 0)


def joined(texels: np.ndarray, width: int, height: int) -> np.ndarray:
    """Put the tiles of a level together."""
    image = np.empty((height, width, texels.shape[1]), texels.dtype)
    start = 0
    for y in range(0, height, TILE_SIZE):
        for x in range(0, width, TILE_SIZE):
            tile = image[y : y + TILE_SIZE, x : x + TILE_SIZE]
            end = start + tile.shape[0] * tile.shape[1]
            tile[:] = texels[start:end].reshape(tile.shape)
            start = end
    return image


def to_rgba(image: np.ndarray) -> np.ndarray:
    """Extend one to four channels to red, green, blue and alpha."""
    channels = image.shape[2]
    rgba = np.ones((*image.shape[:2], 4), np.float32)
    rgba[..., :3] = image[..., :3] if channels >= 3 else image[..., :1]
    if channels in (2, 4):
        rgba[..., 3] = image[..., -1]
    return rgba

"""Tile files: images cut into tiles with mip levels, as `kilauea-texture` documents the format."""

from __future__ import annotations

import os
import struct
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

VERSION = 1
SUFFIX = ".tiles"

_MAGIC = b"KLTILES\0"
_HEADER = struct.Struct("<8s10I")
_LEVEL = struct.Struct("<2IQ")
_TILE_SIZE = 64
_BAND_ROWS = 256
_MAX_HALF = 65504.0
_ELEMENTS = {np.dtype(np.uint8): 0, np.dtype(np.float16): 1, np.dtype(np.float32): 2}

Wraps = tuple[str | None, str | None]
"""Wrap modes in an image's metadata, horizontal and vertical: black, clamp, repeat or mirror."""

_WRAPS = (None, "black", "clamp", "repeat", "mirror")
_WRAP_METADATA = {"black": 1, "clamp": 2, "periodic": 3, "mirror": 4}


class UnreadableImageError(Exception):
    """An image that cannot be read; the message says why."""


@dataclass(frozen=True, slots=True)
class _Image:
    texels: np.ndarray[Any, Any]
    """(height, width, channels), highest row first: u8, f16 or f32."""
    is_srgb: bool
    """u8 only; other types are linear."""
    wraps: tuple[int, int]
    """Indices into `_WRAPS`."""
    n_replaced: int
    """Values that were not finite."""


def write(image_file: str, target: Path, color_space: str) -> None:
    """Write the tile file of an image; `target` appears at once and complete.

    `color_space` is raw, sRGB or auto: sRGB for 8-bit images of three or four channels. 8-bit
    images stay as they are; others are stored linear, as f16 where their values fit.

    Raises
    ------
    UnreadableImageError
        Where the image is damaged or of an unknown format.
    """
    image = _read(image_file, color_space)
    levels = list(_mip_levels(image))
    height, width, channels = image.texels.shape
    offset = _HEADER.size + len(levels) * _LEVEL.size
    header = [
        _HEADER.pack(
            _MAGIC,
            VERSION,
            width,
            height,
            channels,
            _ELEMENTS[image.texels.dtype],
            int(image.is_srgb),
            *image.wraps,
            len(levels),
            image.n_replaced,
        )
    ]
    for level in levels:
        header.append(_LEVEL.pack(level.shape[1], level.shape[0], offset))
        offset += level.nbytes
    beside = target.with_name(f"{target.name}.{os.getpid()}.{threading.get_ident()}")
    try:
        with beside.open("wb") as file:
            file.writelines(header)
            for level in levels:
                file.writelines(_tiles(level))
        beside.replace(target)
    finally:
        beside.unlink(missing_ok=True)


def wraps(target: Path) -> Wraps | None:
    """Return the wrap modes that a tile file recorded; None where it is no usable tile file."""
    try:
        with target.open("rb") as file:
            header = _HEADER.unpack(file.read(_HEADER.size))
    except (OSError, struct.error):
        return None
    magic, version, wrap_s, wrap_t = header[0], header[1], header[7], header[8]
    if (magic, version) != (_MAGIC, VERSION) or max(wrap_s, wrap_t) >= len(_WRAPS):
        return None
    return _WRAPS[wrap_s], _WRAPS[wrap_t]


def wraps_of_image(image_file: str) -> Wraps:
    """Return the wrap modes in an image's metadata.

    Raises
    ------
    UnreadableImageError
        Where the image has no readable header.
    """
    with _open(image_file) as reader:
        wrap_s, wrap_t = _wrap_metadata(reader.spec())
    return _WRAPS[wrap_s], _WRAPS[wrap_t]


@contextmanager
def _open(image_file: str) -> Iterator[Any]:
    # Takes a while to load, and most runs find all their images as tile files.
    import OpenImageIO as oiio

    config = oiio.ImageSpec()
    # Texels as stored: nothing is multiplied by alpha.
    config.attribute("oiio:UnassociatedAlpha", 1)
    reader = oiio.ImageInput.open(image_file, config)
    if reader is None:
        raise UnreadableImageError(oiio.geterror() or "unknown image format")
    try:
        yield reader
    finally:
        reader.close()


def _read(image_file: str, color_space: str) -> _Image:
    with _open(image_file) as reader:
        spec = reader.spec()
        is_u8 = str(spec.format) in ("uint8", "int8")
        element = "uint8" if is_u8 else "half" if str(spec.format) == "half" else "float"
        texels = reader.read_image(0, 0, 0, spec.nchannels, element)
        if texels is None:
            raise UnreadableImageError(reader.geterror() or "cannot read its texels")
        texels = _fill_display_window(_color_channels(texels, spec), spec)
        is_srgb = color_space == "sRGB" or (
            color_space == "auto" and is_u8 and texels.shape[2] >= 3
        )
        wraps = _wrap_metadata(spec)
    n_replaced = 0
    if not is_u8:
        texels, n_replaced = _with_finite_values(texels)
        texels = _as_smallest_float(_linear(texels) if is_srgb else texels)
    return _Image(texels, is_srgb and is_u8, wraps, n_replaced)


def _color_channels(texels: np.ndarray[Any, Any], spec: Any) -> np.ndarray[Any, Any]:
    texels = texels.reshape(spec.height, spec.width, spec.nchannels)
    names = list(spec.channelnames)
    for wanted in ("RGBA", "RGB"):
        if all(name in names for name in wanted):
            return texels[:, :, [names.index(name) for name in wanted]]
    return texels[:, :, :4]


def _fill_display_window(texels: np.ndarray[Any, Any], spec: Any) -> np.ndarray[Any, Any]:
    x, y = spec.x - spec.full_x, spec.y - spec.full_y
    if (x, y, spec.width, spec.height) == (0, 0, spec.full_width, spec.full_height):
        return texels
    full = np.zeros((spec.full_height, spec.full_width, texels.shape[2]), texels.dtype)
    x0, x1 = max(x, 0), min(x + spec.width, spec.full_width)
    y0, y1 = max(y, 0), min(y + spec.height, spec.full_height)
    if x0 < x1 and y0 < y1:
        full[y0:y1, x0:x1] = texels[y0 - y : y1 - y, x0 - x : x1 - x]
    return full


def _wrap_metadata(spec: Any) -> tuple[int, int]:
    modes = str(spec.get_string_attribute("wrapmodes")).split(",")
    known = [_WRAP_METADATA.get(mode.strip(), 0) for mode in modes]
    return known[0], known[-1]


def _with_finite_values(texels: np.ndarray[Any, Any]) -> tuple[np.ndarray[Any, Any], int]:
    """Replace NaN by 0 and infinity by the largest f16; count them."""
    n_replaced = texels.size - int(np.count_nonzero(np.isfinite(texels)))
    if n_replaced:
        texels = np.nan_to_num(texels, nan=0.0, posinf=_MAX_HALF, neginf=-_MAX_HALF)
    return texels, n_replaced


def _as_smallest_float(texels: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Use f16 unless values are larger."""
    if texels.dtype == np.float16 or np.abs(texels).max(initial=0.0) <= _MAX_HALF:
        return texels.astype(np.float16, copy=False)
    return texels


def _n_color_channels(channels: int) -> int:
    """Return how many channels are not alpha."""
    return channels - (channels % 2 == 0)


def _srgb_to_linear(encoded: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """IEC 61966-2-1."""
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def _linear(texels: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    texels = texels.astype(np.float32)
    n = _n_color_channels(texels.shape[2])
    texels[:, :, :n] = _srgb_to_linear(np.maximum(texels[:, :, :n], 0.0))
    return texels


_U8_TO_UNIT = (np.arange(256) / 255.0).astype(np.float32)
_U8_TO_LINEAR = _srgb_to_linear(np.arange(256) / 255.0).astype(np.float32)
_LINEAR_TO_U8 = np.searchsorted(
    _srgb_to_linear((np.arange(255) + 0.5) / 255.0), np.arange(65536) / 65535.0
).astype(np.uint8)
"""sRGB code of a 16-bit linear value."""


def _decode_u8(texels: np.ndarray[Any, Any], is_srgb: bool) -> np.ndarray[Any, Any]:
    if not is_srgb:
        return _U8_TO_UNIT[texels]
    linear = _U8_TO_LINEAR[texels]
    if texels.shape[2] % 2 == 0:
        linear[:, :, -1] = _U8_TO_UNIT[texels[:, :, -1]]
    return linear


def _encode_u8(values: np.ndarray[Any, Any], is_srgb: bool) -> np.ndarray[Any, Any]:
    plain = (values * 255.0 + 0.5).astype(np.uint8)
    if not is_srgb:
        return plain
    n = _n_color_channels(values.shape[2])
    plain[:, :, :n] = _LINEAR_TO_U8[(values[:, :, :n] * 65535.0 + 0.5).astype(np.uint16)]
    return plain


def _mip_levels(image: _Image) -> Iterator[np.ndarray[Any, Any]]:
    """Yield the levels, finest first, each half the size of the last; averaged linearly."""
    yield image.texels
    dtype = image.texels.dtype
    level = image.texels
    while max(level.shape[:2]) > 1:
        # In bands of rows, so that only the result is held as f32.
        bands = [
            _halve(
                _decode_u8(band, image.is_srgb)
                if band.dtype == np.uint8
                else band.astype(np.float32, copy=False),
                axis=1,
            )
            for band in np.split(level, range(_BAND_ROWS, level.shape[0], _BAND_ROWS))
        ]
        level = _halve(np.concatenate(bands), axis=0)
        yield _encode_u8(level, image.is_srgb) if dtype == np.uint8 else level.astype(dtype)


def _halve(values: np.ndarray[Any, Any], axis: int) -> np.ndarray[Any, Any]:
    """Box-filter to half the length, rounded down; odd lengths weigh three neighbours each."""
    length = values.shape[axis]
    if length == 1:
        return values
    half = length // 2
    values = np.moveaxis(values, axis, 0)
    if length % 2 == 0:
        halved = (values[0::2] + values[1::2]) * np.float32(0.5)
    else:
        i = np.arange(half, dtype=np.float32).reshape(-1, 1, 1)
        halved = (
            values[0:-1:2] * (half - i) + values[1::2] * half + values[2::2] * (i + 1)
        ) / np.float32(length)
    return np.moveaxis(halved, 0, axis)


def _tiles(level: np.ndarray[Any, Any]) -> Iterator[Any]:
    """Yield the texels tile by tile, rows of tiles and rows of texels from the lowest up."""
    level = level[::-1]
    _, width, channels = level.shape
    n_whole = width // _TILE_SIZE
    for y in range(0, level.shape[0], _TILE_SIZE):
        rows = level[y : y + _TILE_SIZE]
        rest = rows[:, n_whole * _TILE_SIZE :]
        whole = rows[:, : n_whole * _TILE_SIZE]
        whole = whole.reshape(len(rows), n_whole, _TILE_SIZE, channels).swapaxes(0, 1)
        yield from (np.ascontiguousarray(part).data for part in (whole, rest) if part.size)

"""References in files: an image with the variance of each value, in one EXR.

`R`, `G`, `B` are the mean of all samples; `variance.R`, `variance.G` and `variance.B` the variance
of that mean. The header says which engine made it, from how many batches of how many samples, and
with which settings, so that a check against it needs no flags.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeGuard

import numpy as np
import OpenImageIO as oiio

from kilauea.checking.errors import CannotCheckError
from kilauea.checking.images import LUMINANCE, NoisyImage, StoredImage
from kilauea.output import partial_name

_MEAN = ("R", "G", "B")
_VARIANCE = ("variance.R", "variance.G", "variance.B")
_KINDS = {"engine": str, "batches": int, "samples": int, "variance_scale": float, "max_depth": int}
"""What the header holds that this module or the engine computes with."""
_LARGEST_HALF = 65504.0
SETTINGS = ("resolution", "filter", "filter_radius", "max_depth", "pixel_aspect_ratio")
"""What must be the same for two images to mean the same."""


@dataclass(frozen=True)
class Reference:
    """A reference as read from a file."""

    image: StoredImage
    settings: dict[str, Any] = field(default_factory=dict)
    """Those of `SETTINGS` that the file names; the resolution always."""
    notes: tuple[str, ...] = ()
    """What the check should know about the noise."""


def write_reference(file: Path, image: NoisyImage, n: int, header: dict[str, Any]) -> None:
    """Write an image whole or not at all; `n` is the number of its batches."""
    height, width = image.mean.shape[:2]
    spec = oiio.ImageSpec(width, height, 6, oiio.FLOAT)
    spec.channelnames = (*_MEAN, *_VARIANCE)
    # A variance is known to some tens of percent: 16 bits hold it, if scaled into their range.
    scale = float(image.pixel_variance.max()) / _LARGEST_HALF or 1.0
    spec.channelformats = (oiio.FLOAT,) * 3 + (oiio.HALF,) * 3
    spec.attribute("compression", "zip")
    record = {
        "engine": image.engine,
        "batches": n,
        "samples": image.samples_per_pixel,
        "variance_scale": scale,
        **header,
    }
    spec.attribute("kilauea/reference", json.dumps(record))
    partial = partial_name(file)
    pixels = np.concatenate([image.mean, image.pixel_variance / scale], axis=2)
    target = oiio.ImageBuf(spec)
    target.set_pixels(oiio.ROI.All, np.ascontiguousarray(pixels, np.float32))
    if not target.write(str(partial), fileformat="openexr"):
        partial.unlink(missing_ok=True)
        raise CannotCheckError(f"cannot write {file}: {target.geterror()}")
    partial.replace(file)


def read_reference(file: Path) -> Reference:
    """Read a reference, or any other EXR.

    One that `kilauea render` wrote tells the variance of its luminance, which is shared out to the
    channels by their squares; one without variance is taken as exact.

    Raises
    ------
    CannotCheckError
        It does not exist, is no EXR or has no red, green and blue.
    """
    if not file.is_file():
        raise CannotCheckError(f"{file} does not exist")
    image = oiio.ImageBuf(str(file))
    if image.has_error:
        raise CannotCheckError(f"{file}: {image.geterror()}")
    spec = image.spec()
    pixels = np.asarray(image.get_pixels(oiio.FLOAT), np.float64)
    planes = {name: pixels[..., idx] for idx, name in enumerate(spec.channelnames)}
    if not all(name in planes for name in _MEAN):
        raise CannotCheckError(f"{file} has no channels R, G and B")
    mean = np.stack([planes[name] for name in _MEAN], axis=-1)
    record = _record(file, spec)
    settings = {name: record[name] for name in SETTINGS if name in record}
    settings["resolution"] = [spec.full_width, spec.full_height]
    notes: tuple[str, ...] = ()
    if all(name in planes for name in _VARIANCE):
        variance = np.stack([planes[name] for name in _VARIANCE], axis=-1)
        variance *= record.get("variance_scale", 1.0)
    elif "variance" in planes:
        variance = _shared_out(mean, planes["variance"])
        notes = (f"{file.name}: the variance of its luminance is shared out to the channels",)
    else:
        variance = np.zeros_like(mean)
        notes = (f"{file.name} tells no variance: taken as free of noise",)
    stored = StoredImage(
        engine=record.get("engine", file.name),
        mean=mean,
        pixel_variance=variance,
        samples_per_pixel=record.get("samples", 0),
        n=record.get("batches", 2),
    )
    return Reference(stored, settings, notes)


def _record(file: Path, spec: Any) -> dict[str, Any]:
    """Return what the header says, empty where it says nothing."""
    text = spec.get_string_attribute("kilauea/reference")
    if not text:
        return {}
    try:
        record = json.loads(text)
    except ValueError:
        record = None
    if not _is_sound(record):
        raise CannotCheckError(f"{file}: cannot read its attribute kilauea/reference")
    return record


def _is_sound(record: Any) -> TypeGuard[dict[str, Any]]:
    """Whether what is computed with has the right kind, and there is a spread of batches."""
    if not isinstance(record, dict):
        return False
    kinds_fit = all(isinstance(record.get(name, kind()), kind) for name, kind in _KINDS.items())
    return kinds_fit and record.get("batches", 2) >= 2


def _shared_out(mean: np.ndarray, of_luminance: np.ndarray) -> np.ndarray:
    luminance = np.maximum(mean @ LUMINANCE, np.finfo(np.float32).tiny)
    return of_luminance[:, :, None] * (mean / luminance[:, :, None]) ** 2

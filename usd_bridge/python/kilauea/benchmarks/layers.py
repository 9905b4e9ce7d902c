"""All channels of an image, for whoever asks whether two are the same."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from kilauea.errors import KilaueaError


def read_layers(image: Path) -> NDArray[np.float32]:
    """Return the values of an image as (h, w, channels).

    Raises
    ------
    KilaueaError
        It cannot be read.
    """
    reader = oiio.ImageInput.open(str(image))
    if reader is None:
        raise KilaueaError(f"{image}: {oiio.geterror()}")
    try:
        pixels = reader.read_image(0, 0, 0, reader.spec().nchannels, "float")
    finally:
        reader.close()
    if pixels is None:
        raise KilaueaError(f"{image}: {reader.geterror()}")
    return pixels

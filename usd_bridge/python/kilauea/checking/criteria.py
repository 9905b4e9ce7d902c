"""What counts as a difference, and how sure a check wants to be."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from kilauea.errors import UsageError


@dataclass(frozen=True, slots=True)
class Criteria:
    """Margins below which a difference does not matter, and what the check must be able to find.

    Differences of light are relative to the reference; infinite margins switch a test off.
    """

    image: float = 0.005
    """Margin for the mean of the whole image, each channel apart."""
    tile: float = 0.02
    """Margin for the mean of a tile, each channel apart."""
    shift: float = 0.05
    """Margin for a displacement of the image, in pixels."""
    flip: float = 0.02
    """Margin for mean HDR-FLIP, over what noise alone would give."""
    noise: float = 1.5
    """Margin for the factor by which our noise may exceed what the samples promise."""
    image_bias: float = 0.01
    """Bias of the whole image that must not go unnoticed."""
    tile_bias: float = 0.05
    """Bias of a tile that must not go unnoticed, in `TILES_COVERED` of the tiles."""
    significance: float = 0.01
    """Probability of a false alarm in each group of tests, at the margin."""
    power: float = 0.9
    """Probability of noticing the biases above."""

    def record(self) -> dict[str, float | None]:
        """Return the fields for JSON, which has no infinity."""
        values = dataclasses.asdict(self)
        return {name: v if math.isfinite(v) else None for name, v in values.items()}


TILES_COVERED = 0.9
"""Share of tiles for which the samples must suffice: the noisiest would cost most of the time."""

NAMES = tuple(field.name.replace("_", "-") for field in dataclasses.fields(Criteria))
_SHARES = {"significance", "power"}
_EXAMPLES = {
    "significance": "write a share such as 0.01 or 1%",
    "power": "write a share such as 0.9 or 90%",
    "noise": "write a factor such as 1.5, at least 1, or off",
    "shift": "write pixels such as 0.05, or off",
}
_EXAMPLE = "write a share such as 0.005 or 0.5%, or off"


def parse_criteria(words: Sequence[str]) -> Criteria:
    """Read thresholds such as `image=0.5%`, `shift=0.1` and `flip=off`; the rest are defaults.

    Raises
    ------
    UsageError
        A name is unknown, or a value no positive number that makes sense there.
    """
    values: dict[str, Any] = {}
    for word in words:
        name, _, text = word.partition("=")
        if name not in NAMES:
            raise UsageError(f"unknown threshold {name!r}; there are {', '.join(NAMES)}")
        values[name.replace("-", "_")] = _value(word, name, text)
    for margin, bias in (("image", "image_bias"), ("tile", "tile_bias")):
        if math.isinf(values.get(margin, 0.0)):
            # What is not judged need not be noticed.
            values.setdefault(bias, math.inf)
    criteria = Criteria(**values)
    for margin, bias in (("image", "image_bias"), ("tile", "tile_bias")):
        if getattr(criteria, margin) >= getattr(criteria, bias) < math.inf:
            # No number of samples shows a bias that is within the margin.
            name = bias.replace("_", "-")
            raise UsageError(f"threshold {name} must be above {margin}, the margin that it exceeds")
    return criteria


def _value(word: str, name: str, text: str) -> float:
    if text == "off" and name not in _SHARES:
        return math.inf
    try:
        value = float(text.removesuffix("%")) / (100.0 if text.endswith("%") else 1.0)
    except ValueError:
        value = math.nan
    if name in _SHARES:
        is_sensible = 0.0 < value < 1.0
    else:
        is_sensible = (1.0 if name == "noise" else 0.0) <= value < math.inf
    if not is_sensible:
        raise UsageError(f"cannot read threshold {word!r}: {_EXAMPLES.get(name, _EXAMPLE)}")
    return value

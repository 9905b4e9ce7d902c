"""From measurements to findings, and from findings to a verdict."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

import numpy as np

from kilauea.checking.bias import BiasTest
from kilauea.checking.compare import Light, Shape
from kilauea.checking.criteria import TILES_COVERED, Criteria
from kilauea.checking.looks import Looks
from kilauea.checking.noise import Noise


class Verdict(Enum):
    """What a check comes to."""

    PASS = "pass"
    FAIL = "fail"
    INCONCLUSIVE = "inconclusive"
    """Nothing was found, with too few samples to find it."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that was looked at."""

    name: str
    """As in the JSON and the test report."""
    title: str
    verdict: Verdict
    summary: str


def judge(light: Light, shape: Shape, noise: Noise, criteria: Criteria) -> list[Finding]:
    """Judge everything that was measured, the gravest first."""
    return [
        _finite(light),
        _image(light.image),
        _tiles(light.tiles),
        _shift(shape.shift),
        _looks(shape.looks, criteria.flip),
        _noise(noise, criteria.noise),
        _power(light, criteria),
    ]


def verdict_of(findings: list[Finding]) -> Verdict:
    """Return the gravest verdict."""
    verdicts = {finding.verdict for finding in findings}
    return next(v for v in (Verdict.FAIL, Verdict.INCONCLUSIVE, Verdict.PASS) if v in verdicts)


def percent(share: float) -> str:
    """Write a share with its sign in percent."""
    return f"{100.0 * share:+.2f} %"


def _passes(is_passed: bool) -> Verdict:
    return Verdict.PASS if is_passed else Verdict.FAIL


def _margin(margin: float, unit: str = "%") -> str:
    if math.isinf(margin):
        return "not judged"
    value = 100.0 * margin if unit == "%" else margin
    return f"margin {value:g} {unit}".rstrip()


def _finite(light: Light) -> Finding:
    if light.n_invalid_ours == 0:
        summary = "every pixel is finite"
    else:
        summary = f"{light.n_invalid_ours} pixels are NaN or infinite"
    if light.n_invalid_reference:
        summary += f"; {light.n_invalid_reference} of the reference are not, and left out"
    return Finding("finite", "Finite pixels", _passes(light.n_invalid_ours == 0), summary)


def _image(test: BiasTest) -> Finding:
    differences = test.difference.ravel()
    channels = ", ".join(f"{name} {percent(d)}" for name, d in zip("RGB", differences, strict=True))
    summary = f"{channels} (± {100.0 * test.half_width.max():.2f} %); {_margin(test.margin)}"
    return Finding("image", "Light of the image", _passes(not test.is_significant.any()), summary)


def _tiles(test: BiasTest) -> Finding:
    is_off = test.is_significant.any(axis=2)
    at = np.unravel_index(np.argmax(np.abs(test.t)), test.t.shape)
    row, column, channel = at
    summary = (
        f"{np.count_nonzero(is_off)} of {is_off.size} differ; most certain difference "
        f"{percent(test.difference[at])} in {'RGB'[channel]} of tile column {column}, row {row} "
        f"(t = {test.t[at]:.1f}); {_margin(test.margin)}"
    )
    return Finding("tiles", "Light of the tiles", _passes(not is_off.any()), summary)


def _shift(test: BiasTest | None) -> Finding:
    title = "Place"
    if test is None:
        return Finding("shift", title, Verdict.PASS, "too few edges to tell a shift by")
    right, down = test.difference.ravel()
    summary = (
        f"{right:+.3f} pixels right, {down:+.3f} down (± {test.half_width.max():.3f}); "
        f"{_margin(test.margin, 'pixels')}"
    )
    return Finding("shift", title, _passes(not test.is_significant.any()), summary)


def _looks(looks: Looks, margin: float) -> Finding:
    summary = (
        f"mean HDR-FLIP {looks.mean:.4f}, of which noise {looks.noise:.4f}; {_margin(margin, '')}"
    )
    return Finding("looks", "Looks", _passes(looks.excess <= margin), summary)


def _noise(noise: Noise, margin: float) -> Finding:
    if noise.has_equal_seeds:
        return Finding("noise", "Noise", Verdict.FAIL, "every seed gives the same noisy image")
    ratios = {
        "what the samples promise": noise.over_claim,
        "what fewer samples promise": noise.over_fewer_samples,
        "independent pixels": noise.over_pixels,
    }
    parts = [f"{ratio:.2f} of {of}" for of, ratio in ratios.items() if ratio is not None]
    summary = f"variance is {', '.join(parts)}" if parts else "too little to tell"
    is_passed = noise.worst <= margin
    return Finding("noise", "Noise", _passes(is_passed), f"{summary}; {_margin(margin, '')}")


def _power(light: Light, criteria: Criteria) -> Finding:
    of_image = float(light.image.detectable.max())
    of_tiles = float(np.quantile(light.tiles.detectable, TILES_COVERED, method="higher"))
    is_enough = of_image <= criteria.image_bias and of_tiles <= criteria.tile_bias
    summary = (
        f"a bias of {_share(of_image)} in the image{_wanted(criteria.image_bias)} and of "
        f"{_share(of_tiles)} in {100.0 * TILES_COVERED:g} % of the tiles"
        f"{_wanted(criteria.tile_bias)} would be found with probability {criteria.power:g}"
    )
    verdict = Verdict.PASS if is_enough else Verdict.INCONCLUSIVE
    return Finding("power", "What it could have found", verdict, summary)


def _share(share: float) -> str:
    return f"{100.0 * share:.2g} %" if math.isfinite(share) else "any size"


def _wanted(bias: float) -> str:
    return f" (wanted: {100.0 * bias:g} %)" if math.isfinite(bias) else ""

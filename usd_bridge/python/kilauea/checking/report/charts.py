"""Drawings of the page, as SVG: tiles over a picture, and the histogram of p-values."""

from __future__ import annotations

from html import escape

import numpy as np

from kilauea.checking.bias import BiasTest
from kilauea.checking.judge import percent
from kilauea.checking.report.pixels import DIVERGING, coloured

T_SHOWN = 6.0
"""The t-value of the strongest colours."""
_BINS = 20
_BAR, _CHART_HEIGHT, _AXIS = 22, 120, 22


def tile_map(tests: BiasTest, tile: int, width: int, height: int) -> str:
    """Draw each tile in the colour of its most certain difference, with the figures as a hint."""
    worst = np.abs(tests.t).argmax(axis=2)[:, :, None]
    t = np.take_along_axis(tests.t, worst, axis=2)[..., 0]
    colours = coloured(t, DIVERGING, -T_SHOWN, T_SHOWN)
    cells = []
    for row, column in np.ndindex(t.shape):
        x, y = column * tile, row * tile
        w, h = min(tile, width - x), min(tile, height - y)
        kind = "tile off" if tests.is_significant[row, column].any() else "tile"
        fill = "#" + "".join(f"{c:02x}" for c in colours[row, column])
        cells.append(
            f'<rect class="{kind}" x="{x}" y="{y}" width="{w}" height="{h}" fill="{fill}">'
            f"<title>{escape(_figures(tests, row, column))}</title></rect>"
        )
    return (
        f'<svg class="tiles" viewBox="0 0 {width} {height}" preserveAspectRatio="none" role="img" '
        f'aria-label="t-values of the tiles">{"".join(cells)}</svg>'
    )


def _figures(tests: BiasTest, row: int, column: int) -> str:
    lines = [f"tile column {column}, row {row}"]
    for channel, name in enumerate("RGB"):
        at = (row, column, channel)
        lines.append(
            f"{name} {percent(tests.difference[at])} ± {100.0 * tests.half_width[at]:.2f} %, "
            f"t {tests.t[at]:+.1f}, p {tests.p[at]:.2g}"
        )
    return "\n".join(lines)


def p_histogram(tests: BiasTest) -> str:
    """Draw how often p falls into each of the bins: level where two engines agree."""
    counts, _ = np.histogram(tests.p, bins=_BINS, range=(0.0, 1.0))
    expected = tests.p.size / _BINS
    tallest = max(counts.max(), 2.0 * expected)
    width = _BINS * _BAR
    bars = "".join(
        f'<rect class="bar" x="{idx * _BAR + 1}" width="{_BAR - 2}" '
        f'y="{_CHART_HEIGHT * (1.0 - count / tallest):.1f}" '
        f'height="{_CHART_HEIGHT * count / tallest:.1f}"><title>{count} of {tests.p.size} tests '
        f"with p from {idx / _BINS:.2f} to {(idx + 1) / _BINS:.2f}</title></rect>"
        for idx, count in enumerate(counts)
    )
    level = _CHART_HEIGHT * (1.0 - expected / tallest)
    labels = "".join(
        f'<text x="{width * p:.0f}" y="{_CHART_HEIGHT + 16}" text-anchor="{anchor}">{p:g}</text>'
        for p, anchor in ((0.0, "start"), (0.5, "middle"), (1.0, "end"))
    )
    return (
        f'<svg class="chart" viewBox="0 0 {width} {_CHART_HEIGHT + _AXIS}" role="img" '
        f'aria-label="histogram of p-values">{bars}'
        f'<line class="level" x1="0" x2="{width}" y1="{level:.1f}" y2="{level:.1f}"/>{labels}</svg>'
    )

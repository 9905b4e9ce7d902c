"""Draws error against time from `kilauea bench error --json`: `plot_error.py ROWS.json OUT.svg`.

Needs nothing but Python: a log-log chart per stage, a line per engine through the means of its
seeds, and a dashed line of slope -1, which unbiased sampling follows.
"""

from __future__ import annotations

import argparse
import json
import math
from collections import defaultdict
from pathlib import Path
from statistics import fmean
from typing import Any

WIDTH, HEIGHT, MARGIN = 420, 320, 50
COLOURS = ("#c22", "#26b", "#292", "#b80", "#828", "#088")

Point = tuple[float, float]


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("rows", type=Path, help="JSON of `kilauea bench error`")
    parser.add_argument("out", type=Path, help="SVG to write")
    parser.add_argument("--time", default="render_s", choices=("render_s", "seconds"))
    parser.add_argument("--error", default="relMSE", choices=("relMSE", "MSE"))
    args = parser.parse_args()
    rows = json.loads(args.rows.read_text())["rows"]
    stages = list(dict.fromkeys(row["stage"] for row in rows))
    charts = [
        chart(stage, curves(stage, rows, args.time, args.error), f"{args.time}, {args.error}")
        for stage in stages
    ]
    placed = [f'<g transform="translate(0 {i * HEIGHT})">{c}</g>' for i, c in enumerate(charts)]
    size = f'width="{WIDTH}" height="{HEIGHT * len(charts)}"'
    style = "text { font: 11px sans-serif } path, line { fill: none }"
    body = "\n".join(placed)
    args.out.write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" {size}><style>{style}</style>{body}</svg>\n'
    )


def curves(stage: str, rows: list[dict[str, Any]], x: str, y: str) -> dict[str, list[Point]]:
    """Return the logarithms of each engine's mean time and error at each sample count."""
    groups: dict[str, dict[int, list[dict[str, Any]]]] = defaultdict(lambda: defaultdict(list))
    for row in rows:
        if row["stage"] == stage and row[x] > 0.0 and row[y] > 0.0:
            groups[row["engine"]][row["samples_per_pixel"]].append(row)
    return {
        engine: [
            (math.log10(fmean(r[x] for r in found)), math.log10(fmean(r[y] for r in found)))
            for _, found in sorted(counts.items())
        ]
        for engine, counts in groups.items()
    }


def chart(title: str, lines: dict[str, list[Point]], caption: str) -> str:
    """Draw one chart."""
    points = [point for line in lines.values() for point in line]
    low = [math.floor(min(point[axis] for point in points)) for axis in (0, 1)]
    high = [math.ceil(max(point[axis] for point in points)) for axis in (0, 1)]
    high = [max(top, bottom + 1) for top, bottom in zip(high, low, strict=True)]

    def at(point: Point) -> Point:
        x = MARGIN + (WIDTH - 2 * MARGIN) * (point[0] - low[0]) / (high[0] - low[0])
        y = HEIGHT - MARGIN - (HEIGHT - 2 * MARGIN) * (point[1] - low[1]) / (high[1] - low[1])
        return x, y

    parts = [f'<text x="{MARGIN}" y="20">{title}: {caption}</text>']
    for power in range(low[0], high[0] + 1):
        x, y = at((power, low[1]))
        parts.append(f'<line x1="{x}" x2="{x}" y1="{MARGIN}" y2="{y}" stroke="#ddd"/>')
        parts.append(f'<text x="{x - 12}" y="{y + 15}">1e{power}</text>')
    for power in range(low[1], high[1] + 1):
        x, y = at((low[0], power))
        parts.append(f'<line x1="{x}" x2="{WIDTH - MARGIN}" y1="{y}" y2="{y}" stroke="#ddd"/>')
        parts.append(f'<text x="{x - 32}" y="{y + 4}">1e{power}</text>')
    start = min(points, key=lambda point: point[0])
    reach = min(high[0] - start[0], start[1] - low[1])
    parts.append(path([at(start), at((start[0] + reach, start[1] - reach))], "#999", "4 3"))
    for idx, (engine, line) in enumerate(lines.items()):
        colour = COLOURS[idx % len(COLOURS)]
        parts.append(path([at(point) for point in line], colour, "none"))
        x, y = WIDTH - MARGIN - 90, MARGIN + 14 * idx + 10
        parts.append(f'<text x="{x}" y="{y}" fill="{colour}">{engine}</text>')
    return "\n".join(parts)


def path(points: list[Point], colour: str, dashes: str) -> str:
    """Draw straight lines between points."""
    steps = " L".join(f"{x:.1f} {y:.1f}" for x, y in points)
    return f'<path d="M{steps}" stroke="{colour}" stroke-width="1.5" stroke-dasharray="{dashes}"/>'


if __name__ == "__main__":
    main()

"""Draws peaks of memory against its bound: `plot_memory.py BOUNDED.json UNBOUNDED.json OUT.svg`.

The rows are those of `kilauea bench shading --shade-memory ...`, without and with `--first-come`.
Needs nothing but Python: a log-log chart with a line for each, and a dashed one where the peak is
the bound. What is not bounded has one peak, whatever the bound: one row is enough for it.
"""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path
from typing import Any

WIDTH, HEIGHT, MARGIN = 420, 320, 50

Point = tuple[float, float]


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("bounded", type=Path, help="rows with the rule that bounds memory")
    parser.add_argument("unbounded", type=Path, help="rows of --first-come")
    parser.add_argument("out", type=Path, help="SVG to write")
    args = parser.parse_args()
    rows = {path: json.loads(path.read_text())["rows"] for path in (args.bounded, args.unbounded)}
    bounded = points(rows[args.bounded])
    (_, peak) = max(points(rows[args.unbounded]), key=lambda point: point[1])
    lines = {
        "as rendered": (bounded, "#26b"),
        "first come, first served": ([(bound, peak) for bound, _ in bounded], "#c22"),
    }
    style = "text { font: 11px sans-serif } path, line { fill: none }"
    args.out.write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH}" height="{HEIGHT}">'
        f"<style>{style}</style>{chart(lines)}</svg>\n"
    )


def points(rows: list[dict[str, Any]]) -> list[Point]:
    """Return the logarithms to base 2 of bound and peak in MiB."""
    found = [(row["memory_mib"], row["peak_bytes"] / 2**20) for row in rows if row["peak_bytes"]]
    return sorted((math.log2(bound), math.log2(peak)) for bound, peak in found)


def chart(lines: dict[str, tuple[list[Point], str]]) -> str:
    """Draw the chart."""
    everything = [point for line, _ in lines.values() for point in line]
    low = math.floor(min(min(point) for point in everything))
    right = math.ceil(max(point[0] for point in everything))
    top = math.ceil(max(point[1] for point in everything))

    def at(point: Point) -> Point:
        x = MARGIN + (WIDTH - 2 * MARGIN) * (point[0] - low) / (right - low)
        y = HEIGHT - MARGIN - (HEIGHT - 2 * MARGIN) * (point[1] - low) / (top - low)
        return x, y

    parts = [f'<text x="{MARGIN}" y="20">peak of shades in flight against its bound, MiB</text>']
    for power in range(low, right + 1, 2):
        x, y = at((power, low))
        parts.append(f'<line x1="{x}" x2="{x}" y1="{MARGIN}" y2="{y}" stroke="#ddd"/>')
        parts.append(f'<text x="{x - 8}" y="{y + 15}">{2**power:g}</text>')
    for power in range(low, top + 1, 2):
        x, y = at((low, power))
        parts.append(f'<line x1="{x}" x2="{WIDTH - MARGIN}" y1="{y}" y2="{y}" stroke="#ddd"/>')
        parts.append(f'<text x="{x - 34}" y="{y + 4}">{2**power:g}</text>')
    end = min(right, top)
    parts.append(path([at((low, low)), at((end, end))], "#999", "4 3"))
    for idx, (name, (line, colour)) in enumerate(lines.items()):
        parts.append(path([at(point) for point in line], colour, "none"))
        for point in line:
            x, y = at(point)
            parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="{colour}"/>')
        parts.append(
            f'<text x="{MARGIN + 8}" y="{MARGIN + 14 * idx + 12}" fill="{colour}">{name}</text>'
        )
    return "\n".join(parts)


def path(points: list[Point], colour: str, dashes: str) -> str:
    """Draw straight lines between points."""
    steps = " L".join(f"{x:.1f} {y:.1f}" for x, y in points)
    return f'<path d="M{steps}" stroke="{colour}" stroke-width="1.5" stroke-dasharray="{dashes}"/>'


if __name__ == "__main__":
    main()

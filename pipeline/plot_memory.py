"""Draws peaks of memory against its bound: `plot_memory.py BOUNDED.json UNBOUNDED.json STEM`.

The rows are those of `kilauea bench shading --shade-memory ...`, without and with `--first-come`.
Writes `STEM.svg` and `STEM.png`: a log-log chart with a line for each, and a dashed one where the
peak is the bound. What is not bounded has one peak, whatever the bound: one row is enough for it.
Needs matplotlib.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from chart_files import pyplot, save

MIB = 2**20


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("bounded", type=Path, help="rows with the rule that bounds memory")
    parser.add_argument("unbounded", type=Path, help="rows of --first-come")
    parser.add_argument("stem", type=Path, help="pictures to write, without .svg and .png")
    args = parser.parse_args()
    bounded = json.loads(args.bounded.read_text())["rows"]
    unbounded = json.loads(args.unbounded.read_text())["rows"]
    draw(bounded, max(row["peak_bytes"] for row in unbounded), args.stem)


def draw(bounded: list[dict[str, Any]], unbounded_bytes: int, stem: Path) -> None:
    """Draw the chart."""
    rows = sorted(bounded, key=lambda row: row["memory_mib"])
    bounds = [row["memory_mib"] for row in rows]
    peaks = [row["peak_bytes"] / MIB for row in rows]
    figure, axes = pyplot.subplots(figsize=(4.2, 3.2), layout="constrained")
    without = [unbounded_bytes / MIB] * len(bounds)
    axes.plot(bounds, without, color="#c62828", marker="o", label="first come, first served")
    axes.plot(bounds, bounds, color="#999999", linestyle="--", label="the bound")
    axes.plot(bounds, peaks, color="#1565c0", marker="o", label="as rendered")
    for axis, scale in ((axes.xaxis, axes.set_xscale), (axes.yaxis, axes.set_yscale)):
        scale("log", base=2)
        axis.set_major_formatter("{x:g}")
    axes.set_xticks(bounds)
    axes.set_xlabel("bound, MiB")
    axes.set_ylabel("peak of shades in flight, MiB")
    axes.grid(visible=True, color="#eeeeee")
    axes.legend(frameon=False, fontsize=8)
    save(figure, stem)


if __name__ == "__main__":
    main()

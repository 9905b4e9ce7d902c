"""Draws frames by number of workers: `plot_workers.py ROWS.json STEM`.

The rows are those of `kilauea bench workers --json ROWS.json`. Writes `STEM.svg` and `STEM.png`: a
panel for each stage, integrator and size of set, with seconds of the whole command, of gather
estimation and of final rendering, beside what they would be if N workers were N times as fast as
the smallest number of them. Needs matplotlib.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from chart_files import pyplot, save

LINES = {"seconds": "#c62828", "gather_s": "#2e7d32", "render_s": "#1565c0"}
NAMES = {"seconds": "whole command", "gather_s": "gather estimation", "render_s": "rendering"}


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("rows", type=Path)
    parser.add_argument("stem", type=Path, help="pictures to write, without .svg and .png")
    args = parser.parse_args()
    draw(json.loads(args.rows.read_text())["rows"], args.stem)


def draw(rows: list[dict[str, Any]], stem: Path) -> None:
    """Draw all panels."""
    panels: dict[tuple[str, str, int], list[dict[str, Any]]] = {}
    for row in rows:
        if row["workers"] and row["broadcast"] != "full":
            panels.setdefault((row["stage"], row["integrator"], row["set"]), []).append(row)
    figure, axes_of_all = pyplot.subplots(
        1, len(panels), figsize=(3.2 * len(panels), 2.8), squeeze=False, layout="constrained"
    )
    for axes, ((stage, integrator, size), line) in zip(axes_of_all[0], panels.items(), strict=True):
        draw_panel(axes, line)
        kind = f"sets of {size}" if size > 1 else "replicated"
        axes.set_title(f"{stage}, {integrator}, {kind}", fontsize=8)
    axes_of_all[0][0].set_ylabel("seconds of a frame (dotted: ideal)")
    axes_of_all[0][-1].legend(frameon=False, fontsize=7)
    save(figure, stem)


def draw_panel(axes: Any, rows: list[dict[str, Any]]) -> None:
    """Draw the times of one way of sharing out by number of workers."""
    workers = [row["workers"] for row in rows]
    for name, color in LINES.items():
        seconds = [row[name] for row in rows]
        if not any(seconds):
            continue
        axes.plot(workers, seconds, "o-", color=color, label=NAMES[name])
        ideal = [seconds[0] * workers[0] / n for n in workers]
        axes.plot(workers, ideal, ":", color=color, alpha=0.6)
    axes.set_ylim(bottom=0)
    axes.set_xticks(workers)
    axes.set_xlabel("workers")
    axes.grid(visible=True, color="#eeeeee")


if __name__ == "__main__":
    main()

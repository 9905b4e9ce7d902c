"""Draws frames of some workers beside what is simulated: `plot_replicas.py ROWS.json STEM`.

The rows are those of `cargo run -p kilauea-cluster --example replicas`. Writes `STEM.svg` and
`STEM.png`: seconds of a frame by number of workers, a panel for each network, as measured, as
simulated, and as it would be if N workers were N times as fast. Needs matplotlib.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from chart_files import pyplot, save


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("rows", type=Path)
    parser.add_argument("stem", type=Path, help="pictures to write, without .svg and .png")
    args = parser.parse_args()
    draw(json.loads(args.rows.read_text()), args.stem)


def draw(rows: list[dict[str, Any]], stem: Path) -> None:
    """Draw a panel for each network."""
    networks = list(dict.fromkeys((row["megabytes_per_sec"], row["delay_ms"]) for row in rows))
    figure, panels = pyplot.subplots(
        1, len(networks), figsize=(10, 2.8), sharey=True, layout="constrained"
    )
    for network, axes in zip(networks, panels, strict=True):
        line = [row for row in rows if (row["megabytes_per_sec"], row["delay_ms"]) == network]
        workers = [row["workers"] for row in line]
        measured = [row["seconds"] for row in line]
        axes.plot(workers, measured, "o", color="#c62828", label="measured")
        axes.plot(workers, [row["predicted"] for row in line], "-", label="simulated")
        axes.plot(
            workers,
            [measured[0] * workers[0] / n for n in workers],
            ":",
            color="#777777",
            label="ideal",
        )
        axes.set_title(title(*network), fontsize=9)
        axes.set_xticks(workers)
        axes.set_xlabel("workers")
        axes.grid(visible=True, color="#eeeeee")
    panels[0].set_ylim(bottom=0)
    panels[0].set_ylabel("seconds of a frame")
    panels[-1].legend(frameon=False, fontsize=8, loc="upper right")
    save(figure, stem)


def title(megabytes_per_sec: float, delay_ms: float) -> str:
    """Describe a network."""
    speed = f"{megabytes_per_sec:g} MB/s" if megabytes_per_sec else ""
    delay = f"{delay_ms:g} ms one way" if delay_ms else ""
    return ", ".join(part for part in (speed, delay) if part) or "loopback"


if __name__ == "__main__":
    main()

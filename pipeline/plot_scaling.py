"""Draws what the simulation says of sets: `plot_scaling.py SWEEP.json STEM`.

The rows are those of `cargo run --release -p kilauea-sim --example sweep`. Writes `STEM.svg` and
`STEM.png`: rays a machine gets answered by size of the set, a line for each network and rule,
beside the closed form; and seconds of a frame by number of machines, beside the ideal. Needs
matplotlib.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from chart_files import pyplot, save

COLORS = {1.0: "#c62828", 10.0: "#1565c0", 100.0: "#2e7d32"}
"""By gigabits."""

SIZES_OF_FRAMES = (1, 2, 8, 32)
"""Members of the sets whose frames are drawn."""


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("sweep", type=Path)
    parser.add_argument("stem", type=Path, help="pictures to write, without .svg and .png")
    args = parser.parse_args()
    draw(json.loads(args.sweep.read_text()), args.stem)


def draw(rows: list[dict[str, Any]], stem: Path) -> None:
    """Draw both charts."""
    figure, (rates, frames) = pyplot.subplots(1, 2, figsize=(9, 3.6), layout="constrained")
    draw_rates(rows, rates)
    draw_frames(rows, frames)
    for axes in (rates, frames):
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.xaxis.set_major_formatter("{x:g}")
        axes.yaxis.set_major_formatter("{x:g}")
        axes.grid(visible=True, color="#eeeeee")
        axes.legend(frameon=False, fontsize=7)
    save(figure, stem)


def draw_rates(rows: list[dict[str, Any]], axes: Any) -> None:
    """Draw rays by size of the set."""
    for gigabits, color in COLORS.items():
        for full in (False, True):
            line = [row for row in rows if row["gigabits"] == gigabits and row["full"] == full]
            sizes = [row["members"] for row in line]
            label = f"{gigabits:g} Gb/s, {'all' if full else 'culled'}"
            style = "--" if full else "-"
            simulated = [row["mrays_per_machine"] for row in line]
            axes.plot(sizes, simulated, color=color, linestyle=style, marker=".", label=label)
            law = [row["law_mrays_per_machine"] for row in line]
            axes.plot(sizes, law, color=color, linestyle="", marker="x", alpha=0.5)
    axes.set_xlabel("members of a set")
    axes.set_ylabel("Mrays/s of a machine (crosses: law)")


def draw_frames(rows: list[dict[str, Any]], axes: Any) -> None:
    """Draw seconds of a frame by number of machines, on ten gigabits."""
    for members in SIZES_OF_FRAMES:
        for row in rows:
            if (row["gigabits"], row["members"], row["full"]) != (10.0, members, False):
                continue
            frames = [frame for frame in row["frames"] if frame["seconds"] is not None]
            machines = [frame["machines"] for frame in frames]
            seconds = [frame["seconds"] for frame in frames]
            (line,) = axes.plot(machines, seconds, marker=".", label=f"sets of {members}")
            ideal = [seconds[0] * machines[0] / n for n in machines]
            axes.plot(machines, ideal, color=line.get_color(), linestyle=":", alpha=0.6)
    axes.set_xlabel("machines on 10 Gb/s")
    axes.set_ylabel("seconds of a frame (dotted: ideal)")


if __name__ == "__main__":
    main()

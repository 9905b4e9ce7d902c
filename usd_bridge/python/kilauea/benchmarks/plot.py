"""Error against time as log-log charts, one per stage."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kilauea.benchmarks.convergence import Point
from kilauea.benchmarks.summary import curve
from kilauea.errors import KilaueaError

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLOURS = {
    "kilauea": "#7a1fa2",
    "kilauea-consistent": "#ba68c8",
    "path": "#c62828",
    "cycles": "#1565c0",
    "cycles-guided": "#64b5f6",
    "mitsuba": "#2e7d32",
    "mitsuba-stratified": "#81c784",
    "luxcore": "#ef8f00",
    "luxcore-hybrid": "#ffb74d",
    "luxcore-bidir": "#bcaaa4",
    "luxcore-bidirvm": "#8d6e63",
    "luxcore-photongi": "#5d4037",
}
COLUMNS = 4
CLOCK_NAMES = {
    "seconds": "seconds of the whole command",
    "render_s": "seconds of rendering",
    "cpu_s": "processor seconds",
}


def write(rows: list[dict[str, Any]], stem: Path, clock: str = "seconds") -> None:
    """Draw `stem.svg` and `stem.png`.

    Raises
    ------
    KilaueaError
        matplotlib is not installed, or a file cannot be written.
    """
    try:
        import matplotlib
    except ModuleNotFoundError:
        raise KilaueaError("plots need matplotlib: pip install 'kilauea[bench]'") from None
    matplotlib.use("agg")
    # Equal rows make equal files.
    matplotlib.rcParams["svg.hashsalt"] = "kilauea"
    from matplotlib import pyplot

    stages = list(dict.fromkeys(row["stage"] for row in rows))
    columns = min(COLUMNS, len(stages))
    n_rows = -(-len(stages) // columns)
    figure, grid = pyplot.subplots(
        n_rows,
        columns,
        figsize=(3.1 * columns, 2.6 * n_rows + 0.5),
        squeeze=False,
        layout="constrained",
    )
    for axes, stage in zip(grid.flat, stages, strict=False):
        draw_stage(axes, stage, [row for row in rows if row["stage"] == stage], clock)
    for axes in list(grid.flat)[len(stages) :]:
        axes.set_visible(False)
    figure.supxlabel(CLOCK_NAMES[clock], fontsize=9)
    figure.supylabel("relMSE", fontsize=9)
    handles = {line.get_label(): line for axes in grid.flat for line in axes.get_lines()}
    named = {label: line for label, line in handles.items() if not str(label).startswith("_")}
    figure.legend(
        named.values(),
        [str(label) for label in named],
        loc="outside upper center",
        ncols=len(named),
        fontsize=9,
        frameon=False,
    )
    try:
        for suffix in (".svg", ".png"):
            figure.savefig(stem.with_suffix(suffix), dpi=110, metadata=_no_date(suffix))
    except OSError as error:
        raise KilaueaError(f"cannot write {stem}: {error.strerror}") from None
    finally:
        pyplot.close(figure)


def draw_stage(axes: Axes, stage: str, rows: list[dict[str, Any]], clock: str) -> None:
    """Draw the curves of all engines, and a dotted line of slope -1."""
    from matplotlib.ticker import FormatStrFormatter, LogLocator, NullFormatter

    lines: dict[str, list[Point]] = {}
    for engine in dict.fromkeys(row["engine"] for row in rows):
        found = curve([row for row in rows if row["engine"] == engine], clock)
        lines[engine] = sorted(point for point in found if point[1] > 0.0)
    for engine, points in lines.items():
        seconds, errors = zip(*points, strict=True) if points else ((), ())
        axes.plot(seconds, errors, color=COLOURS[engine], marker="o", markersize=3, label=engine)
    draw_slope(axes, [point for points in lines.values() for point in points])
    axes.set_xscale("log")
    axes.set_yscale("log")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(FormatStrFormatter("%g"))
        axis.set_minor_formatter(NullFormatter())
    axes.set_title(stage, fontsize=9)
    axes.tick_params(which="both", labelsize=7)
    axes.grid(visible=True, which="both", color="#eeeeee", linewidth=0.6)


def draw_slope(axes: Axes, points: Sequence[Point]) -> None:
    """Draw the slope of unbiased sampling through the middle of the points."""
    if not points:
        return
    start, end = min(x for x, _ in points), max(x for x, _ in points)
    top = max(y for _, y in points)
    axes.plot([start, end], [top, top * start / end], color="#999999", linestyle=":", label="_")


def _no_date(suffix: str) -> dict[str, Any]:
    return {"Date": None} if suffix == ".svg" else {}

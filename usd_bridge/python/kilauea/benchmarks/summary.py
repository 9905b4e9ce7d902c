"""From rows of single renders to a row per stage and engine."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable
from statistics import fmean
from typing import Any

from kilauea.benchmarks.convergence import Point, efficiency, error_at, slope, time_to

BASELINE = "cycles"
"""The engine that ratios are taken to."""
CLOCKS = ("seconds", "render_s", "cpu_s")
"""Whole command, rendering alone, processor time of the whole command."""

Rows = list[dict[str, Any]]
Average = Callable[[Iterable[float]], float]
"""Of numbers: their mean, or their median."""


def summarise(rows: Rows) -> Rows:
    """Compare the engines of each stage at the longest time that the baseline has."""
    return [
        describe(stage, engine, found, by_engine.get(BASELINE, []))
        for stage, by_engine in by_stage_and_engine(rows).items()
        for engine, found in by_engine.items()
    ]


def by_stage_and_engine(rows: Rows) -> dict[str, dict[str, Rows]]:
    """Group rows, both in the order in which they come."""
    groups: dict[str, dict[str, Rows]] = defaultdict(dict)
    for row in rows:
        groups[row["stage"]].setdefault(row["engine"], []).append(row)
    return groups


def describe(stage: str, engine: str, rows: Rows, baseline: Rows) -> dict[str, Any]:
    """Summarise an engine at a stage; ratios below 1 are better than the baseline."""
    longest = means(rows)[-1]
    mse_points = [(point["render_s"], point["MSE"]) for point in means(rows)]
    return {
        "stage": stage,
        "engine": engine,
        "samples": longest["samples_per_pixel"],
        "load_s": longest["load_s"],
        "build_s": longest["build_s"],
        "render_s": longest["render_s"],
        "seconds": longest["seconds"],
        "relMSE": longest["relMSE"] - longest["relMSE_of_reference"],
        "trimmed_relMSE": longest["trimmed_relMSE"],
        "MSE": longest["MSE"],
        "FLIP": longest["mean_FLIP"],
        "variance": longest["variance"],
        "bias_squared": longest["bias_squared"],
        **{f"ratio_{clock}": ratio(rows, baseline, clock) for clock in CLOCKS},
        "time_ratio": time_ratio(rows, baseline),
        "efficiency": efficiency(longest["render_s"], longest["MSE"]),
        "slope": slope(mse_points),
        "Msamples_per_s": millions(longest["samples_per_s"]),
        "Mrays_per_s": millions(longest["rays_per_s"]),
        "peak_MB": millions(longest["peak_rss"]),
        "reference": rows[0]["reference"],
    }


def millions(value: float | None) -> float | None:
    """Return a value in millions, None where it was not measured."""
    return None if value is None else value / 1e6


def ratio(rows: Rows, baseline: Rows, clock: str) -> float | None:
    """Return relMSE over the baseline's at the baseline's longest time on a clock."""
    if not baseline:
        return None
    return ratio_at(rows, baseline, clock, max(seconds for seconds, _ in curve(baseline, clock)))


def ratio_at(
    rows: Rows, baseline: Rows, clock: str, seconds: float, average: Average = fmean
) -> float | None:
    """Return relMSE, averaged over seeds, over the baseline's at a time on a clock."""
    curves = (curve(found, clock, average=average) for found in (rows, baseline))
    ours, theirs = (error_at(points, seconds) for points in curves)
    return None if ours is None or not theirs else ours / theirs


def time_ratio(rows: Rows, baseline: Rows) -> float | None:
    """Return the time to the baseline's lowest error, over the baseline's, whole command."""
    if not baseline:
        return None
    target = min(error for _, error in curve(baseline, "seconds"))
    ours, theirs = (time_to(curve(found, "seconds"), target) for found in (rows, baseline))
    return None if ours is None or not theirs else ours / theirs


def curve(rows: Rows, clock: str, error: str = "relMSE", average: Average = fmean) -> list[Point]:
    """Return time and error, averaged over seeds, at each time that was aimed at.

    What the noise of the reference adds to relMSE is taken off.
    """
    noise = "relMSE_of_reference" if error == "relMSE" else None
    return [
        (point[clock], point[error] - (point[noise] if noise else 0.0))
        for point in means(rows, average)
    ]


def means(rows: Rows, average: Average = fmean) -> Rows:
    """Average the numbers of all seeds at each sample count that was asked for, ascending."""
    groups: dict[int, Rows] = defaultdict(list)
    for row in rows:
        groups[row["samples_asked"]].append(row)
    return [_mean(found, average) for _, found in sorted(groups.items())]


def _mean(rows: Rows, average: Average) -> dict[str, Any]:
    return {
        name: average([row[name] for row in rows]) if _is_number(value) else value
        for name, value in rows[0].items()
    }


def _is_number(value: Any) -> bool:
    return isinstance(value, float | int) and not isinstance(value, bool)

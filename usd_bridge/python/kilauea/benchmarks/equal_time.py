"""All engines' errors over the baseline's, at each time that the baseline was measured at.

Where a few samples hold most of the error, the mean over seeds says who has met them. The median
says what to expect of a single picture, so both are told.
"""

from __future__ import annotations

from statistics import fmean, median
from typing import Any

from kilauea.benchmarks.markdown import number, table
from kilauea.benchmarks.summary import (
    BASELINE,
    Average,
    Rows,
    by_stage_and_engine,
    curve,
    ratio_at,
)

CLOCK = "seconds"
"""Of the whole command."""
AVERAGES: tuple[Average, Average] = (fmean, median)


def ratios(report: dict[str, Any]) -> str:
    """Return a line for each stage and time, with a column for each engine."""
    stages = by_stage_and_engine(report["rows"])
    engines = dict.fromkeys(engine for found in stages.values() for engine in found)
    engines.pop(BASELINE, None)
    lines = []
    for stage, found in stages.items():
        baseline = found.get(BASELINE, [])
        for seconds, _ in curve(baseline, CLOCK):
            seeds = max(row["seed"] for row in baseline)
            line = {"stage": f"`{stage}`", "seconds": round(seconds), "seeds": seeds}
            for engine in engines:
                line[engine] = compared(found.get(engine, []), baseline, seconds)
            lines.append(line)
    return table(lines)


def compared(rows: Rows, baseline: Rows, seconds: float) -> str:
    """Write the ratio of mean errors, and that of medians in brackets; nothing without rows."""
    found = [ratio_at(rows, baseline, CLOCK, seconds, average) for average in AVERAGES]
    mean, middle = (number(ratio) for ratio in found)
    return f"{mean} ({middle})" if mean else ""

"""A report that is measured a few stages at a time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from kilauea.benchmarks.report import read_json
from kilauea.errors import KilaueaError

Rows = list[dict[str, Any]]


def read(path: str | None) -> tuple[Rows, Rows]:
    """Return rows and stages that a report has already; none where there is none.

    Raises
    ------
    KilaueaError
        The file is no report of `kilauea bench error`.
    """
    if path is None or not Path(path).exists():
        return [], []
    report = read_json(Path(path))
    if "stages" not in report:
        raise KilaueaError(f"{path}: not what `kilauea bench error --json` writes")
    return report["rows"], report["stages"]


def with_measured(earlier: Rows, measured: Rows) -> Rows:
    """Return all, with what is measured anew in the place of what was there of the same stages."""
    by_stage = _by_stage(earlier) | _by_stage(measured)
    return [row for rows in by_stage.values() for row in rows]


def _by_stage(rows: Rows) -> dict[str, Rows]:
    groups: dict[str, Rows] = {}
    for row in rows:
        groups.setdefault(row["stage"], []).append(row)
    return groups

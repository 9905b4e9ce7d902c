"""A report that is measured a few stages at a time."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

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
    try:
        report = json.loads(Path(path).read_text(encoding="utf-8"))
        return report["rows"], report["stages"]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise KilaueaError(
            f"{path}: not what `kilauea bench error --json` writes: {error}"
        ) from None


def with_measured(earlier: Rows, measured: Rows) -> Rows:
    """Return all, with what is measured anew in the place of what was there of the same stages."""
    new = {name: [row for row in measured if row["stage"] == name] for name in names(measured)}
    old = {name: [row for row in earlier if row["stage"] == name] for name in names(earlier)}
    return [row for found in (old | new).values() for row in found]


def names(rows: Rows) -> list[str]:
    """Return the stages of rows, each once, in their order."""
    return list(dict.fromkeys(row["stage"] for row in rows))

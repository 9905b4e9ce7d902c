"""Rows of results: a table for people, JSON for programs."""

from __future__ import annotations

import json
import os
import platform
import time
from pathlib import Path
from typing import Any

from kilauea.errors import KilaueaError
from kilauea.output import write_text


def machine() -> dict[str, Any]:
    """Describe the machine that the figures belong to."""
    return {
        "cpu": _cpu_name(),
        "cores": len(os.sched_getaffinity(0)),
        "memory": os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"),
        "system": platform.platform(),
        "python": platform.python_version(),
        "load_average": os.getloadavg()[0],
        "date": time.strftime("%Y-%m-%d"),
    }


def write_json(path: str | None, rows: list[dict[str, Any]], **more: Any) -> None:
    """Write `{"machine": ..., "rows": [...]}` where a file is asked for."""
    if path:
        report = {"machine": machine(), "rows": rows, **more}
        write_text(Path(path), json.dumps(report, indent=1) + "\n")


def read_json(file: Path) -> dict[str, Any]:
    """Read what `write_json` wrote.

    Raises
    ------
    KilaueaError
        It is no report, or cannot be read.
    """
    try:
        report = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise KilaueaError(f"{file}: {error}") from None
    if not isinstance(report, dict) or not {"machine", "rows"} <= report.keys():
        raise KilaueaError(f"{file}: not what `kilauea bench --json` writes")
    return report


def print_table(rows: list[dict[str, Any]]) -> None:
    """Print rows with the columns of the first."""
    if not rows:
        return
    columns = list(rows[0])
    cells = [columns, *([_cell(row.get(column)) for column in columns] for row in rows)]
    widths = [max(len(row[i]) for row in cells) for i in range(len(columns))]
    for row in cells:
        print("  ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)))


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.4g}"
    return "-" if value is None else str(value)


def _cpu_name() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor()
    names = (line.partition(":")[2].strip() for line in lines if line.startswith("model name"))
    return next(names, platform.processor())

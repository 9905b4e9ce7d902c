"""Pieces of Markdown that reports are made of."""

from __future__ import annotations

from typing import Any


def table(rows: list[dict[str, Any]]) -> str:
    """Return rows as a table with the columns of the first."""
    if not rows:
        return ""
    columns = list(rows[0])
    cells = [columns, ["---"] * len(columns)]
    cells += [[number(row.get(column)) for column in columns] for row in rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in cells)


def number(value: Any) -> str:
    """Write a value with three digits, nothing where there is none."""
    if isinstance(value, float):
        return f"{value:.3g}"
    return "" if value is None else str(value)


def conditions(report: dict[str, Any]) -> str:
    """Say when, on what and with which versions a report was made."""
    machine = report["machine"]
    memory_gb = machine["memory"] / 1e9
    parts = [
        f"{machine.get('date', 'no date')}: {machine['cores']} cores of {machine['cpu']}",
        f"{memory_gb:.0f} GB, load average {machine['load_average']:.1f} at the end",
    ]
    versions = sorted({row["version"] for row in report["rows"] if "version" in row})
    if versions:
        parts.append(", ".join(versions))
    counts = {row["stage"]: row["seed"] for row in report["rows"] if "seed" in row}
    if counts:
        parts.append(f"{max(counts.values())} seeds")
    sizes = {
        "x".join(map(str, s["resolution"])) for s in report.get("stages", []) if "resolution" in s
    }
    depths = {s["max_depth"] for s in report.get("stages", []) if "max_depth" in s}
    if sizes:
        parts.append(f"{', '.join(sorted(sizes))} pixels, {max(depths)} bounces, box filter")
    return "; ".join(parts) + "."

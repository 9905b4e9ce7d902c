"""The reports of `kilauea bench samples`, `load` and `rays` as Markdown."""

from __future__ import annotations

from typing import Any

from kilauea.benchmarks.markdown import conditions, number, table
from kilauea.benchmarks.rays import by_threads, means, mode

Report = dict[str, Any]

RAY_KINDS = ("primary", "diffuse", "shadow", "occlusion")
PEERS = ("robust", "medium")
"""Modes of Embree that a table compares with: watertight as ours, and its default."""


def samples(report: Report) -> str:
    """Compare camera paths per second."""
    columns = {
        "stage": "stage",
        "engine": "engine",
        "resolution": "resolution",
        "samples_per_pixel": "samples",
        "Msamples_per_s": "million paths a second",
        "build_s": "load and build, s",
        "render_s": "render, s",
    }
    rows = [{title: row[name] for name, title in columns.items()} for row in report["rows"]]
    return f"{conditions(report)}\n\n{table(rows)}"


def load(report: Report) -> str:
    """Compare what comes before the first ray."""
    rows = [
        {
            "stage": row["stage"],
            "engine": row["engine"],
            "load, s": row["load_s"],
            "build, s": row["build_s"],
            "whole command, s": row["total_s"],
            "peak memory, GB": row["peak_rss"] / 1e9,
        }
        for row in report["rows"]
    ]
    return f"{conditions(report)}\n\n{table(rows)}"


def rays(report: Report) -> str:
    """Compare rays per second with Embree's, four kinds in a cell; then builds."""
    rows = report["rows"]
    lines = [ray_line(mesh, rows) for mesh in dict.fromkeys(row["mesh"] for row in rows)]
    overall = {mean["rays"]: mean for mean in means(rows)}
    last: dict[str, Any] = {"mesh": "geometric mean"}
    for peer in PEERS:
        last[f"over Embree {peer}"] = cell(overall[kind][f"ours/{peer}"] for kind in RAY_KINDS)
    parts = [conditions(report), table([*lines, last])]
    return "\n\n".join([*parts, builds(report)])


def ray_line(mesh: str, rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Return one mesh's row."""
    found = {(row["rays"], mode(row)): row for row in rows if row["mesh"] == mesh}
    first = next(iter(found.values()))
    return {
        "mesh": f"`{mesh}`",
        "triangles": f"{first['triangles']:,}",
        "ours, million rays a second": cell(found[kind, PEERS[0]]["ours"] for kind in RAY_KINDS),
        **{
            f"over Embree {peer}": cell(found[kind, peer]["ratio"] for kind in RAY_KINDS)
            for peer in PEERS
        },
    }


def builds(report: Report) -> str:
    """Compare building of the largest mesh's tree; nothing where builds were left out."""
    lines = by_threads(report["builds"])
    if not lines:
        return ""
    largest = max(lines, key=lambda line: line["triangles"])["mesh"]
    threads = [name for name in lines[0] if name.startswith("threads=")]
    rows = [
        {
            f"tree over `{largest}`": line["builder"],
            **{f"{name.partition('=')[2]} threads, s": line[name] for name in threads},
            "bytes a triangle": round(line["bytes_per_triangle"]),
        }
        for line in lines
        if line["mesh"] == largest
    ]
    return table(rows)


def cell(values: Any) -> str:
    """Write one number for each kind of rays."""
    return " / ".join(number(float(value)) for value in values)

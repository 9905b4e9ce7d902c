"""`kilauea bench load`: from a stage on disk to the first ray, ours against Blender's."""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from pathlib import Path
from statistics import median
from typing import Any

from kilauea.benchmarks.report import print_table, write_json
from kilauea.child import run_apart
from kilauea.environments import CYCLES, pipeline_script
from kilauea.errors import KilaueaError

WIDTH, HEIGHT = 16, 16
"""Small enough that one sample a pixel takes no time."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the subcommand's options."""
    parser.add_argument("stages", nargs="+", metavar="STAGE")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--json", metavar="FILE", help="machine and rows")


def run(args: argparse.Namespace) -> int:
    """Measure, print and write."""
    rows: list[dict[str, Any]] = []
    with tempfile.TemporaryDirectory(prefix="kilauea-") as name:
        for stage in args.stages:
            rounds: dict[str, list[dict[str, Any]]] = {"kilauea": [], "blender": []}
            for _ in range(args.rounds):
                for engine, found in rounds.items():
                    try:
                        found.append(LOADERS[engine](stage, Path(name)))
                    except KilaueaError as error:
                        print(f"kilauea: {stage}: {engine}: {error}", file=sys.stderr)
            rows += [row(stage, engine, found) for engine, found in rounds.items() if found]
    print_table(rows)
    write_json(args.json, rows)
    return 0 if rows else 1


def row(stage: str, engine: str, found: list[dict[str, Any]]) -> dict[str, Any]:
    """Summarise rounds by their medians; the first one also reads files from disk."""
    return {
        "stage": Path(stage).name,
        "engine": engine,
        "load_s": median(r["load_s"] for r in found),
        "build_s": median(r["build_s"] for r in found),
        "total_s": median(r["total_s"] for r in found),
        "first_s": found[0]["total_s"],
        "peak_rss": max(r["peak_rss"] for r in found),
    }


def load_ours(stage: str, folder: Path) -> dict[str, Any]:
    """Flatten and build: a render of one sample in a few pixels."""
    stats_file = folder / "ours.json"
    command = [sys.executable, "-m", "kilauea.cli", "render", stage, "-o", folder / "ours.exr"]
    command += ["-r", WIDTH, HEIGHT, "-p", 1, "--stats", stats_file, "-V", "0"]
    done = run_apart([str(word) for word in command], "render with Kilauea")
    stats = json.loads(stats_file.read_text())
    return {
        "load_s": stats["times"]["load"],
        "build_s": stats["times"].get("build", 0.0),
        "total_s": done.wall_s,
        "peak_rss": stats["memory"]["peak_rss"],
    }


def load_blender(stage: str, folder: Path) -> dict[str, Any]:
    """Import with Blender's own USD importer, then let Cycles take the scene over."""
    stats_file = folder / "blender.json"
    command = [CYCLES.python(), pipeline_script("blender_import.py"), stage]
    command += ["--res", WIDTH, HEIGHT, "--stats", stats_file]
    done = run_apart([str(word) for word in command], "import with Blender")
    return {"total_s": done.wall_s, **json.loads(stats_file.read_text())}


LOADERS = {"kilauea": load_ours, "blender": load_blender}

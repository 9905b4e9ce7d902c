"""`kilauea bench samples`: camera paths per second, engines in turn on the same triangles."""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path
from statistics import median
from typing import Any

from kilauea.benchmarks.engines import Run, render
from kilauea.benchmarks.job import Job
from kilauea.benchmarks.options import add_engine_options, settings_of
from kilauea.benchmarks.report import print_table, write_json
from kilauea.errors import KilaueaError


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the subcommand's options."""
    add_engine_options(parser, engines=("path", "cycles", "mitsuba"))
    parser.add_argument("-p", "--pixel-samples", type=int, default=64, metavar="SAMPLES")
    parser.add_argument("--rounds", type=int, default=3, help="renders by each engine")


def run(args: argparse.Namespace) -> int:
    """Measure, print and write."""
    rows: list[dict[str, Any]] = []
    skipped: list[str] = []
    with tempfile.TemporaryDirectory(prefix="kilauea-") as name:
        for idx, stage in enumerate(args.stages):
            job = Job.prepare(stage, Path(name) / str(idx), settings_of(args))
            rows += measure(job, args, skipped)
    print_table(rows)
    for line in skipped:
        print(f"kilauea: {line}", file=sys.stderr)
    write_json(args.json, rows, skipped=skipped)
    return 0 if rows else 1


def measure(job: Job, args: argparse.Namespace, skipped: list[str]) -> list[dict[str, Any]]:
    """Let the engines take turns, so that what else the machine does hits all of them."""
    runs: dict[str, list[Run]] = {engine: [] for engine in args.engines}
    for round_idx in range(args.rounds):
        for engine in list(runs):
            try:
                runs[engine].append(render(engine, job, args.pixel_samples, round_idx + 1))
            except KilaueaError as error:
                skipped.append(f"{job.stage}: {engine}: {error}")
                del runs[engine]
    return [row(job, engine, done) for engine, done in runs.items() if done]


def row(job: Job, engine: str, runs: list[Run]) -> dict[str, Any]:
    """Summarise the rounds of an engine by their medians."""
    rates = [run.samples_per_s(job.n_pixels) for run in runs]
    width, height = job.settings["resolution"]
    return {
        "stage": Path(job.stage).name,
        "engine": engine,
        "resolution": f"{width}x{height}",
        "max_depth": job.settings["max_depth"],
        "samples_per_pixel": runs[0].samples_per_pixel,
        "rounds": len(runs),
        "Msamples_per_s": median(rates) / 1e6,
        "slowest": min(rates) / 1e6,
        "fastest": max(rates) / 1e6,
        "build_s": median(run.setup_s for run in runs),
        "render_s": median(run.render_s for run in runs),
        "total_s": median(run.total_s for run in runs),
        "peak_rss": max(run.peak_rss for run in runs),
    }

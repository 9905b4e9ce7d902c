"""`kilauea bench error`: error against time, over sample counts and seeds."""

from __future__ import annotations

import argparse
import json
import math
import sys
import tempfile
from collections import defaultdict
from pathlib import Path
from statistics import fmean, linear_regression
from typing import Any

from kilauea.benchmarks.engines import ENGINES, Job, Run, render
from kilauea.benchmarks.options import add_engine_options, settings_of
from kilauea.benchmarks.report import print_table, write_json
from kilauea.errors import KilaueaError
from kilauea.render import native

REFERENCE_SEED = 1_000_003
"""Far from the seeds that are measured."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the subcommand's options."""
    add_engine_options(parser, engines=("path", "cycles"))
    parser.add_argument(
        "-p", "--pixel-samples", nargs="+", type=int, default=[1, 4, 16, 64, 256], metavar="SAMPLES"
    )
    parser.add_argument("--seeds", type=int, default=2, help="renders at each sample count")
    parser.add_argument("--reference", metavar="FILE.exr", help="converged image of the one stage")
    parser.add_argument("--reference-engine", choices=tuple(ENGINES), default="cycles")
    parser.add_argument("--reference-samples", type=int, default=8192, metavar="SAMPLES")


def run(args: argparse.Namespace) -> int:
    """Measure, print and write."""
    if args.reference and len(args.stages) != 1:
        raise KilaueaError("--reference is the image of one stage")
    rows: list[dict[str, Any]] = []
    with tempfile.TemporaryDirectory(prefix="kilauea-") as name:
        for idx, stage in enumerate(args.stages):
            job = Job.prepare(stage, Path(name) / str(idx), settings_of(args))
            reference = args.reference or converged(job, args)
            rows += measure(job, args, str(reference))
    slopes = [slope for stage in args.stages for slope in fits(Path(stage).name, rows)]
    print_table(rows)
    print_table(slopes)
    write_json(args.json, rows, slopes=slopes)
    return 0 if rows else 1


def converged(job: Job, args: argparse.Namespace) -> Path:
    """Render the image that all others are compared with."""
    print(
        f"kilauea: {Path(job.stage).name}: {args.reference_samples} samples with "
        f"{args.reference_engine} as the reference",
        file=sys.stderr,
    )
    return render(args.reference_engine, job, args.reference_samples, REFERENCE_SEED).image


def measure(job: Job, args: argparse.Namespace, reference: str) -> list[dict[str, Any]]:
    """Let the engines take turns over seeds and sample counts."""
    rows = []
    engines = list(args.engines)
    for seed in range(1, args.seeds + 1):
        for samples in args.pixel_samples:
            for engine in list(engines):
                try:
                    rows.append(row(job, render(engine, job, samples, seed), seed, reference))
                except KilaueaError as error:
                    print(f"kilauea: {job.stage}: {engine}: {error}", file=sys.stderr)
                    engines.remove(engine)
    return rows


def row(job: Job, run: Run, seed: int, reference: str) -> dict[str, Any]:
    """Compare one render with the reference."""
    found = json.loads(native().compare(str(run.image), reference))
    return {
        "stage": Path(job.stage).name,
        "engine": run.engine,
        "seed": seed,
        "samples_per_pixel": run.samples_per_pixel,
        "seconds": run.total_s,
        "build_s": run.build_s,
        "render_s": run.render_s,
        "relMSE": found["relMSE"],
        "MSE": found["MSE"],
        "mean_ratio": fmean(found["mean_ratio"]),
        "peak_rss": run.peak_rss,
    }


def fits(stage: str, rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Fit `MSE = c t^slope` to each engine's mean error at each sample count.

    Path tracing has slope -1. The efficiency `1 / (MSE t)` compares engines at equal slopes; it is
    that of the highest sample count.
    """
    groups: dict[str, dict[int, list[dict[str, Any]]]] = defaultdict(lambda: defaultdict(list))
    for found in rows:
        if found["stage"] == stage:
            groups[found["engine"]][found["samples_per_pixel"]].append(found)
    slopes = []
    for engine, counts in groups.items():
        means = [
            [fmean(r[key] for r in at_count) for key in ("render_s", "MSE", "relMSE")]
            for _, at_count in sorted(counts.items())
        ]
        usable = [(math.log(t), math.log(mse)) for t, mse, _ in means if t > 0.0 and mse > 0.0]
        slope = linear_regression(*zip(*usable, strict=True)).slope if len(usable) > 1 else None
        last_s, last_mse, last_relative = means[-1]
        slopes.append(
            {
                "stage": stage,
                "engine": engine,
                "slope": slope,
                "efficiency": 1.0 / (last_mse * last_s) if last_mse * last_s > 0.0 else None,
                "relMSE_times_s": last_relative * last_s,
            }
        )
    return slopes

"""`kilauea bench photons`: photons traced and stored per second, and what a map of them takes."""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path
from typing import Any

from kilauea import interrupt
from kilauea.benchmarks.report import print_table, write_json
from kilauea.errors import KilaueaError, UsageError
from kilauea.render import RenderOptions, build_scene, native


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the subcommand's options."""
    parser.add_argument("stages", nargs="+", metavar="STAGE")
    parser.add_argument("--emitted", type=int, default=1_000_000, help="photons that leave lights")
    parser.add_argument("--max-depth", type=int, default=16, metavar="SURFACES")
    parser.add_argument("--rounds", type=int, default=3, help="of which the fastest counts")
    parser.add_argument("-j", "--threads", nargs="+", type=int, default=[1], metavar="N")
    parser.add_argument("--json", metavar="FILE", help="machine and rows")


def run(args: argparse.Namespace) -> int:
    """Measure, print and write."""
    if min(args.emitted, args.max_depth, args.rounds, *args.threads) < 1:
        raise UsageError("--emitted, --max-depth, --rounds and --threads must be positive")
    rows: list[dict[str, Any]] = []
    for stage in args.stages:
        scene = load(stage)
        rows += [measure(stage, scene, threads, args) for threads in args.threads]
        write_json(args.json, rows)
    print_table(rows)
    return 0


def load(stage: str) -> Any:
    """Flatten and build a stage."""
    from kilauea.usd.options import FlattenOptions
    from kilauea.usd.stage import flatten

    frame = flatten(stage, FlattenOptions())
    return build_scene(frame, RenderOptions(outputs=[]))


def measure(stage: str, scene: Any, threads: int, args: argparse.Namespace) -> dict[str, Any]:
    """Trace the same photons a few times; of each time the least counts."""
    engine = native()
    request = {
        "resolution": [640, 360],
        "emitted": args.emitted,
        "max_depth": args.max_depth,
        "seed": 0,
        "threads": threads,
    }
    text = json.dumps(request)
    reports, cpu_seconds = [], []
    try:
        for _ in range(args.rounds):
            cpu = time.process_time()
            reports.append(json.loads(interrupt.run(lambda: engine.measure_photons(scene, text))))
            cpu_seconds.append(time.process_time() - cpu)
    except engine.RenderError as error:
        raise KilaueaError(f"{stage}: {error}") from None
    numbers = reports[0]["photons"]
    seconds = min(report["times"]["photon"] for report in reports)
    n_bytes = reports[0]["memory"]["photons"]
    return {
        "stage": Path(stage).name,
        "threads": threads,
        "emitted": numbers["emitted"],
        "stored": numbers["stored"],
        "caustic": numbers["caustic"],
        "rays": reports[0]["rays"]["photon"],
        "seconds": seconds,
        "emitted_per_second": numbers["emitted"] / seconds,
        "stored_per_second": numbers["stored"] / seconds,
        "cpu_seconds": min(cpu_seconds),
        "map_seconds": min(report["times"]["map"] for report in reports),
        "bytes": n_bytes,
        "bytes_per_photon": n_bytes / max(numbers["stored"], 1),
    }
